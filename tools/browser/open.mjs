// Uses the page of `tsumu open` in a real browser as a person without a terminal would: from a survey file to report, variant and
// comparison. No request may leave the machine, no script may fail.
//
//   npm install playwright-core
//   CHROMIUM=/usr/bin/chromium node open.mjs target/release/tsumu examples/breakwater [folder for pictures]
//
// Prints one line a check; exit 1 when one fails.

import { chromium } from "playwright-core";
import { spawn } from "node:child_process";
import { cpSync, existsSync, mkdirSync, mkdtempSync, readFileSync, renameSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const [, , program, sample, pictures] = process.argv;
if (!sample) { console.error("usage: node open.mjs PROGRAM SAMPLE_SITE [PICTURES]"); process.exit(2); }
let failed = 0;
const check = (what, ok, detail = "") => { console.log(`${ok ? "ok    " : "FAILED"} ${what} ${detail}`); if (!ok) failed++; };

const folder = mkdtempSync(join(tmpdir(), "tsumu-open-"));
writeFileSync(join(folder, "alignment.csv"), "east,north\n41243,-98760\n41257,-98760\n");
const server = spawn(program, ["--json", "open", folder, "--no-browser"]);
const address = await new Promise((done, no) => {
  let text = "";
  server.stdout.on("data", d => { text += d; if (text.includes("\n")) done(JSON.parse(text.split("\n")[0]).value.address); });
  server.on("exit", no);
});
const origin = new URL(address).origin;
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM || "/usr/bin/chromium", args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"] });
const requests = [], errors = [];
async function opened(options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, locale: "en-GB", ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(240000);
  page.on("request", r => { if (!/^(data|blob):/.test(r.url())) requests.push(r.url()); });
  page.on("pageerror", e => errors.push(e.message));
  page.on("console", m => { if (m.type() === "error" && !/status of (4|5)/.test(m.text())) errors.push(m.text()); });
  page.on("dialog", d => { errors.push(`dialog: ${d.message()}`); d.dismiss(); });
  await page.goto(address);
  await page.waitForFunction(() => document.documentElement.dataset.ready);
  return page;
}
const page = await opened();
const shot = async (name, on = page) => { if (pictures) { mkdirSync(pictures, { recursive: true }); await on.screenshot({ path: `${pictures}/${name}.png` }); } };
const ready = hash => page.waitForFunction(h => document.documentElement.dataset.ready === h, hash);
const label = text => page.getByLabel(text, { exact: true }).first();
const idle = () => page.waitForFunction(() => /can be answered|cannot be answered/.test(document.querySelector(".checkrow p, .verdict")?.textContent || ""));
const wide = () => page.evaluate(() => document.documentElement.scrollWidth - innerWidth);

try {
  // A survey becomes a site.
  check("an empty folder says what to do", (await page.textContent("main")).includes("Make the first one"));
  await shot("home-empty");
  await page.setInputFiles("input[type=file]", join(sample, "survey.laz"));
  await page.waitForSelector("text=files/survey.laz is stored");
  await page.setInputFiles("input[type=file]", join(sample, "survey.laz"));
  await page.waitForSelector(".bad");
  check("the same name twice is named", (await page.textContent(".bad")).includes("stored already"));
  const name = "East <img src=x onerror=alert(1)> =1+1";
  await label("Name of the site").fill(name);
  await label("Block").selectOption("tetrapod 5t");
  await page.click("text=Make the site");
  await page.waitForSelector("#height-map");
  await idle();
  check("a hostile name is text", (await page.textContent("h1")) === name && !errors.length, await page.textContent("h1"));
  check("the survey's system is read", (await label("Coordinate system").inputValue()) === "EPSG:6679");
  check("the map is drawn", await page.evaluate(() => { const c = document.getElementById("height-map"), d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data; let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n * 4 > d.length * 0.2; }));
  check("the block's size is said", /1\.93 m high.*points on one/.test(await page.textContent(".form")));
  await page.waitForSelector("text=The survey shows");
  const sized = await page.evaluate(() => [...document.querySelectorAll(".complaint.refusal")].map(c => c.closest(".field")?.querySelector("label").textContent));
  check("another size than the survey shows is refused beside its field", sized.includes("Height, m"), sized.join(", "));
  await shot("setup");
  await page.click("text=Use this size");
  await page.waitForSelector('text="Saved"');
  check("and the survey's is taken at a press", Math.abs(Number(await label("Height, m").inputValue()) - 2) < 0.03, await label("Height, m").inputValue());

  // Complaints stand beside their field, and go.
  await label("Coordinate system").fill("EPSG:6677");
  await page.waitForSelector('text="Saved"');
  await page.click("text=Check again");
  await page.waitForSelector(".complaint.refusal");
  const beside = await page.evaluate(() => document.querySelector(".complaint.refusal").closest(".field")?.querySelector("label").textContent);
  check("a wrong system is refused beside its field", beside === "Coordinate system", beside);
  await shot("complaint");
  await page.click("text=Use it");
  await page.waitForSelector('text="Saved"');

  // The design, drawn and typed.
  await label("Design").selectOption("section");
  await page.click("#draw");
  const box = await page.locator("#height-map").boundingBox();
  await page.mouse.click(box.x + box.width * 0.38, box.y + box.height * 0.5);
  await page.mouse.click(box.x + box.width * 0.62, box.y + box.height * 0.5);
  await page.keyboard.press("Enter");
  const area = page.locator("textarea");
  check("clicks become the alignment", (await area.inputValue()).trim().split("\n").length === 2, JSON.stringify(await area.inputValue()));
  await page.focus("#height-map");
  await page.evaluate(() => document.getElementById("draw").click());
  for (const key of ["ArrowLeft", "ArrowLeft", "Space", "ArrowRight", "ArrowRight", "ArrowRight", "ArrowRight", "Space", "Enter"]) await page.keyboard.press(key === "Space" ? " " : key);
  check("and so do keys alone", (await area.inputValue()).trim().split("\n").length === 2, JSON.stringify(await area.inputValue()));
  await label("Alignment from a file").selectOption({ label: "alignment.csv" });
  await idle();
  await page.waitForFunction(() => /about [\d,]+ m³/.test(document.querySelector(".strongish").textContent));
  check("an alignment is imported", await area.isDisabled());
  await label("Alignment from a file").selectOption("");
  await area.fill("41243, -98760\n41257, -98760");
  for (const [field, value] of [["Crest level, m", "3.4"], ["Crest width, m", "6"], ["Slopes end at, m", "1"]]) await label(field).fill(value);
  check("the space below is estimated at once", /about [\d,]+ m³/.test(await page.textContent(".look")), (await page.textContent(".strongish")));
  await label("Crest level, m").fill("three");
  check("what is no number is said beside it", (await page.textContent(".form")).includes("a number is needed here"));
  await label("Crest level, m").fill("3.4");
  await label("Day of the survey").fill("2026-11-30");
  await page.waitForSelector('text="Saved"');
  await page.click("text=Check again");
  await idle();
  await page.locator("#height-map").hover();
  await page.locator(".look select").selectOption("difference");
  await shot("design");
  const id = (await page.evaluate(() => location.hash)).split("/")[2];
  const site = decodeURIComponent(id);

  // Run: stop, reload in the middle, a second browser, go on.
  await page.click("text=2 Check and run");
  await page.waitForSelector(".verdict.good");
  await page.click("#run");
  await page.waitForSelector(".stage");
  await page.reload();
  await page.waitForSelector(".work .stage");
  check("a reload in the middle finds the work", true);
  const other = await opened();
  await other.goto(`${origin}/#/site/${id}/run`);
  await other.waitForSelector(".work .stage");
  check("a second browser sees it too", true);
  await shot("running");
  await other.click("#stop");
  await page.waitForSelector("text=nothing is lost");
  check("stopped by the second, named at the first", true, existsSync(join(folder, site, "run")) ? "finished parts are there" : "");
  await page.waitForSelector("text=Go on with the interrupted run");
  await page.click("#run");
  await page.waitForSelector("text=See the results");
  await shot("done");
  check("the run is whole", existsSync(join(folder, site, "run/report.html")));
  await other.context().close();

  // Results: the report in its box, its review kept in the site.
  await page.click("text=See the results");
  const report = page.frameLocator("iframe.report");
  const frame = await (await page.waitForSelector("iframe.report")).contentFrame();
  await frame.waitForFunction(() => document.documentElement.dataset.ready === "yes");
  await frame.waitForFunction(() => document.querySelector(".language").hidden);
  check("the report is boxed", await frame.evaluate(() => origin) === "null");
  check("and cannot ask the program", await frame.evaluate(url => fetch(url).then(() => false, () => true), `${origin}/api/state`));
  errors.splice(0, errors.length, ...errors.filter(e => !/Content Security Policy|Refused to connect|violates/.test(e)));
  await shot("results");
  await report.locator("#review-start").click();
  await frame.evaluate(() => document.dispatchEvent(new KeyboardEvent("keydown", { key: "x", bubbles: true })));
  await page.waitForSelector("text=decisions are kept");
  const kept = JSON.parse(readFileSync(join(folder, site, "review.json"), "utf8"));
  check("the review is kept in the site", kept.blocks.length === 1 && kept.blocks[0].verdict === "rejected");
  await page.reload();
  const again = await (await page.waitForSelector("iframe.report")).contentFrame();
  await again.waitForFunction(() => document.documentElement.dataset.ready === "yes" && window.tsumu.review.decisions.size === 1);
  check("a reload keeps the review", true);
  const download = page.waitForEvent("download");
  await page.locator(".downloads a", { hasText: "recognise/blocks.csv" }).click();
  check("every file can be taken along", readFileSync(await (await download).path(), "utf8").startsWith("block_id") && await page.locator(".downloads a").count() > 20, `${await page.locator(".downloads a").count()} files`);

  // What if.
  await page.click("text=4 What if");
  await page.click("#plan");
  check("a variant without a change is not planned", (await page.textContent("main")).includes("Change one of them first"));
  await label("Crest level, m").fill("3.9");
  await page.click("#plan");
  await page.waitForSelector(".side tbody tr:nth-child(2)");
  await label("Block to place").selectOption("tetrapod 8t");
  await page.click("#plan");
  await page.waitForSelector(".side tbody tr:nth-child(3)");
  const counts = await page.locator(".side tbody tr td:nth-child(3)").allTextContents();
  check("plans stand side by side", counts.length === 3 && Number(counts[1]) > Number(counts[0]), counts.join(", "));
  await shot("what-if");

  // Compare.
  await page.click("text=Compare surveys");
  await page.waitForSelector("text=Two sites, or one site with two results");
  cpSync(join(folder, site), join(folder, "later"), { recursive: true });
  await page.reload();
  await page.waitForSelector("#compare");
  await label("Name of the comparison").fill("../<b>2026</b>");
  await page.click("#compare");
  const compared = await (await page.waitForSelector("iframe.report")).contentFrame();
  await compared.waitForSelector("body");
  check("a comparison is shown", (await compared.textContent("body")).length > 200);
  await shot("compare");

  // Taken away while it is open.
  await page.goto(`${origin}/#/site/${id}/results`);
  await page.waitForSelector("iframe.report");
  renameSync(join(folder, site, "run"), join(folder, "..", "gone-run"));
  await page.reload();
  await page.waitForSelector("text=No finished run yet");
  check("a run that is gone is named", true);
  renameSync(join(folder, "..", "gone-run"), join(folder, site, "run"));

  // Japanese, dark, tablet, keys.
  await page.click("text=日本語");
  await page.goto(`${origin}/#/site/${id}/setup`);
  await page.waitForSelector("#height-map");
  await page.waitForFunction(() => document.querySelector(".checkrow p").textContent.includes("計算できます"));
  check("Japanese", (await page.textContent("main")).includes("平面座標系"));
  await shot("setup-ja");
  await page.click("#theme");
  await page.waitForFunction(() => document.documentElement.dataset.theme === "dark");
  await shot("setup-dark");
  await page.goto(`${origin}/#/`);
  await page.waitForSelector(".card");
  await shot("home-dark-ja");
  await page.click("#theme");
  for (const [w, h] of [[1280, 720], [820, 1180], [390, 844]]) {
    await page.setViewportSize({ width: w, height: h });
    for (const at of ["#/", `#/site/${id}/setup`, `#/site/${id}/run`, `#/site/${id}/variants`]) {
      await page.goto(`${origin}/${at}`);
      await ready(at);
      check(`no sideways scrolling at ${w} × ${h}, ${at.split("/").pop() || "home"}`, await wide() <= 0, String(await wide()));
      if (w === 820) await shot(`tablet-${at.split("/").pop() || "home"}`);
    }
  }
  await page.setViewportSize({ width: 1280, height: 720 });
  await page.goto(`${origin}/#/`);
  await ready("#/");
  const stops = new Set();
  for (let i = 0; i < 30; i++) {
    await page.keyboard.press("Tab");
    stops.add(await page.evaluate(() => { const a = document.activeElement; return `${a.tagName} ${a.textContent.slice(0, 12) || a.id} ${getComputedStyle(a).outlineStyle !== "none" || a === document.body}`; }));
  }
  check("Tab reaches every control and shows it", stops.size >= 9 && [...stops].every(s => s.endsWith("true")), `${stops.size} stops`);

  check("no script failed", errors.length === 0, errors.slice(0, 3).join(" | "));
  server.kill("SIGINT");
  await new Promise(done => server.once("exit", done));
  await page.evaluate(() => location.reload()).catch(() => {});
  check("no request left the machine", requests.every(r => r.startsWith(origin)), requests.find(r => !r.startsWith(origin)) || `${requests.length} requests`);
} catch (error) {
  await shot("failed").catch(() => {});
  check("the walk came to its end", false, `${error.message.split("\n").slice(0, 4).join(" ")}; on the page: ${errors.slice(0, 3).join(" | ")}`);
} finally {
  server.kill("SIGKILL");
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
process.exit(failed ? 1 : 0);
