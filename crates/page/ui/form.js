// Set up a site: every value with what is wrong of it beside it, the height map, a section that follows the form.

import { get } from "./api.js";
import { complaintsOf } from "./complaints.js";
import { designPart } from "./design_form.js";
import { HeightMap } from "./map.js";
import { blockChoice, button, choice, field, make, number, section } from "./parts.js";
import { Profile, cutAt } from "./profile.js";
import { designOnMap, levels, lengthOf, spaceBelow } from "./surface.js";
import { t } from "./words.js";

const PLANES = Array.from({ length: 19 }, (_, i) => `EPSG:${6669 + i}`);

export function setupTab(body, site) {
  const { draft } = site, spec = draft.site, fields = new Map();
  const kept = (key, box) => { fields.set(key, [...(fields.get(key) || []), box]); return box; };
  const text = (value, put, more = {}) => {
    const input = make("input", { type: "text", value: value ?? "", ...more });
    input.addEventListener("input", () => { put(input.value.trim()); site.change(); show(); });
    return input;
  };
  const numeric = (value, put) => {
    const input = make("input", { type: "text", inputMode: "decimal", className: "number", value: value ?? "" });
    input.addEventListener("input", () => {
      const n = input.value.trim() === "" ? NaN : Number(input.value.replace(",", "."));
      put(n);
      input.closest(".field")?.say(Number.isFinite(n) ? [] : [{ severity: "refusal", text: t("needs-number") }]);
      if (Number.isFinite(n)) site.change();
      show();
    });
    return input;
  };
  const map = new HeightMap(make("canvas", { id: "height-map", "aria-label": t("map") }), make("p", { className: "read", role: "status" }));
  const profile = new Profile(make("canvas", { id: "profile-canvas", "aria-label": t("profile") }));
  const station = make("input", { type: "range", min: 0, max: 1000, value: 500, "aria-label": t("profile") }), where = make("output", {}), space = make("p", { className: "strongish", role: "status" }), system = make("small", { className: "system" });
  station.addEventListener("input", show);
  const mode = choice([["height", t("show-height")], ["difference", t("show-difference")]], "height");
  mode.addEventListener("change", () => { map.mode = mode.value; map.picture = null; map.draw(); });

  const left = make("div", { className: "form" });
  const right = make("div", { className: "look" },
    section(t("map"), system, make("div", { className: "bar" }, make("label", {}, `${t("map-show")} `, mode), space), map.canvas, map.read),
    section(t("profile"), make("div", { className: "bar" }, station, where, make("span", { className: "legend" }, ...profile.legend().map(([name, line]) => make("span", {}, make("i", { className: `line ${line}` }), name)))), profile.canvas));
  const checking = make("p", { role: "status" }), rest = make("div", { className: "rest" });
  const design = designPart(site, { kept, numeric, show, map });
  left.append(
    make("div", { className: "row checkrow" }, button(t("check-again"), () => site.look()), checking), rest,
    section(t("site-data"), kept("name", field(t("site-name"), text(spec.name, v => { spec.name = v; }, { maxLength: 64 }))), kept("date", field(t("survey-date"), text(spec.survey_date, v => { spec.survey_date = v; }, { type: "date" }))), field(t("datum"), text(spec.vertical_datum, v => { spec.vertical_datum = v; }))),
    coordinates(), surveys(), blocks(), design.part,
  );
  body.replaceChildren(make("div", { className: "setup" }, left, right));

  function coordinates() {
    const list = make("datalist", { id: "systems" }, ...PLANES.map((value, i) => make("option", { value }, `JGD2011 ${i + 1}`)), make("option", { value: "none" }));
    const input = text(spec.crs, v => { spec.crs = v; });
    input.setAttribute("list", "systems");
    const of = make("div", { className: "from-file" });
    site.hear("check", () => fromFile(of, input));
    fromFile(of, input);
    const axes = choice([["east-north", t("axes-en")], ["north-east", t("axes-ne")]], spec.axis_order);
    axes.addEventListener("change", () => { spec.axis_order = axes.value; site.change(); });
    return section(t("coordinates"), list, kept("crs", field(t("crs"), input, t("crs-hint"))), of, kept("axes", field(t("axes"), axes)));
  }
  // What the surveys say of themselves, and a way to believe them.
  function fromFile(of, input) {
    const said = [...new Set((site.check?.found?.surveys || []).map(s => s.crs).filter(Boolean))];
    const code = said.map(s => s.match(/EPSG:\d+/)?.[0]).find(Boolean);
    of.replaceChildren(...(site.check?.found?.surveys.length ? [said.length ? t("crs-file", { crs: said.join("; ") }) : t("crs-silent"), " "] : []));
    if (code && code !== spec.crs) of.append(button(t("crs-use"), () => { spec.crs = input.value = code; site.change(); fromFile(of, input); }));
  }

  function surveys() {
    const list = make("div"), add = make("select", { "aria-label": t("add-survey") }, make("option", { value: "" }, t("add-survey")));
    get("/api/files").then(all => all.filter(f => f.survey).forEach(f => add.append(make("option", { value: f.path }, f.path)))).catch(() => {});
    add.addEventListener("change", () => { spec.survey.push({ file: site.up + add.value, sensor: "uav", vertical_offset_m: 0 }); add.value = ""; site.change(); fill(); });
    const fill = () => {
      list.replaceChildren(...spec.survey.map((survey, i) => {
        const sensor = choice([["uav", t("sensor-uav")], ["mbes", t("sensor-mbes")], ["depth-camera", t("sensor-depth-camera")]], survey.sensor);
        sensor.addEventListener("change", () => { survey.sensor = sensor.value; site.change(); });
        const facts = make("small", { className: "facts" });
        const said = kept(`survey:${survey.file}`, make("div", { className: "said" }));
        said.say = lines => said.replaceChildren(...lines.map(l => make("p", { className: `complaint ${l.severity}` }, make("b", {}, t(l.severity)), ` ${l.text}`)));
        site.hear("check", () => { facts.textContent = factsOf(survey); });
        facts.textContent = factsOf(survey);
        return make("fieldset", { className: "survey" }, make("legend", {}, survey.file), facts, field(t("sensor"), sensor), field(t("offset"), numeric(survey.vertical_offset_m, v => { survey.vertical_offset_m = v; })), button(t("remove"), () => { spec.survey.splice(i, 1); site.change(); fill(); }), said);
      }));
      show();
    };
    fill();
    return section(t("surveys"), list, add, kept("surveys", emptyField()));
  }
  function factsOf(survey) {
    const name = survey.file.split("/").pop(), found = (site.check?.found?.surveys || []).find(s => s.file.split(/[\\/]/).pop() === name);
    return found ? t("survey-found", { points: number(found.points), density: number(found.density_per_m2), low: number(found.levels_m[0], 2), high: number(found.levels_m[2], 2) }) : "";
  }
  function emptyField() {
    const said = make("div", { className: "said" });
    said.say = lines => said.replaceChildren(...lines.map(l => make("p", { className: `complaint ${l.severity}` }, make("b", {}, t(l.severity)), ` ${l.text}`)));
    return said;
  }

  function blocks() {
    const list = make("div"), known = site.state.blocks;
    const fill = () => {
      list.replaceChildren(...(draft.catalog.block || []).map((block, i) => {
        const named = typeof block.shape === "string", facts = make("small", { className: "facts" });
        const tell = () => { facts.textContent = blockFacts(block); };
        const control = named || !block.mesh ? blockChoice(known, named ? block.shape : t("own-shape", { kind: block.shape?.kind, size: number(block.shape?.size, 3) })) : make("input", { type: "text", readOnly: true, value: t("own-mesh", { file: block.mesh }) });
        control.addEventListener("change", () => {
          if (!known.some(b => b.name === control.value)) return;
          // A name that followed the shape goes on following it.
          if (!block.name || block.name === block.shape || !named) block.name = control.value;
          block.shape = control.value;
          site.change(); fill(); show();
        });
        const seen = make("div", { className: "from-survey" });
        const look = () => { tell(); fromSurvey(seen, block, fill); };
        look();
        site.hear("check", look);
        return make("fieldset", {}, make("legend", {}, block.name), field(t("block"), control), ...height(block, tell), seen, field(t("density"), numeric(block.density_kg_m3 ?? 2300, v => { block.density_kg_m3 = v; tell(); })), facts, ...(draft.catalog.block.length > 1 ? [button(t("remove"), () => { draft.catalog.block.splice(i, 1); site.change(); fill(); show(); })] : []));
      }));
    };
    fill();
    const add = button(t("add-block"), () => { draft.catalog.block.push({ name: "tetrapod 5t", shape: "tetrapod 5t", density_kg_m3: 2300 }); site.change(); fill(); });
    return section(t("blocks"), list, add, make("p", { className: "soft" }, t("block-size")), kept("block", emptyField()));
  }
  const kindOf = block => typeof block.shape === "string" ? site.state.blocks.find(b => b.name === block.shape)?.kind : block.shape?.kind;
  const resize = (block, size_m) => { block.shape = { kind: kindOf(block), size: size_m }; };
  // Makers differ, and old blocks are none of the list: the height may be given.
  function height(block, tell) {
    const shape = shapeOf(block);
    if (!shape) return [];
    return [kept(`size:${block.name}`, field(t("block-height"), numeric(Number(shape.height_m.toFixed(3)), v => { if (v > 0) { resize(block, v); tell(); } })))];
  }
  // The size that the survey shows, where it is another, and a way to believe it.
  function fromSurvey(of, block, fill) {
    const size = (site.check?.found?.sizes || []).find(s => s.block === block.name), shape = shapeOf(block);
    const other = size && shape && Math.abs(size.fits_m / shape.height_m - 1) > 0.01;
    of.replaceChildren(...(other ? [t("size-seen", { size: number(size.fits_m, 2), n: number(size.found) }), " ", button(t("size-use"), () => { resize(block, Number(size.fits_m.toFixed(2))); site.change(); fill(); show(); })] : []));
  }
  function shapeOf(block) {
    if (typeof block.shape === "string") return site.state.blocks.find(b => b.name === block.shape);
    const like = block.shape && site.state.blocks.find(b => b.kind === block.shape.kind);
    return like && { height_m: block.shape.size, volume_m3: like.volume_m3 * (block.shape.size / like.height_m) ** 3 };
  }
  function blockFacts(block) {
    const shape = shapeOf(block), densest = Math.max(0, ...(site.check?.found?.surveys || []).map(s => s.density_per_m2));
    if (!shape) return "";
    const values = { height: number(shape.height_m, 2), volume: number(shape.volume_m3, 2), mass: number(shape.volume_m3 * (block.density_kg_m3 ?? 2300) / 1000, 2), points: number(densest * shape.height_m ** 2) };
    return t(densest ? "block-facts" : "block-facts-short", values);
  }

  // Map and section as the form has them now.
  function show() {
    const stated = (site.check?.found?.surveys || []).map(s => s.crs).find(c => spec.crs && c.startsWith(spec.crs));
    system.textContent = stated || spec.crs;
    if (!map.map) return;
    const line = design.line(), surface = designOnMap(map.map, spec.design || (spec.design_file && { kind: "file" }), line);
    const block = shapeOf((draft.catalog.block || [])[0] || {});
    Object.assign(map, { line: spec.design?.kind === "level" ? spec.design.boundary : line, closed: spec.design?.kind === "level", block_m: block?.height_m || 0 });
    const cut = cutAt(map.map, line, station.value / 1000);
    map.cut = cut.ends;
    map.paint(surface);
    profile.show(map, cut, levels(spec.design, line), map.block_m);
    where.textContent = t("chainage", { at: number(cut.at, 1) });
    station.hidden = line.length > 1 && !lengthOf(line);
    const below = surface && spaceBelow(map.map, surface);
    space.textContent = below && below.area ? t("void-estimate", { void: number(below.volume), area: number(below.area) }) : "";
  }

  function checked() {
    checking.textContent = site.checking ? t("checking") : "";
    if (site.checking || !site.check) return;
    const { found, errors } = site.check, sorted = complaintsOf(found, spec);
    for (const [key, boxes] of fields) boxes.forEach(b => b.isConnected && b.say?.(sorted.get(key) || []));
    const placed = new Set([...fields].filter(([, b]) => b.some(x => x.isConnected)).map(([key]) => key));
    const others = [...sorted].filter(([key]) => !placed.has(key)).flatMap(([, lines]) => lines).concat(errors.map(text_ => ({ severity: "refusal", text: text_ })));
    rest.replaceChildren(...others.map(l => make("p", { className: `complaint ${l.severity}` }, make("b", {}, t(l.severity)), ` ${l.text}`)));
    checking.textContent = found ? t(found.can_be_answered ? "check-ok" : "check-no") : "";
    if (site.check.map && site.check.map !== map.map) map.show(site.check.map);
    design.checked();
    show();
  }
  site.hear("check", checked);
  site.check ? checked() : site.look();
  return { close() { map.close(); profile.close(); } };
}
