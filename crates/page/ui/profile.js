// A section across the works, redrawn while the design is changed; a block stands in it to scale.

import { sharp, theme } from "/ui/report/words.js";
import { number } from "./parts.js";
import { lengthOf, pointAt } from "./surface.js";
import { t } from "./words.js";

// Ends of the cut at a share of the alignment's length; across the middle of the map without one.
export function cutAt(map, line, share) {
  const wide = map.columns * map.cell_m, tall = map.rows * map.cell_m, reach = Math.hypot(wide, tall) / 2;
  if (line.length > 1) {
    const { e, n, de, dn } = pointAt(line, share * lengthOf(line)), far = Math.min(reach, 60);
    // From left to right of the direction of travel.
    return { ends: [[e - dn * far, n + de * far], [e + dn * far, n - de * far]], at: share * lengthOf(line), middle: far };
  }
  const e = map.west_m + wide * share;
  return { ends: [[e, map.north_m - tall], [e, map.north_m]], at: wide * share, middle: tall / 2 };
}

export class Profile {
  constructor(canvas) {
    this.canvas = canvas;
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(canvas);
    this.repaint = () => this.draw();
    document.addEventListener("theme", this.repaint);
  }
  close() { this.watch.disconnect(); document.removeEventListener("theme", this.repaint); }
  show(heights, cut, level, block_m) {
    Object.assign(this, { heights, cut, level, block_m });
    this.draw();
  }
  samples() {
    const { heights, cut } = this, { map } = heights, [[ae, an], [be, bn]] = cut.ends, long = Math.hypot(be - ae, bn - an), count = Math.min(600, Math.max(60, Math.ceil(long / map.cell_m)));
    return Array.from({ length: count + 1 }, (_, i) => {
      const f = i / count, e = ae + (be - ae) * f, n = an + (bn - an) * f, cell = heights.heightAt(e, n);
      return { x: f * long - cut.middle, z: cell < 0 ? NaN : map.survey_m[cell] ?? NaN, d: this.level ? this.level(e, n) : cell >= 0 && heights.design ? heights.design[cell] : NaN };
    });
  }
  draw() {
    const { g, w, h } = sharp(this.canvas), c = theme();
    if (!this.cut || !this.heights.map) return;
    let all = this.samples();
    const used = all.filter(s => Number.isFinite(s.z) || Number.isFinite(s.d));
    if (!used.length) return;
    const from = used[0].x, to = used[used.length - 1].x;
    all = all.filter(s => s.x >= from && s.x <= to);
    const heights = used.flatMap(s => [s.z, s.d]).filter(Number.isFinite), low = Math.min(...heights), high = Math.max(...heights);
    // The same scale in both directions: slopes are slopes.
    const scale = Math.min((w - 60) / Math.max(1e-3, to - from), (h - 46) / Math.max(1e-3, high - low)), x = v => 40 + (w - 60) / 2 + (v - (from + to) / 2) * scale, y = v => h - 26 - (h - 46 - (high - low) * scale) / 2 - (v - low) * scale;
    g.font = "12px system-ui, sans-serif"; g.strokeStyle = c.grid; g.fillStyle = c.soft; g.lineWidth = 1;
    const raw = 60 / scale, power = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].map(m => m * power).find(v => v >= raw);
    g.textAlign = "right";
    for (let v = Math.ceil(low / step) * step; v <= high; v += step) { g.beginPath(); g.moveTo(40, y(v)); g.lineTo(w - 10, y(v)); g.stroke(); g.fillText(number(v, step < 1 ? 1 : 0), 36, y(v) + 4); }
    g.textAlign = "center";
    for (let v = Math.ceil(from / step) * step; v <= to; v += step) { g.beginPath(); g.moveTo(x(v), 10); g.lineTo(x(v), h - 22); g.stroke(); g.fillText(number(v, step < 1 ? 1 : 0), x(v), h - 8); }
    const stroke = (key, colour, dash, wide) => { g.strokeStyle = colour; g.setLineDash(dash); g.lineWidth = wide; g.beginPath(); let on = false; for (const s of all) { if (!Number.isFinite(s[key])) { on = false; continue; } on ? g.lineTo(x(s.x), y(s[key])) : g.moveTo(x(s.x), y(s[key])); on = true; } g.stroke(); g.setLineDash([]); };
    g.fillStyle = c.fill;
    for (let i = 0; i + 1 < all.length; i++) { const a = all[i], b = all[i + 1]; if (a.d > a.z && b.d > b.z) { g.beginPath(); g.moveTo(x(a.x), y(a.z)); g.lineTo(x(b.x), y(b.z)); g.lineTo(x(b.x), y(b.d)); g.lineTo(x(a.x), y(a.d)); g.fill(); } }
    stroke("z", c.asis, [], 2);
    stroke("d", c.design, [7, 4], 2);
    if (this.block_m) { const r = this.block_m / 2 * scale; g.strokeStyle = c.planned; g.lineWidth = 2; g.beginPath(); g.arc(w - 16 - r, 14 + r, r, 0, 7); g.stroke(); }
  }
  legend() { return [["profile-survey", "asis"], ["profile-design", "design"], ["profile-block", "planned"]].map(([key, line]) => [t(key), line]); }
}
