// The page: which view is shown, in which language and colours.

import { get, onLost } from "./api.js";
import { comparePage } from "./compare.js";
import { home } from "./home.js";
import { make } from "./parts.js";
import { sitePage } from "./site.js";
import { t } from "./words.js";

const root = document.documentElement, main = document.getElementById("main");
let current = { leave: () => true };

const kept = {
  read(name) { try { return localStorage.getItem(`tsumu ${name}`); } catch { return null; } },
  write(name, value) { try { localStorage.setItem(`tsumu ${name}`, value); } catch { /* not kept */ } },
};

function setLanguage(lang) {
  root.lang = root.dataset.lang = lang;
  for (const b of document.querySelectorAll("[data-lang-choice]")) b.setAttribute("aria-pressed", b.dataset.langChoice === lang);
}

function setTheme(theme) {
  root.dataset.theme = theme;
  document.getElementById("theme").setAttribute("aria-pressed", theme === "dark");
  document.dispatchEvent(new Event("theme"));
}

function navigation(place) {
  const link = (to, text) => make("a", { href: to, ...(place === to ? { "aria-current": "page" } : {}) }, text);
  document.getElementById("nav").replaceChildren(make("b", {}, "Tsumu"), link("#/", t("sites")), link("#/compare", t("compare")));
}

export function banner(text, act) {
  const box = document.getElementById("banner");
  box.hidden = !text;
  box.replaceChildren(text, ...(act ? [act] : []));
}

// `#/`, `#/compare`, `#/site/NAME/TAB`
async function show() {
  const [, what, name, tab] = location.hash.split("/");
  current.close?.();
  current = {};
  navigation(what === "compare" ? "#/compare" : "#/");
  banner("");
  try {
    const state = await get("/api/state");
    document.title = "Tsumu";
    if (what === "site") current = await sitePage(main, state, decodeURIComponent(name), tab || "setup");
    else if (what === "compare") current = comparePage(main, state);
    else current = home(main, state);
  } catch (error) {
    main.replaceChildren(make("section", { role: "alert" }, error.message));
  }
  root.dataset.ready = location.hash || "#/";
}

document.querySelectorAll("[data-lang-choice]").forEach(b => b.addEventListener("click", () => {
  setLanguage(b.dataset.langChoice);
  kept.write("language", b.dataset.langChoice);
  show();
}));
document.getElementById("theme").addEventListener("click", () => {
  setTheme(root.dataset.theme === "dark" ? "light" : "dark");
  kept.write("theme", root.dataset.theme);
});
onLost(is => { if (is) banner(t("lost")); else if (document.getElementById("banner").textContent === t("lost")) banner(""); });
setLanguage(kept.read("language") || (navigator.language.startsWith("ja") ? "ja" : "en"));
setTheme(kept.read("theme") || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
addEventListener("hashchange", show);
addEventListener("beforeunload", e => { if (current.unsaved?.()) e.preventDefault(); });
show();
