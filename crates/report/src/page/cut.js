// Cutting: a line with its chainage, meshes by a vertical plane, surfaces along a line, areas between them.

import { rotate } from "./camera.js";
import { heightAt } from "./data.js";

// A polyline in plan, local metres.
export class Line {
  constructor(points) {
    this.points = points;
    this.ends = [0];
    for (let i = 1; i < points.length; i++) this.ends.push(this.ends[i - 1] + Math.hypot(points[i][0] - points[i - 1][0], points[i][1] - points[i - 1][1]));
    this.length = this.ends[this.ends.length - 1];
  }
  // Where a chainage lies, and the direction there.
  place(chainage) {
    let i = 1;
    while (i < this.points.length - 1 && this.ends[i] < chainage) i++;
    const [a, b] = [this.points[i - 1], this.points[i]], long = this.ends[i] - this.ends[i - 1] || 1, f = (chainage - this.ends[i - 1]) / long;
    return { at: [a[0] + (b[0] - a[0]) * f, a[1] + (b[1] - a[1]) * f], along: [(b[0] - a[0]) / long, (b[1] - a[1]) / long] };
  }
}

// Heights of a grid along a cut, one value each cell: [[offset, height]].
export function profile(grid, cut) {
  const n = Math.max(1, Math.ceil(cut.length / grid.cell));
  return Array.from({ length: n + 1 }, (_, i) => {
    const d = cut.length * i / n;
    return [cut.start + d, heightAt(grid, cut.from[0] + cut.along[0] * d, cut.from[1] + cut.along[1] * d)];
  });
}

// Areas between two profiles of one cut, m²: where the upper lies above the lower, and the other way round.
export function between(upper, lower) {
  let above = 0, below = 0;
  for (let i = 1; i < Math.min(upper.length, lower.length); i++) {
    const wide = upper[i][0] - upper[i - 1][0], a = upper[i - 1][1] - lower[i - 1][1], b = upper[i][1] - lower[i][1];
    if (Number.isNaN(a) || Number.isNaN(b)) continue;
    if (a >= 0 && b >= 0) above += (a + b) / 2 * wide;
    else if (a <= 0 && b <= 0) below -= (a + b) / 2 * wide;
    else { const share = a / (a - b); for (const [v, w] of [[a, share], [b, 1 - share]]) if (v > 0) above += v / 2 * w * wide; else below -= v / 2 * w * wide; }
  }
  return { above, below };
}

// The outline of a block in a vertical plane: closed rings of [offset, height]; empty where the plane passes by.
export function blockOutline(block, model, cut) {
  const normal = [-cut.along[1], cut.along[0]], flat = p => [(p[0] - cut.from[0]) * cut.along[0] + (p[1] - cut.from[1]) * cut.along[1] + cut.start, p[2]];
  const c = block.centre, away = (c[0] - cut.from[0]) * normal[0] + (c[1] - cut.from[1]) * normal[1], along = flat(c)[0];
  if (Math.abs(away) > model.radius || along < cut.start - model.radius || along > cut.start + cut.length + model.radius) return [];
  const { vertices: v, triangles: t } = model, n = v.length / 3, place = new Array(n), side = new Float64Array(n);
  for (let i = 0; i < n; i++) {
    const p = rotate(block.pose, [v[i * 3], v[i * 3 + 1], v[i * 3 + 2]]);
    place[i] = [p[0] + block.pose[4], p[1] + block.pose[5], p[2] + block.pose[6]];
    // A corner exactly in the plane would be on both sides.
    side[i] = (place[i][0] - cut.from[0]) * normal[0] + (place[i][1] - cut.from[1]) * normal[1] || 1e-12;
  }
  // Each cut edge of the mesh is one corner of the outline; a triangle joins two of them.
  const next = new Map(), corners = new Map();
  const corner = (a, b) => {
    const key = a < b ? a * n + b : b * n + a;
    if (!corners.has(key)) { const f = side[a] / (side[a] - side[b]); corners.set(key, flat(place[a].map((p, k) => p + (place[b][k] - p) * f))); }
    return key;
  };
  for (let i = 0; i < t.length; i += 3) {
    const corner3 = [t[i], t[i + 1], t[i + 2]];
    let from = -1, to = -1;
    for (let k = 0; k < 3; k++) {
      const a = corner3[k], b = corner3[(k + 1) % 3];
      if (side[a] > 0 && side[b] < 0) from = corner(a, b);
      else if (side[a] < 0 && side[b] > 0) to = corner(a, b);
    }
    if (from >= 0 && to >= 0) next.set(from, to);
  }
  const rings = [];
  while (next.size) {
    const ring = [];
    let [key] = next.keys();
    while (next.has(key)) { ring.push(corners.get(key)); const after = next.get(key); next.delete(key); key = after; }
    rings.push(ring);
  }
  return rings;
}
