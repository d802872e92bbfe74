// A table of any length: only the rows in sight are in the page. Search, filters, choice of columns, sorting, CSV.
//
// A column: {key, head: {en, ja}, unit, value(row) -> number or text, digits, wide, hidden}.

import { byId, csv, download, make, number, said, words } from "./words.js";

const ROW = 30; // pixels, as in style.css
const MORE = 6; // rows above and below what is in sight

export class Table {
  // filters: [{head, options: [{head, keep(row)}]}]; number(row) links a row to a block; marks(row) -> class names.
  constructor(place, { name, columns, rows, filters = [], selection = null, of = null, marks = null, empty = null }) {
    Object.assign(this, { place, name, columns, rows, filters, selection, of, marks, empty, sorted: null, words: "", picked: filters.map(() => 0) });
    this.columns.forEach(c => { c.shown = !c.hidden; });
    this.build();
    this.language = () => { this.build(); this.refresh(); };
    document.addEventListener("language", this.language);
    selection?.addEventListener("chosen", e => this.chosen(e.detail));
    selection?.addEventListener("pointed", e => this.pointed(e.detail));
    this.refresh();
  }
  build() {
    this.search = make("input", { type: "search", value: this.words, placeholder: words("Search …", "検索 …"), "aria-label": words("Search the table", "表を検索") });
    this.search.addEventListener("input", () => { this.words = this.search.value; this.refresh(); });
    const filters = this.filters.map((filter, k) => {
      const select = make("select", { "aria-label": said(filter.head) }, ...filter.options.map((o, i) => new Option(said(o.head), i)));
      select.value = this.picked[k];
      select.addEventListener("change", () => { this.picked[k] = Number(select.value); this.refresh(); });
      return select;
    });
    const boxes = this.columns.map(c => {
      const box = make("input", { type: "checkbox", checked: c.shown });
      box.addEventListener("change", () => { c.shown = box.checked; this.layout(); this.draw(true); });
      return make("label", {}, box, " ", said(c.head));
    });
    const choice = make("details", { className: "columns" }, make("summary", {}, words("Columns", "列")), make("div", {}, ...boxes));
    const save = make("button", { type: "button" }, "CSV");
    save.addEventListener("click", () => download(`${this.name}.csv`, this.csv(), "text/csv"));
    this.count = make("output", { className: "soft" });
    this.head = make("div", { className: "vhead", role: "row" });
    this.body = make("div", { className: "vbody" });
    this.box = make("div", { className: "vtable", tabIndex: 0, role: "table", "aria-label": this.name }, this.head, this.body);
    this.box.addEventListener("scroll", () => this.draw());
    this.box.addEventListener("keydown", e => this.key(e));
    this.body.addEventListener("click", e => this.click(e));
    this.body.addEventListener("pointerover", e => { const row = e.target.closest(".vrow"); if (row && this.of) this.selection?.point(this.of(this.list[row.dataset.at]), this); });
    this.body.addEventListener("pointerleave", () => this.selection?.point(0, this));
    this.place.replaceChildren(make("div", { className: "tools" }, this.search, ...filters, choice, save, this.count), this.box);
    this.layout();
    new ResizeObserver(() => this.draw(true)).observe(this.box);
  }
  layout() {
    const shown = this.columns.filter(c => c.shown);
    this.grid = shown.map(c => `minmax(${c.wide || 84}px, ${c.grow || 1}fr)`).join(" ");
    this.box.style.setProperty("--columns", this.grid);
    this.box.style.setProperty("--wide", `${shown.reduce((sum, c) => sum + (c.wide || 84), 0)}px`);
    this.head.replaceChildren(...shown.map(c => {
      const button = make("button", { type: "button" }, said(c.head), c.unit ? make("small", {}, ` ${c.unit}`) : "");
      button.addEventListener("click", () => { this.sorted = this.sorted?.column === c && this.sorted.up ? { column: c, up: false } : { column: c, up: true }; this.layout(); this.refresh(); });
      const cell = make("div", { role: "columnheader", className: c.text ? "text" : "" }, button);
      if (this.sorted?.column === c) cell.setAttribute("aria-sort", this.sorted.up ? "ascending" : "descending");
      return cell;
    }));
  }
  text(column, row) {
    const v = column.value(row);
    return typeof v === "number" ? number(v, column.digits || 0) : v ?? "";
  }
  refresh() {
    const wanted = this.words.trim().toLowerCase(), keeps = this.filters.map((f, k) => f.options[this.picked[k]].keep).filter(Boolean);
    this.list = this.rows.filter(row => keeps.every(keep => keep(row)) && (!wanted || this.columns.some(c => String(this.text(c, row)).toLowerCase().includes(wanted))));
    if (this.sorted) {
      const { column, up } = this.sorted, sign = up ? 1 : -1;
      this.list.sort((a, b) => { const [u, v] = [column.value(a), column.value(b)]; return sign * (typeof u === "number" && typeof v === "number" ? (Number.isNaN(u) ? 1 : Number.isNaN(v) ? -1 : u - v) : String(u).localeCompare(String(v))); });
    }
    this.count.textContent = this.list.length === this.rows.length ? number(this.rows.length) : words(`${number(this.list.length)} of ${number(this.rows.length)}`, `${number(this.rows.length)} 件中 ${number(this.list.length)}`);
    this.body.style.height = `${Math.max(1, this.list.length) * ROW}px`;
    this.draw(true);
  }
  draw(anew = false) {
    const first = Math.max(0, Math.floor(this.box.scrollTop / ROW) - MORE), last = Math.min(this.list.length, Math.ceil((this.box.scrollTop + this.box.clientHeight) / ROW) + MORE);
    if (!anew && first === this.first && last === this.last) return;
    Object.assign(this, { first, last });
    const shown = this.columns.filter(c => c.shown), rows = [];
    for (let i = first; i < last; i++) {
      const row = this.list[i], line = make("div", { className: "vrow", role: "row" }, ...shown.map(c => make("div", { role: "cell", className: c.text ? "text" : "" }, this.text(c, row))));
      line.dataset.at = i;
      line.style.top = `${i * ROW}px`;
      const block = this.of ? this.of(row) : 0;
      if (block) line.dataset.number = block;
      line.classList.toggle("chosen", Boolean(block) && block === this.selection?.chosen);
      line.classList.toggle("pointed", Boolean(block) && block === this.selection?.pointed);
      if (this.marks) line.classList.add(...this.marks(row));
      rows.push(line);
    }
    if (!rows.length) rows.push(make("p", { className: "soft empty" }, this.rows.length ? words("Nothing matches.", "該当なし") : this.empty ? said(this.empty) : words("None.", "なし")));
    this.body.replaceChildren(...rows);
  }
  click(event) {
    const row = event.target.closest(".vrow");
    if (row && this.of) this.selection?.choose(this.of(this.list[row.dataset.at]), this);
  }
  key(event) {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step || !this.of || !this.list.length) return;
    event.preventDefault();
    const now = this.list.findIndex(r => this.of(r) === this.selection.chosen), next = Math.min(this.list.length - 1, Math.max(0, now < 0 ? 0 : now + step));
    this.selection.choose(this.of(this.list[next]), this);
    this.into(next);
  }
  into(i) {
    const top = i * ROW, { scrollTop, clientHeight } = this.box;
    if (top < scrollTop || top + 2 * ROW > scrollTop + clientHeight) this.box.scrollTop = top - clientHeight / 2;
  }
  chosen({ number, from }) {
    const i = number && this.of ? this.list.findIndex(r => this.of(r) === number) : -1;
    if (i >= 0 && from !== this) this.into(i);
    this.draw(true);
  }
  pointed({ number }) {
    this.body.querySelectorAll(".pointed").forEach(r => r.classList.remove("pointed"));
    if (number) this.body.querySelector(`[data-number="${number}"]`)?.classList.add("pointed");
  }
  // The rows as they are filtered and sorted, all columns, plain numbers.
  csv() {
    const head = this.columns.map(c => said(c.head) + (c.unit ? ` (${c.unit})` : ""));
    const value = (c, row) => { const v = c.value(row); return typeof v === "number" && c.digits !== undefined && Number.isFinite(v) ? Number(v.toFixed(c.digits)) : v ?? ""; };
    return csv([head, ...this.list.map(row => this.columns.map(c => value(c, row)))]);
  }
}

export const tableAt = (id, options) => byId(id) && new Table(byId(id), options);
