// The list of sites, and a new one from surveys.

import { follow, get, post, upload } from "./api.js";
import { blockChoice, button, day, field, make, number, section, size } from "./parts.js";
import { t } from "./words.js";

export function home(main, state) {
  const list = make("div", { className: "cards" }, ...state.sites.map(siteCard));
  const none = make("p", {}, t("no-sites"));
  main.replaceChildren(
    make("p", { className: "soft" }, `${t("folder")} ${state.folder}`, state.free_bytes ? ` · ${t("free", { size: size(state.free_bytes) })}` : "", make("br"), t("nothing-leaves")),
    section(t("sites"), state.sites.length ? list : none),
    newSite(state),
  );
  return {};
}

export function answer(run) {
  const found = number(run.recognised?.recognised_blocks ?? NaN);
  if (!run.planned) return t("answer-inventory", { found });
  return t("answer-plan", { found, added: number(run.planned.blocks), mass: number(run.planned.mass_kg / 1000) });
}

function siteCard(site) {
  const run = site.runs.find(r => r.recognised) || site.runs[0];
  const said = !run ? t("never-run") : run.whole ? `${day(run.at_s)} · ${answer(run)}` : t("unfinished-run");
  const name = site.name || site.id, tab = run?.whole ? "results" : "setup";
  return make("a", { className: "card", href: `#/site/${encodeURIComponent(site.id)}/${tab}` }, make("b", {}, name), make("span", { className: "soft" }, site.id === name ? "" : site.id), make("span", {}, said));
}

// The folder's name is what a disk can hold; the site's is what was typed.
async function named(id, name) {
  const address = `/api/site/${encodeURIComponent(id)}`, { draft } = await get(address);
  draft.site.name = name;
  await post(address, draft);
}

function newSite(state) {
  const chosen = new Set(), list = make("div", { className: "files" }), progress = make("div", { role: "status" }), said = make("p", { role: "alert" });
  const name = make("input", { type: "text", maxLength: 64 }), block = blockChoice(state.blocks, "tetrapod 5t");
  const make_ = button(t("make-site"), start, { className: "strong" });
  const input = make("input", { type: "file", multiple: true, "aria-label": t("choose-files") });
  const zone = make("div", { className: "drop" }, make("b", {}, t("drop-here")), make("small", {}, t("drop-kinds")), input);
  input.addEventListener("change", () => take(input.files));
  zone.addEventListener("dragover", e => { e.preventDefault(); zone.classList.add("over"); });
  zone.addEventListener("dragleave", () => zone.classList.remove("over"));
  zone.addEventListener("drop", e => { e.preventDefault(); zone.classList.remove("over"); take(e.dataTransfer.files); });

  async function files() {
    const all = (await get("/api/files")).filter(f => f.survey);
    list.replaceChildren(...all.map(f => {
      const box = make("input", { type: "checkbox", checked: chosen.has(f.path), value: f.path });
      box.addEventListener("change", () => choose(f.path, box.checked));
      return make("label", {}, box, ` ${f.path} `, make("small", {}, size(f.bytes)));
    }), ...(all.length ? [] : [make("span", { className: "soft" }, t("no-files"))]));
  }
  function choose(path, is) {
    is ? chosen.add(path) : chosen.delete(path);
    if (is && !name.value) name.value = path.split("/").pop().replace(/\.[^.]+$/, "");
  }
  async function take(given) {
    for (const file of [...given]) {
      const cancel = {}, line = make("p"), bar = make("progress", { max: 1, value: 0 }), text = make("span");
      line.append(bar, " ", text, " ", button(t("cancel"), () => cancel.now()));
      progress.append(line);
      try {
        const path = await upload(file, share => { bar.value = share; text.textContent = t("uploading", { name: file.name, share: number(share * 100) }); }, cancel);
        line.replaceChildren(t("upload-done", { name: path }));
        choose(path, true);
      } catch (error) {
        line.replaceChildren(make("span", { className: "bad", role: "alert" }, `${file.name}: ${error.message}`));
      }
    }
    input.value = "";
    await files();
  }
  async function start() {
    said.textContent = t("making-site");
    make_.disabled = true;
    try {
      if (!name.value.trim()) throw new Error(t("needs-name"));
      const { id } = await post("/api/jobs", { kind: "init", files: [...chosen], block: block.value, name: name.value });
      const end = await follow(id, () => {});
      if (end.state !== "done") throw new Error(end.errors.join("\n") || t(`state-${end.state}`));
      await named(end.site, name.value.trim());
      location.hash = `#/site/${encodeURIComponent(end.site)}/setup`;
    } catch (error) {
      said.textContent = error.message;
    }
    make_.disabled = false;
  }
  files();
  const form = make("div", { className: "columns2" }, make("div", {}, zone, progress), make("div", {}, make("h3", {}, t("files-here")), list, field(t("site-name"), name), field(t("block"), block), make_, said));
  return section(t("new-site"), form);
}
