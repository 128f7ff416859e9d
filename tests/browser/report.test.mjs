// node report.test.mjs NODE_MODULES CHROMIUM SAMPLES [PICTURES]
import { createRequire } from "node:module";
import assert from "node:assert/strict";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { pathToFileURL } from "node:url";

const [modules, chromium, samples, pictures] = process.argv.slice(2);
const { chromium: launcher } = createRequire(path.join(path.resolve(modules), "x.js"))("playwright-core");
const flags = ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];

async function withPage(extra, options, file, work) {
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), "talus-browser-"));
  const context = await launcher.launchPersistentContext(profile, { executablePath: chromium, headless: true, args: [...flags, ...extra], viewport: { width: 1440, height: 1000 }, offline: true, ...options });
  try {
    const page = context.pages()[0] || (await context.newPage()), errors = [];
    page.setDefaultTimeout(120000);   // drawn in software, on a crowded machine
    page.on("console", (m) => { if (m.type() === "error") errors.push(m.text()); });
    page.on("pageerror", (e) => errors.push(String(e)));
    page.on("request", (r) => { if (!/^(file|data|blob):/.test(r.url())) errors.push(`network: ${r.url()}`); });
    const session = await context.newCDPSession(page);
    await session.send("Performance.enable", { timeDomain: "threadTicks" });   // CPU time of the page's thread: a crowded machine does not count
    await page.goto(pathToFileURL(path.join(samples, file, "report.html")).href, { timeout: 120000 });
    await page.waitForFunction(() => window.talus !== undefined);
    const opened = (await session.send("Performance.getMetrics")).metrics.find((m) => m.name === "TaskDuration").value;
    await page.evaluate(() => window.talus.ready);
    await work(page, opened);
    assert.deepEqual(errors, [], "console errors");
  } finally {
    await context.close();
    fs.rmSync(profile, { recursive: true, force: true });
  }
}
const shot = (page, name, options) => (pictures ? page.screenshot({ path: path.join(pictures, `${name}.png`), ...options }) : null);
// Texts below the contrast of 4.5 that WCAG 2.1 AA asks for, on plain grounds.
function lowContrast() {
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (color) => { canvas.clearRect(0, 0, 1, 1); canvas.fillStyle = color; canvas.fillRect(0, 0, 1, 1); const [r, g, b, a] = canvas.getImageData(0, 0, 1, 1).data; return [r, g, b, a / 255]; };
  const luminance = ([r, g, b]) => [r, g, b].map((v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4)).reduce((s, v, i) => s + v * [0.2126, 0.7152, 0.0722][i], 0);
  const found = new Set(), walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walk.nextNode(); node; node = walk.nextNode()) {
    const e = node.parentElement;
    if (!node.textContent.trim() || !e.checkVisibility() || e.closest("script, style, .skip, .stage")) continue;   // the stage is seen through
    let ground = null;
    for (let at = e; at && !ground; at = at.parentElement) { const c = rgba(getComputedStyle(at).backgroundColor); if (c[3] > 0.5) ground = c; }
    if (e.closest(":disabled")) continue;
    let opacity = 1;   // what is faded mixes with its ground
    for (let at = e; at; at = at.parentElement) opacity *= +getComputedStyle(at).opacity;
    const seen = rgba(getComputedStyle(e).color).map((c, i) => opacity * c + (1 - opacity) * ground[i]);
    const [a, b] = [luminance(seen), luminance(ground)].sort((x, y) => y - x);
    if ((a + 0.05) / (b + 0.05) < 4.5) found.add(`${((a + 0.05) / (b + 0.05)).toFixed(2)} ${e.tagName}.${e.className}: ${node.textContent.trim().slice(0, 30)}`);
  }
  return [...found];
}
// What the usual audits of accessibility ask of a page: names of controls and pictures, labels of fields, order of headings, unique ids, tables with heads, lists of their items.
function inaccessible() {
  const found = [], shown = [...document.body.querySelectorAll("*")].filter((e) => e.checkVisibility());
  const name = (e) => (e.getAttribute("aria-label") || (e.getAttribute("aria-labelledby") || "").split(" ").map((i) => (document.getElementById(i) || {}).textContent || "").join(" ") || [...(e.labels || [])].map((l) => l.textContent).join(" ") || e.textContent || e.title || "").trim();
  let level = 0;
  for (const e of shown) {
    const tag = e.tagName.toLowerCase(), say = (what) => found.push(`${what}: ${e.outerHTML.slice(0, 120)}`);
    if (/^(button|a|summary|canvas|dialog|nav|section)$/.test(tag) && !name(e) && e.getAttribute("role") !== "presentation") say("no name");
    if (/^(input|select|textarea)$/.test(tag) && !(e.getAttribute("aria-label") || [...e.labels].some((l) => l.textContent.trim()))) say("no label");
    if (tag === "canvas" && !e.getAttribute("role")) say("a picture without a role");
    if (/^h[1-6]$/.test(tag)) { if (+tag[1] > level + 1) say(`a heading that skips from ${level}`); level = +tag[1]; }
    if (e.id && document.querySelectorAll(`#${CSS.escape(e.id)}`).length > 1) say("an id twice");
    if (tag === "li" && !/^(UL|OL|MENU)$/.test(e.parentElement.tagName)) say("an item without a list");
    if (/^(dt|dd)$/.test(tag) && !e.closest("dl")) say("a term without a list");
    if (tag === "table" && e.classList.contains("data") && !e.querySelector("th[scope=col]")) say("a table without heads");
    if (e.tabIndex > 0) say("an order of its own for the tabulator");
    if (e.closest("[aria-hidden=true]") && e.tabIndex >= 0) say("hidden, yet in reach of the keyboard");
    if (/^(button|a|select)$/.test(tag) && e.closest("summary, button, a") !== e && e.closest("summary, button, a")) say("a control within a control");
    const r = e.getBoundingClientRect();
    if (/^(button|select)$/.test(tag) && (r.width < 24 || r.height < 24)) say(`a target of ${Math.round(r.width)} x ${Math.round(r.height)}`);
  }
  if (document.documentElement.lang !== "en") found.push("no language");
  if (!document.title) found.push("no title");
  if (document.querySelectorAll("main").length !== 1) found.push("no main part");
  return found;
}
// Brings the section to the top and waits until the page stands still there: the page scrolls smoothly, and a scroll that is under way, or what is laid out late, moves it on.
async function bringToTop(page, id) {
  for (let still = 0, k = 0; still < 3; k++) {
    assert.ok(k < 300, `the page comes to rest at #${id}`);
    const off = await page.evaluate((i) => { const e = document.getElementById(i), before = e.getBoundingClientRect().top; e.scrollIntoView({ behavior: "instant" }); return Math.abs(e.getBoundingClientRect().top - before); }, id);
    still = off < 0.5 ? still + 1 : 0;
    await page.waitForTimeout(200);
  }
}
const software = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const flat = ["--disable-gpu", "--disable-software-rasterizer", "--disable-3d-apis"];   // no WebGL: for what the 3D view has no part in
const only = process.env.TALUS_BROWSER_ONLY;
const tests = {
  async "playback moves, picking works, keys work"() {
    await withPage(software, { colorScheme: "dark", reducedMotion: "reduce" }, "one", async (page, opened) => {   // a smooth scroll under way would move the page from under the pointer
      assert.ok(opened > 0 && opened < 3, `opened in ${opened} s of CPU time`);   // without the 3D view, which comes after
      assert.equal(await page.evaluate(() => window.talus.webgl), true, "WebGL");
      assert.match(await page.textContent("#headline"), /B1 struck P2 at 5/);
      await page.waitForTimeout(600);
      await shot(page, "one-dark");
      // What is drawn is not one colour.
      const before = await page.locator("#stage").screenshot();
      await page.click("#play");
      await page.waitForFunction(() => window.talus.time > 0.05);
      await page.keyboard.press(" ");
      assert.equal(await page.evaluate(() => window.talus.playing), false);
      const after = await page.locator("#stage").screenshot();
      assert.notDeepEqual(before, after, "the picture changed");

      await page.evaluate(() => { window.talus.setTime(5.3); window.talus.preset("structure", true); });
      await page.waitForTimeout(500);
      await shot(page, "structure");
      const box = await page.locator("#view").boundingBox();
      await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
      assert.deepEqual(await page.evaluate(() => window.talus.chosen), { kind: "structure", index: 0 });
      assert.match(await page.textContent("#panel"), /P2/);
      await page.waitForSelector("#panel .uplot");
      await shot(page, "picked-structure");
      await page.keyboard.press("Escape");
      assert.equal(await page.isVisible("#panel"), false);

      await page.evaluate(() => { document.getElementById("playback").scrollIntoView({ behavior: "instant" }); window.talus.setTime(3); window.talus.preset("overview", true); });
      await page.waitForTimeout(800);
      const [x, y] = await page.evaluate(() => window.talus.onScreen(0));
      await page.mouse.click(x, y);
      assert.deepEqual(await page.evaluate(() => window.talus.chosen), { kind: "block", index: 0 });
      assert.match(await page.textContent("#panel h2"), /B1/);
      await page.waitForSelector("#panel .uplot");
      await shot(page, "picked-block");
      await page.keyboard.press("Escape");

      // The same without a mouse: what to select, from where to look.
      for (const [key, kind] of [["n", "structure"], ["n", "block"], ["b", "structure"]]) {
        await page.keyboard.press(key);
        assert.deepEqual(await page.evaluate(() => window.talus.chosen), { kind, index: 0 });
      }
      await page.keyboard.press("Escape");
      for (const key of ["a", "w", "i"]) {
        const place = await page.evaluate(() => window.talus.onScreen(0));
        await page.keyboard.press(key);
        assert.notDeepEqual(await page.evaluate(() => window.talus.onScreen(0)), place, `${key} moves the view`);
      }
      for (const [title, kind] of [["Structures", "structure"], ["Blocks", "block"]]) {
        await page.locator(".table", { has: page.locator("summary b", { hasText: title }) }).locator("tr.pick").first().focus();
        await page.keyboard.press("Enter");
        assert.equal((await page.evaluate(() => window.talus.chosen)).kind, kind, `a row of the table ${title}`);
        await page.keyboard.press("Escape");
      }
      await page.keyboard.press("?");
      await page.keyboard.press(" ");
      assert.equal(await page.evaluate(() => window.talus.playing), false, "keys act on the help alone while it is open");
      await page.evaluate(() => document.getElementById("help").close());

      const now = await page.evaluate(() => window.talus.time);
      await page.keyboard.press("ArrowRight");
      assert.ok((await page.evaluate(() => window.talus.time)) > now);
      await page.keyboard.press("Home");
      assert.equal(await page.evaluate(() => window.talus.time), 0);
      await page.keyboard.press(".");
      assert.ok(Math.abs((await page.evaluate(() => window.talus.time)) - 4.98) < 1e-6, "next impact");
      const theme = await page.getAttribute("html", "data-theme");
      await page.keyboard.press("t");
      assert.notEqual(await page.getAttribute("html", "data-theme"), theme);
      await page.selectOption("#field", "displacement");
      assert.match(await page.textContent("#legend"), /Displacement/);
      await page.evaluate(() => { window.talus.setTime(5.05); window.talus.preset("structure", true); });
      await page.selectOption("#field", "bars");
      assert.match(await page.textContent("#legend"), /Strain of the bars/);
      await page.waitForTimeout(400);
      await shot(page, "bars");

      // The wheel scrolls the page until the view is chosen; then it goes to what is under the pointer, whatever lies behind or before the point turned about.
      await page.evaluate(() => { document.activeElement.blur(); window.talus.setTime(3); window.talus.preset("overview", true); });
      await bringToTop(page, "playback");
      const [bx, by] = await page.evaluate(() => window.talus.onScreen(0)), away = await page.evaluate(() => window.talus.distance(0));
      await page.mouse.move(bx, by);
      const scrolled = await page.evaluate(() => scrollY);
      await page.evaluate(() => { const hint = document.getElementById("zoom-hint"); window.hinted = !hint.hidden; new MutationObserver(() => { window.hinted = window.hinted || !hint.hidden; }).observe(hint, { attributes: true }); });
      await page.mouse.wheel(0, 120);
      await page.waitForFunction((y) => scrollY > y, scrolled);
      assert.ok(Math.abs((await page.evaluate(() => window.talus.distance(0))) / away - 1) < 1e-9, "a page that scrolls does not zoom");
      for (let k = 0; k < 20 && !(await page.evaluate(() => window.hinted)); k++) {   // what was laid out late has moved the view from under the pointer
        await bringToTop(page, "playback");
        await page.mouse.move(...(await page.evaluate(() => window.talus.onScreen(0))));
        await page.mouse.wheel(0, 120);
        await page.waitForTimeout(300);
      }
      assert.ok(await page.evaluate(() => window.hinted), "a wheel over the view that is not chosen says how to zoom");
      await bringToTop(page, "playback");
      await page.mouse.move(bx, by);
      await page.evaluate((y) => scrollTo({ top: y, behavior: "instant" }), scrolled);
      await page.evaluate(() => document.getElementById("view").focus({ preventScroll: true }));
      for (let k = 0; k < 15; k++) await page.mouse.wheel(0, -100);
      await page.waitForFunction((d) => window.talus.distance(0) < 0.15 * d, away);
      const near = await page.evaluate(() => window.talus.distance(0)), [nx, ny] = await page.evaluate(() => window.talus.onScreen(0));
      assert.ok(near < 0.15 * away, `15 notches: from ${away} to ${near} m`);
      assert.ok(Math.hypot(nx - bx, ny - by) < 60, `it stays under the pointer: ${[bx, by]} to ${[nx, ny]}`);
      assert.equal(await page.evaluate(() => scrollY), scrolled, "the page does not scroll while the view zooms");
      await shot(page, "zoomed");
      for (let k = 0; k < 15; k++) await page.mouse.wheel(0, 100);
      await page.waitForFunction((d) => window.talus.distance(0) > 0.5 * d, away);   // and back

      const [download] = await Promise.all([page.waitForEvent("download"), page.keyboard.press("p")]);
      const png = fs.readFileSync(await download.path());
      assert.equal(png.subarray(1, 4).toString(), "PNG");
      assert.ok(png.length > 5000, "the picture shows something");

      // Every plot gets drawn, whether it comes into sight or not: a print and a picture of the whole page need them all.
      await page.waitForFunction(() => [...document.querySelectorAll("#plots figure, #site figure:not(.wide-map)")].every((f) => f.querySelector(".uplot")), null, { timeout: 60000 });
      // The map too, though it is far below what is seen.
      await page.waitForFunction(() => document.getElementById("map").width > 400, null, { timeout: 60000 });
      const painted = await page.evaluate(() => { const c = document.getElementById("map"), d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data; return new Set(Array.from({ length: 500 }, (_, i) => d[4 * Math.floor((i * d.length) / 2000)])).size; });
      assert.ok(painted > 20, `${painted} tones on the map`);
      // No label of an axis is cut off: a lost minus sign is a wrong number.
      const hidden = await page.evaluate(() => window.talus.charts().flatMap((u) => u.axes.filter((a) => a.side === 3).map((a) => { u.ctx.font = a.font[0]; return Math.max(0, ...a._values.map((v) => u.ctx.measureText(v).width / devicePixelRatio)) + a.ticks.size + a.gap - a._size; })).filter((over) => over > 0));
      assert.deepEqual(hidden, [], "labels cut off");
      // On paper the page is light, whatever the screen shows.
      assert.equal(await page.evaluate(() => { document.documentElement.dataset.theme === "dark" || document.getElementById("theme").click(); dispatchEvent(new Event("beforeprint")); return document.documentElement.dataset.theme; }), "light");
      assert.equal(await page.evaluate(() => { dispatchEvent(new Event("afterprint")); return document.documentElement.dataset.theme; }), "dark");
      await page.keyboard.press("t");
      const cut = await page.evaluate(() => [...document.querySelectorAll(".scroll")].filter((e) => e.scrollWidth > e.clientWidth + 1).map((e) => e.parentElement.querySelector("b").textContent));
      assert.deepEqual(cut, [], "tables cut off at 1440 pixels");
      const figures = await page.locator("#plots figure").count();
      assert.ok(figures >= 7, `${figures} plots`);
      assert.equal(await page.locator("#plots .uplot").count(), figures);
      assert.ok((await page.locator("#tables table").count()) >= 6);
      const formulas = await page.locator(".table", { hasText: "Design cross-checks" }).innerText();
      for (const name of ["Hertz", "EN 1991-1-7", "EN 1992-1-1"]) assert.match(formulas, new RegExp(name));
      assert.doesNotMatch(formulas, /cushion/);   // there is none
      assert.match(formulas, /unverified/);
      await shot(page, "one-light-full", { fullPage: true });
      await page.evaluate(() => { window.copied = ""; Object.defineProperty(navigator, "clipboard", { value: { writeText: async (t) => { window.copied = t; } }, configurable: true }); });
      await page.locator(".table", { hasText: "single sub-step, which depends on cells" }).locator("button.copy").click();
      const copied = await page.evaluate(() => window.copied);
      assert.equal(copied.split("\n").length, 2);
      assert.equal(copied.split("\n")[0].split("\t").length, copied.split("\n")[1].split("\t").length);
    });
  },
  async "plots have names and come as pictures and numbers"() {
    await withPage(flat, {}, "one", async (page) => {
      await page.waitForFunction(() => [...document.querySelectorAll("#plots figure, #site figure")].every((f) => f.querySelector(".downloads")), null, { timeout: 60000 });
      const unnamed = await page.evaluate(() => [...document.querySelectorAll("canvas")].filter((c) => c.id !== "view" && !(c.getAttribute("role") === "img" && c.getAttribute("aria-label").length > 20)).map((c) => c.outerHTML));
      assert.deepEqual(unnamed, [], "canvases without a name");
      const take = async (figure, which) => {
        const [download] = await Promise.all([page.waitForEvent("download"), figure.locator(".downloads button", { hasText: which }).click()]);
        return [download.suggestedFilename(), fs.readFileSync(await download.path())];
      };
      const force = page.locator("figure", { hasText: "P2: base force" }), [name, png] = await take(force, "PNG");
      assert.match(name, /^Synthetic-boulder.*P2-base-force\.png$/);
      assert.equal(png.subarray(1, 4).toString(), "PNG");
      const drawn = await page.evaluate(() => document.querySelector("#plots .uplot canvas").height);
      assert.ok(png.readUInt32BE(20) > drawn, "with a title and the names of the curves");
      const [, csv] = await take(force, "CSV"), lines = csv.toString().trim().split("\r\n");
      assert.equal(lines[0], "t [s],x [N],y [N],z [N]");
      assert.ok(lines.length > 500 && lines.every((l) => l.split(",").length === 4));
      assert.equal(+lines[1].split(",")[3], -1.2e6);   // in newtons, whatever the axis shows
      const [, paths] = await take(page.locator("figure.wide-map"), "CSV"), rows = paths.toString().trim().split("\r\n");
      assert.equal(rows[0], "block,t [s],x [m],y [m],z [m],speed [m/s]");
      assert.match(rows[1], /^B1,0,10\d\d/);   // scene coordinates, not those of the view
    });
  },
  async "a member's section forces, the deck, lines and places"() {
    await withPage(flat, {}, "one", async (page) => {
      await page.waitForFunction(() => document.querySelectorAll("#plots .group figure .uplot").length > 7, null, { timeout: 60000 });
      const titles = () => page.evaluate(() => [...document.querySelectorAll("#plots figcaption > span:first-child")].map((e) => e.textContent));
      assert.ok((await titles()).includes("P2: shear force V"), "the worst member comes first");
      assert.ok(!(await titles()).some((t) => /S1/.test(t)));
      const shown = page.locator("figure", { hasText: "P2: shear force V" });
      assert.match(await shown.innerText(), /permanent load[\s\S]*greatest of the run[\s\S]*V_Rd, design[\s\S]*greatest mean over 1.5 ms/);
      assert.match(await page.locator("figure", { hasText: "plotted are rows" }).first().innerText(), /table: 36.0 MN at station 3.00 m, mean over 1.5 ms of every step/);   // why it is not what is read off
      assert.match(await page.locator("figure", { hasText: "P2: displacement of top" }).innerText(), /greatest/);
      await page.selectOption("#member", { label: "P2, S1" });
      await page.waitForFunction(() => [...document.querySelectorAll("#plots figcaption > span:first-child")].some((e) => e.textContent === "P2, S1: bending moment M"));
      assert.ok(!(await titles()).includes("P2: shear force V"));
      const card = await page.locator(".stat", { hasText: "Deck" }).innerText();
      assert.match(card, /open/);
      const table = (name) => page.locator(".table", { has: page.locator("summary b", { hasText: name }) });
      assert.match(await table("Deck").innerText(), /S1\s+open\s+damage class [01]/);
      assert.match(await table("Crossings of lines").innerText(), /road\s+B1\s+4\s+21.93\s+4100/);
      assert.match(await table("Places of the members").innerText(), /P2\s+P2\s+1120/);
      assert.match(await page.textContent("#map-note"), /Coordinates: of the scene/);
    });
  },
  async "shortcuts can be switched off"() {
    await withPage(flat, {}, "one", async (page) => {
      const theme = () => page.getAttribute("html", "data-theme");
      await page.click("#help-button");
      await page.uncheck("#shortcuts");
      assert.ok(await page.isVisible("#help"), "the box does not shut the help");
      await page.keyboard.press("Escape");
      const before = await theme();
      await page.keyboard.press("t");
      assert.equal(await theme(), before, "a letter does nothing");
      await page.reload();
      await page.waitForFunction(() => window.talus);
      await page.evaluate(() => window.talus.ready);
      await page.keyboard.press("t");
      assert.equal(await theme(), before, "and that is kept");
      await page.click("#help-button");
      assert.equal(await page.isChecked("#shortcuts"), false);
      await page.check("#shortcuts");
      await page.keyboard.press("Escape");
      await page.keyboard.press("t");
      assert.notEqual(await theme(), before);
    });
  },
  async "everything has a name, a level and a label"() {
    await withPage(software, {}, "one", async (page) => {
      assert.match(await page.textContent("#legend"), /Impulse of an impact: where and which way/, "the arrows have a legend");
      for (const open of [false, true]) {
        if (open) { await page.evaluate(() => window.talus.choose({ kind: "structure", index: 0 })); await page.waitForTimeout(300); }
        assert.deepEqual(await page.evaluate(inaccessible), []);
      }
    });
  },
  async "texts are told from their ground in both themes"() {
    for (const colorScheme of ["light", "dark"])
      await withPage(flat, { colorScheme }, "one", async (page) => {
        const faint = await page.evaluate(lowContrast);
        assert.deepEqual(faint, [], colorScheme);
      });
  },
  async "a phone's width has no sideways scrolling"() {
    await withPage(software, { viewport: { width: 390, height: 844 }, colorScheme: "light" }, "one", async (page) => {
      const [wide, seen] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
      assert.ok(wide <= seen + 1, `page is ${wide} wide in ${seen}`);
      const tall = await page.evaluate(() => document.documentElement.scrollHeight);
      assert.ok(tall < 5500, `${tall} pixels on a phone`);   // plots and tables come folded
      assert.equal(await page.locator("#plots details[open], #tables details[open]").count(), 0);
      const folded = () => page.locator("details:not([open])").count(), before = await folded();
      await page.evaluate(() => dispatchEvent(new Event("beforeprint")));
      assert.equal(await folded(), 0, "on paper nothing is folded");
      // A4 of 19 cm between its margins: no column beyond them, in type that is set for paper.
      await page.emulateMedia({ media: "print" });
      await page.setViewportSize({ width: 718, height: 1000 });
      const beyond = await page.evaluate(() => [...document.querySelectorAll("table.data")].filter((t) => t.getBoundingClientRect().right > innerWidth + 1 || parseFloat(getComputedStyle(t).fontSize) > 10).map((t) => t.closest(".table").querySelector("b").textContent));
      assert.deepEqual(beyond, [], "tables wider than the paper");
      await page.emulateMedia({ media: "screen" });
      await page.setViewportSize({ width: 390, height: 844 });
      await page.evaluate(() => dispatchEvent(new Event("afterprint")));
      assert.equal(await folded(), before);
      await page.locator("#plots summary").first().click();
      await page.waitForSelector("#plots .uplot");
      assert.ok((await page.locator("#plots .uplot").first().boundingBox()).width > 300, "an unfolded plot has the width of the page");
      assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= seen + 1);
      await page.locator("#plots summary").first().click();
      await page.evaluate(() => scrollTo(0, 0));
      await page.evaluate(() => { window.talus.setTime(5.02); });
      await page.waitForTimeout(300);
      await shot(page, "phone");
      await shot(page, "phone-full", { fullPage: true });
    });
  },
  async "a thousand blocks play"() {
    await withPage(software, { colorScheme: "light" }, "many", async (page, opened) => {
      console.log(`    opened in ${opened.toFixed(2)} s of CPU time`);
      assert.ok(fs.statSync(path.join(samples, "many", "report.html")).size < 20e6);
      await page.evaluate(() => window.talus.setTime(4));
      await page.waitForTimeout(1200);
      await shot(page, "many");
      const t = await page.evaluate(() => { window.talus.play(true); return window.talus.time; });
      await page.waitForFunction((before) => window.talus.time > before, t, { timeout: 60000 });   // drawn in software, a picture may take seconds
    });
  },
  async "no blocks, and no WebGL"() {
    await withPage(software, {}, "none", async (page) => { assert.match(await page.textContent("#headline"), /P2/); });
    await withPage(flat, {}, "one", async (page) => {
      assert.equal(await page.evaluate(() => window.talus.webgl), false);
      assert.match(await page.textContent("#no-webgl"), /no WebGL/);
      await page.click("#play");
      await page.waitForTimeout(400);
      assert.ok((await page.evaluate(() => window.talus.time)) > 0);
    });
  },
};
let failed = 0;
for (const [name, test] of Object.entries(tests)) {
  if (only && !name.includes(only)) continue;
  try {
    await test();
    console.log(`ok   ${name}`);
  } catch (e) {
    failed++;
    console.log(`FAIL ${name}\n${e.stack}`);
  }
}
process.exit(failed ? 1 : 0);
