// The design: its kind, its numbers, its line drawn on the map, typed or from a file.

import { get } from "./api.js";
import { button, choice, field, make, section } from "./parts.js";
import { t } from "./words.js";

const KINDS = ["none", "level", "section", "file"];

export function designPart(site, { kept, numeric, show, map }) {
  const spec = site.draft.site, inner = make("div"), own = kindOf(spec);
  const part = section(t("design"));
  const kind = choice((KINDS.includes(own) ? KINDS : [...KINDS, "other"]).map(k => [k, t(`design-${k}`)]), own);
  const said = kept("design", field(t("design"), kind));
  let points = null, files = [];
  part.append(said, inner);
  kind.addEventListener("change", () => { change(kind.value); fill(); show(); });
  get("/api/files").then(all => { files = all; fill(); }).catch(() => {});

  function kindOf({ design, design_file: file }) {
    if (file) return "file";
    if (!design) return "none";
    return ["level", "section"].includes(design.kind) ? design.kind : "other";
  }
  // A new kind begins with what the survey says: its extent and its upper heights.
  function change(to) {
    const before = spec.design;
    delete spec.design; delete spec.design_file; delete spec.alignment_file;
    const m = map.map, top = Math.round(10 * Math.max(0, ...(site.check?.found?.surveys || []).map(s => s.levels_m[2]))) / 10;
    const edge = m && [m.west_m, m.north_m - m.rows * m.cell_m, m.west_m + m.columns * m.cell_m, m.north_m].map(v => Math.round(v * 10) / 10);
    if (to === "level") spec.design = { kind: "level", level_m: before?.crest_level_m ?? top, boundary: m ? [[edge[0], edge[1]], [edge[2], edge[1]], [edge[2], edge[3]], [edge[0], edge[3]]] : [] };
    if (to === "section") spec.design = { kind: "section", alignment: [], crest_level_m: before?.level_m ?? top, crest_width_m: 6, left_slope_m: 1.5, right_slope_m: 1.5, toe_level_m: 0 };
    // A section without its line is no design yet: it is kept when the line is there.
    if (to !== "file" && to !== "section") site.change();
  }
  function fill() {
    const d = spec.design;
    points = null;
    inner.replaceChildren();
    if (kind.value === "level" && d) inner.append(kept("level", field(t("level"), numeric(d.level_m, v => { d.level_m = v; }))), ...line("boundary", 3));
    if (kind.value === "section" && d) {
      const slope = (key, name) => field(t(name), numeric(d[key], v => { d[key] = v; }));
      inner.append(...line("alignment", 2), fromFile(), make("div", { className: "numbers" }, slope("crest_level_m", "crest-level"), slope("crest_width_m", "crest-width"), slope("left_slope_m", "left-slope"), slope("right_slope_m", "right-slope"), slope("toe_level_m", "toe")), make("small", {}, t("left-right")));
    }
    if (kind.value === "file") inner.append(surface());
  }
  // Points as text, a line each, and as clicks on the map.
  function line(key, least) {
    const area = make("textarea", { rows: 4, spellcheck: false, value: (spec.design[key] || []).map(p => p.map(v => v.toFixed(2)).join(", ")).join("\n"), disabled: Boolean(spec.alignment_file) });
    const box = field(t(key), area);
    points = area;
    const take = () => {
      const rows = area.value.split("\n").map(r => r.trim()).filter(Boolean).map(r => r.split(/[\s,;]+/).map(Number));
      const good = rows.every(r => r.length >= 2 && r.slice(0, 2).every(Number.isFinite));
      spec.design[key] = good ? rows.map(r => r.slice(0, 2)) : spec.design[key];
      const enough = good && rows.length >= least;
      box.say(enough ? [] : [{ severity: "refusal", text: good ? t("needs-points", { n: least }) : t("needs-number") }]);
      if (enough) site.change();
      show();
    };
    area.addEventListener("input", take);
    const help = make("small", { hidden: true }, t("draw-help"));
    const draw = button(t("draw"), () => { map.drawing ? map.finish() : map.begin(); begun(); }, { id: "draw" });
    const begun = () => { draw.textContent = t(map.drawing ? "draw-end" : "draw"); draw.setAttribute("aria-pressed", Boolean(map.drawing)); help.hidden = !map.drawing; };
    map.onDrawn = drawn => { area.value = drawn.map(p => p.map(v => v.toFixed(2)).join(", ")).join("\n"); take(); };
    map.onDone = begun;
    return [box, make("div", { className: "row" }, draw, help)];
  }
  function fromFile() {
    const list = choice([["", t("own-points")], ...files.filter(f => f.alignment).map(f => [site.up + f.path, f.path])], spec.alignment_file?.file || "");
    list.addEventListener("change", () => {
      if (list.value) { spec.alignment_file = { file: list.value }; spec.design.alignment = []; } else delete spec.alignment_file;
      site.change();
      fill();
      site.look();
    });
    return field(t("alignment-file"), list);
  }
  function surface() {
    const of = spec.design_file, list = choice([["", t("choose")], ...files.filter(f => f.design).map(f => [site.up + f.path, f.path])], of?.file || "");
    if (of && !list.value) { list.append(make("option", { value: of.file }, of.file)); list.value = of.file; }
    list.addEventListener("change", () => {
      if (!list.value) return;
      spec.design_file = { ...(spec.design_file || { cell_m: 0.1 }), file: list.value };
      site.change();
      site.look();
    });
    return make("div", {}, field(t("design-file"), list), of ? field(t("design-cell"), numeric(of.cell_m ?? 0.1, v => { of.cell_m = v; })) : "");
  }
  fill();
  return {
    part,
    // The alignment as drawn, or as the check has read it from its file.
    line: () => spec.design?.kind !== "section" ? [] : spec.alignment_file ? site.check?.map?.alignment || [] : spec.design.alignment,
    checked() {},
  };
}
