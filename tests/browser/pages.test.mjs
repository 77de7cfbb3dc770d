// Every page, in light, dark and on paper, wide and narrow, with and without scripts.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { axe, committed, launch, made, open, shoot } from "./browser.mjs";

let browser;
let fresh;
before(async () => {
  fresh = made();
  browser = await launch();
});
after(() => browser?.close());

const all = () => ({ ...committed(), ...fresh });

// Names of what axe finds, with the element.
async function violations(page) {
  await page.evaluate(axe);
  const rules = { runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "best-practice"], resultTypes: ["violations"] };
  const found = await page.evaluate((options) => window.axe.run(document, options), rules);
  return found.violations.map((one) => `${one.id}: ${one.nodes.slice(0, 3).map((node) => node.html.slice(0, 120)).join(" | ")}`);
}

const overflow = (page) => page.evaluate(() => document.documentElement.scrollWidth - innerWidth);

test("no page overflows, complains or asks the network for anything, at 1200 and 400 px", async () => {
  for (const [name, path] of Object.entries(all())) {
    for (const width of [1200, 400]) {
      const { page, heard, close } = await open(browser, path, { width });
      assert.ok((await overflow(page)) <= 0, `${name} at ${width} px is ${await overflow(page)} px too wide`);
      assert.deepEqual(heard.complaints, [], name);
      assert.deepEqual(heard.outside(), [], name);
      await close();
    }
  }
});

test("a page runs no script, loads no picture and asks nothing that is not its own", async () => {
  for (const [name, path] of Object.entries(fresh)) {
    const { page, close } = await open(browser, path);
    const refused = await page.evaluate(async () => {
      const directives = [];
      document.addEventListener("securitypolicyviolation", (event) => directives.push(event.effectiveDirective));
      const script = document.createElement("script");
      script.textContent = "window.foreign = true";
      const style = document.createElement("style");
      style.textContent = "p { display: none }";
      const image = document.createElement("img");
      image.src = "https://example.org/a.png";
      document.body.append(script, style, image);
      await fetch("https://example.org/").catch(() => {});
      await new Promise((done) => setTimeout(done, 100));
      return [...directives.sort(), window.foreign ?? "not run"];
    });
    assert.deepEqual(refused, ["connect-src", "img-src", "script-src-elem", "style-src-elem", "not run"], name);
    await close();
  }
});

test("every figure has a name, a text alternative and, where it is wider than the screen, a way to scroll", async () => {
  for (const [name, path] of Object.entries(all())) {
    const { page, close } = await open(browser, path, { width: 400 });
    const figures = await page.$$eval("figure", (list) =>
      list.map((figure) => ({
        alternative: figure.querySelector('svg[role="img"] > title')?.textContent ?? "",
        caption: figure.querySelector("figcaption")?.textContent ?? "",
        scrolls: figure.querySelector(".sheet")?.scrollWidth > figure.querySelector(".sheet")?.clientWidth,
        wide: figure.classList.contains("wide"),
      })),
    );
    for (const figure of figures) {
      assert.ok(figure.alternative.length > 10, `${name}: a figure without text alternative`);
      assert.match(figure.caption, /^(Figure \d+|Motion)\. ./, name);
      if (Object.hasOwn(fresh, name)) assert.equal(figure.scrolls, figure.wide, `${name}: ${figure.caption}`);
    }
    await close();
  }
});

test("fresh pages pass axe in light and in dark, as they open and while figures are explored", async () => {
  for (const [name, path] of Object.entries(fresh)) {
    for (const colorScheme of ["light", "dark"]) {
      const { page, close } = await open(browser, path, { colorScheme });
      assert.deepEqual(await violations(page), [], `${name}, ${colorScheme}`);
      for (const explore of (await page.$$("button[aria-label^=Explore]")).slice(0, 2)) await explore.click();
      assert.deepEqual(await violations(page), [], `${name}, ${colorScheme}, explored`);
      await shoot(page, `${name}-${colorScheme}`, { fullPage: name !== "joint" });
      await close();
    }
    const narrow = await open(browser, path, { width: 400 });
    assert.deepEqual(await violations(narrow.page), [], `${name}, 400 px`);
    await shoot(narrow.page, `${name}-400`);
    await narrow.close();
  }
});

test("a dark page is dark and its figures lie on a light plate", async () => {
  const { page, close } = await open(browser, fresh.calibration, { colorScheme: "dark" });
  const [ground, sheet] = await page.evaluate(() =>
    [document.body, document.querySelector(".sheet")].map((it) => getComputedStyle(it).backgroundColor),
  );
  assert.equal(sheet, "rgb(255, 255, 255)");
  assert.ok(ground.match(/\d+/g).every((channel) => Number(channel) < 60), ground);
  await close();
});

test("without scripts every figure and every table stands in the page, and no control", async () => {
  for (const [name, path] of Object.entries(fresh)) {
    const { page, close } = await open(browser, path, { javaScriptEnabled: false });
    const [figures, drawn] = [await page.locator("figure").count(), await page.locator("figure svg").count()];
    assert.ok(figures > 0 && figures === drawn, name);
    for (const svg of await page.locator("figure svg").all()) assert.ok((await svg.boundingBox()).height > 50, name);
    assert.equal(await page.locator("button").count(), 0, name);
    assert.equal(await page.locator("figure canvas").count(), 0, name);
    await shoot(page, `${name}-without-scripts`);
    await close();
  }
});

test("on paper every figure is as printed, every table open, and no control is left", async () => {
  for (const [name, path] of Object.entries(fresh)) {
    for (const javaScriptEnabled of [true, false]) {
      const { page, close } = await open(browser, path, { javaScriptEnabled });
      if (javaScriptEnabled) {
        for (const explore of (await page.$$("button[aria-label^=Explore]")).slice(0, 2)) await explore.click();
        await page.evaluate(() => document.querySelectorAll("details").forEach((one) => (one.open = false)));
      }
      await page.emulateMedia({ media: "print" });
      for (const svg of await page.locator("figure svg").all()) assert.ok((await svg.boundingBox())?.height > 50, name);
      for (const row of await page.locator("table tbody tr:last-child").all()) assert.ok(await row.isVisible(), name);
      for (const control of await page.locator(".controls, .live").all()) assert.ok(!(await control.isVisible()), name);
      if (javaScriptEnabled) await shoot(page, `${name}-print`, { fullPage: name !== "joint" });
      await close();
    }
  }
});

test("the contents lead to every heading of a long page", async () => {
  const { page, close } = await open(browser, fresh.calibration);
  const links = await page.$$eval(".contents a", (list) => list.map((link) => [link.textContent, link.getAttribute("href")]));
  const headings = await page.$$eval("h2", (list) => list.map((heading) => [heading.textContent, `#${heading.id}`]));
  assert.ok(links.length > 3);
  assert.deepEqual(links, headings);
  await close();
});

test("a calibration shows its waveform on the first screen", async () => {
  const { page, close } = await open(browser, fresh.calibration);
  const box = await page.locator("figure svg").first().boundingBox();
  assert.ok(box.y + box.height < 900, `ends at ${box.y + box.height} px`);
  await close();
});

test("what is printed of a bench stands beside no synthetic record, and no backtick or dots beside words", async () => {
  for (const name of ["calibration", "joint", "effects"]) {
    const { page, close } = await open(browser, fresh[name]);
    const text = await page.evaluate(() => document.querySelector("main").innerText);
    assert.doesNotMatch(text, /`|\u2026/, name);
    if (name !== "effects") {
      const heads = await page.$$eval("th", (list) => list.map((head) => head.textContent));
      assert.ok(heads.includes("sensitivity") && !heads.includes("published"), name);
    }
    await close();
  }
});
