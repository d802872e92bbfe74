// The tables of a run: blocks found, blocks to place, trials that failed, places that stay unfilled.

import { tableAt } from "./table.js";
import { doubt } from "./review.js";
import { said, scaled, words } from "./words.js";

// With a projected system Japanese readers know X as north; without one the axes have no direction.
const axes = data => data.crs
  ? [{ en: "east", ja: "東（Y）" }, { en: "north", ja: "北（X）" }, { en: "level", ja: "標高" }]
  : [{ en: "x", ja: "x" }, { en: "y", ja: "y" }, { en: "z", ja: "z" }];
const ANY = { en: "all", ja: "すべて" };
const STATES = { overflow: ["stands above the design", "計画面超過"], unsettled: ["did not come to rest", "静止せず"], outside: ["outside the area or reach", "範囲外"], unstable: ["unstable", "不安定"], kept: ["kept", "採用"] };
export const stateWord = state => words(...(STATES[state] || [state, state]));

export function tables(data, selection, review) {
  const model = b => b.model === null ? "–" : data.models[b.model].name, place = axes(data).map((head, k) => ({ head, unit: "m", digits: 3, wide: 112, value: b => b.centre[k] + data.origin[k] }));
  const type = { head: { en: "type", ja: "種類" }, value: model, text: true, wide: 130 };
  const ofType = { head: { en: "type", ja: "種類" }, options: [{ head: ANY }, ...data.models.map((m, i) => ({ head: { en: m.name }, keep: b => b.model === i }))] };
  const made = [];
  made.push(tableAt("found-table", {
    name: "blocks", rows: [...data.found, ...data.places], selection, of: b => b.number,
    empty: { en: "No block was recognised.", ja: "認識されたブロックはありません。" },
    columns: [{ head: { en: "No.", ja: "番号" }, value: b => b.id, wide: 64 }, type, ...place,
      { head: { en: "confidence", ja: "信頼度" }, digits: 2, value: b => scaled(b.confidence, 1) }, { head: { en: "fitting error", ja: "当てはめ誤差" }, unit: "mm", digits: 0, value: b => scaled(b.fitness_m, 1000), wide: 96 },
      { head: { en: "hidden", ja: "隠れ" }, unit: "%", digits: 0, value: b => scaled(b.occlusion, 100) }, { head: { en: "legs missing", ja: "欠損脚" }, value: b => b.legs ? b.legs[2] : "", hidden: !data.found.some(b => b.legs) }, { head: { en: "doubt", ja: "疑わしさ" }, digits: 2, value: doubt, hidden: true },
      { head: { en: "second type", ja: "次点" }, value: b => b.second === null ? "" : `${data.models[b.second].name} (${Math.round(b.secondFit_m * 1000)} mm)`, text: true, wide: 120, hidden: data.models.length < 2 },
      { head: { en: "judged", ja: "判定" }, value: b => b.judged ? b.typeJudged ? words("stated", "判定済") : words("type open", "種類未定") : words("not judged", "判定不能"), text: true },
      { head: { en: "review", ja: "確認" }, value: b => review.word(b), text: true }],
    filters: [ofType, ...data.found.some(b => b.legs && b.legs[2]) ? [{ head: { en: "legs", ja: "脚" }, options: [{ head: ANY }, { head: { en: "a leg missing", ja: "欠損あり" }, keep: b => b.legs && b.legs[2] > 0 }] }] : [], { head: { en: "judged", ja: "判定" }, options: [{ head: ANY }, { head: { en: "stated", ja: "判定済" }, keep: b => b.judged }, { head: { en: "not judged", ja: "判定不能" }, keep: b => !b.judged }] },
      { head: { en: "confidence", ja: "信頼度" }, options: [{ head: ANY }, ...[0.8, 0.9].map(v => ({ head: { en: `confidence < ${v}`, ja: `信頼度 < ${v}` }, keep: b => b.confidence !== null && b.confidence < v }))] }],
    marks: b => review.verdict(b)?.verdict === "rejected" ? ["out"] : b.judged ? [] : ["faint"],
  }));
  const rounds = [...Array(data.rounds).keys()].map(r => ({ head: { en: `round ${r + 1}`, ja: `${r + 1} 回目` }, keep: b => b.round === r + 1 }));
  const placing = [{ head: { en: "order", ja: "順序" }, value: b => b.order, wide: 64 }, { head: { en: "round", ja: "回" }, value: b => b.round, wide: 60 }, type, ...place,
    { head: { en: "let go at", ja: "投下高" }, unit: "m", digits: 2, value: b => b.drop_m + data.origin[2] }, { head: { en: "fills", ja: "充填量" }, unit: "m³", digits: 2, value: b => b.filled_m3 },
    { head: { en: "contacts", ja: "接触数" }, value: b => b.contacts }, { head: { en: "handling", ja: "据付方法" }, value: b => b.handling || "", text: true, wide: 120, hidden: !data.added.some(b => b.handling) }];
  made.push(tableAt("placements-table", {
    name: "placements", rows: data.added, selection, of: b => b.number,
    columns: [...placing, { head: { en: "mass", ja: "質量" }, unit: "t", digits: 2, value: b => data.models[b.model].mass_t, hidden: true }, { head: { en: "review", ja: "確認" }, value: b => review.word(b), text: true }],
    filters: [ofType, { head: { en: "round", ja: "回" }, options: [{ head: ANY }, ...rounds] }],
    marks: b => review.verdict(b)?.verdict === "struck" ? ["out"] : [],
  }));
  const states = [...new Set(data.removed.map(b => b.state))];
  made.push(tableAt("removed-table", {
    name: "removed", rows: data.removed, columns: [{ head: { en: "why not", ja: "除外の理由" }, value: b => stateWord(b.state), text: true, wide: 170 }, ...placing],
    filters: [{ head: { en: "why not", ja: "除外の理由" }, options: [{ head: ANY }, ...states.map(s => ({ head: { en: STATES[s]?.[0] || s, ja: STATES[s]?.[1] || s }, keep: b => b.state === s }))] }],
  }));
  made.push(tableAt("windows-table", {
    name: "unfilled", rows: data.windows, columns: [{ head: { en: "why", ja: "理由" }, value: w => said(w.reason), text: true, wide: 260, grow: 3 },
      ...axes(data).slice(0, 2).map((head, k) => ({ head, unit: "m", digits: 2, value: w => (k ? w.y : w.x) + data.origin[k] })), { head: { en: "edge", ja: "辺長" }, unit: "m", digits: 2, value: w => 2 * w.half_m }, { head: { en: "missing", ja: "不足" }, unit: "m³", digits: 2, value: w => w.void_m3 }],
  }));
  document.addEventListener("review", () => made.forEach(t => t?.draw(true)));
  return made.filter(Boolean);
}
