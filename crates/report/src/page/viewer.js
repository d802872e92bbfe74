// The 3D view: what is shown, how it is coloured, and what mouse, touch and keys do to it.

const TYPE_COLOURS = [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [213, 94, 0], [86, 180, 233]];
const ADDED = [213, 94, 0], NOT_JUDGED = [150, 150, 150];
const mix = (stops, share) => {
  const v = Math.min(1, Math.max(0, share)) * (stops.length - 1), i = Math.min(Math.floor(v), stops.length - 2), f = v - i;
  return stops[i].map((c, k) => c * (1 - f) + stops[i + 1][k] * f);
};

class Viewer {
  constructor(canvas, data) {
    this.canvas = canvas;
    this.data = data;
    this.painter = new Painter(canvas, data);
    const [low, high] = this.bounds();
    this.state = {
      camera: new Camera(low, high), cut: [0, 0, 0, 1], chosen: 0, showPoints: true, showLines: true, showFound: true, showAdded: true,
      pointSize: 2, pointMode: 0, blockMode: "type", order: data.added.length,
    };
    this.low = low;
    this.high = high;
    this.onPick = () => {};
    this.onDrawn = () => {};
    this.state.camera.reset(this.aspect());
    this.listen();
    this.update();
    new ResizeObserver(() => this.redraw()).observe(canvas);
  }
  // Added blocks are numbered after the found ones.
  number(kind, i) { return kind === "found" ? i + 1 : this.data.found.length + i + 1; }
  block(number) {
    const n = this.data.found.length;
    return number <= n ? { kind: "found", ...this.data.found[number - 1] } : { kind: "added", ...this.data.added[number - n - 1] };
  }
  centre(b) {
    return add(rotate(b.pose, this.data.models[b.model].centre), b.pose.slice(4));
  }
  // Around the blocks, or the points when there are none.
  bounds() {
    const p = this.data.points, blocks = [...this.data.found, ...this.data.added];
    if (!blocks.length) return [p.min, p.min.map((v, i) => v + p.size[i])];
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const b of blocks) {
      const c = this.centre(b), r = this.data.models[b.model].radius;
      c.forEach((v, i) => { low[i] = Math.min(low[i], v - r); high[i] = Math.max(high[i], v + r); });
    }
    return [low, high];
  }
  colour(b, kind) {
    const mode = this.state.blockMode;
    let c;
    if (mode === "confidence") c = kind === "found" && b.confidence !== null ? mix(RAMP, b.confidence) : [225, 225, 225];
    else if (mode === "round") c = kind === "found" ? [178, 184, 190] : mix(RAMP, this.data.rounds > 1 ? (b.round - 1) / (this.data.rounds - 1) : 1);
    else if (kind === "added") c = ADDED;
    else c = b.judged ? TYPE_COLOURS[b.model % 6].map(v => v * 0.55 + 105) : NOT_JUDGED;
    return c.map(v => v / 255);
  }
  // Rebuilds the list of blocks after a setting changed.
  update() {
    const s = this.state, list = [];
    const put = (kind, b, i) => list.push({ model: b.model, pose: b.pose, colour: this.colour(b, kind), number: this.number(kind, i) });
    if (s.showFound) this.data.found.forEach((b, i) => put("found", b, i));
    if (s.showAdded) this.data.added.forEach((b, i) => { if (i < s.order) put("added", b, i); });
    this.painter.setBlocks(list);
    this.redraw();
  }
  aspect() { return this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight); }
  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.drawNow(); });
  }
  drawNow() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), w = Math.max(1, Math.round(this.canvas.clientWidth * ratio)), h = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== w || this.canvas.height !== h) { this.canvas.width = w; this.canvas.height = h; }
    this.matrix = this.painter.draw(this.state);
    this.onDrawn();
  }
  choose(number, fly) {
    this.state.chosen = number;
    if (number && fly) {
      const b = this.block(number);
      this.state.camera.target = this.centre(b);
      this.state.camera.distance = Math.min(this.state.camera.distance, this.data.models[b.model].radius * 9);
    }
    this.redraw();
  }
  // share in [0, 1] along the axis; "" takes the cut away.
  setCut(axis, share) {
    const cut = [0, 0, 0, 1];
    if (axis !== "") {
      const k = Number(axis), low = Math.min(this.low[k], this.data.points.min[k]), high = Math.max(this.high[k], this.data.points.min[k] + this.data.points.size[k]);
      cut[k] = 1;
      cut[3] = low + (high - low) * share;
    }
    this.state.cut = cut;
    this.redraw();
  }
  pick(event) {
    const box = this.canvas.getBoundingClientRect(), ratio = this.canvas.width / box.width;
    return this.painter.pick(this.state, Math.round((event.clientX - box.left) * ratio), Math.round((event.clientY - box.top) * ratio));
  }
  listen() {
    const canvas = this.canvas, camera = this.state.camera, held = new Map();
    let travelled = 0, spread = 0;
    canvas.addEventListener("contextmenu", e => e.preventDefault());
    canvas.addEventListener("pointerdown", e => { canvas.setPointerCapture(e.pointerId); held.set(e.pointerId, e); travelled = 0; spread = 0; });
    canvas.addEventListener("pointermove", e => {
      const last = held.get(e.pointerId);
      if (!last) return;
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
      this.redraw();
    });
    const release = e => {
      if (held.delete(e.pointerId) && e.type === "pointerup" && travelled < 0.008 && e.button === 0) this.onPick(this.pick(e));
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("wheel", e => { e.preventDefault(); camera.zoom(Math.exp(e.deltaY * 0.0012)); this.redraw(); }, { passive: false });
    canvas.addEventListener("keydown", e => {
      const step = 0.12, keys = {
        ArrowLeft: () => e.shiftKey ? camera.move(step, 0) : camera.turn(-step, 0), ArrowRight: () => e.shiftKey ? camera.move(-step, 0) : camera.turn(step, 0),
        ArrowUp: () => e.shiftKey ? camera.move(0, step) : camera.turn(0, step), ArrowDown: () => e.shiftKey ? camera.move(0, -step) : camera.turn(0, -step),
        "+": () => camera.zoom(0.85), "=": () => camera.zoom(0.85), "-": () => camera.zoom(1 / 0.85), t: () => camera.fromAbove(this.aspect()), r: () => camera.reset(this.aspect()),
      };
      if (!keys[e.key]) return;
      e.preventDefault();
      keys[e.key]();
      this.redraw();
    });
  }
}
