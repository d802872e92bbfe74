// The report: joins data, 3D view, plan, sections, tables and review.

import { loadData } from "./data.js";
import { hearFrame, tellFrame } from "./frame.js";
import { PlanView } from "./plan.js";
import { Ratings } from "./ratings.js";
import { Review } from "./review.js";
import { Sections, sectionLegend } from "./sections.js";
import { Selection } from "./selection.js";
import { tables } from "./tables.js";
import { tools } from "./tools.js";
import { Viewer } from "./viewer.js";
import { byId, number, words } from "./words.js";

function setLanguage(lang) {
  document.documentElement.dataset.lang = document.documentElement.lang = lang;
  document.querySelectorAll("[data-set-lang]").forEach(b => b.setAttribute("aria-pressed", b.dataset.setLang === lang));
  document.querySelectorAll("option[data-ja]").forEach(o => {
    o.dataset.en = o.dataset.en || o.textContent;
    o.textContent = o.dataset[lang];
  });
  document.dispatchEvent(new Event("language"));
}

// As the system has it, or as the reader chose.
function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  byId("theme").setAttribute("aria-pressed", theme === "dark");
  document.dispatchEvent(new Event("theme"));
}

function head() {
  document.querySelectorAll("[data-set-lang]").forEach(b => b.addEventListener("click", () => setLanguage(b.dataset.setLang)));
  setLanguage((navigator.language || "").startsWith("ja") ? "ja" : "en");
  setTheme(window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  byId("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
  document.querySelectorAll(".light").forEach(light => light.addEventListener("click", () => light.setAttribute("aria-expanded", light.getAttribute("aria-expanded") !== "true")));
}

function show(data) {
  const selection = new Selection(data), viewer = new Viewer(byId("canvas"), byId("overlay"), data, selection);
  const plan = new PlanView(byId("plan-canvas"), viewer, selection), sections = new Sections(viewer, selection, plan);
  const review = new Review(viewer, selection);
  const ratings = new Ratings(viewer, selection);
  tables(data, selection, review);
  tools(viewer, selection, plan, sections);
  document.addEventListener("language", sectionLegend);
  sectionLegend();
  document.addEventListener("theme", () => viewer.redraw());
  document.addEventListener("review", () => plan.stale());
  for (const [id, list] of [["found", data.found], ["placements", data.added], ["removed", data.removed], ["windows", data.windows]]) {
    byId(id).hidden = !list.length && id !== "found";
    byId(`${id}-count`).textContent = number(list.length);
  }
  // What a test or a page around this one may take hold of.
  window.tsumu = { data, selection, viewer, plan, sections, review, ratings };
  hearFrame(said => said.review && review.takeOver(said.review));
  // A printer takes the canvas as it is at that moment.
  window.addEventListener("beforeprint", () => { viewer.drawNow(); plan.render(); plan.draw(); sections.draw(); });
}

head();
hearFrame(({ look }) => {
  if (!look) return;
  document.querySelector(".language").hidden = true;
  setLanguage(look.language === "ja" ? "ja" : "en");
  setTheme(look.theme === "dark" ? "dark" : "light");
});
const state = byId("state");
state.textContent = words("Loading …", "読み込み中 …");
try {
  show(await loadData(byId("view-data").textContent, byId("view-blob").textContent));
  state.textContent = "";
  tellFrame({ ready: true });
  requestAnimationFrame(() => requestAnimationFrame(() => { document.documentElement.dataset.ready = "yes"; }));
} catch (error) {
  state.textContent = words(`The 3D view cannot be shown here: ${error.message}. The figures above are complete; tables are in the run folder.`, `3D 表示ができません: ${error.message}。上の数値は有効です。表は出力フォルダにあります。`);
  document.documentElement.dataset.ready = "failed";
  throw error;
}
