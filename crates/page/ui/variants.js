// What if: plans side by side on the same blocks.

import { follow, get, path, post } from "./api.js";
import { blockChoice, button, field, make, number, section } from "./parts.js";
import { t } from "./words.js";
import { workBox } from "./work.js";

const NUMBERS = [["crest_level_m", "crest-level"], ["crest_width_m", "crest-width"], ["minimum_volume_m3", "v"], ["overflow_m", "f"]];

export function variantsTab(body, site) {
  const base = site.runs.find(r => r.whole && r.planned && r.recognised), spec = site.draft.site;
  if (!base) return body.replaceChildren(section(t("tab-variants"), make("p", {}, t("no-results"))));
  const kind = spec.design?.kind, inputs = new Map();
  for (const [key, name] of NUMBERS) {
    if (key === "crest_level_m" && !["section", "level"].includes(kind)) continue;
    if (key === "crest_width_m" && kind !== "section") continue;
    const input = make("input", { type: "text", inputMode: "decimal", className: "number", placeholder: String(now(key) ?? t("as-now")) });
    inputs.set(key, { input, box: field(t(key === "crest_level_m" && kind === "level" ? "level" : name), input) });
  }
  const block = blockChoice(site.state.blocks, "", [["", t("as-now")]]), blockBox = field(t("block-to-place"), block);
  const table = make("div", { className: "scroll" }), progress = make("div"), said = make("p", { role: "alert" });
  body.replaceChildren(section(t("tab-variants"), make("p", { className: "soft" }, t("what-if-intro")), make("div", { className: "numbers" }, ...[...inputs.values()].map(i => i.box), blockBox), make("div", { className: "row" }, button(t("add-plan"), plan, { className: "strong", id: "plan" })), said, progress, table));

  function now(key) {
    if (key === "crest_level_m") return spec.design?.crest_level_m ?? spec.design?.level_m;
    return key === "crest_width_m" ? spec.design?.crest_width_m : spec.plan?.[key];
  }
  async function plan() {
    const variant = {};
    let wrong = false;
    for (const [key, { input, box }] of inputs) {
      const text = input.value.trim().replace(",", ".");
      const bad = text !== "" && !Number.isFinite(Number(text));
      box.say(bad ? [{ severity: "refusal", text: t("needs-number") }] : []);
      wrong ||= bad;
      if (text !== "" && !bad) variant[key] = Number(text);
    }
    if (block.value) variant.block = block.value;
    said.textContent = Object.keys(variant).length ? "" : t("nothing-changed");
    if (wrong || said.textContent) return;
    try {
      block.value = "";
      inputs.forEach(({ input }) => { input.value = ""; });
      const { id } = await post("/api/jobs", { kind: "what-if", site: site.id, variant });
      const box = workBox(id);
      progress.append(box.element);
      const end = await follow(id, box.show, () => site.alive);
      if (end?.state === "done") box.element.remove();
      if (site.alive) { site.variants = (await get(site.address)).variants; fill(); }
    } catch (error) {
      said.textContent = error.message;
    }
  }
  function changes(of) {
    const value = (s, key) => key === "crest_level_m" ? s.design?.crest_level_m ?? s.design?.level_m : key === "crest_width_m" ? s.design?.crest_width_m : s.plan?.[key];
    const list = NUMBERS.filter(([key]) => value(of, key) !== undefined && value(of, key) !== value(spec, key)).map(([key, name]) => `${t(name)} ${value(of, key)}`);
    if (of.plan?.block && of.plan.block !== spec.plan?.block) list.push(of.plan.block);
    return list.join(", ");
  }
  function row(name, changed, plan, files, act = "") {
    if (!plan) return make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, changed), make("td", { colSpan: 8, className: "soft" }, t("not-planned")));
    const filled = 100 * (1 - plan.void_after_m3 / plan.void_before_m3);
    const cells = [number(plan.blocks), number(plan.mass_kg / 1000, 1), number(plan.concrete_m3, 1), number(plan.void_after_m3, 1), number(filled), number(plan.protruding), number(plan.mean_distance_m, 2)];
    return make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, changed), ...cells.map(c => make("td", { className: "figure-cell" }, c)), make("td", {}, make("a", { href: `/download/${path(files)}/plan/placements.csv` }, "placements.csv")), make("td", {}, act));
  }
  function fill() {
    const heads = ["plan", "change", "blocks", "mass", "concrete", "void", "filled", "high", "distance", "files"].map(k => make("th", { scope: "col" }, t(`col-${k}`)));
    const at = name => [site.place, name].filter(Boolean).join("/");
    const rows = site.variants.map(v => row(String(v.number), changes(v.site), v.planned, at(`what-if/${v.number}/run`), button(t("take-over"), () => take(v.site))));
    table.replaceChildren(make("table", { className: "plain side" }, make("thead", {}, make("tr", {}, ...heads, make("th"))), make("tbody", {}, row(t("base-plan"), base.name, base.planned, at(base.name)), ...rows)));
  }
  async function take(of) {
    if (spec.design && of.design?.kind === spec.design.kind) for (const key of ["crest_level_m", "crest_width_m", "level_m"]) if (of.design[key] !== undefined) spec.design[key] = of.design[key];
    spec.plan = { ...(spec.plan || {}) };
    for (const key of ["minimum_volume_m3", "overflow_m", "block"]) if (of.plan?.[key] !== undefined) spec.plan[key] = of.plan[key];
    const name = of.plan?.block, list = site.draft.catalog.block;
    if (name && !list.some(b => b.name === name)) list.push({ name, shape: name });
    site.change();
    said.textContent = await site.save() ? t("taken-over") : site.fault;
    fill();
  }
  fill();
  return {};
}
