// What is chosen and what the pointer is on, shared by the 3D view, plan, sections, tables and review.

export class Selection extends EventTarget {
  constructor(data) {
    super();
    Object.assign(this, { data, chosen: 0, pointed: 0, from: null });
  }
  block(number = this.chosen) { return number ? this.data.blocks[number] : null; }
  // `from`: who says so; that one need not move its own view. `fly`: the others go there.
  choose(number, from, fly = true) {
    if (!this.data.blocks[number]) number = 0;
    this.chosen = number;
    this.dispatchEvent(new CustomEvent("chosen", { detail: { number, from, fly } }));
  }
  point(number, from) {
    if (number === this.pointed) return;
    this.pointed = number;
    this.dispatchEvent(new CustomEvent("pointed", { detail: { number, from } }));
  }
}
