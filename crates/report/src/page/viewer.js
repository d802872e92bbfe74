// The 3D view: what is shown, how it is coloured, and what mouse, touch and keys do to it.

import { Camera, project } from "./camera.js";
import { LOCKED, NOT_JUDGED, PLANNED, RAMP, ERROR, STRUCK, TYPES, mix } from "./colours.js";
import { MOST_HASTE, Painter, ROUGH } from "./draw.js";
import { drawOverlay } from "./overlay.js";

// Points that are looked at lie this share of the block's radius before its face.
const PULL = 0.05;
const SETTLE_MS = 220;
// A picture while moving takes longer than the first: more haste next time; less than the second: less.
const SLOW_MS = 55, FAST_MS = 14;
// So long pieces of a large picture are drawn before the page looks whether something else is wanted.
const PIECES_MS = 24;

export class Viewer {
  constructor(canvas, overlay, data, selection) {
    Object.assign(this, { canvas, overlay, data, selection, version: 0, quick: 2, haste: 2 });
    const p = data.points;
    data.heights = percentiles(data);
    this.painter = new Painter(canvas, data);
    const [low, high] = this.bounds();
    Object.assign(this, { low, high });
    this.state = {
      camera: this.home(low, high), box: null, chosen: 0, pointed: 0, pointSize: 2, pointMode: 0, blockMode: "type", order: data.added.length,
      showPoints: p.shown > 0, showLines: true, showFound: true, showAdded: true, showNotJudged: true, showDesign: Boolean(data.surfaces.design),
      foundOpacity: 1, addedOpacity: 1, designOpacity: 0.28, labels: "added", onlyPoints: 0, fade: null, pointPush: 0,
    };
    this.verdicts = { planned: new Map() };
    this.onPick = () => {};
    this.onDrawn = [];
    this.state.camera.side = side(data.blocks.filter(Boolean).map(b => b.centre));
    this.state.camera.reset(this.aspect());
    this.listen();
    selection.addEventListener("chosen", e => this.chosen(e.detail));
    selection.addEventListener("pointed", e => { this.state.pointed = e.detail.number; this.redraw(); });
    this.update();
    this.moving();
    new ResizeObserver(() => this.redraw()).observe(canvas);
  }
  home(low, high) {
    const blocks = this.data.blocks.filter(Boolean), reach = blocks.reduce((most, b) => Math.max(most, this.data.models[b.model].radius), 0);
    return new Camera(low, high, blocks.map(b => b.centre), reach);
  }
  // Around the blocks, or the points when there are none.
  bounds() {
    const p = this.data.points, blocks = this.data.blocks.filter(Boolean);
    if (!blocks.length) return [p.min, p.min.map((v, i) => v + p.size[i])];
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const b of blocks) {
      const r = this.data.models[b.model].radius;
      b.centre.forEach((v, i) => { low[i] = Math.min(low[i], v - r); high[i] = Math.max(high[i], v + r); });
    }
    return [low, high];
  }
  colour(b) {
    const { blockMode } = this.state, { rounds, errorReach } = this.data, found = b.kind === "found", verdict = found ? null : this.verdicts.planned.get(b.order);
    let c;
    if (verdict) c = verdict === "struck" ? STRUCK : LOCKED;
    else if (found && !b.judged) c = NOT_JUDGED;
    else if (found && (b.confidence === null && blockMode === "confidence" || b.fitness_m === null && blockMode === "fit" || b.occlusion === null && blockMode === "hidden")) c = [225, 225, 225];
    else if (blockMode === "confidence") c = found ? mix(RAMP, b.confidence) : [225, 225, 225];
    else if (blockMode === "fit") c = found ? mix(ERROR, b.fitness_m / errorReach) : [225, 225, 225];
    else if (blockMode === "hidden") c = found ? mix(RAMP, 1 - b.occlusion) : [225, 225, 225];
    else if (blockMode === "round") c = found ? [178, 184, 190] : mix(RAMP, rounds > 1 ? (b.round - 1) / (rounds - 1) : 1);
    else c = found ? TYPES[b.model % 6].map(v => v * 0.5 + 110) : PLANNED;
    return c.map(v => v / 255);
  }
  shown(b) {
    const s = this.state;
    if (b.kind === "added") return s.showAdded && b.order <= s.order;
    return b.judged ? s.showFound : s.showNotJudged;
  }
  opacity(b) {
    const s = this.state;
    if (s.fade && b.number !== s.fade) return 0.26;
    if (b.kind === "added" && this.verdicts.planned.get(b.order) === "struck") return 0.3;
    return b.number === s.chosen ? 1 : b.kind === "found" ? s.foundOpacity : s.addedOpacity;
  }
  // Rebuilds the list of blocks after a setting changed.
  update() {
    const list = this.data.blocks.filter(b => b && this.shown(b));
    const s = this.state, radius = Math.max(0, ...this.data.models.map(m => m.radius));
    const looked = s.pointMode === 2 || s.pointMode === 4 || s.pointMode === 1;
    s.pointPush = looked ? -PULL * radius : 0;
    s.barePoints = !looked && s.showFound && s.foundOpacity > 0.9;
    this.painter.setBlocks(list.map(b => ({ model: b.model, pose: b.pose, colour: this.colour(b), number: b.number, opacity: this.opacity(b) })).concat(this.ghost ? [this.ghost] : []));
    this.redraw();
  }
  aspect() { return this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight); }
  redraw() {
    this.pieces = null;
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      if (this.quick === 0 && this.painter.heavy(this.state)) this.drawSlowly(this.haste > 1 ? [2, 0] : [0]); else this.drawNow(this.quick);
    });
  }
  // The full picture of a large site, after a simpler one where the machine is slow: given up as soon as something moves.
  drawSlowly([quick, ...later]) {
    this.fit();
    this.version++;
    const mine = this.pieces = this.painter.inPieces(this.state, quick);
    const go = () => {
      if (this.pieces !== mine) return;
      const start = performance.now();
      let piece;
      do piece = mine.next(); while (!piece.done && performance.now() - start < PIECES_MS);
      if (!piece.done) return void requestAnimationFrame(go);
      this.matrix = piece.value;
      this.drawn(quick);
      if (later.length) this.drawSlowly(later); else this.pieces = null;
    };
    go();
  }
  // While something moves, quick pictures; the full one when it rests.
  moving() {
    this.quick = this.haste;
    clearTimeout(this.rest);
    this.rest = setTimeout(() => { this.quick = 0; this.redraw(); }, SETTLE_MS);
    this.redraw();
  }
  // The canvas as large as it is shown.
  fit() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), w = Math.max(1, Math.round(this.canvas.clientWidth * ratio)), h = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== w || this.canvas.height !== h) { this.canvas.width = w; this.canvas.height = h; }
  }
  drawNow(quick = 0) {
    this.pieces = null;
    this.fit();
    this.version++;
    const start = performance.now();
    this.matrix = this.painter.draw(this.state, { quick });
    if (quick) {
      this.painter.flush();
      const took = performance.now() - start;
      if (took > SLOW_MS) this.haste = Math.min(MOST_HASTE, quick + 1);
      else if (took < FAST_MS) this.haste = Math.max(1, quick - 1);
    }
    this.drawn(quick);
  }
  drawn(quick) {
    drawOverlay(this, quick >= ROUGH);
    this.onDrawn.forEach(f => f());
  }
  chosen({ number, from, fly }) {
    this.state.chosen = number;
    const b = this.selection.block(number);
    if (b && fly && from !== this) {
      this.state.camera.target = b.centre.slice();
      this.state.camera.distance = Math.min(this.state.camera.distance, this.data.models[b.model].radius * 11);
    }
    this.update();
  }
  // So near that a block fills much of the picture.
  near(b) { Object.assign(this.state.camera, { target: b.centre.slice(), distance: this.data.models[b.model].radius * 5.5 }); }
  // Where a place falls on the canvas, CSS pixels; null behind the eye.
  onScreen(place) { return project(this.matrix, place, this.canvas.clientWidth, this.canvas.clientHeight); }
  setBox(box) { this.state.box = box; this.redraw(); }
  pick(event) {
    const box = this.canvas.getBoundingClientRect(), ratio = this.canvas.width / box.width;
    return this.painter.pick(this.state, Math.round((event.clientX - box.left) * ratio), Math.round((event.clientY - box.top) * ratio), this.version, this.haste);
  }
  listen() {
    const canvas = this.canvas, camera = this.state.camera, held = new Map();
    let travelled = 0, spread = 0, hover = 0;
    canvas.addEventListener("contextmenu", e => e.preventDefault());
    canvas.addEventListener("pointerdown", e => { canvas.setPointerCapture(e.pointerId); held.set(e.pointerId, e); travelled = 0; spread = 0; });
    canvas.addEventListener("pointermove", e => {
      const last = held.get(e.pointerId);
      if (!last) {
        // Hovering waits for the pointer to rest: a picture of numbers is drawn for it.
        clearTimeout(hover);
        hover = setTimeout(() => this.selection.point(this.pick(e)?.number || 0, this), this.haste > 1 ? 160 : 40);
        return;
      }
      const dx = (e.clientX - last.clientX) / canvas.clientHeight, dy = (e.clientY - last.clientY) / canvas.clientHeight;
      travelled += Math.abs(dx) + Math.abs(dy);
      held.set(e.pointerId, e);
      if (held.size === 2) {
        const [a, b] = [...held.values()], now = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
        if (spread) camera.zoom(spread / now);
        spread = now;
        camera.move(dx / 2, dy / 2);
      } else if (e.shiftKey || e.buttons & 6) camera.move(dx, dy);
      else camera.turn(dx * 4, dy * 4);
      this.moving();
    });
    canvas.addEventListener("pointerleave", () => { clearTimeout(hover); this.selection.point(0, this); });
    const release = e => {
      if (held.delete(e.pointerId) && e.type === "pointerup" && travelled < 0.008 && e.button === 0) this.onPick(this.pick(e));
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("wheel", e => { e.preventDefault(); camera.zoom(Math.exp(e.deltaY * 0.0012)); this.moving(); }, { passive: false });
    canvas.addEventListener("keydown", e => {
      const step = 0.12, keys = {
        ArrowLeft: () => e.shiftKey ? camera.move(step, 0) : camera.turn(-step, 0), ArrowRight: () => e.shiftKey ? camera.move(-step, 0) : camera.turn(step, 0),
        ArrowUp: () => e.shiftKey ? camera.move(0, step) : camera.turn(0, step), ArrowDown: () => e.shiftKey ? camera.move(0, -step) : camera.turn(0, -step),
        "+": () => camera.zoom(0.85), "=": () => camera.zoom(0.85), "-": () => camera.zoom(1 / 0.85), t: () => camera.fromAbove(this.aspect()), r: () => camera.reset(this.aspect()),
      };
      if (!keys[e.key] || e.ctrlKey || e.metaKey || e.altKey) return;
      e.preventDefault();
      keys[e.key]();
      this.moving();
    });
  }
}

// Heights of the points between which the colours run: 1 % at either end is left out, so that one stray point does not
// make the rest pale.
function percentiles({ record, points }) {
  const bins = new Uint32Array(1024), n = points.shown;
  for (let i = 0; i < n; i++) bins[record[i * 6 + 2] >> 6]++;
  const at = share => { let sum = 0; for (let i = 0; i < 1024; i++) if ((sum += bins[i]) >= share * n) return (i + 0.5) / 1024; return 1; };
  const [low, high] = [at(0.01), at(0.99)].map(s => points.min[2] + s * points.size[2]);
  return high - low > 1e-6 ? [low, high] : [points.min[2], points.min[2] + points.size[2]];
}

// The side from which the long way of the works runs across the picture, a little turned; the usual corner where
// nothing is long.
function side(places) {
  const n = places.length || 1, mean = [0, 1].map(k => places.reduce((s, p) => s + p[k], 0) / n);
  let [xx, xy, yy] = [0, 0, 0];
  for (const p of places) { const [x, y] = [p[0] - mean[0], p[1] - mean[1]]; xx += x * x; xy += x * y; yy += y * y; }
  const long = Math.hypot(xx - yy, 2 * xy) / ((xx + yy) || 1), direction = Math.atan2(2 * xy, xx - yy) / 2;
  if (long < 0.5) return -2.2;
  // Seen from the south rather than from the north.
  const azimuth = direction - Math.PI / 2, seen = Math.sin(azimuth) > 0 ? azimuth + Math.PI : azimuth;
  return seen - 0.3 * (1 - long);
}
