// Darkens what lies behind its neighbours on the screen (eye-dome lighting, Boucheny 2009): without it, a dense cloud
// of points is one flat colour. The scene is drawn with multisampling aside, then put on its target with its shade.

export const SHADE = {
  vertex: `#version 300 es
    void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`,
  fragment: `#version 300 es
    precision highp float;
    uniform sampler2D colour, depth; uniform vec2 range; uniform int reach; uniform float strength; uniform bool flatView;
    out vec4 what;
    float away(ivec2 at) {
      float d = texelFetch(depth, at, 0).r;
      return flatView ? d * range.y : log2(2.0 * range.y * range.x / (range.y + range.x - (2.0 * d - 1.0) * (range.y - range.x)));
    }
    void main() {
      ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(depth, 0) - 1;
      vec4 c = texelFetch(colour, at, 0);
      if (c.a == 0.0) { what = vec4(0.0); return; }
      float here = away(at), behind = 0.0;
      for (int i = 0; i < 8; i++) {
        ivec2 step = ivec2[8](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1), ivec2(1, 1), ivec2(-1, 1), ivec2(1, -1), ivec2(-1, -1))[i] * reach;
        behind += min(max(0.0, here - away(clamp(at + step, ivec2(0), last))), 0.02);
      }
      what = vec4(c.rgb * exp(-strength * behind / 8.0), c.a);
    }`,
};

export class Shade {
  // `aside`: the picture is read back instead of shown.
  constructor(gl, program, aside = false) {
    Object.assign(this, { gl, program, aside });
  }
  // Draws into its own pictures from here on; `plain`: with one sample a pixel, for pictures in haste.
  begin(w, h, plain = false) {
    const gl = this.gl;
    if (!this.size || this.size[0] !== w || this.size[1] !== h) this.allocate(w, h);
    this.plain = plain;
    this.bind();
  }
  bind() { this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, this.plain ? this.one : this.many); }
  // Until all that was asked for is drawn: reading waits for it.
  wait() {
    const gl = this.gl;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.one);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }
  // Puts the picture on the canvas as it is, stretched to its size.
  show(w, h) {
    const gl = this.gl;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.one);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, ...this.size, 0, 0, w, h, gl.COLOR_BUFFER_BIT, gl.LINEAR);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }
  allocate(w, h) {
    const gl = this.gl, samples = Math.min(4, gl.getParameter(gl.MAX_SAMPLES));
    [this.colour, this.depth, this.shown].forEach(t => t && gl.deleteTexture(t));
    (this.buffers || []).forEach(b => gl.deleteRenderbuffer(b));
    const texture = format => {
      const t = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, t);
      gl.texStorage2D(gl.TEXTURE_2D, 1, format, w, h);
      for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
      return t;
    };
    const buffer = (format, slot) => {
      const b = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, b);
      gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, format, w, h);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, slot, gl.RENDERBUFFER, b);
      return b;
    };
    this.many = this.many || gl.createFramebuffer();
    this.one = this.one || gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.many);
    this.buffers = [buffer(gl.RGBA8, gl.COLOR_ATTACHMENT0), buffer(gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT)];
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.one);
    this.colour = texture(gl.RGBA8);
    this.depth = texture(gl.DEPTH_COMPONENT24);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.colour, 0);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.depth, 0);
    if (this.aside) {
      this.target = this.target || gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
      this.shown = texture(gl.RGBA8);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.shown, 0);
    }
    this.size = [w, h];
  }
  // Puts the finished picture on its target.
  end(near, far, strength, flatView = false) {
    const gl = this.gl, [w, h] = this.size, { program, at } = this.program;
    if (!this.plain) {
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.many);
      gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.one);
      gl.blitFramebuffer(0, 0, w, h, 0, 0, w, h, gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT, gl.NEAREST);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.aside ? this.target : null);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(program);
    [this.colour, this.depth].forEach((texture, i) => { gl.activeTexture(gl.TEXTURE0 + i); gl.bindTexture(gl.TEXTURE_2D, texture); });
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(at.colour, 0);
    gl.uniform1i(at.depth, 1);
    gl.uniform2f(at.range, near, far);
    gl.uniform1i(at.flatView, flatView ? 1 : 0);
    gl.uniform1i(at.reach, Math.max(1, Math.round(window.devicePixelRatio || 1)));
    gl.uniform1f(at.strength, strength);
    gl.bindVertexArray(null);
    gl.disable(gl.DEPTH_TEST);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.DEPTH_TEST);
  }
}
