// From the page's text to typed arrays: base64 -> gzip -> columns; and meshes with few triangles for quick pictures.

import { posed } from "./camera.js";

export async function loadData(json, packed) {
  const info = JSON.parse(json), bytes = await unpack(packed);
  const f32 = ([start, n]) => new Float32Array(bytes, start, n);
  const u32 = ([start, n]) => new Uint32Array(bytes, start, n);
  // Zigzag differences; low bytes first, then high bytes.
  const undelta = ([start, n], out, stride, offset) => {
    const low = new Uint8Array(bytes, start, n), high = new Uint8Array(bytes, start + n, n);
    let value = 0;
    for (let i = 0; i < n; i++) {
      const z = low[i] | high[i] << 8;
      value = value + ((z >>> 1) ^ -(z & 1)) & 0xffff;
      out[i * stride + offset] = value;
    }
  };

  // One record a point: x y z, instance, distance to the design, distance to its block's surface.
  const p = info.points, record = new Uint16Array(p.shown * 6);
  p.xyz.forEach((span, axis) => undelta(span, record, 6, axis));
  undelta(p.instance, record, 6, 3);
  if (p.distance) undelta(p.distance, record, 6, 4);
  if (p.fit) undelta(p.fit, record, 6, 5);

  const models = info.models.map(m => {
    const vertices = f32(m.vertices), triangles = u32(m.triangles);
    return { ...m, vertices, triangles, coarse: coarse(vertices, triangles, 7), tiny: coarse(vertices, triangles, 3) };
  });
  const grid = g => {
    const raw = new Uint16Array(g.nx * g.ny), z = new Float32Array(raw.length);
    undelta(g.z, raw, 1, 0);
    for (let i = 0; i < raw.length; i++) z[i] = raw[i] ? g.low + (raw[i] - 1) * g.step : NaN;
    return { ...g, z };
  };
  const surfaces = Object.fromEntries(Object.entries(info.surfaces).map(([name, g]) => [name, grid(g)]));
  const maps = info.maps.map(m => ({ ...m, grid: grid(m.grid) }));
  const data = { ...info, record, models, surfaces, maps };
  for (const b of [...data.found, ...data.added, ...data.removed]) b.centre = posed(b.pose, models[b.model].centre);
  data.found.forEach((b, i) => { b.kind = "found"; b.number = i + 1; });
  data.added.forEach((b, i) => { b.kind = "added"; b.number = data.found.length + i + 1; });
  // Places that no type fits stand in the table only.
  const none = { judged: false, typeJudged: false, model: null, confidence: null, fitness_m: null, occlusion: null, legs: null, second: null };
  data.places = data.places.map(p => ({ ...none, ...p, kind: "place", number: 0 }));
  data.blocks = [null, ...data.found, ...data.added];
  return data;
}

async function unpack(text) {
  const packed = Uint8Array.fromBase64 ? Uint8Array.fromBase64(text.trim()) : bytesOf(atob(text.trim()));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

function bytesOf(text) {
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

// The mesh with its vertices gathered on a grid of so many cells an edge: few triangles, the same outline.
function coarse(vertices, triangles, cells) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < vertices.length; i++) { low[i % 3] = Math.min(low[i % 3], vertices[i]); high[i % 3] = Math.max(high[i % 3], vertices[i]); }
  const cell = Math.max(high[0] - low[0], high[1] - low[1], high[2] - low[2], 1e-9) / cells, sums = new Map(), of = new Uint32Array(vertices.length / 3);
  for (let v = 0; v < of.length; v++) {
    const key = [0, 1, 2].map(k => Math.round((vertices[v * 3 + k] - low[k]) / cell)).join();
    if (!sums.has(key)) sums.set(key, { index: sums.size, n: 0, sum: [0, 0, 0] });
    const group = sums.get(key);
    group.n++;
    for (let k = 0; k < 3; k++) group.sum[k] += vertices[v * 3 + k];
    of[v] = group.index;
  }
  const few = new Float32Array([...sums.values()].flatMap(g => g.sum.map(s => s / g.n))), kept = [], seen = new Set();
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [of[triangles[t]], of[triangles[t + 1]], of[triangles[t + 2]]];
    if (a === b || b === c || a === c) continue;
    const turn = a < b && a < c ? [a, b, c] : b < c ? [b, c, a] : [c, a, b], key = turn.join();
    if (!seen.has(key)) { seen.add(key); kept.push(...turn); }
  }
  return { vertices: few, triangles: new Uint32Array(kept) };
}

// Height of a grid at a place, bilinear; NaN outside it or next to a gap.
export function heightAt(grid, x, y) {
  const u = (x - grid.origin[0]) / grid.cell, v = (y - grid.origin[1]) / grid.cell;
  if (u < -0.5 || v < -0.5 || u > grid.nx - 0.5 || v > grid.ny - 0.5) return NaN;
  const i = Math.min(Math.max(Math.floor(u), 0), Math.max(grid.nx - 2, 0)), j = Math.min(Math.max(Math.floor(v), 0), Math.max(grid.ny - 2, 0));
  const i1 = Math.min(i + 1, grid.nx - 1), j1 = Math.min(j + 1, grid.ny - 1), fx = Math.min(Math.max(u - i, 0), 1), fy = Math.min(Math.max(v - j, 0), 1);
  const z = grid.z, row = (at, f) => z[at * grid.nx + i] * (1 - f) + z[at * grid.nx + i1] * f;
  return row(j, fx) * (1 - fy) + row(j1, fx) * fy;
}
