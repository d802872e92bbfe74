// Compare surveys: which results, in which order, and what came of it.

import { follow, get, path, post } from "./api.js";
import { button, choice, day, field, make, section } from "./parts.js";
import { downloads, reportFrame } from "./results.js";
import { t } from "./words.js";
import { workBox } from "./work.js";

export function comparePage(main, state) {
  const epochs = state.sites.flatMap(s => s.runs.filter(r => r.whole && r.recognised).map(r => ({ at: r.at_s, place: s.id === "~" ? r.name : `${s.id}/${r.name}`, text: `${s.name || s.id} · ${r.name} · ${day(r.at_s)}` }))).sort((a, b) => a.at - b.at);
  const lists = make("div"), progress = make("div"), said = make("p", { role: "alert" }), shown = make("div"), kept = make("div");
  const name = make("input", { type: "text", maxLength: 64 });
  let alive = true, frame = null;
  const chosen = [];
  const add = preset => {
    const list = choice(epochs.map(e => [e.place, e.text]), preset);
    chosen.push(list);
    lists.append(field(t("epoch", { n: chosen.length }), list));
  };
  const form = epochs.length < 2 ? [make("p", {}, t("needs-two-runs"))] : [lists, make("div", { className: "row" }, button(t("add-epoch"), () => add(epochs[epochs.length - 1].place))), field(t("comparison-name"), name), button(t("start-compare"), start, { className: "strong", id: "compare" }), said, progress];
  main.replaceChildren(section(t("compare"), make("p", { className: "soft" }, t("compare-intro")), ...form), section(t("comparisons"), kept), shown);
  if (epochs.length > 1) { add(epochs[epochs.length - 2].place); add(epochs[epochs.length - 1].place); name.value = `${chosen.map(c => c.value.split("/")[0]).join(" - ")}`; }
  async function start() {
    said.textContent = "";
    try {
      const { id } = await post("/api/jobs", { kind: "compare", epochs: chosen.map(c => c.value), name: name.value });
      const box = workBox(id);
      progress.replaceChildren(box.element);
      const end = await follow(id, box.show, () => alive);
      if (end?.state === "done" && alive) { fill((await get("/api/state")).comparisons); view(end.out); }
    } catch (error) {
      said.textContent = error.message;
    }
  }
  function fill(list) {
    kept.replaceChildren(...(list.length ? list.map(c => make("p", {}, button(c.place.split("/").pop(), () => view(c.place)))) : [make("p", { className: "soft" }, t("no-comparisons"))]));
  }
  function view(place) {
    frame?.close();
    frame = reportFrame(`/view/${path(place)}/report.html`, null, said);
    shown.replaceChildren(frame.element, section(t("downloads"), downloads(place)));
    shown.scrollIntoView();
  }
  fill(state.comparisons);
  return { close() { alive = false; frame?.close(); } };
}
