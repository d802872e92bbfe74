// The plan view: blocks from straight above, heat maps, outlines, alignment with chainage, numbers as far as they have
// room, section lines. Drag moves, wheel zooms; drawing a line or a box makes a free section.

import { PlanCamera } from "./camera.js";
import { DIVERGING, css, mix } from "./colours.js";
import { bar, haloed } from "./overlay.js";
import { number, roundUp, said, sharp, theme, words } from "./words.js";

export class PlanView {
  constructor(canvas, viewer, selection) {
    Object.assign(this, { canvas, viewer, selection, data: viewer.data, layer: "blocks", tool: "", drag: null, sections: null, picture: null });
    this.camera = new PlanCamera(viewer.low, viewer.high);
    // Heat maps as pictures, ready to be scaled.
    this.maps = this.data.maps.map(m => heat(m.grid));
    this.windows = heatOfWindows(this.data);
    this.listen();
    for (const name of ["chosen", "pointed"]) selection.addEventListener(name, e => { if (name === "chosen") this.follow(e.detail); this.draw(); });
    // Nothing is drawn for a plan nobody sees.
    new IntersectionObserver(([entry]) => { this.inSight = entry.isIntersecting; if (this.inSight && this.old) this.stale(); }).observe(canvas);
    new ResizeObserver(() => { this.fitted ? this.stale() : this.fit(); }).observe(canvas);
    document.addEventListener("language", () => this.draw());
    document.addEventListener("theme", () => this.draw());
  }
  fit() {
    if (!this.canvas.clientWidth) return;
    this.camera.fit(this.canvas.clientWidth, this.canvas.clientHeight);
    this.fitted = true;
    this.stale();
  }
  // CSS pixels of a local place, and back.
  at(x, y) { const { target, metresPerPixel: m } = this.camera; return [this.canvas.clientWidth / 2 + (x - target[0]) / m, this.canvas.clientHeight / 2 - (y - target[1]) / m]; }
  place(px, py) { const { target, metresPerPixel: m } = this.camera; return [target[0] + (px - this.canvas.clientWidth / 2) * m, target[1] - (py - this.canvas.clientHeight / 2) * m]; }
  follow({ number, from }) {
    const b = this.selection.block(number);
    if (!b || from === this) return;
    const [x, y] = this.at(...b.centre), { clientWidth: w, clientHeight: h } = this.canvas;
    if (x < 20 || y < 20 || x > w - 20 || y > h - 20) { this.camera.target = b.centre.slice(); this.stale(); }
  }
  // The picture of the blocks is old: the one there is drawn where it belongs until a new one is made.
  stale() {
    this.draw();
    this.old = true;
    if (!this.inSight) return;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => { this.render(); this.draw(); }, 90);
  }
  render() {
    this.old = false;
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    const ratio = Math.min(window.devicePixelRatio || 1, 2), w = Math.round(clientWidth * ratio), h = Math.round(clientHeight * ratio);
    const state = { ...this.viewer.state, chosen: 0, pointed: 0, showPoints: this.viewer.state.showPoints && !this.data.blocks.length, showLines: false };
    const many = this.camera.metresPerPixel > Math.max(...this.data.models.map(m => m.radius), 1e-6) / 14;
    const pixels = this.viewer.painter.plan(state, this.camera, w, h, ratio, many ? this.viewer.haste : 0);
    const picture = this.picture?.canvas || document.createElement("canvas");
    picture.width = w;
    picture.height = h;
    const g = picture.getContext("2d"), image = new ImageData(w, h), row = w * 4;
    for (let y = 0; y < h; y++) image.data.set(pixels.subarray((h - 1 - y) * row, (h - y) * row), y * row);
    g.putImageData(image, 0, 0);
    this.picture = { canvas: picture, target: this.camera.target.slice(), metresPerPixel: this.camera.metresPerPixel, w: clientWidth, h: clientHeight };
    this.viewer.redraw();
  }
  draw() {
    if (!this.canvas.clientWidth) return;
    const { g, w, h } = sharp(this.canvas), colours = theme();
    this.grid(g, w, h, colours);
    if (this.layer === "blocks") this.blocks(g, w, h);
    else this.heat(g, w, h);
    this.lines(g, colours);
    this.numbers(g, w, h, colours);
    this.alignment(g, colours);
    this.cuts(g, colours);
    this.marks(g, colours);
    this.frame(g, w, h, colours);
  }
  blocks(g, w, h, alpha = 1) {
    if (!this.picture) return;
    const p = this.picture, scale = p.metresPerPixel / this.camera.metresPerPixel, [x, y] = this.at(p.target[0], p.target[1]);
    g.globalAlpha = alpha;
    g.drawImage(p.canvas, x - p.w * scale / 2, y - p.h * scale / 2, p.w * scale, p.h * scale);
    g.globalAlpha = 1;
  }
  heat(g, w, h) {
    const grid = this.layer === "windows" ? null : this.data.maps[this.layer].grid;
    if (!grid) { this.blocks(g, w, h, 0.35); this.windows.draw(g, this); return; }
    const [x, y] = this.at(grid.origin[0] - grid.cell / 2, grid.origin[1] + (grid.ny - 0.5) * grid.cell);
    g.imageSmoothingEnabled = false;
    g.drawImage(this.maps[this.layer].picture, x, y, grid.nx * grid.cell / this.camera.metresPerPixel, grid.ny * grid.cell / this.camera.metresPerPixel);
    g.imageSmoothingEnabled = true;
  }
  grid(g, w, h, colours) {
    const step = roundUp(this.camera.metresPerPixel * 100), o = this.data.origin, [x0, y1] = this.place(0, 0), [x1, y0] = this.place(w, h);
    const digits = Math.max(0, -Math.floor(Math.log10(step)));
    g.strokeStyle = colours.grid;
    g.lineWidth = 1;
    g.beginPath();
    this.ticks = [];
    for (let e = Math.ceil((x0 + o[0]) / step) * step; e < x1 + o[0]; e += step) { const [x] = this.at(e - o[0], 0); g.moveTo(x, 0); g.lineTo(x, h); this.ticks.push([x, h - 8, number(e, digits)]); }
    for (let n = Math.ceil((y0 + o[1]) / step) * step; n < y1 + o[1]; n += step) { const [, y] = this.at(0, n - o[1]); g.moveTo(0, y); g.lineTo(w, y); this.ticks.push([6, y - 4, number(n, digits), 1]); }
    g.stroke();
  }
  lines(g, colours) {
    g.strokeStyle = colours.design;
    g.lineWidth = 1.6;
    g.setLineDash([8, 4]);
    for (const o of this.data.outlines) {
      g.beginPath();
      o.points.forEach((p, i) => i ? g.lineTo(...this.at(p[0], p[1])) : g.moveTo(...this.at(p[0], p[1])));
      if (o.closed) g.closePath();
      g.stroke();
    }
    g.setLineDash([]);
  }
  alignment(g, colours) {
    const s = this.sections;
    if (!s?.works) return;
    g.strokeStyle = colours.ink;
    g.lineWidth = 1.2;
    g.beginPath();
    s.line.points.forEach((p, i) => i ? g.lineTo(...this.at(...p)) : g.moveTo(...this.at(...p)));
    g.stroke();
    const step = Math.max(s.spacing, roundUp(this.camera.metresPerPixel * 70));
    g.textAlign = "left";
    g.textBaseline = "middle";
    for (let c = 0; c <= s.line.length + 1e-6; c += step) {
      const { at: p, along } = s.line.place(c), [x, y] = this.at(...p), [u, v] = [along[1] * 5, along[0] * 5];
      g.beginPath(); g.moveTo(x - u, y - v); g.lineTo(x + u, y + v); g.stroke();
      haloed(g, chainage(c), x + u + 3, y + v + 3, colours.ink, colours.halo);
    }
  }
  numbers(g, w, h, colours) {
    const m = this.camera.metresPerPixel, taken = new Set();
    g.textAlign = "center";
    g.textBaseline = "middle";
    g.font = "600 11px system-ui, sans-serif";
    for (const b of this.data.blocks) {
      if (!b || !this.viewer.shown(b)) continue;
      const must = b.number === this.selection.chosen || b.number === this.selection.pointed;
      if (!must && (b.kind === "found" || this.data.models[b.model].radius / m < 7)) continue;
      const [x, y] = this.at(...b.centre), slot = `${Math.round(x / 20)} ${Math.round(y / 13)}`;
      if (x < 0 || y < 0 || x > w || y > h || (!must && taken.has(slot))) continue;
      taken.add(slot);
      haloed(g, b.kind === "added" ? String(b.order) : `R${b.id}`, x, y, b.number === this.selection.chosen ? colours.chosen : colours.ink, colours.halo);
    }
  }
  cuts(g, colours) {
    const s = this.sections;
    if (!s) return;
    const cut = s.current();
    if (cut) {
      const [a, b] = [this.at(...cut.from), this.at(...cut.to)];
      g.strokeStyle = colours.chosen;
      g.lineWidth = 2;
      g.beginPath(); g.moveTo(...a); g.lineTo(...b); g.stroke();
      g.textAlign = "left";
      haloed(g, cut.name, b[0] + 5, b[1], colours.chosen, colours.halo);
      if (s.pointer !== null) { const t = (s.pointer - cut.start) / cut.length, x = a[0] + (b[0] - a[0]) * t, y = a[1] + (b[1] - a[1]) * t; g.beginPath(); g.arc(x, y, 5, 0, 7); g.fillStyle = colours.chosen; g.fill(); }
    }
    if (this.drag?.from && this.tool) {
      const { from, to } = this.drag, [a, b] = [this.at(...from), this.at(...to)];
      g.strokeStyle = colours.chosen;
      g.setLineDash([5, 4]);
      if (this.tool === "box") g.strokeRect(a[0], a[1], b[0] - a[0], b[1] - a[1]);
      else { g.beginPath(); g.moveTo(...a); g.lineTo(...b); g.stroke(); }
      g.setLineDash([]);
    }
    const box = this.viewer.state.box;
    if (box && box.corners) {
      g.strokeStyle = colours.chosen;
      g.lineWidth = 1;
      g.beginPath();
      box.corners.forEach((p, i) => i ? g.lineTo(...this.at(...p)) : g.moveTo(...this.at(...p)));
      g.closePath();
      g.stroke();
    }
  }
  marks(g, colours) {
    for (const [number, wide] of [[this.selection.pointed, 1.5], [this.selection.chosen, 2.5]]) {
      const b = this.selection.block(number);
      if (!b) continue;
      const [x, y] = this.at(...b.centre);
      g.beginPath();
      g.arc(x, y, Math.max(9, this.data.models[b.model].radius / this.camera.metresPerPixel), 0, 7);
      g.lineWidth = wide;
      g.strokeStyle = colours.chosen;
      g.stroke();
    }
  }
  frame(g, w, h, colours) {
    g.font = "11px system-ui, sans-serif";
    g.textBaseline = "alphabetic";
    for (const [x, y, text, left] of this.ticks) { g.textAlign = left ? "left" : "center"; if (left ? y > 20 && y < h - 24 : x > 70 && x < w - 40) haloed(g, text, x, y, colours.soft, colours.halo); }
    g.font = "600 12px system-ui, sans-serif";
    const metres = roundUp(this.camera.metresPerPixel * 90);
    bar(g, w - 20 - metres / this.camera.metresPerPixel, h - 26, metres / this.camera.metresPerPixel, metres, colours);
    g.beginPath(); g.moveTo(w - 30, 14); g.lineTo(w - 37, 38); g.lineTo(w - 30, 33); g.lineTo(w - 23, 38); g.closePath();
    g.fillStyle = colours.ink;
    g.fill();
    g.textAlign = "center";
    haloed(g, "N", w - 30, 52, colours.ink, colours.halo);
  }
  // The block whose centre is nearest within its own reach; planned ones lie on top.
  under(x, y) {
    let best = 0, least = Infinity;
    for (const b of this.data.blocks) {
      if (!b || !this.viewer.shown(b)) continue;
      const d = Math.hypot(b.centre[0] - x, b.centre[1] - y) - b.centre[2] * 0.15;
      if (Math.hypot(b.centre[0] - x, b.centre[1] - y) < this.data.models[b.model].radius * 0.8 && d < least) { least = d; best = b.number; }
    }
    return best;
  }
  listen() {
    const canvas = this.canvas, place = e => { const box = canvas.getBoundingClientRect(); return this.place(e.clientX - box.left, e.clientY - box.top); };
    canvas.addEventListener("wheel", e => {
      e.preventDefault();
      const [x, y] = place(e), factor = Math.exp(e.deltaY * 0.0015), { target } = this.camera;
      this.zoom(factor, x, y, target);
    }, { passive: false });
    const held = new Map();
    let spread = 0;
    canvas.addEventListener("pointerdown", e => { canvas.setPointerCapture(e.pointerId); held.set(e.pointerId, e); spread = 0; this.drag = { start: [e.clientX, e.clientY], last: e, moved: 0, from: place(e), to: place(e) }; });
    canvas.addEventListener("pointermove", e => {
      const d = this.drag;
      if (!d) { this.selection.point(this.under(...place(e)), this); return; }
      held.set(e.pointerId, e);
      if (held.size === 2) {
        const [a, b] = [...held.values()], now = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
        if (spread) this.zoom(spread / now, ...this.camera.target, this.camera.target);
        spread = now;
        d.moved = 99;
        return;
      }
      d.moved += Math.abs(e.clientX - d.last.clientX) + Math.abs(e.clientY - d.last.clientY);
      d.to = place(e);
      if (this.tool) this.draw();
      else if (d.moved > 4) {
        this.camera.target[0] -= (e.clientX - d.last.clientX) * this.camera.metresPerPixel;
        this.camera.target[1] += (e.clientY - d.last.clientY) * this.camera.metresPerPixel;
        this.stale();
      }
      d.last = e;
    });
    const end = e => {
      held.delete(e.pointerId);
      const d = this.drag;
      if (held.size || !d) return;
      this.drag = null;
      if (d.moved < 5) { if (!this.tool) this.selection.choose(this.under(...place(e)), this); }
      else if (this.tool && Math.hypot(d.to[0] - d.from[0], d.to[1] - d.from[1]) > this.camera.metresPerPixel * 8) this.onDrawn(this.tool, d.from, d.to);
      this.draw();
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("pointerleave", () => { if (!this.drag) this.selection.point(0, this); });
    canvas.addEventListener("keydown", e => {
      const step = 60 * this.camera.metresPerPixel, t = this.camera.target, keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[e.key];
      if (keys) { t[0] += keys[0] * step; t[1] += keys[1] * step; }
      else if (e.key === "+" || e.key === "=") this.zoom(0.8, t[0], t[1], t);
      else if (e.key === "-") this.zoom(1.25, t[0], t[1], t);
      else if (e.key === "0" || e.key === "r") this.fit();
      else return;
      e.preventDefault();
      this.stale();
    });
  }
  zoom(factor, x, y, target) {
    const now = this.camera.metresPerPixel, next = Math.min(Math.max(now * factor, 0.0005), 50);
    target[0] = x + (target[0] - x) * next / now;
    target[1] = y + (target[1] - y) * next / now;
    this.camera.metresPerPixel = next;
    this.stale();
  }
  // The legend of what is shown, as HTML nodes made by the caller's `swatch` and `ramp`.
  legend(swatch, ramp) {
    if (this.layer === "blocks") return [];
    if (this.layer === "windows") return this.windows.reasons.map(r => swatch(css(r.colour), `${said(r.reason)} · ${number(r.count)} · ${number(r.volume, 1)} m³`));
    const { reach } = this.maps[this.layer];
    return [ramp([...DIVERGING].reverse(), words(`${number(reach, 2)} m above the design`, `超過 ${number(reach, 2)} m`), words(`${number(reach, 2)} m missing`, `不足 ${number(reach, 2)} m`))];
  }
}

// Chainage as surveyors write it: No.3+12.00 counts stations of 20 m.
export function chainage(metres) {
  const station = Math.floor(metres / 20 + 1e-9), rest = metres - station * 20;
  return `No.${station}` + (rest > 0.005 ? `+${number(rest, Math.abs(rest - Math.round(rest)) < 0.005 ? 0 : 2)}` : "");
}

// A grid as a picture; colours reach as far as 98 % of the cells, so that one outlier does not make it pale.
function heat(grid) {
  const sizes = Float32Array.from(grid.z.filter(v => !Number.isNaN(v)), Math.abs).sort(), reach = Math.max(sizes.length ? sizes[Math.floor((sizes.length - 1) * 0.98)] : 1, 1e-6);
  const picture = document.createElement("canvas");
  picture.width = grid.nx;
  picture.height = grid.ny;
  const image = new ImageData(grid.nx, grid.ny);
  for (let j = 0; j < grid.ny; j++) for (let i = 0; i < grid.nx; i++) {
    const v = grid.z[(grid.ny - 1 - j) * grid.nx + i];
    if (Number.isNaN(v)) continue;
    // Missing (a positive deficit) is red.
    image.data.set([...mix(DIVERGING, (v / reach + 1) / 2), 255], (j * grid.nx + i) * 4);
  }
  picture.getContext("2d").putImageData(image, 0, 0);
  return { picture, reach };
}

const REASONS = [[213, 94, 0], [0, 114, 178], [120, 94, 160], [0, 158, 115], [200, 160, 0], [110, 110, 110]];

// Places that stay unfilled, by reason.
function heatOfWindows(data) {
  const reasons = [];
  for (const w of data.windows) {
    let r = reasons.find(r => r.reason.en === w.reason.en);
    if (!r) reasons.push(r = { reason: w.reason, colour: REASONS[reasons.length % REASONS.length], count: 0, volume: 0, windows: [] });
    r.count++;
    r.volume += w.void_m3;
    r.windows.push(w);
  }
  return { reasons, draw(g, plan) {
    for (const r of reasons) for (const w of r.windows) {
      const [x, y] = plan.at(w.x - w.half_m, w.y + w.half_m), size = 2 * w.half_m / plan.camera.metresPerPixel;
      g.fillStyle = css(r.colour, 0.55);
      g.fillRect(x, y, size, size);
      g.strokeStyle = css(r.colour);
      g.lineWidth = 1;
      g.strokeRect(x, y, size, size);
    }
  } };
}
