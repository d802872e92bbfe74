// The controls beside the 3D view and above the plan: layers, colours, order, section box, views, measuring.

import { DIVERGING, ERROR, NOT_JUDGED, PLANNED, RAMP, TYPES, css, gradient } from "./colours.js";
import { Measure } from "./measure.js";
import { byId, make, number, said, scaled, sharp, theme, words } from "./words.js";

export const swatch = (colour, text) => { const i = make("i"); i.style.background = colour; return make("span", {}, i, text); };
export const ramp = (stops, low, high) => { const r = make("span", { className: "ramp" }); r.style.background = gradient(stops); return make("span", {}, low, r, high); };

export function tools(viewer, selection, plan, sections) {
  const { data, state } = viewer, redraw = () => viewer.redraw(), on = (id, event, act) => byId(id).addEventListener(event, e => act(e.target, e));
  const update = () => { viewer.update(); legend(); plan.stale(); sections.draw(); };
  const ticks = [];
  const layer = (id, key, there) => { ticks.push([id, key]); byId(id).checked = state[key]; byId(id).closest(".layer").hidden = !there; on(id, "change", t => { state[key] = t.checked; update(); }); };
  const open = data.found.filter(b => !b.judged).length;
  layer("show-points", "showPoints", data.points.shown);
  layer("show-found", "showFound", data.found.length > open);
  layer("show-not-judged", "showNotJudged", open);
  layer("show-added", "showAdded", data.added.length);
  layer("show-design", "showDesign", data.surfaces.design);
  layer("show-lines", "showLines", data.outlines.length);
  for (const [id, key] of [["found-opacity", "foundOpacity"], ["added-opacity", "addedOpacity"], ["design-opacity", "designOpacity"]]) on(id, "input", t => { state[key] = Number(t.value); key === "designOpacity" ? redraw() : viewer.update(); });
  on("point-colour", "change", t => { state.pointMode = Number(t.value); update(); });
  on("block-colour", "change", t => { state.blockMode = t.value; update(); });
  on("point-size", "input", t => { state.pointSize = Number(t.value); redraw(); });
  on("labels", "change", t => { state.labels = t.value; redraw(); });
  const without = (id, value) => byId(id).querySelector(`[value="${value}"]`)?.remove();
  if (!data.points.distance) without("point-colour", 2);
  if (!data.points.fit) without("point-colour", 4);
  if (!data.rounds) without("block-colour", "round");
  on("reset", "click", () => { state.camera.reset(viewer.aspect()); viewer.moving(); });
  on("from-above", "click", () => { state.camera.fromAbove(viewer.aspect()); viewer.moving(); });
  on("full-screen", "click", () => document.fullscreenElement ? document.exitFullscreen() : byId("stage").requestFullscreen());
  on("panel-toggle", "click", () => byId("stage").classList.toggle("no-panel"));
  order(viewer, selection, update, on);
  box(viewer, plan, on);
  views(viewer, data.run);
  measuring(viewer, selection, data);
  planTools(plan, sections, viewer);

  // The controls say what is shown: a review changes that by itself.
  function mirror() {
    for (const [id, key] of ticks) byId(id).checked = state[key];
    byId("point-colour").value = String(state.pointMode);
  }

  function legend() {
    mirror();
    const lines = [], p = data.points, z = v => `${number(v + data.origin[2], 1)} m`;
    if (state.blockMode === "type") {
      if (state.showFound) data.models.forEach((m, i) => { if (data.found.some(b => b.judged && b.model === i)) lines.push(swatch(css(TYPES[i % 6].map(v => v * 0.5 + 110)), m.name)); });
      if (state.showAdded && data.added.length) lines.push(swatch(css(PLANNED), words("to place", "据付")));
    }
    if (state.showNotJudged && open) lines.push(swatch(css(NOT_JUDGED), words("not judged", "判定不能")));
    if (state.blockMode === "confidence") lines.push(ramp(RAMP, words("confidence 0", "信頼度 0"), "1"));
    if (state.blockMode === "hidden") lines.push(ramp(RAMP, words("hidden", "隠れている"), words("in sight", "見えている")));
    if (state.blockMode === "fit") lines.push(ramp(ERROR, words("fitting error 0", "当てはめ誤差 0"), `${number(data.errorReach * 1000)} mm`));
    if (state.blockMode === "round") lines.push(ramp(RAMP, words("round 1", "1 回"), String(data.rounds)));
    if (state.showPoints && state.pointMode === 0) lines.push(ramp(RAMP, z(data.heights[0]), z(data.heights[1])));
    if (state.showPoints && state.pointMode === 2) lines.push(ramp([...DIVERGING].reverse(), words(`${p.reach} m above`, `超過 ${p.reach} m`), words(`${p.reach} m missing`, `不足 ${p.reach} m`)));
    if (state.showPoints && state.pointMode === 4) lines.push(ramp(ERROR, words("point to block 0", "点とブロックの距離 0"), `${number(p.fitReach * 1000)} mm`));
    if (p.shown < p.total) lines.push(make("small", {}, words(`${number(p.shown)} of ${number(p.total)} points`, `${number(p.total)} 点中 ${number(p.shown)} 点`)));
    byId("legend").replaceChildren(...lines);
    byId("plan-legend").replaceChildren(...plan.legend(swatch, ramp));
  }
  document.addEventListener("language", legend);
  document.addEventListener("review", legend);
  selection.addEventListener("chosen", legend);
  legend();
  return { legend, update };
}

function order(viewer, selection, update, on) {
  const { data, state } = viewer, slider = byId("order"), count = data.added.length;
  byId("order-tool").hidden = !count;
  slider.max = count;
  const set = n => {
    state.order = n;
    slider.value = n;
    byId("order-value").textContent = `${number(n)} / ${number(count)}`;
    viewer.update();
  };
  let playing = 0;
  const stop = () => { clearInterval(playing); playing = 0; byId("play").textContent = "▶"; byId("play").setAttribute("aria-pressed", false); update(); };
  on("order", "input", t => { stop(); set(Number(t.value)); if (state.order) selection.choose(data.added[state.order - 1].number, viewer, false); });
  on("play", "click", () => {
    if (playing) return stop();
    if (state.order >= count) set(0);
    byId("play").textContent = "❚❚";
    byId("play").setAttribute("aria-pressed", true);
    // The whole order in about twenty seconds, at most five blocks a second.
    const step = Math.max(1, Math.round(count / 100));
    playing = setInterval(() => { set(Math.min(count, state.order + step)); if (state.order >= count) stop(); }, 200);
  });
  set(count);
}

// A section box: a rectangle drawn in the plan, and from which level to which.
function box(viewer, plan, on) {
  const { low, high, data, state } = viewer, span = high[2] - low[2] || 1, base = () => state.box || { middle: [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2], direction: [1, 0], half: [1e9, 1e9] };
  const levels = () => {
    const [a, b] = ["box-from", "box-to"].map(id => low[2] - span * 0.05 + span * 1.1 * byId(id).value / 100);
    byId("box-levels").textContent = `${number(a + data.origin[2], 1)} – ${number(b + data.origin[2], 1)} m`;
    viewer.setBox({ ...base(), from: byId("box-from").value === "0" ? -1e9 : a, to: byId("box-to").value === "100" ? 1e9 : b });
  };
  on("box-from", "input", levels);
  on("box-to", "input", levels);
  on("box-clear", "click", () => { byId("box-from").value = 0; byId("box-to").value = 100; byId("box-levels").textContent = ""; byId("follow-section").checked = false; viewer.setBox(null); plan.draw(); });
}

// Views are kept in this browser.
function views(viewer, run) {
  const name = `tsumu views ${run}`, list = () => { try { return JSON.parse(localStorage.getItem(name)) || []; } catch { return []; } };
  const show = () => {
    byId("views").replaceChildren(...list().map((v, i) => {
      const go = make("button", { type: "button" }, `${words("View", "視点")} ${i + 1}`), gone = make("button", { type: "button", className: "small", "aria-label": words("forget the view", "視点を削除") }, "×");
      go.addEventListener("click", () => { Object.assign(viewer.state.camera, v); viewer.moving(); });
      gone.addEventListener("click", () => { keep(list().filter((_, k) => k !== i)); });
      return make("span", { className: "pair" }, go, gone);
    }));
  };
  const keep = views => { try { localStorage.setItem(name, JSON.stringify(views)); } catch { /* a browser that keeps nothing shows no views */ } show(); };
  byId("keep-view").addEventListener("click", () => keep([...list(), viewer.state.camera.state()].slice(-8)));
  document.addEventListener("language", show);
  show();
}

function measuring(viewer, selection, data) {
  const info = byId("info");
  const say = () => {
    for (const b of document.querySelectorAll("[data-measure]")) b.setAttribute("aria-pressed", b.dataset.measure === measure.kind);
    byId("profile").hidden = !(measure.kind === "profile" && measure.places.length === 2);
    if (measure.kind) {
      info.textContent = measure.text() + (measure.places.length ? `\n${measure.places.slice(-2).map(p => place(p)).join("\n")}` : "");
      if (!byId("profile").hidden) drawProfile(viewer, measure.places);
      return;
    }
    const b = selection.block(selection.chosen) || selection.block(selection.pointed);
    info.textContent = b ? describe(b) : "";
  };
  const place = p => p.map((v, i) => number(v + data.origin[i], 3)).join("   ");
  const legs = b => b.legs ? ` · ${words("legs", "脚")} ${b.legs[0]} ${words("seen", "確認")}, ${b.legs[1]} ${words("hidden", "隠れ")}, ${b.legs[2]} ${words("missing", "欠損")}` : "";
  const describe = b => {
    const name = data.models[b.model].name, where = place(b.centre);
    return b.kind === "found"
      ? `R${b.id} · ${name}${b.judged ? "" : ` · ${words("not judged", "判定不能")}`}\n${words("confidence", "信頼度")} ${number(scaled(b.confidence, 1), 2)} · ${words("fitting error", "当てはめ誤差")} ${number(scaled(b.fitness_m, 1000))} mm · ${words("hidden", "隠れ")} ${number(scaled(b.occlusion, 100))} %${legs(b)}\n${where}`
      : `${words("place", "据付")} ${b.order} · ${name} · ${words("round", "回")} ${b.round}\n${words("fills", "充填量")} ${number(b.filled_m3, 2)} m³ · ${words("contacts", "接触数")} ${b.contacts}\n${where}`;
  };
  const measure = new Measure(viewer, say);
  document.querySelectorAll("[data-measure]").forEach(b => b.addEventListener("click", () => measure.start(b.dataset.measure)));
  viewer.canvas.addEventListener("keydown", e => { if (e.key === "m") measure.start("distance"); if (e.key === "Escape" && measure.kind) measure.start(measure.kind); });
  viewer.onPick = hit => measure.kind ? hit && measure.add(hit.place) : selection.choose(hit ? hit.number : 0, viewer);
  for (const name of ["chosen", "pointed"]) selection.addEventListener(name, say);
  document.addEventListener("language", say);
}

// The points of the survey in a band about the line, side on.
function drawProfile(viewer, [a, b]) {
  const { g, w, h } = sharp(byId("profile")), colours = theme(), { record, points: p, origin } = viewer.data, long = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1, c = [(b[0] - a[0]) / long, (b[1] - a[1]) / long], half = Math.max(long / 100, 0.1), seen = [];
  for (let i = 0; i < p.shown; i++) {
    const [x, y, z] = [0, 1, 2].map(k => p.min[k] + record[i * 6 + k] / 65535 * p.size[k]), d = (x - a[0]) * c[0] + (y - a[1]) * c[1];
    if (d >= 0 && d <= long && Math.abs(-(x - a[0]) * c[1] + (y - a[1]) * c[0]) < half) seen.push([d, z]);
  }
  if (!seen.length) return;
  let low = Infinity, high = -Infinity;
  for (const [, z] of seen) { low = Math.min(low, z); high = Math.max(high, z); }
  const m = Math.max(long / (w - 56), (high - low) / (h - 34), 1e-6), at = ([d, z]) => [44 + d / m, h - 20 - (z - low) / m];
  g.fillStyle = colours.asis;
  for (const s of seen) { const [x, y] = at(s); g.fillRect(x, y, 1.6, 1.6); }
  g.fillStyle = colours.soft;
  g.font = "11px system-ui, sans-serif";
  g.textAlign = "right";
  for (const z of [low, high]) g.fillText(number(z + origin[2], 2), 40, at([0, z])[1] + 4);
  g.textAlign = "center";
  g.fillText(`${number(long, 2)} m`, 44 + long / m / 2, h - 5);
}

function planTools(plan, sections, viewer) {
  const select = byId("plan-layer"), names = () => [["blocks", words("blocks", "ブロック")], ...viewer.data.maps.map((m, i) => [i, said(m.label)]), ...(viewer.data.windows.length ? [["windows", words("unfilled places by reason", "未充填箇所（理由別）")]] : [])];
  const fill = () => { select.replaceChildren(...names().map(([v, n]) => new Option(n, v))); select.value = plan.layer; };
  select.addEventListener("change", () => { plan.layer = /^\d+$/.test(select.value) ? Number(select.value) : select.value; byId("plan-legend").replaceChildren(...plan.legend(swatch, ramp)); plan.draw(); });
  document.addEventListener("language", fill);
  fill();
  byId("plan-fit").addEventListener("click", () => plan.fit());
  const pick = tool => { plan.tool = plan.tool === tool ? "" : tool; document.querySelectorAll("[data-plan-tool]").forEach(b => b.setAttribute("aria-pressed", b.dataset.planTool === plan.tool)); plan.canvas.classList.toggle("measuring", Boolean(plan.tool)); };
  document.querySelectorAll("[data-plan-tool]").forEach(b => b.addEventListener("click", () => pick(b.dataset.planTool)));
  plan.onDrawn = (tool, from, to) => {
    if (tool === "line") sections.setFree(from, to);
    else {
      const middle = [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2], half = [Math.abs(to[0] - from[0]) / 2, Math.abs(to[1] - from[1]) / 2];
      viewer.setBox({ from: -1e9, to: 1e9, ...viewer.state.box, middle, direction: [1, 0], half, corners: [from, [to[0], from[1]], to, [from[0], to[1]]] });
    }
    pick(tool);
    plan.draw();
  };
}
