// Which field a complaint of the check belongs to, and its words.

import { language } from "./words.js";

const JAPANESE = {
  "crs-differs": "座標系の不一致", "crs-not-used": "ファイルの座標系は使われません", "crs-unstated": "座標系の記載なし", "crs-without-code": "座標系のコードが不明", "vertical-differs": "高さの基準の不一致",
  "block-size": "ブロックの大きさ", size: "ブロックの大きさ", block: "ブロック", catalog: "ブロックの定義", density: "点密度の不足", step: "座標の刻みが粗い", strays: "離れた点", water: "水面の点が多い", "left-out": "除外した点", read: "読み込み", survey: "測量ファイル",
  "datum-step": "測量間の高さの差", design: "計画面", "design-heights": "計画面の高さ", "design-elsewhere": "計画面の位置", "design-covered": "計画面と測量の重なり", alignment: "法線", site: "現場の設定",
};

function key(c, spec) {
  if (/^(crs|vertical)/.test(c.code)) return "crs";
  if (c.code === "size") return `size:${c.found.match(/`([^`]+)`/)?.[1]}`;
  if (/^(block|catalog)/.test(c.code)) return "block";
  if (/^(design|alignment)/.test(c.code)) return "design";
  if (c.code === "site") {
    const text = `${c.place} ${c.found}`;
    return /survey_date/.test(text) ? "date" : /`crs`/.test(text) ? "crs" : /design|alignment/.test(text) ? "design" : /\[\[survey\]\]/.test(text) ? "surveys" : /`name`/.test(text) ? "name" : "site";
  }
  const name = c.file.split(/[\\/]/).pop(), survey = spec.survey.find(s => s.file.split("/").pop() === name);
  return survey ? `survey:${survey.file}` : "surveys";
}

export function said(c) {
  const own = [c.place, c.found].filter(Boolean).join(": ") + (c.advice ? `; ${c.advice}` : "");
  return language() === "ja" && JAPANESE[c.code] ? `${JAPANESE[c.code]} — ${own}` : own;
}

// Lines by field.
export function complaintsOf(found, spec) {
  const out = new Map();
  for (const c of found?.complaints || []) {
    const k = key(c, spec);
    out.set(k, [...(out.get(k) || []), { severity: c.severity, text: said(c) }]);
  }
  return out;
}
