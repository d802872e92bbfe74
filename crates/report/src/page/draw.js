// WebGL2: points, instanced blocks, lines, the design surface; and a second pass that writes what is where, for clicks.
// While the view moves, points are thinned and blocks drawn with few triangles, as far as the machine needs it.

import { add, unit } from "./camera.js";
import { DIVERGING, ERROR, RAMP } from "./colours.js";
import { PROGRAMS } from "./shaders.js";
import { SHADE, Shade } from "./shade.js";

const shares = list => list.flat().map(v => v / 255);
const RECORD = 12; // bytes of a point; a stride may be 255 at most
// What a picture of each haste may hold: 0 everything, then less and less.
const HASTE = [{ points: Infinity, triangles: Infinity }, { points: 350_000, triangles: 600_000 }, { points: 120_000, triangles: 250_000 }, { points: 25_000, triangles: 50_000 }, { points: 6_000, triangles: 50_000 }];
export const MOST_HASTE = HASTE.length - 1;
// From this haste on at half the size, unshaded, without the design and without numbers.
export const ROUGH = 3;
// A picture that is put together in pieces draws so much at a time.
const PIECE = { points: 150_000, triangles: 150_000 };

export class Painter {
  constructor(canvas, data) {
    const gl = this.gl = canvas.getContext("webgl2", { antialias: false, alpha: true, premultipliedAlpha: true });
    if (!gl) throw new Error("WebGL 2 is not available");
    this.data = data;
    this.programs = Object.fromEntries(Object.entries(PROGRAMS).map(([kind, p]) => [kind, this.program(p)]));
    const shade = this.program(SHADE);
    this.shade = new Shade(gl, shade);
    this.aside = new Shade(gl, shade, true);
    this.small = new Shade(gl, shade);
    this.pointBuffer = this.buffer(gl.ARRAY_BUFFER, data.record);
    this.points = new Map();
    this.meshes = data.models.map(m => [m, m.coarse, m.tiny].map(mesh => ({ vertices: this.buffer(gl.ARRAY_BUFFER, mesh.vertices), triangles: this.buffer(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles), count: mesh.triangles.length })));
    this.batches = [];
    this.lines = data.outlines.map(l => this.lineArray(l));
    if (data.surfaces.design) this.design = this.surfaceArray(data.surfaces.design);
    gl.enable(gl.DEPTH_TEST);
  }
  program({ vertex, fragment }) {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const at = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
      const name = gl.getActiveUniform(program, i).name;
      at[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
    }
    return { program, at };
  }
  buffer(target, values, usage) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindVertexArray(null);
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, values, usage || gl.STATIC_DRAW);
    return buffer;
  }
  // Every n-th point; they are sorted along a curve that fills space, so that this thins evenly.
  pointArray(every) {
    if (this.points.has(every)) return this.points.get(every);
    const far = every * RECORD > 255, buffer = far ? this.buffer(this.gl.ARRAY_BUFFER, this.thinned(every)) : this.pointBuffer;
    const gl = this.gl, array = gl.createVertexArray(), stride = far ? RECORD : RECORD * every;
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.UNSIGNED_SHORT, true, stride, 0);
    gl.enableVertexAttribArray(1); gl.vertexAttribIPointer(1, 1, gl.UNSIGNED_SHORT, stride, 6);
    gl.enableVertexAttribArray(2); gl.vertexAttribPointer(2, 1, gl.UNSIGNED_SHORT, true, stride, 8);
    gl.enableVertexAttribArray(3); gl.vertexAttribPointer(3, 1, gl.UNSIGNED_SHORT, true, stride, 10);
    const made = { array, count: Math.floor(this.data.points.shown / every) };
    this.points.set(every, made);
    return made;
  }
  thinned(every) {
    const { record, points } = this.data, n = Math.floor(points.shown / every), few = new Uint16Array(n * 6);
    for (let i = 0; i < n; i++) few.set(record.subarray(i * every * 6, i * every * 6 + 6), i * 6);
    return few;
  }
  lineArray(line) {
    const gl = this.gl, array = gl.createVertexArray(), corners = this.buffer(gl.ARRAY_BUFFER, new Float32Array(line.points.flat()));
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, corners);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    return { array, count: line.points.length, closed: line.closed };
  }
  // A height field as triangles, at most some hundred thousand of them.
  surfaceArray(grid) {
    const every = Math.max(1, Math.ceil(Math.sqrt(grid.nx * grid.ny / 60_000))), nx = Math.floor((grid.nx - 1) / every) + 1, ny = Math.floor((grid.ny - 1) / every) + 1;
    const corners = new Float32Array(nx * ny * 3), indices = [];
    const z = (i, j) => grid.z[Math.min(j * every, grid.ny - 1) * grid.nx + Math.min(i * every, grid.nx - 1)];
    for (let j = 0; j < ny; j++) for (let i = 0; i < nx; i++) {
      corners.set([grid.origin[0] + i * every * grid.cell, grid.origin[1] + j * every * grid.cell, z(i, j)], (j * nx + i) * 3);
      if (i && j && ![z(i, j), z(i - 1, j), z(i, j - 1), z(i - 1, j - 1)].some(Number.isNaN)) {
        const a = (j - 1) * nx + i - 1, b = a + 1, c = a + nx, d = c + 1;
        indices.push(a, b, d, a, d, c);
      }
    }
    const gl = this.gl, vertices = this.buffer(gl.ARRAY_BUFFER, corners.map(v => Number.isNaN(v) ? 0 : v)), triangles = this.buffer(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(indices)), array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, vertices);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, triangles);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    return { array, count: indices.length };
  }
  // Blocks to draw: [{model, pose, colour, number, opacity}]. One batch a model and opacity.
  setBlocks(list) {
    const gl = this.gl, groups = new Map();
    for (const b of list) {
      const key = `${b.model} ${b.opacity}`;
      if (!groups.has(key)) groups.set(key, { model: b.model, opacity: b.opacity, blocks: [] });
      groups.get(key).blocks.push(b);
    }
    for (const batch of this.batches) {
      gl.deleteBuffer(batch.records);
      batch.arrays.forEach(a => gl.deleteVertexArray(a));
    }
    // Solid ones first: what shines through needs something behind it.
    this.batches = [...groups.values()].sort((a, b) => b.opacity - a.opacity).map(({ model, opacity, blocks }) => {
      const values = new Float32Array(blocks.length * 12), whole = new Uint32Array(values.buffer);
      blocks.forEach((b, i) => { values.set(b.pose, i * 12); values.set(b.colour, i * 12 + 7); whole[i * 12 + 11] = b.number; });
      const records = this.buffer(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW), arrays = [...this.meshes[model].map(mesh => this.blockArray(mesh, records)), this.ballArray(records)];
      return { model, opacity, records, arrays, count: blocks.length };
    });
  }
  ballArray(records) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, records);
    for (const [slot, n, offset] of [[1, 4, 0], [2, 3, 16], [3, 4, 28]]) { gl.enableVertexAttribArray(slot); gl.vertexAttribPointer(slot, n, gl.FLOAT, false, 48, offset); }
    gl.enableVertexAttribArray(4); gl.vertexAttribIPointer(4, 1, gl.UNSIGNED_INT, 48, 44);
    return array;
  }
  blockArray(mesh, records) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.vertices);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles);
    // One record an instance: turn 4, shift 3, colour 4 (floats), number (whole).
    gl.bindBuffer(gl.ARRAY_BUFFER, records);
    for (const [slot, n, offset] of [[1, 4, 0], [2, 3, 16], [3, 4, 28]]) {
      gl.enableVertexAttribArray(slot); gl.vertexAttribPointer(slot, n, gl.FLOAT, false, 48, offset); gl.vertexAttribDivisor(slot, 1);
    }
    gl.enableVertexAttribArray(4); gl.vertexAttribIPointer(4, 1, gl.UNSIGNED_INT, 48, 44); gl.vertexAttribDivisor(4, 1);
    return array;
  }
  // Draws the view; `quick` while it moves. Returns the matrix. In great haste at half the size, unshaded.
  draw(state, { picking = false, quick = 0 } = {}) {
    const gl = this.gl, w = gl.drawingBufferWidth, h = gl.drawingBufferHeight, matrix = state.camera.matrix(w / h);
    if (picking) this.bindPicture(w, h);
    else if (quick >= ROUGH) {
      const [sw, sh] = [w, h].map(v => Math.max(1, v >> 1));
      this.small.begin(sw, sh, true);
      this.scene(state, matrix, sw, sh, false, quick, sh / h);
      this.small.show(w, h);
      return matrix;
    } else this.shade.begin(w, h);
    this.scene(state, matrix, w, h, picking, quick);
    if (!picking) this.shade.end(...state.camera.range(), 190);
    return matrix;
  }
  // The view in pieces that take little time each, so that whoever turns it meanwhile does not wait; shown after the last.
  // Yields between two pieces, all of this one drawn; returns the matrix.
  *inPieces(state, quick) {
    const gl = this.gl, w = gl.drawingBufferWidth, h = gl.drawingBufferHeight, matrix = state.camera.matrix(w / h);
    this.shade.begin(w, h);
    for (const piece of this.parts(state, matrix, w, h, false, quick, 1, PIECE)) {
      this.shade.wait();
      yield piece;
      this.shade.bind();
      gl.viewport(0, 0, w, h);
    }
    this.shade.end(...state.camera.range(), 190);
    return matrix;
  }
  // Whether the whole of it is too much for one go.
  heavy(state) {
    return state.showPoints && this.data.points.shown > 2 * PIECE.points || this.triangles(0) > 2 * PIECE.triangles;
  }
  triangles(mesh) { return this.batches.reduce((n, b) => n + b.count * this.meshes[b.model][mesh].count / 3, 0); }
  // The plan as an ImageData-sized array, bottom row first.
  plan(state, camera, w, h, ratio, quick) {
    const gl = this.gl;
    this.aside.begin(w, h);
    this.scene({ ...state, camera, showDesign: false, box: null }, camera.matrixOf(w / ratio, h / ratio), w, h, false, quick);
    this.aside.end(...camera.range(), 45, true);
    const pixels = new Uint8ClampedArray(w * h * 4);
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return pixels;
  }
  scene(...all) { for (const piece of this.parts(...all)) void piece; }
  // `scale`: pixels of the picture for one of the screen. `most`: points and triangles of a piece.
  *parts(state, matrix, w, h, picking, quick, scale = 1, most = { points: Infinity, triangles: Infinity }) {
    const gl = this.gl, { back, right, up } = state.camera.axes(), eye = state.camera.eye();
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    // Light over the viewer's left shoulder.
    const sun = unit(add(add(add([0, 0, 0.6], back, 0.45), right, -0.6), up, 0.35));
    const box = state.box || { middle: [0, 0], direction: [1, 0], half: [1e9, 1e9], from: -1e9, to: 1e9 };
    const use = kind => {
      const { program, at } = this.programs[kind];
      gl.useProgram(program);
      gl.uniformMatrix4fv(at.camera, false, matrix);
      gl.uniform4f(at.boxPlace, ...box.middle, ...box.direction);
      gl.uniform4f(at.boxSize, ...box.half, box.from, box.to);
      if (at.picking) gl.uniform1i(at.picking, picking ? 1 : 0);
      if (at.eye) gl.uniform3fv(at.eye, eye);
      if (at.sun) gl.uniform3fv(at.sun, sun);
      return at;
    };
    yield* this.drawBlocks(use, state, picking, quick, h, most.triangles);
    if (state.showPoints) yield* this.drawPoints(use, state, quick, scale, most.points);
    if (state.showLines) {
      use("line");
      for (const line of this.lines) {
        gl.bindVertexArray(line.array);
        gl.drawArrays(line.closed ? gl.LINE_LOOP : gl.LINE_STRIP, 0, line.count);
      }
    }
    if (state.showDesign && this.design && !picking && quick < ROUGH) this.drawDesign(use("surface"), state);
  }
  *drawBlocks(use, state, picking, quick, h, most) {
    const gl = this.gl, few = [0, 1, 2].find(mesh => this.triangles(mesh) <= HASTE[quick].triangles) ?? 3;
    if (few === 3 && !picking && !state.camera.flat) return this.drawBalls(use("ball"), state, h);
    const mesh = Math.min(few, 2);
    for (const batch of this.batches) {
      if (picking && batch.opacity < 0.5) continue;
      const corners = this.meshes[batch.model][mesh].count, step = Math.max(1, Math.min(batch.count, Math.floor(most / corners * 3)));
      for (let first = 0; first < batch.count; first += step) {
        const at = use("block");
        gl.uniform1ui(at.chosen, state.chosen);
        gl.uniform1ui(at.pointed, state.pointed);
        if (!picking) gl.enable(gl.SAMPLE_COVERAGE);
        gl.sampleCoverage(batch.opacity, false);
        gl.bindVertexArray(batch.arrays[mesh]);
        if (step < batch.count) this.startAt(batch.records, first);
        gl.drawElementsInstanced(gl.TRIANGLES, corners, gl.UNSIGNED_INT, 0, Math.min(step, batch.count - first));
        if (step < batch.count) this.startAt(batch.records, 0);
        gl.disable(gl.SAMPLE_COVERAGE);
        if (step < batch.count) yield "blocks";
      }
    }
  }
  // The bound array's instances begin with this record.
  startAt(records, first) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, records);
    for (const [slot, n, offset] of [[1, 4, 0], [2, 3, 16], [3, 4, 28]]) gl.vertexAttribPointer(slot, n, gl.FLOAT, false, 48, first * 48 + offset);
    gl.vertexAttribIPointer(4, 1, gl.UNSIGNED_INT, 48, first * 48 + 44);
  }
  drawBalls(at, state, h) {
    const gl = this.gl;
    gl.uniform1ui(at.chosen, state.chosen);
    gl.uniform1f(at.pixelsPerMetre, h / state.camera.metresPerPixel(1) * state.camera.distance);
    for (const batch of this.batches.filter(b => b.opacity > 0.3)) {
      const model = this.data.models[batch.model];
      gl.uniform3fv(at.centre, model.centre);
      gl.uniform1f(at.radius, model.radius);
      gl.bindVertexArray(batch.arrays[3]);
      gl.drawArrays(gl.POINTS, 0, batch.count);
    }
  }
  *drawPoints(use, state, quick, scale, most) {
    const gl = this.gl, p = this.data.points, every = Math.max(1, Math.ceil(p.shown / HASTE[quick].points)), { array, count } = this.pointArray(every);
    for (let first = 0; first < count; first += most) {
      const at = use("point");
      gl.uniform3fv(at.low, p.min); gl.uniform3fv(at.size, p.size);
      gl.uniform1f(at.pixels, (state.camera.flat ? 1 : state.pointSize) * (window.devicePixelRatio || 1) * scale * (every > 4 ? 1.5 : 1));
      gl.uniform1i(at.mode, state.pointMode);
      gl.uniform2f(at.heights, ...this.data.heights); gl.uniform1f(at.eyeDistance, state.camera.distance || 1);
      gl.uniform1f(at.push, state.pointPush); gl.uniform1ui(at.only, state.onlyPoints || 0); gl.uniform1i(at.bare, state.barePoints ? 1 : 0);
      gl.uniform3fv(at.ramp, shares(RAMP)); gl.uniform3fv(at.diverging, shares(DIVERGING)); gl.uniform3fv(at.error, shares(ERROR));
      gl.bindVertexArray(array);
      gl.drawArrays(gl.POINTS, first, Math.min(most, count - first));
      if (most < count) yield "points";
    }
  }
  drawDesign(at, state) {
    const gl = this.gl;
    gl.uniform4f(at.tint, 0.86, 0.36, 0.42, state.designOpacity);
    gl.uniform1f(at.step, 1);
    gl.uniform1f(at.base, this.data.origin[2] % 1);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.bindVertexArray(this.design.array);
    gl.drawElements(gl.TRIANGLES, this.design.count, gl.UNSIGNED_INT, 0);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }
  // Waits until all is drawn; `finish` returns early in some browsers, reading does not.
  flush() { this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, new Uint8Array(4)); }
  bindPicture(w, h) {
    const gl = this.gl;
    if (!this.picture || this.picture.w !== w || this.picture.h !== h) {
      if (this.picture) { gl.deleteFramebuffer(this.picture.frame); this.picture.textures.forEach(t => gl.deleteTexture(t)); gl.deleteRenderbuffer(this.picture.depth); }
      const frame = gl.createFramebuffer(), depth = gl.createRenderbuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      const textures = [gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1].map(slot => {
        const texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, w, h);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, slot, gl.TEXTURE_2D, texture, 0);
        return texture;
      });
      gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, w, h);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
      gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
      this.picture = { frame, textures, depth, w, h };
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picture.frame);
    this.pictureIsOf = null;
  }
  // What lies under a pixel (from the top left): block number (0 none) and place, or null.
  // The picture is drawn once for a view and read as long as the view stays (`version`).
  pick(state, x, y, version, quick = 0) {
    const gl = this.gl, pixel = new Uint8Array(4);
    const stays = this.pictureIsOf === version && this.picture && this.picture.w === gl.drawingBufferWidth && this.picture.h === gl.drawingBufferHeight;
    if (stays) gl.bindFramebuffer(gl.FRAMEBUFFER, this.picture.frame);
    else { this.draw(state, { picking: true, quick }); this.pictureIsOf = version; }
    const read = (slot, dx, dy) => {
      gl.readBuffer(slot);
      gl.readPixels(x + dx, gl.drawingBufferHeight - 1 - y + dy, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      return pixel;
    };
    let found = null;
    // Points are small: the nearest hit around the pixel counts.
    for (const [dx, dy] of [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [2, 2], [-2, 2], [2, -2], [-2, -2], [4, 0], [-4, 0], [0, 4], [0, -4]]) {
      const d = read(gl.COLOR_ATTACHMENT1, dx, dy), depth = d[0] / 255 + d[1] / 65025 + d[2] / 16581375;
      if (depth === 0) continue;
      const id = read(gl.COLOR_ATTACHMENT0, dx, dy);
      found = { number: id[3] ? id[0] | id[1] << 8 | id[2] << 16 : 0, depth };
      break;
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    if (!found) return null;
    const w = gl.drawingBufferWidth, h = gl.drawingBufferHeight;
    found.place = state.camera.place(2 * (x + 0.5) / w - 1, 1 - 2 * (y + 0.5) / h, found.depth, w / h);
    return found;
  }
}


