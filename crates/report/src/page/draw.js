// WebGL2: points, instanced blocks, lines; and a second pass that writes what is where, for clicks.

const SHADERS = {
  common: `#version 300 es
    precision highp float; precision highp int;
    uniform mat4 camera; uniform vec4 cut;
    bool cutAway(vec3 p) { return dot(p, cut.xyz) > cut.w; }`,
  pointVertex: `
    layout(location=0) in vec3 grid; layout(location=1) in uint instance; layout(location=2) in float distance;
    uniform vec3 low, size; uniform float pixels; uniform int mode; uniform vec2 heights; uniform float eyeDistance;
    uniform vec3 ramp[6]; uniform vec3 diverging[5];
    out vec3 colour; out vec3 place; flat out uint block;
    vec3 along(vec3 a, vec3 b, float f) { return a + (b - a) * f; }
    void main() {
      place = low + grid * size; block = instance;
      gl_Position = camera * vec4(place, 1.0);
      gl_PointSize = max(1.0, pixels * clamp(eyeDistance / gl_Position.w, 0.5, 2.5));
      if (mode == 0) {
        float v = clamp((place.z - heights.x) / (heights.y - heights.x), 0.0, 1.0) * 5.0; int i = min(int(v), 4);
        colour = along(ramp[i], ramp[i + 1], v - float(i));
      } else if (mode == 1) {
        if (instance == 0u) colour = vec3(0.62);
        else { uint h = instance * 2654435761u; h ^= h >> 15; vec3 c = vec3(h & 255u, (h >> 8) & 255u, (h >> 16) & 255u) / 255.0; colour = 0.2 + 0.7 * c; }
      } else if (mode == 2) {
        if (distance == 0.0) colour = vec3(0.7);
        else { float v = clamp(distance, 0.0, 1.0) * 4.0; int i = min(int(v), 3); colour = along(diverging[i], diverging[i + 1], v - float(i)); }
      } else colour = vec3(0.36, 0.42, 0.48);
    }`,
  pointFragment: `
    in vec3 colour; in vec3 place; flat in uint block; uniform bool picking;
    layout(location=0) out vec4 what; layout(location=1) out vec4 depth;
    PACK
    void main() {
      if (cutAway(place)) discard;
      what = picking ? number(block) : vec4(colour, 1.0); depth = pack(gl_FragCoord.z);
    }`,
  blockVertex: `
    layout(location=0) in vec3 corner; layout(location=1) in vec4 turn; layout(location=2) in vec3 shift; layout(location=3) in vec4 look; layout(location=4) in uint id;
    out vec3 place; flat out vec4 paint; flat out uint block;
    void main() {
      vec3 t = 2.0 * cross(turn.xyz, corner);
      place = corner + turn.w * t + cross(turn.xyz, t) + shift;
      paint = look; block = id;
      gl_Position = camera * vec4(place, 1.0);
    }`,
  blockFragment: `
    in vec3 place; flat in vec4 paint; flat in uint block; uniform bool picking; uniform vec3 eye, sun; uniform uint chosen;
    layout(location=0) out vec4 what; layout(location=1) out vec4 depth;
    PACK
    void main() {
      if (cutAway(place)) discard;
      depth = pack(gl_FragCoord.z);
      if (picking) { what = number(block); return; }
      vec3 n = normalize(cross(dFdx(place), dFdy(place)));
      vec3 toEye = normalize(eye - place);
      if (dot(n, toEye) < 0.0) n = -n;
      float light = 0.32 + 0.22 * (0.5 + 0.5 * n.z) + 0.52 * max(dot(n, sun), 0.0);
      vec3 base = block == chosen ? vec3(1.0, 0.80, 0.10) : paint.rgb;
      what = vec4(base * light, 1.0);
      if (!gl_FrontFacing) what = vec4(base * 0.45, 1.0);
    }`,
  lineVertex: `
    layout(location=0) in vec3 corner; out vec3 place;
    void main() { place = corner; gl_Position = camera * vec4(corner, 1.0); }`,
  lineFragment: `
    in vec3 place; layout(location=0) out vec4 what; layout(location=1) out vec4 depth; uniform bool picking;
    void main() { if (picking || cutAway(place)) discard; what = vec4(0.69, 0.0, 0.13, 1.0); depth = vec4(1.0); }`,
};
const PACK = `vec4 number(uint n) { return vec4(n & 255u, (n >> 8) & 255u, (n >> 16) & 255u, n == 0u ? 0u : 255u) / 255.0; }
  vec4 pack(float d) { vec4 e = fract(d * vec4(1.0, 255.0, 65025.0, 16581375.0)); return e - e.yzww * vec4(1.0 / 255.0, 1.0 / 255.0, 1.0 / 255.0, 0.0); }`;
const RAMP = [[0, 32, 81], [42, 63, 108], [97, 100, 112], [140, 137, 120], [196, 178, 104], [253, 234, 69]];
const DIVERGING = [[33, 79, 138], [140, 175, 214], [247, 247, 247], [242, 174, 114], [166, 73, 10]];
const shares = list => list.flat().map(v => v / 255);

class Painter {
  constructor(canvas, data) {
    const gl = this.gl = canvas.getContext("webgl2", { antialias: false, alpha: true, premultipliedAlpha: true });
    if (!gl) throw new Error("WebGL 2 is not available");
    this.data = data;
    this.programs = {};
    for (const kind of ["point", "block", "line"]) this.programs[kind] = this.program(SHADERS.common + SHADERS[kind + "Vertex"], SHADERS.common + SHADERS[kind + "Fragment"]);
    this.shade = new Shade(gl, this.program(SHADE.vertex, SHADE.fragment));
    this.points = this.pointArray();
    this.blocks = data.models.map(m => this.blockArray(m));
    this.lines = data.outlines.map(l => this.lineArray(l));
    gl.enable(gl.DEPTH_TEST);
  }
  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text.replace("PACK", PACK));
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
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, values, usage || gl.STATIC_DRAW);
    return buffer;
  }
  pointArray() {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    this.buffer(gl.ARRAY_BUFFER, this.data.record);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.UNSIGNED_SHORT, true, 12, 0);
    gl.enableVertexAttribArray(1); gl.vertexAttribIPointer(1, 1, gl.UNSIGNED_SHORT, 12, 6);
    gl.enableVertexAttribArray(2); gl.vertexAttribPointer(2, 1, gl.UNSIGNED_SHORT, true, 12, 8);
    return array;
  }
  blockArray(model) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    this.buffer(gl.ARRAY_BUFFER, model.vertices);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    this.buffer(gl.ELEMENT_ARRAY_BUFFER, model.triangles);
    // One record an instance: turn 4, shift 3, colour 4 (floats), number (whole).
    const records = this.buffer(gl.ARRAY_BUFFER, new Float32Array(0), gl.DYNAMIC_DRAW);
    for (const [slot, n, offset] of [[1, 4, 0], [2, 3, 16], [3, 4, 28]]) {
      gl.enableVertexAttribArray(slot); gl.vertexAttribPointer(slot, n, gl.FLOAT, false, 48, offset); gl.vertexAttribDivisor(slot, 1);
    }
    gl.enableVertexAttribArray(4); gl.vertexAttribIPointer(4, 1, gl.UNSIGNED_INT, 48, 44); gl.vertexAttribDivisor(4, 1);
    return { array, records, triangles: model.triangles.length, count: 0 };
  }
  lineArray(line) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    this.buffer(gl.ARRAY_BUFFER, new Float32Array(line.points.flat()));
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    return { array, count: line.points.length, closed: line.closed };
  }
  // Blocks to draw: [{model, pose, colour, number}].
  setBlocks(list) {
    const gl = this.gl;
    this.blocks.forEach((blocks, model) => {
      const own = list.filter(b => b.model === model), values = new Float32Array(own.length * 12), whole = new Uint32Array(values.buffer);
      own.forEach((b, i) => { values.set([...b.pose, ...b.colour, 1], i * 12); whole[i * 12 + 11] = b.number; });
      gl.bindBuffer(gl.ARRAY_BUFFER, blocks.records);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
      blocks.count = own.length;
    });
  }
  draw(state, picking = false) {
    const gl = this.gl, w = gl.drawingBufferWidth, h = gl.drawingBufferHeight, matrix = state.camera.matrix(w / h);
    if (picking) this.bindPicture(w, h); else this.shade.begin(w, h);
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const { back, right, up } = state.camera.axes();
    // What is cut away is the side of the viewer.
    const cut = dot(state.cut, back) < 0 ? state.cut.map(v => -v) : state.cut;
    const use = kind => {
      const { program, at } = this.programs[kind];
      gl.useProgram(program);
      gl.uniformMatrix4fv(at.camera, false, matrix);
      gl.uniform4fv(at.cut, cut);
      gl.uniform1i(at.picking, picking ? 1 : 0);
      return at;
    };
    let at = use("block");
    gl.uniform3fv(at.eye, state.camera.eye());
    gl.uniform1ui(at.chosen, state.chosen);
    // Light over the viewer's left shoulder.
    gl.uniform3fv(at.sun, unit(add(add(add([0, 0, 0.6], back, 0.45), right, -0.6), up, 0.35)));
    for (const blocks of this.blocks) {
      if (!blocks.count) continue;
      gl.bindVertexArray(blocks.array);
      gl.drawElementsInstanced(gl.TRIANGLES, blocks.triangles, gl.UNSIGNED_INT, 0, blocks.count);
    }
    if (state.showPoints) {
      const p = this.data.points;
      at = use("point");
      gl.uniform3fv(at.low, p.min); gl.uniform3fv(at.size, p.size);
      gl.uniform1f(at.pixels, state.pointSize * (window.devicePixelRatio || 1)); gl.uniform1i(at.mode, state.pointMode);
      gl.uniform2f(at.heights, p.min[2], p.min[2] + p.size[2]); gl.uniform1f(at.eyeDistance, state.camera.distance);
      gl.uniform3fv(at.ramp, shares(RAMP)); gl.uniform3fv(at.diverging, shares(DIVERGING));
      gl.bindVertexArray(this.points);
      gl.drawArrays(gl.POINTS, 0, p.shown);
    }
    if (state.showLines) {
      use("line");
      for (const line of this.lines) {
        gl.bindVertexArray(line.array);
        gl.drawArrays(line.closed ? gl.LINE_LOOP : gl.LINE_STRIP, 0, line.count);
      }
    }
    if (!picking) this.shade.end(...state.camera.range(), 190);
    return matrix;
  }
  bindPicture(w, h) {
    const gl = this.gl;
    if (!this.picture || this.picture.w !== w || this.picture.h !== h) {
      const frame = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      [gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1].forEach(slot => {
        const texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, w, h);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, slot, gl.TEXTURE_2D, texture, 0);
      });
      const depth = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, w, h);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
      gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
      this.picture = { frame, w, h };
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picture.frame);
  }
  // What lies under a pixel (from the top left): block number (0 none) and place, or null.
  pick(state, x, y) {
    const gl = this.gl, matrix = this.draw(state, true), pixel = new Uint8Array(4), read = (slot, dx, dy) => {
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
    const w = gl.drawingBufferWidth, h = gl.drawingBufferHeight, camera = state.camera;
    const { back, right, up } = camera.axes(), f = 1 / Math.tan(0.4);
    const [near, far] = camera.range();
    const away = 2 * far * near / (far + near - (2 * found.depth - 1) * (far - near));
    const sx = (2 * (x + 0.5) / w - 1) * (w / h) / f * away, sy = (1 - 2 * (y + 0.5) / h) / f * away;
    found.place = add(add(add(camera.eye(), back, -away), right, sx), up, sy);
    return found;
  }
}
