// Opens a report in a real browser and uses it: no request may leave, no script may fail, controls must act.
//
//   npm install playwright-core
//   CHROMIUM=/usr/bin/chromium node report.mjs run/report.html [folder for screenshots and the PDF]
//
// Software rendering, so that it runs on a machine without a screen. Prints one line a check; exit 1 when one fails.

import { chromium } from "playwright-core";
import { mkdirSync, readFileSync } from "node:fs";
import { resolve } from "node:path";

const [, , file, pictures] = process.argv;
if (!file) {
  console.error("usage: node report.mjs REPORT.html [SCREENSHOT_FOLDER]");
  process.exit(2);
}
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM || "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
});
const page = await browser.newPage({ viewport: { width: 1360, height: 900 }, locale: "en-GB" });
page.setDefaultTimeout(180000);
const requests = [], errors = [];
page.on("request", r => { if (!/^(data|blob):/.test(r.url())) requests.push(r.url()); });
page.on("pageerror", e => errors.push(e.message));
page.on("console", m => { if (m.type() === "error") errors.push(m.text()); });

let failed = 0;
const check = (what, ok, detail = "") => {
  console.log(`${ok ? "ok    " : "FAILED"} ${what} ${detail}`);
  if (!ok) failed++;
};
const shot = async (name, selector) => {
  if (!pictures) return;
  mkdirSync(pictures, { recursive: true });
  const path = `${pictures}/${name}.png`;
  await (selector ? page.locator(selector).first().screenshot({ path }) : page.screenshot({ path, fullPage: true }));
};
const picture = () => page.evaluate(() => { viewer.drawNow(); return viewer.canvas.toDataURL(); });
const changes = async (what, act) => {
  const before = await picture();
  await act();
  check(`${what} changes the picture`, before !== await picture());
};

const start = Date.now();
await page.goto("file://" + resolve(file));
await page.waitForFunction(() => document.documentElement.dataset.ready, null, { timeout: 120000 });
check("3D view is ready", await page.evaluate(() => document.documentElement.dataset.ready) === "yes", `after ${Date.now() - start} ms`);
await shot("report");
await shot("view", "#stage");
await shot("sections", "#sections figure");

const { found, added } = await page.evaluate(() => ({ found: viewer.data.found.length, added: viewer.data.added.length }));
console.log(`       ${found} blocks found, ${added} to place`);
if (found) {
  const row = page.locator("tr[data-block]").first();
  await changes("a clicked row", () => row.click());
  check("the row is marked", await row.evaluate(r => r.classList.contains("chosen")));
  // The view now centres on that block: a click in the middle must find a block.
  const box = await page.locator("#canvas").boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  check("a click in the view marks one row", await page.locator("tr.chosen").count() === 1);
  check("and says what it is", (await page.textContent("#info")).length > 5, JSON.stringify(await page.textContent("#info")));
}
await page.click("#reset");
if (added) {
  await changes("the placing order", () => page.locator("#order").evaluate(s => { s.value = 1; s.dispatchEvent(new Event("input")); }));
  await page.locator("#order").evaluate(s => { s.value = s.max; s.dispatchEvent(new Event("input")); });
}
await changes("a key", () => page.locator("#canvas").press("ArrowLeft"));
await changes("the view from above", () => page.click("#from-above"));
await page.click("#reset");
await changes("the cut", () => page.selectOption("#cut-axis", "1"));
await shot("cut", "#stage");
await page.selectOption("#cut-axis", "");
for (const mode of await page.locator("#point-colour option").evaluateAll(o => o.map(x => x.value).slice(1))) {
  await changes(`points by ${mode}`, () => page.selectOption("#point-colour", mode));
}
if (found) await changes("blocks by confidence", () => page.selectOption("#block-colour", "confidence"));
await page.click("#measure");
const box = await page.locator("#canvas").boundingBox();
for (const [x, y] of [[0.46, 0.5], [0.54, 0.55]]) await page.mouse.click(box.x + box.width * x, box.y + box.height * y);
await picture();
check("measuring gives a distance", /distance [\d.]+ m/.test(await page.textContent("#info")), JSON.stringify(await page.textContent("#info")));
await page.click("#measure");

if (found) {
  await page.locator("tr[data-block]").nth(1).click();
  await page.click("#review-reject");
  await page.locator("tr[data-block]").nth(2).click();
  await page.fill("#review-note", "seen on site");
  await page.click("#review-accept");
  // In a small window and without the points: a quiet picture, and a small file.
  await page.uncheck("#show-points");
  await page.setViewportSize({ width: 860, height: 560 });
  await picture();
  await shot("review", "#view");
  await page.setViewportSize({ width: 1360, height: 900 });
  await page.check("#show-points");
  const download = page.waitForEvent("download");
  await page.click("#review-save");
  const saved = JSON.parse(readFileSync(await (await download).path(), "utf8"));
  check("the review is saved", saved.format === 1 && saved.blocks.map(b => b.verdict).join() === "rejected,accepted" && saved.blocks[1].note === "seen on site", JSON.stringify(saved.blocks[0]));
  await page.click("#review-clear");

  // Opened again, also with a decision about a block that this run does not show: both must be in the file that is saved next.
  await page.evaluate(() => viewer.review.decisions.clear());
  const gone = { ...saved.blocks[0], block_id: 9999, x_m: saved.blocks[0].x_m + 500, note: "taken away" };
  const renumbered = { ...saved.blocks[1], block_id: 4711 };
  const file = { format: 1, reviewer: "Sato", blocks: [gone, renumbered] };
  await page.setInputFiles("#review-open", { name: "review.json", mimeType: "application/json", buffer: Buffer.from(JSON.stringify(file)) });
  await page.waitForFunction(() => viewer.review.elsewhere.length === 1);
  const again = JSON.parse(await page.evaluate(() => viewer.review.text()));
  check("a review goes on", again.reviewer === "Sato" && again.blocks.length === 2
    && again.blocks[0].block_id === saved.blocks[1].block_id && again.blocks[1].note === "taken away", JSON.stringify(again.blocks.map(b => b.block_id)));
  await page.locator("tr[data-block]").nth(3).click();
  await page.locator("#canvas").press("x");
  check("X rejects", await page.locator("tr[data-block]").nth(3).evaluate(r => r.classList.contains("rejected")));
  await page.locator("#canvas").press("a");
  check("A accepts", !(await page.locator("tr[data-block]").nth(3).evaluate(r => r.classList.contains("rejected"))));
  await page.evaluate(() => { viewer.review.unsaved = false; });
}

// Without a mouse: the first controls take the focus in their order, and what has it shows it.
const stops = [], unseen = [];
await page.locator("[data-set-lang]").first().focus();
for (let i = 0; i < 6; i++) {
  await page.keyboard.press("Tab");
  const { name, outline } = await page.evaluate(() => {
    const now = document.activeElement;
    return { name: now.id || now.textContent.trim().slice(0, 12), outline: getComputedStyle(now).outlineStyle };
  });
  stops.push(name);
  if (outline === "none") unseen.push(name);
}
check("Tab goes from control to control", new Set(stops).size === 6 && stops.includes("show-points"), stops.join(", "));
check("what has the focus shows it", unseen.length === 0, unseen.join(", "));

await page.click("[data-set-lang=ja]");
check("Japanese", await page.locator("h2 [lang=ja]").first().isVisible() && !await page.locator("h2 [lang=en]").first().isVisible());
await shot("report-ja");
// Prints of several pages, in both languages.
const print = async (language, name) => {
  if (!pictures) return;
  const path = `${pictures}/${name}.pdf`;
  const failure = await page.pdf({ path, format: "A4" }).then(() => null, e => e.message);
  const pages = failure ? 0 : readFileSync(path, "latin1").match(/\/Type \/Page\b(?!s)/g)?.length || 0;
  check(`it prints in ${language}`, pages > 1, failure || `${pages} pages`);
};
await print("Japanese", "report-ja");
await page.click("[data-set-lang=en]");
await print("English", "report");

check("no request but the file itself", requests.length === 1, requests.slice(1).join(" "));
check("no script error", errors.length === 0, errors.join(" | "));
await browser.close();
process.exit(failed ? 1 : 0);
