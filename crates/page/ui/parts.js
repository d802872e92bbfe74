// Small pieces of page: fields with what is said of them, sizes and times in words.

import { make, number } from "/ui/report/words.js";
import { t } from "./words.js";

export { make, number };

export function size(bytes) {
  const steps = ["B", "kB", "MB", "GB", "TB"], at = Math.min(4, Math.max(0, Math.floor(Math.log10(Math.max(1, bytes)) / 3)));
  return `${number(bytes / 1000 ** at, at > 1 ? 1 : 0)} ${steps[at]}`;
}

export function time(seconds) {
  if (seconds < 90) return t("seconds", { n: number(seconds) });
  return seconds < 5400 ? t("minutes", { n: number(seconds / 60) }) : t("hours", { n: number(seconds / 3600, 1) });
}

export const day = seconds => new Date(seconds * 1000).toLocaleString(document.documentElement.dataset.lang === "ja" ? "ja-JP" : "en-GB", { dateStyle: "medium", timeStyle: "short" });

let last = 0;
// A labelled control; complaints about it stand below and are read out with it.
export function field(label, control, hint = "") {
  const id = `f${++last}`, said = make("div", { className: "said", id: `${id}-said` });
  control.id = id;
  control.setAttribute("aria-describedby", said.id);
  const box = make("div", { className: "field" }, make("label", { htmlFor: id }, label), control);
  if (hint) box.append(make("small", {}, hint));
  box.append(said);
  box.control = control;
  box.say = lines => {
    said.replaceChildren(...lines.map(complaint));
    control.setAttribute("aria-invalid", lines.some(l => l.severity === "refusal"));
  };
  return box;
}

export function complaint({ severity, text }) {
  return make("p", { className: `complaint ${severity}` }, make("b", {}, t(severity)), ` ${text}`);
}

export function choice(options, value) {
  const list = make("select", {}, ...options.map(([v, text]) => make("option", { value: v }, text)));
  list.value = value;
  return list;
}

export const button = (text, act, properties = {}) => make("button", { type: "button", onclick: act, ...properties }, text);
export const section = (title, ...children) => make("section", {}, make("h2", {}, title), ...children);

// The blocks of the list, kind by kind; further names stay possible.
export function blockChoice(blocks, value, more = []) {
  const list = make("select", {}), kinds = [...new Set(blocks.map(b => b.kind))];
  for (const [v, text] of more) list.append(make("option", { value: v }, text));
  for (const kind of kinds) {
    const of = blocks.filter(b => b.kind === kind).map(b => make("option", { value: b.name }, `${b.name} · ${number(b.height_m, 2)} m`));
    list.append(make("optgroup", { label: kind }, ...of));
  }
  if (![...list.options].some(o => o.value === value)) list.prepend(make("option", { value }, value));
  list.value = value;
  return list;
}
