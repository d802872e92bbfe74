// What is written over the 3D view: numbers of blocks, north arrow, scale bar, measurements.

import { add } from "./camera.js";
import { number, roundUp, sharp, theme } from "./words.js";

const MOST_LABELS = 160;

// `bare`: in haste, the numbers wait.
export function drawOverlay(viewer, bare = false) {
  const { g, w, h } = sharp(viewer.overlay), colours = theme();
  g.font = "600 12px system-ui, sans-serif";
  g.lineJoin = "round";
  if (!bare) labels(viewer, g, w, h, colours);
  north(viewer, g, w, colours);
  scaleBar(viewer, g, w, h, colours);
  viewer.measure?.draw(g, colours);
}

export function haloed(g, text, x, y, ink, halo) {
  g.lineWidth = 3;
  g.strokeStyle = halo;
  g.strokeText(text, x, y);
  g.fillStyle = ink;
  g.fillText(text, x, y);
}

// The nearest blocks first, and none on top of another.
function labels(viewer, g, w, h, colours) {
  const { state, data } = viewer, camera = state.camera, eye = camera.eye(), named = [], box = state.box;
  const wanted = b => b.number === state.chosen || b.number === state.pointed || state.labels === "all" || state.labels === b.kind;
  for (const b of data.blocks) {
    if (!b || !wanted(b) || !viewer.shown(b) || (box && outside(box, b.centre))) continue;
    const away = Math.hypot(...b.centre.map((v, i) => v - eye[i])), size = data.models[b.model].radius / (camera.metresPerPixel(h) * away / camera.distance);
    const must = b.number === state.chosen || b.number === state.pointed;
    if (size < 9 && !must) continue;
    const at = viewer.onScreen(b.centre);
    if (at && at[0] > 0 && at[0] < w && at[1] > 0 && at[1] < h) named.push({ b, at, away: must ? 0 : away });
  }
  named.sort((a, b) => a.away - b.away);
  const taken = [];
  g.textAlign = "center";
  g.textBaseline = "middle";
  for (const { b, at: [x, y] } of named) {
    if (taken.length >= MOST_LABELS) break;
    if (taken.some(([u, v]) => Math.abs(u - x) < 24 && Math.abs(v - y) < 14)) continue;
    taken.push([x, y]);
    haloed(g, b.kind === "added" ? String(b.order) : `R${b.id}`, x, y, b.number === state.chosen ? colours.chosen : colours.ink, colours.halo);
  }
}

export function outside(box, p) {
  const dx = p[0] - box.middle[0], dy = p[1] - box.middle[1], [c, s] = box.direction;
  return Math.abs(dx * c + dy * s) > box.half[0] || Math.abs(-dx * s + dy * c) > box.half[1] || p[2] < box.from || p[2] > box.to;
}

// Drawn as it lies: an arrow on the ground, seen from here.
function north(viewer, g, w, colours) {
  const { right, up } = viewer.state.camera.axes(), flat = v => [v[0] * right[0] + v[1] * right[1] + v[2] * right[2], -(v[0] * up[0] + v[1] * up[1] + v[2] * up[2])];
  const at = (east, north) => { const [x, y] = flat([east, north, 0]); return [w - 46 + x * 28, 48 + y * 28]; };
  const tip = at(0, 1), foot = at(0, -0.8), left = at(-0.45, -0.8), side = at(0.45, -0.8), inner = at(0, -0.45);
  const wing = (corner, fill) => {
    g.beginPath();
    [tip, corner, inner].forEach(([x, y], i) => i ? g.lineTo(x, y) : g.moveTo(x, y));
    g.closePath();
    g.fillStyle = fill;
    g.fill();
    g.strokeStyle = colours.ink;
    g.lineWidth = 1;
    g.stroke();
  };
  wing(left, colours.ink);
  wing(side, colours.paper);
  const [x, y] = add([...tip, 0], [...tip.map((v, i) => v - foot[i]), 0], 0.2);
  g.textAlign = "center";
  g.textBaseline = "middle";
  haloed(g, "N", x, y, colours.ink, colours.halo);
}

// True at the depth of what the view turns about.
function scaleBar(viewer, g, w, h, colours) {
  const metres = roundUp(viewer.state.camera.metresPerPixel(h) * 90), long = metres / viewer.state.camera.metresPerPixel(h);
  bar(g, w - 20 - long, h - 16, long, metres, colours);
}

export function bar(g, x, y, long, metres, colours) {
  g.lineWidth = 5;
  g.strokeStyle = colours.halo;
  g.beginPath(); g.moveTo(x, y - 5); g.lineTo(x, y); g.lineTo(x + long, y); g.lineTo(x + long, y - 5); g.stroke();
  g.lineWidth = 2;
  g.strokeStyle = colours.ink;
  g.stroke();
  g.textAlign = "center";
  g.textBaseline = "alphabetic";
  haloed(g, metres >= 1 ? `${number(metres)} m` : `${number(metres * 100)} cm`, x + long / 2, y - 6, colours.ink, colours.halo);
}
