// The reviewer's queue: blocks in order of doubt, one at a time. Recognised blocks are accepted, rejected or corrected,
// planned ones struck out or locked. Kept in this browser until it is saved as review.json for the next run.

import { posed } from "./camera.js";
import { tellFrame } from "./frame.js";
import { byId, download, make, number, scaled, words } from "./words.js";

const VERDICTS = { accepted: ["✓ accepted", "✓ 採用"], rejected: ["✗ rejected", "✗ 却下"], corrected: ["✎ corrected", "✎ 修正"], struck: ["✗ struck out", "✗ 取消"], locked: ["⚿ locked", "⚿ 固定"] };

export class Review {
  constructor(viewer, selection) {
    Object.assign(this, { viewer, selection, data: viewer.data, decisions: new Map(), elsewhere: [], block: null, active: false });
    this.planned = viewer.verdicts.planned;
    this.queue = this.data.found.map(b => b).sort((a, b) => doubt(b) - doubt(a));
    byId("review").hidden = !this.data.found.length && !this.data.added.length;
    byId("review-model").replaceChildren(...this.data.models.map((m, i) => new Option(m.name, i)));
    selection.addEventListener("chosen", e => this.choose(e.detail.number));
    const press = (id, act) => byId(id).addEventListener("click", act);
    press("review-start", () => this.active ? this.leave() : this.start());
    press("review-next", () => this.step(1));
    press("review-previous", () => this.step(-1));
    press("review-accept", () => this.decide(this.block.kind === "found" ? "accepted" : "locked"));
    press("review-reject", () => this.decide(this.block.kind === "found" ? "rejected" : "struck"));
    press("review-clear", () => this.decide(null));
    press("review-save", () => this.save());
    byId("review-model").addEventListener("change", () => this.decide("corrected"));
    byId("review-note").addEventListener("change", () => this.decide(this.verdict()?.verdict || "accepted"));
    byId("review-by").addEventListener("change", () => this.keep());
    byId("review-open").addEventListener("change", e => this.open(e.target));
    document.addEventListener("keydown", e => this.key(e));
    document.addEventListener("language", () => this.show());
    window.addEventListener("beforeunload", e => { if (this.unsaved && !this.kept) e.preventDefault(); });
    if (this.data.review) this.adopt(this.data.review);
    this.restore();
    this.choose(0);
  }
  start() {
    this.active = true;
    this.before = { added: this.viewer.state.showAdded, mode: this.viewer.state.pointMode, points: this.viewer.state.showPoints, design: this.viewer.state.showDesign };
    byId("review").classList.add("active");
    const first = this.queue.find(b => !this.decisions.has(b.id)) || this.queue[0];
    if (first) this.selection.choose(first.number, this);
    byId("stage").scrollIntoView({ block: "center" });
    this.viewer.canvas.focus({ preventScroll: true });
  }
  leave() {
    this.active = false;
    byId("review").classList.remove("active");
    Object.assign(this.viewer.state, { fade: null, onlyPoints: 0, showAdded: this.before.added, pointMode: this.before.mode, showPoints: this.before.points, showDesign: this.before.design });
    this.viewer.update();
    this.show();
    document.dispatchEvent(new Event("review"));
  }
  // The plan is hidden, neighbours are faded, and only this block's points remain, coloured by their distance to it.
  isolate() {
    const s = this.viewer.state, found = this.block?.kind === "found";
    Object.assign(s, { fade: this.block ? this.block.number : null, onlyPoints: found ? this.block.number : 0, showAdded: !found, showDesign: false, showPoints: found || this.before.points, pointMode: found && this.data.points.fit ? 4 : this.before.mode });
    if (this.block) this.viewer.near(this.block);
    this.viewer.update();
  }
  step(by) {
    const list = this.block?.kind === "added" ? this.data.added : this.queue, now = list.findIndex(b => b === this.block);
    const next = list[Math.min(list.length - 1, Math.max(0, now + by))];
    if (next) this.selection.choose(next.number, this);
  }
  key(e) {
    if (/^(INPUT|SELECT|TEXTAREA)$/.test(e.target.tagName) || e.ctrlKey || e.metaKey || e.altKey) return;
    const found = this.block?.kind === "found", acts = { a: found && "accepted", x: found ? "rejected" : "struck", l: !found && "locked", u: null };
    if (this.active && (e.key === "n" || e.key === "j")) return this.step(1);
    if (this.active && (e.key === "p" || e.key === "k")) return this.step(-1);
    if (this.active && e.key === "Escape") return this.leave();
    if (!this.block || !(e.key in acts) || acts[e.key] === false) return;
    this.decide(acts[e.key]);
    if (this.active && found && e.key !== "u") this.step(1);
  }
  verdict(block = this.block) {
    if (!block || block.kind === "place") return null;
    if (block.kind === "found") return this.decisions.get(block.id);
    const verdict = this.planned.get(block.order);
    return verdict && { verdict, model: block.model, note: "" };
  }
  choose(number) {
    this.block = this.selection.block(number);
    const given = this.verdict(), found = this.block?.kind === "found";
    byId("review-model").value = given ? given.model : this.block ? this.block.model : 0;
    byId("review-note").value = given ? given.note : "";
    for (const id of ["review-accept", "review-reject", "review-clear"]) byId(id).disabled = !this.block;
    for (const id of ["review-model", "review-note"]) byId(id).disabled = !found;
    if (this.active && this.block) this.isolate();
    this.show();
  }
  decide(verdict) {
    const b = this.block, model = Number(byId("review-model").value);
    if (!b) return;
    if (b.kind === "added") verdict ? this.planned.set(b.order, verdict) : this.planned.delete(b.order);
    else if (verdict === null) this.decisions.delete(b.id);
    else this.decisions.set(b.id, { verdict: verdict === "accepted" && model !== b.model ? "corrected" : verdict, model, note: byId("review-note").value });
    this.unsaved = true;
    this.keep();
    if (b.kind === "added") this.viewer.update();
    this.show();
    document.dispatchEvent(new Event("review"));
  }
  word(block) { const given = this.verdict(block); return given ? words(...VERDICTS[given.verdict]) : ""; }
  show() {
    const b = this.block, found = b?.kind === "found", planned = b?.kind === "added", given = this.verdict();
    const names = planned ? [words("Lock", "固定"), words("Strike out", "取消線")] : [words("Accept", "採用"), words("Reject", "却下")];
    byId("review-accept").replaceChildren(names[0], make("kbd", {}, planned ? "L" : "A"));
    byId("review-reject").replaceChildren(names[1], make("kbd", {}, "X"));
    byId("review-accept").setAttribute("aria-pressed", given?.verdict === "accepted" || given?.verdict === "locked");
    byId("review-reject").setAttribute("aria-pressed", given?.verdict === "rejected" || given?.verdict === "struck");
    byId("review-start").textContent = this.active ? words("Leave review", "確認を終了") : words("Review in order of doubt", "疑わしい順に確認");
    byId("review-start").setAttribute("aria-pressed", this.active);
    const done = this.queue.filter(q => this.decisions.has(q.id)).length, at = found ? this.queue.indexOf(b) + 1 : 0;
    byId("review-place").textContent = found ? words(`${number(at)} of ${number(this.queue.length)} by doubt`, `疑わしい順 ${number(at)} / ${number(this.queue.length)}`) : planned ? words(`placement ${b.order}`, `据付 ${b.order}`) : words("no block chosen", "ブロック未選択");
    byId("review-why").textContent = found ? why(b) : planned ? words("A struck-out block is left out of the next plan; a locked one is kept.", "取消したブロックは次の計画から除かれ、固定したものは残ります。") : "";
    byId("review-progress").max = Math.max(1, this.queue.length);
    byId("review-progress").value = done;
    const more = this.elsewhere.length + this.planned.size;
    byId("review-count").textContent = words(`${number(done)} of ${number(this.queue.length)} reviewed`, `${number(this.queue.length)} 中 ${number(done)} 確認済`) + (this.planned.size ? words(`, ${this.planned.size} of the plan`, `、計画 ${this.planned.size}`) : "") + (this.elsewhere.length ? words(`, ${this.elsewhere.length} not shown here`, `、表示外 ${this.elsewhere.length}`) : "");
    byId("review-save").disabled = !(this.decisions.size + more);
  }
  // What is written for one block: place and pose as blocks.csv and placements.csv have them.
  entry(b) {
    const [qx, qy, qz, qw, x, y, z] = b.pose, [x_m, y_m, z_m] = [x, y, z].map((v, i) => v + this.data.origin[i]);
    return { x_m, y_m, z_m, qw, qx, qy, qz };
  }
  content() {
    const blocks = this.data.found.filter(b => this.decisions.has(b.id)).map(b => {
      const { verdict, model, note } = this.decisions.get(b.id);
      return { block_id: b.id, verdict, model: this.data.models[model].name, ...this.entry(b), fitness_m: b.fitness_m, occlusion: b.occlusion, note };
    });
    const placements = this.data.added.filter(b => this.planned.has(b.order)).map(b => ({ order: b.order, verdict: this.planned.get(b.order), model: this.data.models[b.model].name, ...this.entry(b) }));
    const review = { format: 1, reviewer: byId("review-by").value, blocks: [...blocks, ...this.elsewhere] };
    if (placements.length) review.placements = placements;
    return review;
  }
  text() { return JSON.stringify(this.content(), null, 1) + "\n"; }
  save() {
    download("review.json", this.text(), "application/json");
    this.unsaved = false;
  }
  // This browser remembers the review of this very run.
  keep() {
    tellFrame({ review: this.text() });
    try { localStorage.setItem(`tsumu review ${this.data.run}`, this.text()); this.kept = true; } catch { this.kept = false; }
  }
  restore() {
    try {
      const kept = localStorage.getItem(`tsumu review ${this.data.run}`);
      if (!kept) return;
      this.clear();
      this.adopt(JSON.parse(kept));
      this.kept = true;
    } catch { this.kept = false; }
  }
  // What a page around this one has kept is the latest, unless something was decided here already.
  takeOver(review) {
    if (!review || review.format !== 1 || !Array.isArray(review.blocks) || this.unsaved) return;
    this.clear();
    this.adopt(review);
    this.choose(this.selection.chosen);
    document.dispatchEvent(new Event("review"));
  }
  clear() { this.decisions.clear(); this.planned.clear(); this.elsewhere = []; }
  // Takes over the decisions of a file or of the run itself. Numbers change from run to run: a block is known by its place.
  adopt(review) {
    const { data } = this;
    byId("review-by").value = review.reviewer || "";
    const nearest = (list, b) => {
      const model = data.models.findIndex(m => m.name === b.model);
      if (model < 0) return null;
      const place = [b.x_m, b.y_m, b.z_m].map((v, i) => v - data.origin[i]), at = posed([b.qx, b.qy, b.qz, b.qw, ...place], data.models[model].centre), far = f => Math.hypot(...f.centre.map((v, i) => v - at[i]));
      const best = list.reduce((a, f) => !a || far(f) < far(a) ? f : a, null);
      return best && far(best) < 0.4 * data.models[model].radius ? { block: best, model } : null;
    };
    for (const b of review.blocks) {
      const here = nearest(data.found, b);
      if (here) this.decisions.set(here.block.id, { verdict: b.verdict, model: here.model, note: b.note || "" });
      else this.elsewhere.push(b);
    }
    for (const b of review.placements || []) {
      const here = nearest(data.added, b);
      if (here) this.planned.set(here.block.order, b.verdict);
    }
    this.viewer.update();
  }
  async open(input) {
    try {
      const review = JSON.parse(await input.files[0].text());
      if (review.format !== 1) throw new Error(`format ${review.format}`);
      this.clear();
      this.adopt(review);
      this.keep();
      this.choose(this.selection.chosen);
      document.dispatchEvent(new Event("review"));
    } catch (error) {
      byId("review-count").textContent = words(`not a review: ${error.message}`, `読み込めません: ${error.message}`);
    }
    input.value = "";
  }
}

// Not judged first, then the least sure; among equals the more hidden.
export const doubt = b => (b.judged ? 0 : 2) + (b.typeJudged ? 0 : 0.5) + (1 - (b.confidence ?? 0.5)) + (b.occlusion ?? 0.5) * 0.05;

function why(b) {
  const said = [`${words("confidence", "信頼度")} ${number(scaled(b.confidence, 1), 2)}`, `${words("fitting error", "当てはめ誤差")} ${number(scaled(b.fitness_m, 1000))} mm`, `${words("hidden", "隠れ")} ${number(scaled(b.occlusion, 100))} %`];
  if (!b.judged) said.unshift(words("not judged", "判定不能"));
  if (!b.typeJudged) said.push(words("type open", "種類未定"));
  if (b.legs && b.legs[2]) said.push(words(`${b.legs[2]} of ${b.legs[0] + b.legs[1] + b.legs[2]} legs missing`, `脚の欠損 ${b.legs[2]}/${b.legs[0] + b.legs[1] + b.legs[2]}`));
  return said.join(" · ");
}
