// The programs of the 3D view. A second pass writes block number and depth in place of colours, for clicks.

const COMMON = `#version 300 es
  precision highp float; precision highp int;
  uniform mat4 camera; uniform vec4 boxPlace; uniform vec4 boxSize; 
  // Outside the section box: middle (x, y), direction (cos, sin); half length, half width, from, to height.
  bool cutAway(vec3 p) {
    vec2 d = p.xy - boxPlace.xy, along = vec2(dot(d, boxPlace.zw), dot(d, vec2(-boxPlace.w, boxPlace.z)));
    return abs(along.x) > boxSize.x || abs(along.y) > boxSize.y || p.z < boxSize.z || p.z > boxSize.w;
  }
  vec3 along(vec3 a, vec3 b, float f) { return a + (b - a) * f; }
`;
const PACK = `vec4 number(uint n) { return vec4(n & 255u, (n >> 8) & 255u, (n >> 16) & 255u, n == 0u ? 0u : 255u) / 255.0; }
  vec4 pack(float d) { vec4 e = fract(d * vec4(1.0, 255.0, 65025.0, 16581375.0)); return e - e.yzww * vec4(1.0 / 255.0, 1.0 / 255.0, 1.0 / 255.0, 0.0); }
`;

const point = {
  vertex: `
    layout(location=0) in vec3 grid; layout(location=1) in uint instance; layout(location=2) in float distance; layout(location=3) in float fit;
    uniform vec3 low, size, eye; uniform float pixels, eyeDistance, push; uniform int mode; uniform vec2 heights; uniform uint only; uniform bool bare;
    uniform vec3 ramp[6]; uniform vec3 diverging[5]; uniform vec3 error[5];
    out vec3 colour; out vec3 place; flat out uint block;
    void main() {
      place = low + grid * size; block = instance;
      // Points of a shown block are left out (they would stain it), or lie before its face when they are what one looks at.
      vec3 seen = instance == 0u ? place : place + normalize(place - eye) * push;
      gl_Position = camera * vec4(seen, 1.0);
      gl_PointSize = max(1.0, pixels * clamp(eyeDistance / gl_Position.w, 0.5, 2.5));
      if ((bare && instance != 0u) || (only != 0u && instance != only)) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
      if (mode == 0) {
        float v = clamp((place.z - heights.x) / (heights.y - heights.x), 0.0, 1.0) * 5.0; int i = min(int(v), 4);
        colour = along(ramp[i], ramp[i + 1], v - float(i));
      } else if (mode == 1) {
        if (instance == 0u) colour = vec3(0.62);
        else { uint h = instance * 2654435761u; h ^= h >> 15; vec3 c = vec3(h & 255u, (h >> 8) & 255u, (h >> 16) & 255u) / 255.0; colour = 0.2 + 0.7 * c; }
      } else if (mode == 2) {
        if (distance == 0.0) colour = vec3(0.7);
        else { float v = clamp(1.0 - distance, 0.0, 1.0) * 4.0; int i = min(int(v), 3); colour = along(diverging[i], diverging[i + 1], v - float(i)); }
      } else if (mode == 4) {
        if (fit == 0.0) colour = vec3(0.72, 0.75, 0.78);
        else { float v = clamp(fit, 0.0, 1.0) * 4.0; int i = min(int(v), 3); colour = along(error[i], error[i + 1], v - float(i)); }
      } else colour = vec3(0.36, 0.42, 0.48);
    }`,
  fragment: `
    in vec3 colour; in vec3 place; flat in uint block; uniform bool picking;
    layout(location=0) out vec4 what; layout(location=1) out vec4 depth;
    void main() {
      if (cutAway(place)) discard;
      what = picking ? number(block) : vec4(colour, 1.0); depth = pack(gl_FragCoord.z);
    }`,
};

const block = {
  vertex: `
    layout(location=0) in vec3 corner; layout(location=1) in vec4 turn; layout(location=2) in vec3 shift; layout(location=3) in vec4 look; layout(location=4) in uint id;
    out vec3 place; flat out vec4 paint; flat out uint block;
    void main() {
      vec3 t = 2.0 * cross(turn.xyz, corner);
      place = corner + turn.w * t + cross(turn.xyz, t) + shift;
      paint = look; block = id;
      gl_Position = camera * vec4(place, 1.0);
    }`,
  fragment: `
    in vec3 place; flat in vec4 paint; flat in uint block; uniform bool picking; uniform vec3 eye, sun; uniform uint chosen, pointed;
    layout(location=0) out vec4 what; layout(location=1) out vec4 depth;
    void main() {
      if (cutAway(place)) discard;
      depth = pack(gl_FragCoord.z);
      if (picking) { what = number(block); return; }
      vec3 n = normalize(cross(dFdx(place), dFdy(place)));
      if (dot(n, eye - place) < 0.0) n = -n;
      float light = 0.34 + 0.22 * (0.5 + 0.5 * n.z) + 0.5 * max(dot(n, sun), 0.0);
      vec3 base = block == chosen ? vec3(0.91, 0.24, 0.55) : block == pointed ? mix(paint.rgb, vec3(0.96, 0.55, 0.75), 0.65) : paint.rgb;
      what = vec4(base * (gl_FrontFacing ? light : 0.45), 1.0);
    }`,
};

// A block as a lit disc: what a picture in haste shows of thousands.
const ball = {
  vertex: `
    layout(location=1) in vec4 turn; layout(location=2) in vec3 shift; layout(location=3) in vec4 look; layout(location=4) in uint id;
    uniform vec3 centre; uniform float radius, pixelsPerMetre;
    out vec3 place; flat out vec4 paint; flat out uint block;
    void main() {
      vec3 t = 2.0 * cross(turn.xyz, centre);
      place = centre + turn.w * t + cross(turn.xyz, t) + shift;
      paint = look; block = id;
      gl_Position = camera * vec4(place, 1.0);
      gl_PointSize = max(2.0, 1.3 * radius * pixelsPerMetre / gl_Position.w);
    }`,
  fragment: `
    in vec3 place; flat in vec4 paint; flat in uint block; uniform uint chosen;
    layout(location=0) out vec4 what; layout(location=1) out vec4 depth;
    void main() {
      vec2 at = gl_PointCoord * 2.0 - 1.0;
      float off = dot(at, at);
      if (off > 1.0 || cutAway(place)) discard;
      depth = pack(gl_FragCoord.z);
      vec3 base = block == chosen ? vec3(0.91, 0.24, 0.55) : paint.rgb;
      what = vec4(base * (0.62 + 0.4 * dot(vec3(at.x, -at.y, sqrt(1.0 - off)), vec3(-0.4, 0.5, 0.77))), 1.0);
    }`,
};

const line = {
  vertex: `
    layout(location=0) in vec3 corner; out vec3 place;
    void main() { place = corner; gl_Position = camera * vec4(corner, 1.0); }`,
  fragment: `
    in vec3 place; layout(location=0) out vec4 what; layout(location=1) out vec4 depth; uniform bool picking;
    void main() { if (picking || cutAway(place)) discard; what = vec4(0.74, 0.05, 0.16, 1.0); depth = vec4(1.0); }`,
};

// The design: a height field with soft light and a line every metre.
const surface = {
  vertex: `
    layout(location=0) in vec3 corner; out vec3 place;
    void main() { place = corner; gl_Position = camera * vec4(corner, 1.0); }`,
  fragment: `
    in vec3 place; uniform vec4 tint; uniform vec3 sun, eye; uniform float step, base; uniform bool picking;
    layout(location=0) out vec4 what; layout(location=1) out vec4 depth;
    void main() {
      if (picking || cutAway(place)) discard;
      vec3 n = normalize(cross(dFdx(place), dFdy(place)));
      if (dot(n, eye - place) < 0.0) n = -n;
      float level = (place.z + base) / step, width = fwidth(level);
      float on = width > 0.4 ? 0.0 : 1.0 - smoothstep(0.6, 1.4, abs(fract(level - 0.5) - 0.5) / max(width, 1e-5));
      what = vec4(tint.rgb * (0.72 + 0.3 * max(dot(n, sun), 0.0)), tint.a);
      what = mix(what, vec4(tint.rgb * 0.45, min(1.0, tint.a + 0.35)), on);
      depth = vec4(1.0);
    }`,
};

export const PROGRAMS = Object.fromEntries(Object.entries({ point, block, ball, line, surface }).map(([name, p]) =>
  [name, { vertex: COMMON + p.vertex, fragment: COMMON + PACK + p.fragment }]));
