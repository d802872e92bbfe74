// A camera that turns about a target, z up; and the little matrix algebra it needs (column-major).

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const add = (a, b, s = 1) => [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = a => Math.hypot(a[0], a[1], a[2]);
const unit = a => { const l = length(a) || 1; return [a[0] / l, a[1] / l, a[2] / l]; };
const rotate = (q, v) => {
  const t = cross(q, v).map(x => 2 * x), c = cross(q, t);
  return [v[0] + q[3] * t[0] + c[0], v[1] + q[3] * t[1] + c[1], v[2] + q[3] * t[2] + c[2]];
};

class Camera {
  constructor(low, high) {
    this.home = { target: low.map((v, i) => (v + high[i]) / 2), half: low.map((v, i) => (high[i] - v) / 2), radius: Math.max(length(sub(high, low)) / 2, 1e-3) };
    this.reset(1.8);
  }
  // Both take the picture's width over height.
  reset(aspect) { this.lookFrom(-2.2, 0.62, aspect); }
  fromAbove(aspect) { this.lookFrom(-Math.PI / 2, Math.PI / 2, aspect); }
  // From this side, as near as the whole box fits.
  lookFrom(azimuth, elevation, aspect) {
    Object.assign(this, { target: this.home.target.slice(), azimuth, elevation });
    const { back, right, up } = this.axes(), tall = Math.tan(0.4), wide = tall * aspect;
    const needed = [...Array(8).keys()].map(i => {
      const corner = this.home.half.map((h, k) => i >> k & 1 ? h : -h);
      return dot(corner, back) + Math.max(Math.abs(dot(corner, right)) / wide, Math.abs(dot(corner, up)) / tall);
    });
    this.distance = Math.max(...needed) * 1.06;
  }
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
    this.distance = Math.min(this.home.radius * 20, Math.max(this.home.radius * 0.01, this.distance * factor));
  }
  // Nearest and farthest distance drawn.
  range() { return [this.distance * 0.02, this.distance + this.home.radius * 4]; }
  // View-projection matrix for a picture of the given width over height.
  matrix(aspect) {
    const { back, right, up } = this.axes(), eye = this.eye(), f = 1 / Math.tan(0.4);
    const [near, far] = this.range();
    const a = (far + near) / (near - far), b = 2 * far * near / (near - far);
    const rows = [right.map(v => v * f / aspect), up.map(v => v * f), back.map(v => v * a), back.map(v => -v)];
    const offsets = [-dot(rows[0], eye), -dot(rows[1], eye), -dot(rows[2], eye) + b, -dot(rows[3], eye)];
    const m = new Float32Array(16);
    rows.forEach((row, r) => { row.forEach((v, c) => { m[c * 4 + r] = v; }); m[12 + r] = offsets[r]; });
    return m;
  }
}

// Where a point falls in a picture of w x h pixels; null behind the eye.
function project(m, p, w, h) {
  const at = r => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r];
  const s = at(3);
  return s <= 0 ? null : [(at(0) / s + 1) * w / 2, (1 - at(1) / s) * h / 2];
}
