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
  // JPEG: a cloud of points makes a PNG of a megabyte.
  const path = `${pictures}/${name}.jpg`;
  await (selector ? page.locator(selector).first().screenshot({ path, quality: 82 }) : page.screenshot({ path, quality: 82, fullPage: true }));
};
const picture = () => page.evaluate(() => { tsumu.viewer.drawNow(); return tsumu.viewer.canvas.toDataURL(); });
const settled = () => page.waitForFunction(() => tsumu.viewer.quick === 0 && !tsumu.viewer.waiting && !tsumu.viewer.pieces);
const changes = async (what, act) => {
  const before = await picture();
  await act();
  check(`${what} changes the picture`, before !== await picture());
};
const set = (selector, value, event = "input") => page.locator(selector).evaluate((t, [v, e]) => { t.value = v; t.dispatchEvent(new Event(e)); }, [String(value), event]);

const start = Date.now();
await page.goto("file://" + resolve(file));
await page.waitForFunction(() => document.documentElement.dataset.ready, null, { timeout: 120000 });
check("3D view is ready", await page.evaluate(() => document.documentElement.dataset.ready) === "yes", `after ${Date.now() - start} ms`);
await settled();
const nodes = await page.evaluate(() => document.getElementsByTagName("*").length);
check("the page is small", nodes <= 8000, `${nodes} nodes`);
check("the head is a sentence with four lights", (await page.textContent("h1")).length > 10 && await page.locator(".light").count() === 4, JSON.stringify(await page.textContent("h1 span, h1")));
check("3D stands on the first screen, full width", await page.locator("#scene").evaluate(s => { const r = s.getBoundingClientRect(); return r.top < innerHeight / 2 && document.querySelector("#stage").getBoundingClientRect().width > innerWidth * 0.9; }));
await shot("whole");
if (pictures) await page.screenshot({ path: `${pictures}/report.jpg`, quality: 82 });

// Turned by the pointer for six seconds: pictures a second, as this machine has it now.
const turned = await page.evaluate(() => new Promise(done => {
  const { viewer } = tsumu, { canvas } = viewer, start = performance.now();
  let pictures = 0, x = 300;
  const count = () => { pictures++; }, move = type => canvas.dispatchEvent(new PointerEvent(type, { pointerId: 1, clientX: x, clientY: 300, buttons: 1, bubbles: true }));
  canvas.setPointerCapture = () => {};
  viewer.onDrawn.push(count);
  move("pointerdown");
  const step = () => {
    x += 4;
    move("pointermove");
    const seconds = (performance.now() - start) / 1000;
    if (seconds < 6) return void requestAnimationFrame(step);
    move("pointerup");
    viewer.onDrawn.splice(viewer.onDrawn.indexOf(count), 1);
    delete canvas.setPointerCapture;
    done(pictures / seconds);
  };
  requestAnimationFrame(step);
}));
check("the view turns", turned > 0, `${turned.toFixed(1)} pictures a second`);
await page.click("#reset");
await settled();

const { found, added, works } = await page.evaluate(() => ({ found: tsumu.data.found.length, added: tsumu.data.added.length, works: Boolean(tsumu.sections.works) }));
console.log(`       ${found} blocks found, ${added} to place`);
const chosen = () => page.evaluate(() => tsumu.selection.chosen);
if (found) {
  const row = page.locator("#found-table .vrow").first();
  await changes("a clicked row", () => row.click());
  check("the row is marked", await page.locator("#found-table .vrow.chosen").count() === 1);
  // The view now centres on that block: a click in the middle must find a block.
  const box = await page.locator("#canvas").boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  check("a click in the view chooses a block", await chosen() > 0);
  check("and says what it is", (await page.textContent("#info")).length > 5, JSON.stringify(await page.textContent("#info")));
  // Hovering in the plan marks the same block in 3D, in the table and in the plan.
  await page.locator("#plan-canvas").scrollIntoViewIfNeeded();
  const at = await page.evaluate(() => { const b = tsumu.data.found[0], c = tsumu.plan.canvas.getBoundingClientRect(); tsumu.plan.fit(); const p = tsumu.plan.at(...b.centre); return [c.left + p[0], c.top + p[1]]; });
  await page.mouse.move(...at);
  check("hovering in the plan points everywhere", await page.evaluate(() => tsumu.selection.pointed > 0 && tsumu.viewer.state.pointed === tsumu.selection.pointed));
  await page.fill("#found-table input[type=search]", "no such block");
  check("search filters", await page.locator("#found-table .vrow").count() === 0);
  await page.fill("#found-table input[type=search]", "");
  const download = page.waitForEvent("download");
  await page.locator("#found-table button", { hasText: "CSV" }).click();
  const csv = readFileSync(await (await download).path(), "utf8").trim().split("\r\n");
  check("CSV holds every row", csv.length === found + 1 + await page.evaluate(() => tsumu.data.places.length), csv[1]);
}
await page.click("#reset");
await settled();
if (added) {
  await changes("the placing order", () => set("#order", 1));
  await page.click("#play");
  await page.waitForFunction(() => tsumu.viewer.state.order > 1 || tsumu.data.added.length < 2);
  check("play goes on by itself", true);
  await page.click("#play");
  await set("#order", added);
}
await changes("a key", () => page.locator("#canvas").press("ArrowLeft"));
await changes("the view from above", () => page.click("#from-above"));
await page.click("#reset");
await changes("a level that is cut", () => set("#box-to", 50));
await shot("cut", "#stage");
await page.click("#box-clear");
for (const mode of await page.locator("#point-colour option").evaluateAll(o => o.map(x => x.value).slice(1))) {
  await changes(`points by ${mode}`, () => page.selectOption("#point-colour", mode));
}
await page.selectOption("#point-colour", "0");
if (found) for (const mode of ["confidence", "fit", "hidden"]) await changes(`blocks by ${mode}`, () => page.selectOption("#block-colour", mode));
await page.selectOption("#block-colour", "type");
if (await page.locator("#design-opacity").isVisible()) await changes("the design's opacity", () => set("#design-opacity", 0.9));
await page.click("#keep-view");
check("a view is kept", await page.locator("#views .pair").count() === 1);
// What lies beside a long and narrow site is no place: near a block both clicks meet the pile.
if (found) await page.locator("#found-table .vrow").first().click();
await page.click("[data-measure=distance]");
const box = await page.locator("#canvas").boundingBox();
for (const [x, y] of [[0.48, 0.5], [0.52, 0.52]]) await page.mouse.click(box.x + box.width * x, box.y + box.height * y);
check("measuring gives a distance", /distance [\d.,]+ m/.test(await page.textContent("#info")), JSON.stringify(await page.textContent("#info")));
await page.click("[data-measure=area]");
for (const [x, y] of [[0.48, 0.49], [0.52, 0.49], [0.5, 0.53]]) await page.mouse.click(box.x + box.width * x, box.y + box.height * y);
check("and an area", /area in plan [\d.,]+ m²/.test(await page.textContent("#info")), JSON.stringify(await page.textContent("#info")));
await page.click("[data-measure=area]");

// Sections: any spacing, areas that add up to volumes, a free line, the 3D view cut along.
if (works) {
  await page.locator("#section-spacing").fill("2");
  await page.locator("#section-spacing").press("Enter");
  const sums = await page.evaluate(() => tsumu.sections.rows.reduce((s, r, i, all) => s + (i ? (r.areas.fill + all[i - 1].areas.fill) / 2 * (r.chainage - all[i - 1].chainage) : 0), 0) - tsumu.sections.total.fill);
  check("volumes are average end areas", Math.abs(sums) < 1e-6 && await page.evaluate(() => tsumu.sections.total.fill > 0));
  await shot("sections", "#sections");
  await shot("plan", "#map");
  await page.evaluate(() => tsumu.plan.onDrawn("line", tsumu.plan.place(80, 60), tsumu.plan.place(400, 200)));
  check("a free section", (await page.textContent("#section-name")) === "free section");
  await changes("the slice in 3D", () => page.check("#follow-section"));
  await page.uncheck("#follow-section");
}

if (found) {
  await page.click("#review-start");
  check("the queue begins with the most doubtful", await page.evaluate(() => tsumu.selection.block() === tsumu.review.queue[0]));
  check("the plan is hidden and the neighbours are faded", await page.evaluate(() => !tsumu.viewer.state.showAdded && tsumu.viewer.state.fade === tsumu.selection.chosen));
  await settled();
  await shot("review", "#view");
  await page.keyboard.press("x");
  await page.fill("#review-note", "seen on site");
  await page.locator("#review-note").blur();
  check("X rejects and goes on", await page.evaluate(() => tsumu.review.decisions.get(tsumu.review.queue[0].id).verdict === "rejected" && tsumu.selection.block() === tsumu.review.queue[1]));
  await page.keyboard.press("p");
  await page.keyboard.press("Escape");
  if (added) {
    await page.evaluate(() => tsumu.selection.choose(tsumu.data.added[0].number));
    await page.keyboard.press("x");
    check("a planned block is struck out", await page.evaluate(() => tsumu.review.planned.get(tsumu.data.added[0].order) === "struck"));
  }
  const download = page.waitForEvent("download");
  await page.click("#review-save");
  const saved = JSON.parse(readFileSync(await (await download).path(), "utf8"));
  check("the review is saved", saved.format === 1 && saved.blocks.some(b => b.verdict === "rejected") && (!added || saved.placements[0].verdict === "struck"), JSON.stringify(saved.blocks[0]));
  await page.reload();
  await page.waitForFunction(() => document.documentElement.dataset.ready);
  check("a reload loses nothing", await page.evaluate(n => tsumu.review.decisions.size === n, saved.blocks.length));

  // Opened again, also with a decision about a block that this run does not show: both must be in the file that is saved next.
  const gone = { ...saved.blocks[0], block_id: 999999, x_m: saved.blocks[0].x_m + 50000, note: "taken away" };
  const renumbered = { ...saved.blocks[0], block_id: 888888 };
  await page.setInputFiles("#review-open", { name: "review.json", mimeType: "application/json", buffer: Buffer.from(JSON.stringify({ format: 1, reviewer: "Sato", blocks: [gone, renumbered] })) });
  await page.waitForFunction(() => tsumu.review.elsewhere.length === 1);
  const again = JSON.parse(await page.evaluate(() => tsumu.review.text()));
  check("a review goes on", again.reviewer === "Sato" && again.blocks.length === 2 && again.blocks[0].block_id === saved.blocks[0].block_id && again.blocks[1].note === "taken away", JSON.stringify(again.blocks.map(b => b.block_id)));
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
check("Tab goes from control to control", new Set(stops).size === 6 && stops.includes("canvas"), stops.join(", "));
check("what has the focus shows it", unseen.length === 0, unseen.join(", "));

await page.click("[data-set-lang=ja]");
check("Japanese", await page.locator("h2 [lang=ja]:visible").count() > 3 && await page.locator("h2 [lang=en]:visible").count() === 0);
check("X is north in Japanese", !found || !await page.evaluate(() => tsumu.data.crs) || (await page.textContent("#found-table .vhead")).includes("北（X）"));
await shot("whole-ja");
await page.click("#theme");
await settled();
await shot("whole-dark");
await page.click("#theme");
await page.click("[data-set-lang=en]");
await page.setViewportSize({ width: 390, height: 844 });
check("a phone needs no sideways scrolling", await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
await shot("phone");
await page.setViewportSize({ width: 1360, height: 900 });

check("no request but the file itself", requests.every(r => r === requests[0]), requests.filter(r => r !== requests[0]).join(" "));
check("no script error", errors.length === 0, errors.join(" | "));
await browser.close();
process.exit(failed ? 1 : 0);
