// The reviewer's decisions: accept, reject or correct a block, save them as review.json for the next run.

class Review {
  constructor(viewer) {
    this.viewer = viewer;
    this.decisions = new Map();
    this.elsewhere = []; // decisions about blocks this run does not show, rejected ones above all: they stay in the file
    this.block = null;
    byId("review").hidden = !viewer.data.found.length;
    byId("review-model").replaceChildren(...viewer.data.models.map((m, i) => new Option(m.name, i)));
    document.addEventListener("chosen", e => this.choose(e.detail));
    byId("review-accept").addEventListener("click", () => this.decide("accepted"));
    byId("review-reject").addEventListener("click", () => this.decide("rejected"));
    byId("review-clear").addEventListener("click", () => this.decide(null));
    byId("review-model").addEventListener("change", () => this.decide("corrected"));
    byId("review-note").addEventListener("change", () => this.decide(this.decisions.get(this.block.id)?.verdict || "accepted"));
    byId("review-save").addEventListener("click", () => this.save());
    byId("review-open").addEventListener("change", e => this.open(e.target));
    viewer.canvas.addEventListener("keydown", e => { if (this.block && e.key === "a") this.decide("accepted"); if (this.block && e.key === "x") this.decide("rejected"); });
    document.addEventListener("language", () => this.show());
    window.addEventListener("beforeunload", e => { if (this.unsaved) e.preventDefault(); });
    if (viewer.data.review) this.adopt(viewer.data.review);
    this.choose(0);
  }
  choose(number) {
    const block = number ? this.viewer.block(number) : null;
    this.block = block && block.kind === "found" ? block : null;
    const said = this.block && this.decisions.get(this.block.id);
    byId("review-model").value = said ? said.model : this.block ? this.block.model : 0;
    byId("review-note").value = said ? said.note : "";
    for (const id of ["review-accept", "review-reject", "review-clear", "review-model", "review-note"]) byId(id).disabled = !this.block;
    this.show();
  }
  decide(verdict) {
    const model = Number(byId("review-model").value);
    if (verdict === null) this.decisions.delete(this.block.id);
    else this.decisions.set(this.block.id, { verdict: verdict === "accepted" && model !== this.block.model ? "corrected" : verdict, model, note: byId("review-note").value });
    this.unsaved = true;
    this.choose(this.viewer.state.chosen);
  }
  // Marks in the table, and how many there are.
  show() {
    const names = { accepted: ["✓ accepted", "✓ 採用"], rejected: ["✗ rejected", "✗ 却下"], corrected: ["✎ corrected", "✎ 修正"] };
    document.querySelectorAll("tr[data-block]").forEach(row => {
      const said = this.decisions.get(Number(row.dataset.block));
      let mark = row.querySelector(".verdict");
      if (!mark) { mark = document.createElement("b"); mark.className = "verdict"; row.lastElementChild.append(mark); }
      mark.textContent = said ? ` ${words(...names[said.verdict])}` : "";
      row.classList.toggle("rejected", said?.verdict === "rejected");
    });
    const n = this.decisions.size, said = this.block && this.decisions.get(this.block.id);
    const more = this.elsewhere.length;
    byId("review-count").textContent = words(`${n} reviewed`, `確認済 ${n}`) + (more ? words(`, ${more} not shown here`, `、表示外 ${more}`) : "");
    byId("review-save").disabled = !(n + more);
    byId("review-accept").setAttribute("aria-pressed", said?.verdict === "accepted");
    byId("review-reject").setAttribute("aria-pressed", said?.verdict === "rejected");
  }
  text() {
    const { data } = this.viewer, blocks = data.found.filter(b => this.decisions.has(b.id)).map(b => {
      const { verdict, model, note } = this.decisions.get(b.id), [qx, qy, qz, qw, x, y, z] = b.pose;
      const [x_m, y_m, z_m] = [x, y, z].map((v, i) => v + data.origin[i]);
      return { block_id: b.id, verdict, model: data.models[model].name, x_m, y_m, z_m, qw, qx, qy, qz, fitness_m: b.fitness_m, occlusion: b.occlusion, note };
    });
    return JSON.stringify({ format: 1, reviewer: byId("review-by").value, blocks: [...blocks, ...this.elsewhere] }, null, 1) + "\n";
  }
  save() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([this.text()], { type: "application/json" }));
    link.download = "review.json";
    link.click();
    URL.revokeObjectURL(link.href);
    this.unsaved = false;
  }
  // Takes over the decisions of a file or of the run itself. Numbers change from run to run: a block is known by its place.
  adopt(review) {
    const { data } = this.viewer;
    byId("review-by").value = review.reviewer || "";
    for (const b of review.blocks) {
      const model = data.models.findIndex(m => m.name === b.model);
      const pose = [b.qx, b.qy, b.qz, b.qw, ...[b.x_m, b.y_m, b.z_m].map((v, i) => v - data.origin[i])];
      const centre = model < 0 ? null : this.viewer.centre({ model, pose });
      const far = f => Math.hypot(...this.viewer.centre(f).map((v, i) => v - centre[i]));
      const here = centre && data.found.filter(f => far(f) < 0.4 * data.models[model].radius).sort((f, g) => far(f) - far(g))[0];
      if (here) this.decisions.set(here.id, { verdict: b.verdict, model, note: b.note || "" });
      else this.elsewhere.push(b);
    }
  }
  async open(input) {
    try {
      const review = JSON.parse(await input.files[0].text());
      if (review.format !== 1) throw new Error(`format ${review.format}`);
      this.elsewhere = [];
      this.adopt(review);
      this.choose(this.viewer.state.chosen);
    } catch (error) {
      byId("review-count").textContent = words(`not a review: ${error.message}`, `読み込めません: ${error.message}`);
    }
    input.value = "";
  }
}
