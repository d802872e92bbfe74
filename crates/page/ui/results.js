// Results: the report in a box of its own, its review kept in the site, every file to take along.

import { get, path, postText } from "./api.js";
import { answer } from "./home.js";
import { choice, day, make, section, size } from "./parts.js";
import { language, t } from "./words.js";

export function resultsTab(body, site) {
  const whole = site.runs.filter(r => r.whole && r.recognised);
  if (!whole.length) return body.replaceChildren(section(t("result"), make("p", {}, t("no-results"))));
  const list = choice(whole.map(r => [r.name, `${r.name} · ${day(r.at_s)} · ${answer(r)}`]), whole[0].name);
  list.setAttribute("aria-label", t("result"));
  const place = () => [site.place, list.value].filter(Boolean).join("/");
  const shown = make("div"), said = make("p", { role: "status" });
  let frame = null;
  const tell = () => {
    const address = `/view/${path(place())}/report.html`;
    frame = reportFrame(address, site, said);
    shown.replaceChildren(make("div", { className: "row" }, list, make("a", { href: address, target: "_blank" }, t("own-tab")), said), frame.element, section(t("downloads"), downloads(place())));
  };
  list.addEventListener("change", tell);
  body.replaceChildren(shown);
  tell();
  return { close: () => frame?.close() };
}

// The report cannot reach the page, and the page reads nothing of it but the review that it hands over.
export function reportFrame(address, site, said) {
  const element = make("iframe", { className: "report", src: address, title: t("report"), "sandbox": "allow-scripts allow-downloads" });
  const send = value => element.contentWindow?.postMessage({ tsumu: value }, "*");
  const look = () => send({ look: { language: language(), theme: document.documentElement.dataset.theme } });
  let pending = null, latest = null;
  const keep = async () => {
    clearTimeout(pending);
    pending = null;
    if (latest === null) return;
    const text = latest;
    latest = null;
    try {
      await postText(`${site.address}/review`, text);
      said.textContent = t("review-kept", { n: JSON.parse(text).blocks.length });
    } catch (error) {
      said.textContent = t("review-failed", { why: error.message });
    }
  };
  const hear = async event => {
    if (event.source !== element.contentWindow || !event.data?.tsumu) return;
    const { ready, review } = event.data.tsumu;
    if (ready) {
      look();
      if (site?.review) send({ review: await get(`${site.address}/review`).catch(() => null) });
    }
    if (site && typeof review === "string") {
      latest = review;
      clearTimeout(pending);
      pending = setTimeout(keep, 500);
    }
  };
  addEventListener("message", hear);
  document.addEventListener("theme", look);
  return { element, close() { keep(); removeEventListener("message", hear); document.removeEventListener("theme", look); } };
}

export function downloads(place) {
  const list = make("ul", { className: "downloads" });
  get(`/api/results/${path(place)}`).then(files => list.replaceChildren(...files.map(f => make("li", {}, make("a", { href: `/download/${path(f.path)}`, download: f.name.split("/").pop() }, f.name), " ", make("small", {}, size(f.bytes)))))).catch(error => list.replaceChildren(make("li", { className: "bad", role: "alert" }, error.code === "gone" ? t("result-gone") : error.message)));
  return list;
}
