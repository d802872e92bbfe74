// Joins the 3D view with the tools, the tables and the language switch.

const byId = id => document.getElementById(id);
const words = (en, ja) => document.documentElement.dataset.lang === "ja" ? ja : en;

function setLanguage(lang) {
  document.documentElement.dataset.lang = document.documentElement.lang = lang;
  document.querySelectorAll("[data-set-lang]").forEach(b => b.setAttribute("aria-pressed", b.dataset.setLang === lang));
  document.querySelectorAll("option[data-ja]").forEach(o => {
    o.dataset.en = o.dataset.en || o.textContent;
    o.textContent = o.dataset[lang];
  });
  document.dispatchEvent(new Event("language"));
}
document.querySelectorAll("[data-set-lang]").forEach(b => b.addEventListener("click", () => setLanguage(b.dataset.setLang)));
if ((navigator.language || "").startsWith("ja")) setLanguage("ja");

// Tables sort by the column clicked; numbers as numbers.
document.querySelectorAll("thead th button").forEach(button => button.addEventListener("click", () => {
  const head = button.closest("th"), body = head.closest("table").tBodies[0], column = head.cellIndex;
  const up = head.getAttribute("aria-sort") !== "ascending";
  head.parentNode.querySelectorAll("th").forEach(h => h.removeAttribute("aria-sort"));
  head.setAttribute("aria-sort", up ? "ascending" : "descending");
  const key = row => { const text = row.cells[column].textContent; return isNaN(parseFloat(text)) ? text : parseFloat(text); };
  const order = (a, b) => typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b));
  [...body.rows].sort((a, b) => (up ? 1 : -1) * order(key(a), key(b))).forEach(row => body.append(row));
}));

function connect(viewer) {
  const { data, state } = viewer, redraw = () => viewer.redraw(), update = () => viewer.update();
  const tool = (id, event, act) => byId(id).addEventListener(event, e => act(e.target));
  tool("show-points", "change", t => { state.showPoints = t.checked; redraw(); });
  tool("show-found", "change", t => { state.showFound = t.checked; update(); });
  tool("show-added", "change", t => { state.showAdded = t.checked; update(); });
  tool("show-lines", "change", t => { state.showLines = t.checked; redraw(); });
  tool("point-colour", "change", t => { state.pointMode = Number(t.value); legend(); redraw(); });
  tool("block-colour", "change", t => { state.blockMode = t.value; legend(); update(); });
  tool("point-size", "input", t => { state.pointSize = Number(t.value); redraw(); });
  const cut = () => {
    byId("cut").disabled = byId("cut-axis").value === "";
    viewer.setCut(byId("cut-axis").value, byId("cut").value / 1000);
  };
  tool("cut-axis", "change", cut);
  tool("cut", "input", cut);
  tool("reset", "click", () => { state.camera.reset(viewer.aspect()); redraw(); });
  tool("from-above", "click", () => { state.camera.fromAbove(viewer.aspect()); redraw(); });
  if (!data.points.distance) document.querySelector("#point-colour option[value='2']").remove();
  if (!data.rounds) document.querySelector("#block-colour option[value='round']").remove();

  const order = byId("order"), orderText = () => { byId("order-value").textContent = `${state.order} / ${data.added.length}`; };
  order.max = data.added.length;
  order.value = state.order;
  document.querySelector(".order-tool").hidden = byId("show-added").parentNode.hidden = !data.added.length;
  document.querySelector(".order-tool").style.display = data.added.length ? "" : "none";
  tool("order", "input", t => {
    state.order = Number(t.value);
    orderText();
    mark(state.order ? viewer.number("added", state.order - 1) : 0, false);
    update();
  });
  orderText();

  // A block and its row are chosen together.
  const rowOf = number => {
    const b = number && viewer.block(number);
    return b ? byId(b.kind === "found" ? `block-${b.id}` : `place-${b.order}`) : null;
  };
  function mark(number, fly) {
    document.querySelectorAll("tr.chosen").forEach(r => r.classList.remove("chosen"));
    const row = rowOf(number);
    if (row) {
      row.classList.add("chosen");
      const box = row.closest(".scroll");
      box.scrollTop = row.offsetTop - box.clientHeight / 2;
    }
    viewer.choose(number, fly);
    document.dispatchEvent(new CustomEvent("chosen", { detail: number }));
    info();
  }
  const choose = row => {
    const i = row.dataset.block ? data.found.findIndex(b => b.id == row.dataset.block) : data.added.findIndex(b => b.order == row.dataset.place);
    mark(viewer.number(row.dataset.block ? "found" : "added", i), true);
    byId("stage").scrollIntoView({ block: "nearest" });
  };
  document.querySelectorAll("tr[data-block], tr[data-place]").forEach(row => {
    row.addEventListener("click", () => choose(row));
    row.addEventListener("keydown", e => { if (e.key === "Enter") choose(row); });
  });

  // Measuring: two clicks, the line and its lengths.
  let ends = [], measuring = false;
  const measure = on => {
    measuring = on;
    ends = [];
    byId("measure").setAttribute("aria-pressed", on);
    viewer.canvas.classList.toggle("measuring", on);
    info();
    redraw();
  };
  tool("measure", "click", () => measure(!measuring));
  viewer.canvas.addEventListener("keydown", e => { if (e.key === "m") measure(!measuring); });
  viewer.onPick = hit => {
    if (!measuring) return mark(hit ? hit.number : 0, false);
    if (!hit) return;
    ends = ends.length === 2 ? [hit.place] : [...ends, hit.place];
    info();
    redraw();
  };
  viewer.onDrawn = () => {
    const at = ends.map(p => project(viewer.matrix, p, viewer.canvas.clientWidth, viewer.canvas.clientHeight)).filter(p => p);
    let svg = at.map(([x, y]) => `<circle cx="${x}" cy="${y}" r="5"/>`).join("");
    if (at.length === 2) {
      const [[ax, ay], [bx, by]] = at;
      svg = `<line x1="${ax}" y1="${ay}" x2="${bx}" y2="${by}"/>` + svg + `<text x="${(ax + bx) / 2 + 8}" y="${(ay + by) / 2 - 8}">${length(sub(ends[1], ends[0])).toFixed(3)} m</text>`;
    }
    byId("overlay").innerHTML = svg;
  };

  const site = p => p.map((v, i) => (v + data.origin[i]).toFixed(2)).join("  ");
  function info() {
    let text = "";
    if (measuring) {
      text = words("Click two places.", "2 点をクリックしてください。");
      if (ends.length) text = ends.map(site).join("\n");
      if (ends.length === 2) {
        const d = sub(ends[1], ends[0]), flat = Math.hypot(d[0], d[1]);
        text += `\n${words("distance", "距離")} ${length(d).toFixed(3)} m   ${words("level", "水平")} ${flat.toFixed(3)} m   ${words("height", "高低差")} ${d[2].toFixed(3)} m`;
      }
    } else if (state.chosen) {
      const b = viewer.block(state.chosen), name = data.models[b.model].name;
      text = b.kind === "found"
        ? `${words("block", "ブロック")} ${b.id} · ${name} · ${words("confidence", "信頼度")} ${b.confidence === null ? "–" : b.confidence.toFixed(2)}${b.judged ? "" : " · " + words("not judged", "判定不能")}`
        : `${words("place", "据付")} ${b.order} · ${name} · ${words("round", "回")} ${b.round}`;
      text += `\n${site(viewer.centre(b))}`;
    }
    byId("info").textContent = text;
  }

  function legend() {
    const bar = (stops, low, high) => {
      const line = document.createElement("div");
      const ramp = document.createElement("span");
      ramp.className = "ramp";
      ramp.style.background = `linear-gradient(90deg, ${stops.map(c => `rgb(${c})`).join(",")})`;
      line.append(low, ramp, high);
      return line;
    };
    const p = data.points, z = v => `${(v + data.origin[2]).toFixed(1)} m`, lines = [];
    if (state.pointMode === 0) lines.push(bar(RAMP, z(p.min[2]), z(p.min[2] + p.size[2])));
    if (state.pointMode === 2) lines.push(bar(DIVERGING, words(`${p.reach} m above`, `上 ${p.reach} m`), words(`${p.reach} m below design`, `設計面の下 ${p.reach} m`)));
    if (state.blockMode === "confidence") lines.push(bar(RAMP, words("confidence 0", "信頼度 0"), "1"));
    if (state.blockMode === "round") lines.push(bar(RAMP, words("round 1", "1 回"), String(data.rounds)));
    if (p.shown < p.total) {
      const note = document.createElement("div");
      note.textContent = words(`${p.shown.toLocaleString()} of ${p.total.toLocaleString()} points shown`, `${p.total.toLocaleString()} 点中 ${p.shown.toLocaleString()} 点を表示`);
      lines.push(note);
    }
    byId("legend").replaceChildren(...lines);
  }
  document.addEventListener("language", () => { legend(); info(); });
  viewer.review = new Review(viewer);
  // A printer takes the canvas as it is at that moment.
  window.addEventListener("beforeprint", () => viewer.drawNow());
  legend();
}

(async () => {
  const state = byId("state");
  state.textContent = words("Loading …", "読み込み中 …");
  try {
    connect(window.viewer = new Viewer(byId("canvas"), await loadData()));
    state.textContent = "";
    requestAnimationFrame(() => document.documentElement.dataset.ready = "yes");
  } catch (error) {
    state.textContent = words(`The 3D view cannot be shown here: ${error.message}. Maps and tables below are complete.`, `3D 表示ができません: ${error.message}。下の図と表はすべて有効です。`);
    document.documentElement.dataset.ready = "failed";
  }
})();
