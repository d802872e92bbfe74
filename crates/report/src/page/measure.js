// Measuring in the 3D view: place, distance, height, area and volume under a polygon, profile along a line.

import { length, sub } from "./camera.js";
import { heightAt } from "./data.js";
import { haloed } from "./overlay.js";
import { number, words } from "./words.js";

// How each kind is used, and after how many places it starts anew (0: until it is closed).
export const KINDS = { distance: 2, height: 2, area: 0, volume: 0, profile: 2 };

export class Measure {
  constructor(viewer, onChange) {
    Object.assign(this, { viewer, onChange, kind: "", places: [] });
    viewer.measure = this;
  }
  start(kind) {
    this.kind = kind === this.kind ? "" : kind;
    this.places = [];
    this.closed = false;
    this.viewer.canvas.classList.toggle("measuring", Boolean(this.kind));
    this.onChange();
    this.viewer.redraw();
  }
  add(place) {
    const most = KINDS[this.kind];
    if (this.closed || (most && this.places.length >= most)) { this.places = []; this.closed = false; }
    // A click on the first corner closes the polygon.
    if (!most && this.places.length > 2) {
      const [a, b] = [place, this.places[0]].map(p => this.viewer.onScreen(p));
      if (a && b && Math.hypot(a[0] - b[0], a[1] - b[1]) < 12) this.closed = true;
    }
    if (!this.closed) this.places.push(place);
    this.onChange();
    this.viewer.redraw();
  }
  draw(g, colours) {
    const at = this.places.map(p => this.viewer.onScreen(p)).filter(Boolean);
    if (!this.kind || !at.length) return;
    g.beginPath();
    at.forEach(([x, y], i) => i ? g.lineTo(x, y) : g.moveTo(x, y));
    if (at.length > 2 && !KINDS[this.kind]) { g.closePath(); g.fillStyle = "rgba(232,62,140,.18)"; g.fill(); }
    g.lineWidth = 2.5;
    g.strokeStyle = colours.chosen;
    g.stroke();
    for (const [x, y] of at) { g.beginPath(); g.arc(x, y, 4.5, 0, 7); g.fillStyle = colours.chosen; g.fill(); g.lineWidth = 1.5; g.strokeStyle = colours.halo; g.stroke(); }
    if (at.length === 2) {
      g.textAlign = "center";
      haloed(g, `${number(length(sub(this.places[1], this.places[0])), 3)} m`, (at[0][0] + at[1][0]) / 2, (at[0][1] + at[1][1]) / 2 - 10, colours.ink, colours.halo);
    }
  }
  // What is known so far, in words.
  text() {
    const p = this.places, many = !KINDS[this.kind];
    if (p.length < (many ? 3 : 2)) return many
      ? words("Click the corners of a polygon; a click on the first closes it.", "多角形の頂点をクリック。最初の点をクリックすると閉じます。")
      : words("Click two places.", "2 点をクリックしてください。");
    const d = sub(p[1], p[0]), flat = Math.hypot(d[0], d[1]);
    if (this.kind === "distance" || this.kind === "profile") return `${words("distance", "距離")} ${number(length(d), 3)} m\n${words("level", "水平距離")} ${number(flat, 3)} m\n${words("height", "高低差")} ${number(d[2], 3)} m`;
    if (this.kind === "height") return `${words("height", "高低差")} ${number(d[2], 3)} m\n${words("level", "水平距離")} ${number(flat, 3)} m`;
    const area = Math.abs(flatArea(p));
    let text = `${words("area in plan", "平面積")} ${number(area, 2)} m²`;
    if (this.kind === "volume") text += "\n" + this.volumes();
    return text;
  }
  // Between the surfaces inside the polygon, cell by cell.
  volumes() {
    const { design, surveyed, planned } = this.viewer.data.surfaces;
    if (!design || !surveyed) return words("volumes need a design", "体積には計画面が必要です");
    let fill = 0, cut = 0, added = 0;
    const cell2 = design.cell ** 2, [low, high] = extent(this.places);
    for (let y = low[1]; y <= high[1]; y += design.cell) for (let x = low[0]; x <= high[0]; x += design.cell) {
      if (!inside(this.places, x, y)) continue;
      const below = heightAt(design, x, y) - heightAt(surveyed, x, y), more = planned ? heightAt(planned, x, y) - heightAt(surveyed, x, y) : NaN;
      if (below > 0) fill += below * cell2; else if (below < 0) cut -= below * cell2;
      if (more > 0) added += more * cell2;
    }
    return `${words("missing to the design", "計画面までの不足")} ${number(fill, 1)} m³\n${words("above the design", "計画面からの超過")} ${number(cut, 1)} m³` + (planned ? `\n${words("filled by the plan", "計画による充填")} ${number(added, 1)} m³` : "");
  }
}

const flatArea = p => p.reduce((sum, a, i) => { const b = p[(i + 1) % p.length]; return sum + (a[0] * b[1] - b[0] * a[1]) / 2; }, 0);
const extent = p => [[0, 1].map(k => Math.min(...p.map(v => v[k]))), [0, 1].map(k => Math.max(...p.map(v => v[k])))];
function inside(p, x, y) {
  let odd = false;
  for (let i = 0, j = p.length - 1; i < p.length; j = i++) {
    if (p[i][1] > y !== p[j][1] > y && x < (p[j][0] - p[i][0]) * (y - p[i][1]) / (p[j][1] - p[i][1]) + p[i][0]) odd = !odd;
  }
  return odd;
}
