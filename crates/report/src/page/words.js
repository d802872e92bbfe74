// Words in the page's language, numbers as people read them, and small pieces of page.

export const byId = id => document.getElementById(id);
export const language = () => document.documentElement.dataset.lang;
export const words = (en, ja) => language() === "ja" ? ja : en;
// A text of the run: {en, ja}; without Japanese, English stands for both.
export const said = text => words(text.en, text.ja || text.en);

const formats = new Map();
// With thousands separators and so many digits behind the point; what is no number is a dash.
export function number(value, digits = 0) {
  if (!Number.isFinite(value)) return "–";
  if (!formats.has(digits)) formats.set(digits, new Intl.NumberFormat("en-US", { minimumFractionDigits: digits, maximumFractionDigits: digits }));
  const text = formats.get(digits).format(value);
  return /^-0(\.0*)?$/.test(text) ? text.slice(1) : text;
}

// A value in another unit; what nobody knows stays no number.
export const scaled = (value, factor) => value === null ? NaN : value * factor;

// An element with its properties and children; text stays text.
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key.includes("-") || key === "role" || key === "for") element.setAttribute(key, value);
    else element[key] = value;
  }
  element.append(...children);
  return element;
}

// Hands a file to the browser's downloads.
export function download(name, text, type) {
  const link = make("a", { href: URL.createObjectURL(new Blob([text], { type })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// Text that a spreadsheet would take for a formula becomes text again; control characters go.
export function cell(value) {
  if (typeof value === "number") return Number.isFinite(value) ? String(value) : "";
  const text = String(value).replace(/[\u0000-\u0008\u000b-\u001f\u007f]/g, " ");
  const safe = /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
  return /[",\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}
export const csv = rows => "\ufeff" + rows.map(row => row.map(cell).join(",")).join("\r\n") + "\r\n";

// The next of 1, 2, 5, 10, 20 … not below the value.
export function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map(m => m * power).find(v => v >= value * 0.999);
}

// A canvas as sharp as the screen; its context draws in CSS pixels.
export function sharp(canvas) {
  const ratio = Math.min(window.devicePixelRatio || 1, 2), w = Math.max(1, canvas.clientWidth), h = Math.max(1, canvas.clientHeight);
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) { canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio); }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, w, h);
  return { g, w, h, ratio };
}

// The theme's colours, for what is drawn on a canvas.
export function theme() {
  const style = getComputedStyle(document.documentElement), value = name => style.getPropertyValue(name).trim();
  return { ink: value("--ink"), soft: value("--soft"), line: value("--line"), paper: value("--paper"), grid: value("--grid"), halo: value("--halo"),
    design: value("--design"), asis: value("--asis"), planned: value("--planned"), ground: value("--ground"), chosen: value("--chosen"), fill: value("--fill") };
}
