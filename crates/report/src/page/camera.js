// A camera that turns about a target, z up; one that looks straight down; and the little algebra they need
// (matrices are column-major).

export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const add = (a, b, s = 1) => [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = a => Math.hypot(a[0], a[1], a[2]);
export const unit = a => { const l = length(a) || 1; return [a[0] / l, a[1] / l, a[2] / l]; };
export const rotate = (q, v) => {
  const t = cross(q, v).map(x => 2 * x), c = cross(q, t);
  return [v[0] + q[3] * t[0] + c[0], v[1] + q[3] * t[1] + c[1], v[2] + q[3] * t[2] + c[2]];
};
// A point of a block in the local frame; the pose is qx qy qz qw x y z.
export const posed = (pose, v) => add(rotate(pose, v), pose.slice(4));

const HALF_OPENING = 0.4;

export class Camera {
  // `places`: what must be in sight, each with `reach` about it; without any, the corners of the box.
  constructor(low, high, places = [], reach = 0) {
    const corners = [...Array(8).keys()].map(i => low.map((v, k) => i >> k & 1 ? high[k] : v));
    this.home = { places: places.length ? places : corners, reach: places.length ? reach : 0, radius: Math.max(length(sub(high, low)) / 2, 1e-3) };
    this.reset(1.8);
  }
  // Each takes the picture's width over height.
  reset(aspect) { this.lookFrom(this.side ?? -2.2, 0.62, aspect); }
  fromAbove(aspect) { this.lookFrom(-Math.PI / 2, Math.PI / 2, aspect); }
  // From this side, as near as all of it fits, in the middle of the picture.
  lookFrom(azimuth, elevation, aspect) {
    Object.assign(this, { azimuth, elevation, target: [0, 0, 0], distance: 1e9 });
    const { back, right, up } = this.axes();
    // What is near takes more of the picture than what is far: the middle moves as the eye comes nearer.
    for (let i = 0; i < 4; i++) {
      for (const axis of [right, up]) this.target = add(this.target, axis, this.offCentre(axis, back));
      this.distance = this.needed(back, right, up, aspect);
      if (i === 0) this.target = add(this.target, back, this.offCentre(back, back, 1e9));
    }
    this.distance = Math.max(this.needed(back, right, up, aspect) * 1.04, this.home.radius * 0.005);
  }
  // How far along an axis the middle of what is seen lies from the target.
  offCentre(axis, back, distance = this.distance) {
    let low = Infinity, high = -Infinity;
    for (const p of this.home.places) {
      const d = sub(p, this.target), share = dot(d, axis) / Math.max(1 - dot(d, back) / distance, 0.05);
      low = Math.min(low, share);
      high = Math.max(high, share);
    }
    return (low + high) / 2;
  }
  // The distance from which every place is in sight.
  needed(back, right, up, aspect) {
    const { places, reach } = this.home, tall = Math.tan(HALF_OPENING), wide = tall * aspect;
    return places.reduce((most, p) => {
      const d = sub(p, this.target);
      return Math.max(most, dot(d, back) + Math.max((Math.abs(dot(d, right)) + reach) / wide, (Math.abs(dot(d, up)) + reach) / tall));
    }, 0);
  }
  // What a view is kept as.
  state() { return { target: this.target.slice(), azimuth: this.azimuth, elevation: this.elevation, distance: this.distance }; }
  axes() {
    const [ce, se] = [Math.cos(this.elevation), Math.sin(this.elevation)], [ca, sa] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const back = [ce * ca, ce * sa, se], right = [-sa, ca, 0];
    return { back, right, up: cross(back, right) };
  }
  eye() { return add(this.target, this.axes().back, this.distance); }
  turn(dx, dy) {
    this.azimuth -= dx;
    this.elevation = Math.min(Math.PI / 2, Math.max(-1.2, this.elevation + dy));
  }
  move(dx, dy) {
    const { right, up } = this.axes(), scale = this.distance * 0.8;
    this.target = add(add(this.target, right, -dx * scale), up, dy * scale);
  }
  zoom(factor) {
    this.distance = Math.min(this.home.radius * 20, Math.max(this.home.radius * 0.005, this.distance * factor));
  }
  // Nearest and farthest distance drawn.
  range() { return [this.distance * 0.02, this.distance + this.home.radius * 4]; }
  // Metres that one pixel spans at the target.
  metresPerPixel(height) { return 2 * Math.tan(HALF_OPENING) * this.distance / height; }
  matrix(aspect) {
    const { back, right, up } = this.axes(), eye = this.eye(), f = 1 / Math.tan(HALF_OPENING);
    const [near, far] = this.range();
    const a = (far + near) / (near - far), b = 2 * far * near / (near - far);
    return matrix([right.map(v => v * f / aspect), up.map(v => v * f), back.map(v => v * a), back.map(v => -v)], eye, [0, 0, b, 0]);
  }
  // The place under a pixel at a depth in [0, 1]; x and y in [-1, 1].
  place(x, y, depth, aspect) {
    const { back, right, up } = this.axes(), [near, far] = this.range(), f = 1 / Math.tan(HALF_OPENING);
    const away = 2 * far * near / (far + near - (2 * depth - 1) * (far - near));
    return add(add(add(this.eye(), back, -away), right, x * aspect / f * away), up, y / f * away);
  }
}

// Straight down, north up: the plan's camera.
export class PlanCamera {
  constructor(low, high) {
    this.low = low;
    this.high = high;
    this.flat = true;
    this.target = low.map((v, i) => (v + high[i]) / 2);
    this.metresPerPixel = 1;
  }
  // The whole box in a picture of w x h pixels.
  fit(w, h) {
    this.target = this.low.map((v, i) => (v + this.high[i]) / 2);
    this.metresPerPixel = Math.max((this.high[0] - this.low[0]) / Math.max(1, w - 90), (this.high[1] - this.low[1]) / Math.max(1, h - 70), 1e-4);
  }
  axes() { return { back: [0, 0, 1], right: [1, 0, 0], up: [0, 1, 0] }; }
  eye() { return [this.target[0], this.target[1], this.high[2] + 1e4]; }
  range() { return [0, this.high[2] - this.low[2] + 2]; }
  matrixOf(w, h) {
    const sx = 2 / (w * this.metresPerPixel), sy = 2 / (h * this.metresPerPixel), top = this.high[2] + 1, deep = this.range()[1];
    return matrix([[sx, 0, 0], [0, sy, 0], [0, 0, -2 / deep], [0, 0, 0]], [this.target[0], this.target[1], top], [0, 0, -1, 1]);
  }
}

function matrix(rows, eye, offset) {
  const m = new Float32Array(16);
  rows.forEach((row, r) => { row.forEach((v, c) => { m[c * 4 + r] = v; }); m[12 + r] = offset[r] - dot(row, eye); });
  return m;
}

// Where a point falls in a picture of w x h pixels; null behind the eye.
export function project(m, p, w, h) {
  const at = r => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r];
  const s = at(3);
  return s <= 0 ? null : [(at(0) / s + 1) * w / 2, (1 - at(1) / s) * h / 2];
}
