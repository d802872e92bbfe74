// From the page's text to typed arrays: base64 -> gzip -> columns.

async function loadData() {
  const info = JSON.parse(document.getElementById("view-data").textContent);
  const text = atob(document.getElementById("view-blob").textContent.trim());
  const packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) packed[i] = text.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = await new Response(stream).arrayBuffer();

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

  // One record a point: x y z, instance, distance, unused.
  const p = info.points, record = new Uint16Array(p.shown * 6);
  p.xyz.forEach((span, axis) => undelta(span, record, 6, axis));
  undelta(p.instance, record, 6, 3);
  if (p.distance) undelta(p.distance, record, 6, 4);
  const models = info.models.map(m => ({ ...m, vertices: f32(m.vertices), triangles: u32(m.triangles) }));
  return { ...info, record, models };
}
