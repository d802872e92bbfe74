// One site: set up, check and run, results, what if. What the tabs share lives here: the draft, the check, the map.

import { follow, get, post } from "./api.js";
import { banner } from "./main.js";
import { button, make } from "./parts.js";
import { resultsTab } from "./results.js";
import { setupTab } from "./form.js";
import { variantsTab } from "./variants.js";
import { t } from "./words.js";
import { runTab } from "./work.js";

const TABS = { setup: setupTab, run: runTab, results: resultsTab, variants: variantsTab };
// The last check of each site outlives a change of tab.
const checks = new Map();

// Whether every number is one: a field that is being typed in may be empty.
const sound = value => typeof value === "number" ? Number.isFinite(value) : !value || typeof value !== "object" || Object.values(value).every(sound);

export class Site {
  constructor(id, state) {
    Object.assign(this, { id, state, alive: true, pending: null, saving: null, status: "" });
    this.address = `/api/site/${encodeURIComponent(id)}`;
    this.events = new EventTarget();
  }
  async load() {
    Object.assign(this, await get(this.address));
    this.check = checks.get(this.id) || null;
  }
  tell(what) { this.events.dispatchEvent(new Event(what)); }
  hear(what, act) { this.events.addEventListener(what, act); }
  // Keeps the draft a moment after the last change, in order.
  change() {
    this.status = "unsaved";
    this.tell("status");
    clearTimeout(this.pending);
    this.pending = setTimeout(() => this.save(), 700);
  }
  async save() {
    clearTimeout(this.pending);
    this.pending = null;
    while (this.saving) await this.saving;
    if (!sound(this.draft)) {
      Object.assign(this, { status: "failed", fault: t("needs-number") });
      this.tell("status");
      return false;
    }
    if (this.status !== "unsaved") return this.status === "saved" || this.status === "";
    this.status = "saving";
    this.tell("status");
    this.saving = post(this.address, this.draft).then(({ revision }) => {
      this.draft.revision = revision;
      if (this.status === "saving") this.status = "saved";
      this.fault = "";
    }, error => {
      this.status = "failed";
      this.fault = error.message;
      // The one refusal that loading again heals.
      if (/changed elsewhere/.test(error.message)) banner(t("changed-elsewhere"), button(t("reload"), () => location.reload()));
    });
    await this.saving;
    this.saving = null;
    this.tell("status");
    return this.status === "saved";
  }
  async look() {
    if (this.checking) return;
    this.checking = true;
    this.tell("check");
    try {
      if (this.status === "unsaved") await this.save();
      const { id } = await post("/api/jobs", { kind: "check", site: this.id });
      const end = await follow(id, () => {}, () => this.alive);
      if (!end) return;
      const found = end.results.check;
      const map = await get(`/api/jobs/${id}/map`).catch(() => this.check?.map);
      this.check = { found, map, errors: found ? [] : end.errors.length ? end.errors : [t(`state-${end.state}`)] };
      checks.set(this.id, this.check);
    } catch (error) {
      this.check = { found: null, map: this.check?.map, errors: [error.message] };
    } finally {
      this.checking = false;
      this.tell("check");
    }
  }
}

export async function sitePage(main, state, id, tab) {
  const site = new Site(id, state);
  await site.load();
  const name = site.draft?.site.name || id;
  document.title = `${name} · Tsumu`;
  const link = key => make("a", { href: `#/site/${encodeURIComponent(id)}/${key}`, ...(key === tab ? { "aria-current": "page" } : {}) }, t(`tab-${key}`));
  const body = make("div", { className: "tab" });
  const status = make("span", { className: "soft", role: "status" });
  site.hear("status", () => { status.textContent = site.status === "failed" ? site.fault : site.status ? t(site.status) : ""; status.classList.toggle("bad", site.status === "failed"); });
  main.replaceChildren(make("div", { className: "sitehead" }, make("h1", {}, name), make("nav", { className: "tabs", "aria-label": name }, ...Object.keys(TABS).map(link)), status), body);
  if (site.unreadable) {
    body.replaceChildren(make("section", { role: "alert" }, make("h2", {}, t("unreadable")), ...site.unreadable.map(line => make("p", {}, line))));
    return {};
  }
  const view = (TABS[tab] || setupTab)(body, site) || {};
  return {
    unsaved: () => ["unsaved", "saving"].includes(site.status),
    close() { if (site.status === "unsaved") site.save(); site.alive = false; view.close?.(); },
  };
}
