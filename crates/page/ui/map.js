// The height map: seen, moved, and drawn on with mouse, finger or keys.

import { DIVERGING, RAMP, mix } from "/ui/report/colours.js";
import { sharp, theme } from "/ui/report/words.js";
import { number } from "./parts.js";
import { t } from "./words.js";

export class HeightMap {
  constructor(canvas, read) {
    Object.assign(this, { canvas, read, map: null, design: null, line: [], closed: false, mode: "height", drawing: null, block_m: 0, cut: null, cross: null, onDrawn() {}, onDone() {} });
    canvas.tabIndex = 0;
    const on = (name, act) => canvas.addEventListener(name, act);
    on("pointerdown", e => this.down(e));
    on("pointermove", e => this.move(e));
    on("pointerup", e => this.up(e));
    on("pointercancel", () => { this.held = null; });
    on("dblclick", () => this.drawing && this.finish());
    on("wheel", e => { e.preventDefault(); this.zoom(Math.exp(-e.deltaY * 0.0015), e.offsetX, e.offsetY); });
    on("keydown", e => this.key(e));
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(canvas);
    this.repaint = () => { this.picture = null; this.draw(); };
    document.addEventListener("theme", this.repaint);
  }
  close() { this.watch.disconnect(); document.removeEventListener("theme", this.repaint); }
  show(map) {
    this.map = map;
    this.picture = null;
    this.view = null;
    this.draw();
  }
  paint(design) { this.design = design; this.picture = null; this.draw(); }
  // Metres to pixels: middle of the view and pixels a metre.
  fit(w, h) {
    const { map } = this, wide = map.columns * map.cell_m, tall = map.rows * map.cell_m;
    this.view = { e: map.west_m + wide / 2, n: map.north_m - tall / 2, scale: Math.min(w / wide, h / tall) * 0.94 };
  }
  at(e, n) { const { view, canvas } = this; return [canvas.clientWidth / 2 + (e - view.e) * view.scale, canvas.clientHeight / 2 - (n - view.n) * view.scale]; }
  place(x, y) { const { view, canvas } = this; return [view.e + (x - canvas.clientWidth / 2) / view.scale, view.n - (y - canvas.clientHeight / 2) / view.scale]; }
  zoom(by, x = this.canvas.clientWidth / 2, y = this.canvas.clientHeight / 2) {
    if (!this.view) return;
    const [e, n] = this.place(x, y);
    this.view.scale = Math.min(400, Math.max(0.02, this.view.scale * by));
    const [e2, n2] = this.place(x, y);
    this.view.e += e - e2;
    this.view.n += n - n2;
    this.draw();
  }
  down(e) {
    if (!this.view) return;
    this.canvas.setPointerCapture(e.pointerId);
    this.held = { x: e.offsetX, y: e.offsetY, moved: 0 };
  }
  move(e) {
    if (!this.view) return;
    if (this.held) {
      const dx = e.offsetX - this.held.x, dy = e.offsetY - this.held.y;
      this.held.moved += Math.abs(dx) + Math.abs(dy);
      if (this.held.moved > 5) { this.view.e -= dx / this.view.scale; this.view.n += dy / this.view.scale; }
      Object.assign(this.held, { x: e.offsetX, y: e.offsetY });
    }
    this.cross = this.place(e.offsetX, e.offsetY);
    this.tell();
    this.draw();
  }
  up(e) {
    const clicked = this.held && this.held.moved <= 5;
    this.held = null;
    if (clicked && this.drawing) this.add(this.place(e.offsetX, e.offsetY));
  }
  key(e) {
    if (!this.view) return;
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[e.key];
    if (step) {
      const far = (e.shiftKey ? 60 : 12) / this.view.scale;
      if (this.drawing) this.cross = [(this.cross || [this.view.e, this.view.n])[0] + step[0] * far, (this.cross || [this.view.e, this.view.n])[1] + step[1] * far];
      else { this.view.e += step[0] * far; this.view.n += step[1] * far; this.cross = [this.view.e, this.view.n]; }
      this.tell();
    } else if (e.key === "+" || e.key === "-") this.zoom(e.key === "+" ? 1.25 : 0.8);
    else if (e.key === "0") this.view = null;
    else if (this.drawing && e.key === " ") this.add(this.cross || [this.view.e, this.view.n]);
    else if (this.drawing && e.key === "Backspace") { this.drawing.pop(); this.onDrawn([...this.drawing]); }
    else if (this.drawing && (e.key === "Enter" || e.key === "Escape")) this.finish();
    else return;
    e.preventDefault();
    this.draw();
  }
  begin() { this.drawing = []; this.canvas.focus(); this.draw(); }
  add(place) {
    this.drawing.push(place.map(v => Math.round(v * 100) / 100));
    this.onDrawn([...this.drawing]);
    this.draw();
  }
  finish() { this.drawing = null; this.onDone(); this.draw(); }
  heightAt(e, n) {
    const { map } = this, c = Math.floor((e - map.west_m) / map.cell_m), r = Math.floor((map.north_m - n) / map.cell_m);
    return c < 0 || r < 0 || c >= map.columns || r >= map.rows ? -1 : r * map.columns + c;
  }
  tell() {
    if (!this.cross) return;
    const [e, n] = this.cross, i = this.heightAt(e, n), z = i < 0 ? null : this.map.survey_m[i], d = this.design && i >= 0 ? this.design[i] : NaN;
    this.read.textContent = t("map-read", { e: number(e, 2), n: number(n, 2), z: number(z ?? NaN, 2) }) + (Number.isFinite(d) ? ` · ${t("map-design", { z: number(d, 2) })}` : "");
  }
  // One pixel a cell, shaded as if the sun stood in the north-west.
  render() {
    const { map } = this, { columns: w, rows: h, survey_m: z } = map, of = document.createElement("canvas");
    Object.assign(of, { width: w, height: h });
    const g = of.getContext("2d"), image = g.createImageData(w, h), sorted = z.filter(v => v !== null).sort((a, b) => a - b);
    const low = sorted[Math.floor(sorted.length * 0.02)], high = sorted[Math.floor(sorted.length * 0.98)], span = Math.max(1e-6, high - low);
    const differs = this.mode === "difference" && this.design, reach = Math.max(0.5, span / 2);
    this.range = differs ? [-reach, reach] : [low, high];
    for (let i = 0; i < w * h; i++) {
      if (z[i] === null) continue;
      const right = i % w + 1 < w && z[i + 1] !== null ? z[i + 1] : z[i], below = i + w < w * h && z[i + w] !== null ? z[i + w] : z[i];
      const shade = Math.min(1.35, Math.max(0.55, 1 + (z[i] - right + z[i] - below) / map.cell_m * 0.16));
      if (differs && !Number.isFinite(this.design[i])) { image.data.set([150, 150, 150, 90], i * 4); continue; }
      // What is missing below the design is red, as in the report.
      const c = differs ? mix(DIVERGING, 0.5 - (z[i] - this.design[i]) / (2 * reach)) : mix(RAMP, (z[i] - low) / span);
      image.data.set([...c.map(v => Math.min(255, v * shade)), 255], i * 4);
    }
    g.putImageData(image, 0, 0);
    this.picture = of;
  }
  draw() {
    const { g, w, h } = sharp(this.canvas), c = theme();
    if (!this.map) {
      g.fillStyle = c.soft;
      g.font = "14px system-ui, sans-serif";
      g.textAlign = "center";
      g.fillText(t("map-none"), w / 2, h / 2);
      return;
    }
    if (!this.view) this.fit(w, h);
    if (!this.picture) this.render();
    const { map } = this, [x, y] = this.at(map.west_m, map.north_m), pixel = map.cell_m * this.view.scale;
    g.imageSmoothingEnabled = pixel < 1;
    g.drawImage(this.picture, x, y, map.columns * pixel, map.rows * pixel);
    this.drawLine(g, c);
    if (this.cut) this.drawCut(g, c);
    this.drawScale(g, c, w, h);
    if (this.block_m && this.cross) this.ring(g, c.planned, ...this.at(...this.cross), this.block_m / 2 * this.view.scale);
    if (this.drawing && this.cross) { const [a, b] = this.at(...this.cross); g.strokeStyle = c.chosen; g.beginPath(); g.moveTo(a - 12, b); g.lineTo(a + 12, b); g.moveTo(a, b - 12); g.lineTo(a, b + 12); g.stroke(); }
  }
  drawLine(g, c) {
    const points = (this.drawing || this.line).map(p => this.at(...p));
    if (!points.length) return;
    const path = () => { g.beginPath(); points.forEach(([x, y], i) => i ? g.lineTo(x, y) : g.moveTo(x, y)); if (this.closed && !this.drawing) g.closePath(); g.stroke(); };
    g.lineWidth = 5; g.strokeStyle = c.halo; path();
    g.lineWidth = 2.5; g.strokeStyle = c.design; path();
    g.fillStyle = c.design;
    points.forEach(([x, y], i) => { g.beginPath(); g.arc(x, y, i ? 4 : 6, 0, 7); g.fill(); });
    // Which way the alignment runs: left and right follow from it.
    if (!this.closed && points.length > 1) {
      const [a, b] = points.slice(-2), turn = Math.atan2(b[1] - a[1], b[0] - a[0]);
      g.beginPath(); g.moveTo(b[0] + 12 * Math.cos(turn), b[1] + 12 * Math.sin(turn)); for (const s of [2.5, -2.5]) g.lineTo(b[0] + 10 * Math.cos(turn + s), b[1] + 10 * Math.sin(turn + s)); g.fill();
    }
  }
  drawCut(g, c) {
    const [a, b] = this.cut.map(p => this.at(...p));
    g.lineWidth = 1.5; g.strokeStyle = c.ink; g.setLineDash([6, 4]); g.beginPath(); g.moveTo(...a); g.lineTo(...b); g.stroke(); g.setLineDash([]);
  }
  ring(g, colour, x, y, r) { g.lineWidth = 2; g.strokeStyle = colour; g.beginPath(); g.arc(x, y, Math.max(1, r), 0, 7); g.stroke(); }
  drawScale(g, c, w, h) {
    const raw = 110 / this.view.scale, power = 10 ** Math.floor(Math.log10(raw)), long = [1, 2, 5, 10].map(m => m * power).filter(v => v <= raw).pop() || power, px = long * this.view.scale;
    g.fillStyle = c.halo; g.fillRect(8, h - 34, px + 96, 28);
    g.strokeStyle = g.fillStyle = c.ink; g.lineWidth = 2; g.beginPath(); g.moveTo(16, h - 18); g.lineTo(16, h - 12); g.lineTo(16 + px, h - 12); g.lineTo(16 + px, h - 18); g.stroke();
    g.font = "12px system-ui, sans-serif"; g.textAlign = "left"; g.fillText(`${number(long, long < 1 ? 2 : 0)} m`, 22 + px, h - 12);
    g.beginPath(); g.moveTo(px + 78, h - 30); g.lineTo(px + 84, h - 12); g.lineTo(px + 78, h - 16); g.lineTo(px + 72, h - 12); g.fill();
    const wide = 150, x = w - wide - 14;
    g.fillStyle = c.halo; g.fillRect(x - 8, h - 38, wide + 16, 32);
    const ramp = g.createLinearGradient(x, 0, x + wide, 0), stops = this.mode === "difference" && this.design ? [...DIVERGING].reverse() : RAMP;
    stops.forEach((s, i) => ramp.addColorStop(i / (stops.length - 1), `rgb(${s.map(Math.round)})`));
    g.fillStyle = ramp; g.fillRect(x, h - 34, wide, 9);
    g.fillStyle = c.ink; g.fillText(`${number(this.range[0], 1)}`, x, h - 11); g.textAlign = "right"; g.fillText(`${number(this.range[1], 1)} m`, x + wide, h - 11);
  }
}
