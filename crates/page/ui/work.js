// Check and run: the verdict, progress while it works, a way to stop, what came of it.

import { follow, get, post } from "./api.js";
import { complaintsOf } from "./complaints.js";
import { button, make, number, section, size, time } from "./parts.js";
import { t } from "./words.js";

export function runTab(body, site) {
  const verdict = make("div"), start = make("div", { className: "row" }), progress = make("div");
  body.replaceChildren(section(t("tab-run"), make("div", { className: "row" }, button(t("check-again"), () => site.look())), verdict, start), progress);
  let going = false;

  function judged() {
    if (site.checking) return verdict.replaceChildren(make("p", { role: "status" }, t("checking")));
    const { found, errors } = site.check || { errors: [] };
    const lines = [...complaintsOf(found, site.draft.site).values()].flat().sort((a, b) => order(a) - order(b)).concat(errors.map(text => ({ severity: "refusal", text })));
    const ok = found?.can_be_answered;
    verdict.replaceChildren(
      make("p", { className: ok ? "verdict good" : "verdict bad", role: "status" }, t(ok ? "check-ok" : "check-no")),
      ...(lines.length ? lines.map(l => make("p", { className: `complaint ${l.severity}` }, make("b", {}, t(l.severity)), ` ${l.text}`)) : [make("p", { className: "soft" }, t("no-complaints"))]),
      ...(found?.expected.points ? [make("p", { className: "soft" }, t("expected", { points: number(found.expected.points), time: time(found.expected.recognition_s + 5), memory: size(found.expected.memory_bytes) }))] : []),
    );
    offer(ok);
  }
  function offer(ok) {
    const unfinished = site.runs.some(r => !r.whole), whole = site.runs.some(r => r.whole);
    start.replaceChildren(button(t(unfinished ? "run-on" : whole ? "run-again" : "run-now"), begin, { className: "strong", disabled: going || !ok, id: "run" }));
  }
  async function begin() {
    going = true;
    offer(false);
    try {
      await site.save();
      const { id } = await post("/api/jobs", { kind: "run", site: site.id });
      await watch(id);
    } catch (error) {
      progress.replaceChildren(make("section", { role: "alert" }, error.message));
    }
    going = false;
    if (!site.alive) return;
    site.runs = (await get(site.address)).runs;
    judged();
  }
  async function watch(id) {
    going = true;
    const box = workBox(id, end => end.state === "done" ? make("a", { className: "button strong", href: `#/site/${encodeURIComponent(site.id)}/results` }, t("see-results")) : "");
    progress.replaceChildren(box.element);
    await follow(id, box.show, () => site.alive);
  }
  site.hear("check", judged);
  site.check ? judged() : site.look();
  // Begun before a reload, or in another window.
  const open = site.state.jobs.find(j => j.site === site.id && j.kind === "run" && ["waiting", "running"].includes(j.state));
  if (open) { offer(false); watch(open.id).then(async () => { going = false; if (site.alive) { site.runs = (await get(site.address)).runs; judged(); } }).catch(() => {}); }
  return {};
}

const order = line => ["refusal", "warning", "note"].indexOf(line.severity);

// A piece of work as it goes on.
export function workBox(id, after = () => "") {
  const element = make("section", { className: "work", "aria-live": "polite" });
  const stop = button(t("stop"), () => post(`/api/jobs/${id}/stop`, {}).catch(() => {}), { id: "stop" });
  let now = null;
  const clock = make("span", { className: "soft" }), tick = setInterval(() => { if (!element.isConnected && now) clearInterval(tick); if (now && !now.ended_ms) clock.textContent = t("elapsed", { time: time((Date.now() - now.started_ms) / 1000) }); }, 1000);
  const stages = make("div"), said = make("div"), head = make("div", { className: "row" }), state = make("b");
  head.append(state, clock, stop);
  element.append(head, stages, said);
  function show(snapshot) {
    now = snapshot;
    const over = !["waiting", "running"].includes(now.state);
    state.textContent = t(`state-${now.state}`);
    state.className = { done: "good", failed: "bad", died: "bad" }[now.state] || "";
    stop.hidden = over;
    if (over) { clearInterval(tick); clock.textContent = t("elapsed", { time: time((now.ended_ms - now.started_ms) / 1000) }); }
    // A stage that comes several times is one line: the latest.
    const latest = new Map(now.stages.map(s => [s.stage, s]));
    stages.replaceChildren(...[...latest.values()].map(s => make("div", { className: "stage" }, make("span", {}, s.finished ? "✓" : over ? "–" : "…"), make("span", {}, t(`stage-${s.stage}`)), make("progress", { max: 1, value: s.finished ? 1 : s.total ? Math.min(1, s.done / s.total) : 0.05, "aria-label": t(`stage-${s.stage}`) }), make("span", { className: "soft" }, s.total ? `${number(s.finished ? s.total : Math.min(s.done, s.total))} / ${number(s.total)}` : ""))));
    const lines = [];
    if (now.kept.length) lines.push(make("p", { className: "soft" }, t("kept-parts", { parts: now.kept.join(", ") })));
    if (!over && now.note) lines.push(make("p", { className: "soft" }, now.note));
    if (now.errors.length) lines.push(make("h3", {}, t("errors")), ...now.errors.map(e => make("p", { className: "bad" }, e)));
    if (now.warnings.length) lines.push(make("details", { open: now.warnings.length < 4 }, make("summary", {}, `${t("warnings")} (${now.warnings.length})`), ...now.warnings.map(w => make("p", {}, w))));
    if (over) lines.push(after(now));
    said.replaceChildren(...lines);
  }
  return { element, show };
}
