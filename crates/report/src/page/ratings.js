// What a foreman thinks of planned blocks, and which of two places he would choose. Kept in this browser until it is saved as
// ratings.json for the site folder.

import { posed } from "./camera.js";
import { byId, download, make, number, words } from "./words.js";

const GRADES = { good: ["good", "良い"], loose: ["loose", "不安定"], "sticks-out": ["sticks out", "突出"], "blocks-the-next": ["blocks the next", "次の据付を妨げる"], "cannot-be-reached": ["cannot be reached", "届かない"] };
const SIGNS = { above: ["height", "高さ"], raised: ["void below", "下の空隙"], protruding: ["above the design", "計画面超過"], loose: ["missing contacts", "接触不足"], wedged: ["wedged", "下敷き"], far: ["far from the crane", "クレーンから遠い"] };
const GHOST = [0.84, 0.37, 0];

export class Ratings {
  constructor(viewer, selection) {
    Object.assign(this, { viewer, selection, data: viewer.data, rating: viewer.data.rating, given: new Map(), chosen: new Map(), earlier: { blocks: [], pairs: [] }, block: null, at: 0, side: null });
    byId("ratings").hidden = !this.rating;
    if (!this.rating) return;
    const press = (id, act) => byId(id).addEventListener("click", act);
    byId("ratings-buttons").replaceChildren(...Object.keys(GRADES).map(grade => {
      const button = make("button", { type: "button", id: `rate-${grade}` });
      button.addEventListener("click", () => this.rate(grade));
      return button;
    }));
    press("pair-before", () => this.step(-1));
    press("pair-after", () => this.step(1));
    press("pair-show-a", () => this.look(0));
    press("pair-show-b", () => this.look(1));
    press("pair-a", () => this.choose("a"));
    press("pair-b", () => this.choose("b"));
    press("ratings-save", () => this.save());
    byId("ratings-open").addEventListener("change", e => this.open(e.target));
    byId("ratings-by").addEventListener("change", () => this.keep());
    selection.addEventListener("chosen", e => { const b = selection.block(e.detail.number); this.block = b?.kind === "added" ? b : null; this.show(); });
    document.addEventListener("language", () => this.show());
    window.addEventListener("beforeunload", e => { if (this.unsaved && !this.kept) e.preventDefault(); });
    if (this.rating.given) this.earlier = this.rating.given;
    this.restore();
    this.show();
  }
  rate(grade) {
    if (!this.block) return;
    this.given.get(this.block.order)?.rating === grade ? this.given.delete(this.block.order) : this.given.set(this.block.order, { rating: grade, when: new Date().toISOString() });
    this.changed();
  }
  step(by) {
    const n = this.rating.pairs.length;
    this.at = (this.at + by + n) % n;
    this.look(0);
  }
  // One of the two is shown in the 3D view; the second press hides it.
  look(side) {
    const pair = this.rating.pairs[this.at], again = this.side === side && this.viewer.ghost;
    this.side = again ? null : side;
    this.viewer.ghost = null;
    if (pair && !again) {
      const { model, pose } = pair[side];
      this.viewer.ghost = { model, pose, colour: GHOST, number: 0, opacity: 1 };
      this.viewer.near({ model, pose, centre: posed(pose, this.data.models[model].centre), number: 0 });
    }
    this.viewer.update();
    this.show();
  }
  choose(side) {
    this.chosen.get(this.at)?.better === side ? this.chosen.delete(this.at) : this.chosen.set(this.at, { better: side, when: new Date().toISOString() });
    this.changed();
  }
  changed() {
    this.unsaved = true;
    this.keep();
    this.show();
  }
  show() {
    const { pairs, weights } = this.rating, b = this.block, mine = b && this.given.get(b.order);
    byId("ratings-block").textContent = b ? words(`planned block ${b.order} is`, `据付ブロック ${b.order} は`) : words("choose a planned block", "据付ブロックを選択");
    for (const [grade, names] of Object.entries(GRADES)) {
      const button = byId(`rate-${grade}`);
      button.textContent = words(...names);
      button.disabled = !b;
      button.setAttribute("aria-pressed", mine?.rating === grade);
    }
    const pair = pairs[this.at], choice = this.chosen.get(this.at);
    byId("ratings-pair").textContent = pair ? words(`Which would you build? Pair ${this.at + 1} of ${pairs.length}`, `どちらに据え付けますか？ ${this.at + 1} / ${pairs.length}`) : "";
    for (const [id, text, pressed] of [["pair-show-a", words("show A", "A を表示"), this.side === 0], ["pair-show-b", words("show B", "B を表示"), this.side === 1], ["pair-a", words("A is better", "A が良い"), choice?.better === "a"], ["pair-b", words("B is better", "B が良い"), choice?.better === "b"]]) {
      byId(id).textContent = text;
      byId(id).setAttribute("aria-pressed", pressed);
      byId(id).hidden = !pair;
    }
    for (const id of ["pair-before", "pair-after"]) byId(id).hidden = pairs.length < 2;
    byId("pair-words").textContent = pair ? this.difference(pair) : "";
    const n = this.content();
    byId("ratings-count").textContent = words(`${number(n.blocks.length)} blocks rated, ${number(n.pairs.length)} pairs chosen`, `評価 ${number(n.blocks.length)}、選択 ${number(n.pairs.length)}`);
    byId("ratings-save").disabled = !(n.blocks.length + n.pairs.length);
    this.table(weights);
  }
  // In which signs the two differ most.
  difference([a, b]) {
    const by = this.rating.names.map((name, i) => [name, b.signs[i] - a.signs[i]]).filter(([, d]) => Math.abs(d) > 0.02).sort((x, y) => Math.abs(y[1]) - Math.abs(x[1])).slice(0, 3);
    return by.map(([name, d]) => words(`B ${d > 0 ? "more" : "less"} ${SIGNS[name][0]}`, `B は${SIGNS[name][1]}が${d > 0 ? "大" : "小"}`)).join(", ");
  }
  table(weights) {
    if (!weights.length) return;
    const cell = (tag, text) => make(tag, {}, text), head = make("tr", {});
    for (const text of [words("sign", "指標"), words("weight before", "従来の重み"), words("learned", "学習後"), "±", words("raised by", "増やした評価"), words("lowered by", "減らした評価")]) head.append(cell("th", text));
    const rows = weights.map(w => { const row = make("tr", {}); for (const text of [words(...SIGNS[w.sign]), number(w.today, 2), number(w.learned[0], 2), number(w.learned[1], 2), number(w.movedBy[0]), number(w.movedBy[1])]) row.append(cell("td", text)); return row; });
    const table = make("table", { className: "plain" });
    table.append(head, ...rows);
    byId("ratings-weights").replaceChildren(table);
  }
  place({ model, pose, signs }) {
    const [x_m, y_m, z_m] = pose.slice(4).map((v, i) => v + this.data.origin[i]);
    return { model: this.data.models[model].name, x_m, y_m, z_m, signs };
  }
  // Earlier ratings stay in the file; of the same person and place the later counts.
  content() {
    const by = byId("ratings-by").value, { pairs, signs } = this.rating;
    const blocks = this.data.added.map((b, i) => [b, signs[i]]).filter(([b, s]) => s && this.given.has(b.order)).map(([b, s]) => ({ by, when: this.given.get(b.order).when, order: b.order, rating: this.given.get(b.order).rating, place: this.place({ ...b, signs: s }) }));
    const chosen = [...this.chosen].filter(([i]) => pairs[i]).map(([i, c]) => ({ by, when: c.when, pair: i + 1, better: c.better, a: this.place(pairs[i][0]), b: this.place(pairs[i][1]) }));
    return { format: 1, site: this.rating.site, blocks: [...this.earlier.blocks, ...blocks], pairs: [...this.earlier.pairs, ...chosen] };
  }
  text() { return JSON.stringify(this.content(), null, 1) + "\n"; }
  save() {
    download("ratings.json", this.text(), "application/json");
    this.unsaved = false;
  }
  keep() {
    const mine = { by: byId("ratings-by").value, given: [...this.given], chosen: [...this.chosen] };
    try { localStorage.setItem(`tsumu ratings ${this.data.run}`, JSON.stringify(mine)); this.kept = true; } catch { this.kept = false; }
  }
  restore() {
    try {
      const mine = JSON.parse(localStorage.getItem(`tsumu ratings ${this.data.run}`));
      if (!mine) return;
      byId("ratings-by").value = mine.by;
      this.given = new Map(mine.given);
      this.chosen = new Map(mine.chosen);
      this.kept = true;
    } catch { this.kept = false; }
  }
  async open(input) {
    try {
      const file = JSON.parse(await input.files[0].text());
      if (file.format !== 1 || file.site !== this.rating.site) throw new Error(file.site ? `"${file.site}"` : `format ${file.format}`);
      this.earlier = { blocks: file.blocks || [], pairs: file.pairs || [] };
      this.show();
    } catch (error) {
      byId("ratings-count").textContent = words(`not ratings of this site: ${error.message}`, `この現場の評価ではありません: ${error.message}`);
    }
    input.value = "";
  }
}
