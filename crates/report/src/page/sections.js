// Cross-sections at any spacing along the works, or along a line drawn in the plan: surfaces, the blocks cut through,
// areas, and volumes by average end area.

import { css, NOT_JUDGED, PLANNED, TYPES } from "./colours.js";
import { Line, between, blockOutline, profile } from "./cut.js";
import { chainage } from "./plan.js";
import { Table } from "./table.js";
import { byId, make, number, roundUp, said, sharp, theme, words } from "./words.js";
import { bar, haloed } from "./overlay.js";

const SURFACES = [["ground", "ground", [2, 3]], ["surveyed", "asis", []], ["planned", "planned", []], ["design", "design", [9, 4]]];

export class Sections {
  constructor(viewer, selection, plan) {
    Object.assign(this, { viewer, selection, plan, data: viewer.data, canvas: byId("section-canvas"), index: 0, free: null, pointer: null });
    const { works, surfaces } = this.data;
    this.works = works && surfaces.surveyed ? works : null;
    if (this.works) {
      this.line = new Line(works.line);
      this.spacing = works.spacing_m || roundUp(this.line.length / 12);
    }
    plan.sections = this;
    this.measure();
    // The first one shown is the one with most to do.
    if (this.rows.length) this.index = this.rows.reduce((best, row) => (row.areas.added || 0) > (this.rows[best].areas.added || 0) ? row.i : best, 0);
    this.listen();
    this.refresh();
  }
  // Sections as the run drew them, for runs without surfaces.
  stored() {
    return this.data.sections.map(s => {
      const length = Math.hypot(s.to[0] - s.from[0], s.to[1] - s.from[1]) || 1, along = [(s.to[0] - s.from[0]) / length, (s.to[1] - s.from[1]) / length];
      const first = s.lines.flatMap(l => l.points)[0], start = first ? first[0] : 0;
      const lines = Object.fromEntries(s.lines.map(l => [l.kind, l.points.map(p => [p[0], p[1] === null ? NaN : p[1] - this.data.origin[2]])]));
      return { name: said(s.label), from: s.from, to: s.to, along, length, start, lines };
    });
  }
  at(c) {
    // The ends are cut a little inside: on the edge itself nothing is designed.
    const inside = Math.min(1.5 * (this.data.surfaces.design?.cell || 0), this.line.length / 4);
    const { at, along } = this.line.place(Math.min(Math.max(c, inside), this.line.length - inside)), [left, right] = this.works.reach_m, across = [along[1], -along[0]];
    const from = [at[0] - across[0] * left, at[1] - across[1] * left], to = [at[0] + across[0] * right, at[1] + across[1] * right];
    return this.cut({ name: chainage(c), chainage: c, from, to, start: -left });
  }
  cut(cut) {
    cut.length = Math.hypot(cut.to[0] - cut.from[0], cut.to[1] - cut.from[1]);
    cut.along = [(cut.to[0] - cut.from[0]) / cut.length, (cut.to[1] - cut.from[1]) / cut.length];
    cut.lines = {};
    for (const [name] of SURFACES) if (this.data.surfaces[name]) cut.lines[name] = profile(this.data.surfaces[name], cut);
    return cut;
  }
  // All sections with their areas, and the volumes between neighbours.
  measure() {
    if (!this.works) { this.list = this.stored(); this.rows = []; return; }
    const stations = [];
    for (let c = 0; c < this.line.length - this.spacing * 0.05; c += this.spacing) stations.push(c);
    stations.push(this.line.length);
    this.list = stations.map(c => this.at(c));
    let sums = { fill: 0, added: 0, left: 0, above: 0 }, last = null;
    this.rows = this.list.map((cut, i) => {
      const { design, surveyed, planned } = cut.lines, before = between(design, surveyed), after = planned ? between(design, planned) : { above: NaN, below: NaN };
      const areas = { fill: before.above, added: planned ? between(planned, surveyed).above : NaN, left: after.above, above: after.below };
      const long = last ? cut.chainage - last.chainage : 0, row = { i, name: cut.name, chainage: cut.chainage, long, areas, volumes: {} };
      // Average end area: V = (A1 + A2) / 2 · L.
      for (const key in areas) { row.volumes[key] = last ? (areas[key] + last.areas[key]) / 2 * long : 0; sums[key] += row.volumes[key]; }
      last = row;
      return row;
    });
    this.total = sums;
  }
  current() { return this.free || this.list[this.index] || null; }
  setFree(from, to) {
    this.free = this.cut({ name: words("free section", "任意断面"), from, to, start: 0 });
    this.refresh();
  }
  show(i) {
    this.free = null;
    this.index = Math.min(this.list.length - 1, Math.max(0, i));
    this.refresh();
  }
  refresh() {
    byId("sections").hidden = !this.list.length && !this.free;
    const slider = byId("section-at");
    slider.max = Math.max(0, this.list.length - 1);
    slider.value = this.index;
    byId("section-name").textContent = this.current() ? this.current().name : "";
    this.draw();
    this.plan.draw();
    this.table?.draw(true);
    this.total && this.totals();
    if (byId("follow-section").checked) this.clip();
  }
  // The 3D view shows a slice about the section.
  clip() {
    const cut = this.current();
    if (!cut) return;
    const half = Number(byId("section-thickness").value) / 2, middle = [(cut.from[0] + cut.to[0]) / 2, (cut.from[1] + cut.to[1]) / 2], across = [-cut.along[1] * half, cut.along[0] * half];
    const corners = [[cut.from, 1], [cut.to, 1], [cut.to, -1], [cut.from, -1]].map(([p, s]) => [p[0] + across[0] * s, p[1] + across[1] * s]);
    this.viewer.setBox({ middle, direction: cut.along, half: [cut.length / 2, half], from: -1e9, to: 1e9, corners });
  }
  scale(w, h) {
    const cut = this.current(), heights = Object.values(cut.lines).flat().map(p => p[1]).filter(Number.isFinite);
    let low = Infinity, high = -Infinity;
    for (const z of heights) { low = Math.min(low, z); high = Math.max(high, z); }
    for (const { rings } of this.outlines) for (const ring of rings) for (const p of ring) if (p[0] > cut.start && p[0] < cut.start + cut.length) { low = Math.min(low, p[1]); high = Math.max(high, p[1]); }
    if (!(high > low)) [low, high] = [low - 1 || -1, low + 1 || 1];
    const m = Math.max(cut.length / (w - 90), (high - low) * 1.12 / (h - 60), 1e-6), mid = (low + high) / 2;
    this.x = o => w / 2 + 25 + (o - cut.start - cut.length / 2) / m;
    this.y = z => (h - 34) / 2 - (z - mid) / m;
    this.back = px => (px - w / 2 - 25) * m + cut.start + cut.length / 2;
    this.up = py => mid - (py - (h - 34) / 2) * m;
    this.m = m;
  }
  draw() {
    if (!this.canvas.clientWidth) return;
    const { g, w, h } = sharp(this.canvas), colours = theme(), cut = this.current();
    if (!cut) return;
    this.outlines = this.data.blocks.filter(b => b && this.viewer.shown(b)).map(b => ({ b, rings: blockOutline(b, this.data.models[b.model], cut) })).filter(o => o.rings.length);
    this.scale(w, h);
    this.axes(g, w, h, colours);
    g.save();
    g.beginPath();
    g.rect(this.x(cut.start), 0, cut.length / this.m, h - 34);
    g.clip();
    this.fill(g, cut, colours);
    for (const { b, rings } of this.outlines) this.block(g, b, rings, colours);
    for (const [name, colour, dash] of SURFACES) {
      if (!cut.lines[name]) continue;
      g.strokeStyle = colours[colour];
      g.lineWidth = name === "design" ? 2.2 : 1.8;
      g.setLineDash(dash);
      this.path(g, cut.lines[name]);
      g.stroke();
    }
    g.setLineDash([]);
    g.restore();
    if (this.pointer !== null) {
      const x = this.x(this.pointer);
      g.strokeStyle = colours.chosen;
      g.lineWidth = 1;
      g.beginPath(); g.moveTo(x, 0); g.lineTo(x, h - 34); g.stroke();
    }
    const metres = roundUp(this.m * 90);
    bar(g, w - 20 - metres / this.m, 22, metres / this.m, metres, colours);
  }
  path(g, points) {
    g.beginPath();
    let down = false;
    for (const [o, z] of points) {
      if (!Number.isFinite(z)) { down = false; continue; }
      down ? g.lineTo(this.x(o), this.y(z)) : g.moveTo(this.x(o), this.y(z));
      down = true;
    }
  }
  // What is missing up to the design, lightly.
  fill(g, { lines }, colours) {
    const { design, surveyed } = lines, lower = lines.planned || surveyed;
    if (!design || !lower) return;
    g.fillStyle = colours.fill;
    g.beginPath();
    let run = [];
    const close = () => {
      if (run.length > 1) {
        run.forEach(([o, z], i) => i ? g.lineTo(this.x(o), this.y(z)) : g.moveTo(this.x(o), this.y(z)));
        run.reverse().forEach(([o, , z]) => g.lineTo(this.x(o), this.y(z)));
        g.closePath();
      }
      run = [];
    };
    design.forEach(([o, z], i) => {
      const under = lower[i]?.[1];
      if (Number.isFinite(z) && Number.isFinite(under)) run.push([o, z, Math.min(z, under)]); else close();
    });
    close();
    g.fill();
  }
  block(g, b, rings, colours) {
    const base = b.kind === "added" ? PLANNED : b.judged ? TYPES[b.model % 6] : NOT_JUDGED, marked = b.number === this.selection.chosen || b.number === this.selection.pointed;
    g.beginPath();
    for (const ring of rings) { ring.forEach(([o, z], i) => i ? g.lineTo(this.x(o), this.y(z)) : g.moveTo(this.x(o), this.y(z))); g.closePath(); }
    g.fillStyle = marked ? colours.chosen : css(base, 0.42);
    g.fill("evenodd");
    g.strokeStyle = marked ? colours.chosen : css(base);
    g.lineWidth = 1.2;
    g.stroke();
    const wide = rings.flat().map(p => p[0]), x = this.x((Math.min(...wide) + Math.max(...wide)) / 2);
    if ((Math.max(...wide) - Math.min(...wide)) / this.m > 18 && (b.kind === "added" || marked)) {
      const high = rings.flat().map(p => p[1]);
      g.font = "600 11px system-ui, sans-serif";
      g.textAlign = "center";
      g.textBaseline = "middle";
      haloed(g, b.kind === "added" ? String(b.order) : `R${b.id}`, x, this.y((Math.min(...high) + Math.max(...high)) / 2), colours.ink, colours.halo);
    }
  }
  axes(g, w, h, colours) {
    const cut = this.current(), step = roundUp(this.m * 80), rise = roundUp(this.m * 40), z0 = this.data.origin[2], digits = s => Math.max(0, -Math.floor(Math.log10(s)));
    g.font = "11px system-ui, sans-serif";
    g.strokeStyle = colours.grid;
    g.fillStyle = colours.soft;
    g.lineWidth = 1;
    g.beginPath();
    g.textAlign = "center";
    g.textBaseline = "alphabetic";
    for (let o = Math.ceil(cut.start / step) * step; o <= cut.start + cut.length + 1e-6; o += step) { const x = this.x(o); g.moveTo(x, 0); g.lineTo(x, h - 34); g.fillText(number(o, digits(step)), x, h - 20); }
    g.textAlign = "right";
    for (let z = Math.ceil((this.up(h - 34) + z0) / rise) * rise; z < this.up(0) + z0; z += rise) { const y = this.y(z - z0); g.moveTo(46, y); g.lineTo(w, y); g.fillText(number(z, digits(rise)), 42, y + 4); }
    g.stroke();
    g.textAlign = "center";
    g.fillText(this.works && !this.free ? words("offset from the alignment, left − right + (m)", "法線からの離れ 左 − 右 +（m）") : words("distance along the section (m)", "断面に沿う距離（m）"), w / 2, h - 5);
    g.save();
    g.translate(11, (h - 34) / 2);
    g.rotate(-Math.PI / 2);
    g.fillText(words("level (m)", "標高（m）"), 0, 0);
    g.restore();
  }
  listen() {
    byId("section-at").addEventListener("input", e => this.show(Number(e.target.value)));
    byId("section-before").addEventListener("click", () => this.show(this.index - 1));
    byId("section-after").addEventListener("click", () => this.show(this.index + 1));
    const spacing = byId("section-spacing");
    spacing.value = this.spacing || "";
    byId("section-spacing-tool").hidden = !this.works;
    spacing.addEventListener("change", () => {
      const wanted = Number(spacing.value);
      this.spacing = wanted >= this.line.length / 400 && wanted > 0 ? wanted : this.spacing;
      spacing.value = this.spacing;
      this.measure();
      if (this.table) { this.table.rows = this.rows; this.table.refresh(); }
      this.show(0);
    });
    byId("follow-section").addEventListener("change", e => { e.target.checked ? this.clip() : this.viewer.setBox(null); this.plan.draw(); });
    byId("section-thickness").addEventListener("change", () => this.clip());
    this.canvas.addEventListener("pointermove", e => {
      const box = this.canvas.getBoundingClientRect(), o = this.back(e.clientX - box.left), z = this.up(e.clientY - box.top);
      this.pointer = o;
      const near = this.outlines.filter(({ rings }) => rings.some(r => within(r, o, z))).pop();
      this.selection.point(near ? near.b.number : 0, this);
      this.read(o);
      this.draw();
      this.plan.draw();
    });
    this.canvas.addEventListener("pointerleave", () => { this.pointer = null; this.selection.point(0, this); byId("section-read").textContent = ""; this.draw(); this.plan.draw(); });
    this.canvas.addEventListener("click", () => { if (this.selection.pointed) this.selection.choose(this.selection.pointed, this); });
    for (const name of ["chosen", "pointed"]) this.selection.addEventListener(name, e => { if (name === "chosen" && e.detail.from !== this) this.follow(e.detail.number); this.draw(); });
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    document.addEventListener("language", () => this.refresh());
    document.addEventListener("theme", () => this.draw());
    if (!this.works) return;
    const area = (key, en, ja) => ({ head: { en, ja }, unit: "m²", digits: 2, value: r => r.areas[key] }), volume = (key, en, ja) => ({ head: { en, ja }, unit: "m³", digits: 1, value: r => r.volumes[key] });
    const columns = [{ head: { en: "section", ja: "測点" }, value: r => r.name, text: true }, { head: { en: "distance", ja: "区間距離" }, unit: "m", digits: 2, value: r => r.long },
      area("fill", "missing", "不足断面"), volume("fill", "missing", "不足体積"), area("added", "planned", "計画断面"), volume("added", "planned", "計画体積"), area("left", "still missing", "残不足断面"), volume("left", "still missing", "残不足体積"), area("above", "above design", "超過断面"), volume("above", "above design", "超過体積")];
    this.table = new Table(byId("section-table"), { name: "sections", columns, rows: this.rows, marks: r => r.i === this.index && !this.free ? ["current"] : [] });
    byId("section-table").addEventListener("click", e => { const row = e.target.closest(".vrow"); if (row) this.show(this.table.list[row.dataset.at].i); });
  }
  totals() {
    const t = this.total;
    byId("section-totals").textContent = words(
      `Total by average end area: missing ${number(t.fill, 1)} m³, planned ${number(t.added, 1)} m³, still missing ${number(t.left, 1)} m³, above the design ${number(t.above, 1)} m³.`,
      `平均断面法による合計: 不足 ${number(t.fill, 1)} m³、計画 ${number(t.added, 1)} m³、残不足 ${number(t.left, 1)} m³、超過 ${number(t.above, 1)} m³。`);
  }
  read(o) {
    const cut = this.current(), z0 = this.data.origin[2], at = line => { const i = line.findIndex(p => p[0] >= o); return i < 0 ? NaN : line[i][1] + z0; };
    const names = { ground: words("bed", "地盤"), surveyed: words("surveyed", "現況"), planned: words("with the plan", "計画後"), design: words("design", "計画面") };
    byId("section-read").textContent = [`${words("offset", "離れ")} ${number(o, 2)} m`, ...SURFACES.filter(([n]) => cut.lines[n]).map(([n]) => `${names[n]} ${number(at(cut.lines[n]), 2)}`)].join(" · ");
  }
  // The section nearest to a block that was chosen elsewhere.
  follow(number) {
    const b = this.selection.block(number);
    if (!b || !this.works || this.free) return;
    const away = cut => Math.abs((b.centre[0] - cut.from[0]) * -cut.along[1] + (b.centre[1] - cut.from[1]) * cut.along[0]);
    const best = this.list.reduce((a, c, i) => away(c) < away(this.list[a]) ? i : a, 0);
    if (best !== this.index) this.show(best);
  }
}

function within(ring, o, z) {
  let odd = false;
  for (let i = 0, j = ring.length - 1; i < ring.length; j = i++) {
    if (ring[i][1] > z !== ring[j][1] > z && o < (ring[j][0] - ring[i][0]) * (z - ring[i][1]) / (ring[j][1] - ring[i][1]) + ring[i][0]) odd = !odd;
  }
  return odd;
}

// The key of the lines under a section.
export function sectionLegend() {
  const names = { ground: ["bed", "地盤"], asis: ["as surveyed", "現況"], planned: ["with the plan", "計画後"], design: ["design", "計画面"] };
  byId("section-legend").replaceChildren(...SURFACES.map(([, colour]) => make("span", {}, make("i", { className: `line ${colour}` }), words(...names[colour]))));
}
