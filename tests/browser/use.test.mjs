// What a reader does with a page: zoom, read, toggle, reset, sort, play.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { launch, made, open, shoot } from "./browser.mjs";

let browser;
let pages;
before(async () => {
  pages = made(["calibration", "replay", "sweep"]);
  browser = await launch();
});
after(() => browser?.close());

// A figure whose caption begins like this, explored.
async function explored(page, caption) {
  const figure = page.locator("figure", { has: page.locator("figcaption", { hasText: caption }) });
  await figure.getByRole("button", { name: /^Explore/ }).click();
  return figure;
}
const range = async (figure, panel = 0) => {
  // The range is set when the browser next draws.
  await figure.page().waitForTimeout(80);
  const { low, high } = await figure.locator(".plot").nth(panel).evaluate((plot) => ({ ...plot.dataset }));
  return [Number(low), Number(high)];
};
const span = async (figure, panel) => {
  const [low, high] = await range(figure, panel);
  return high - low;
};
async function drag(figure, from, to, modifier) {
  const page = figure.page();
  const box = await figure.locator(".u-over").first().boundingBox();
  const [y, at] = [box.y + 0.5 * box.height, (share) => box.x + share * box.width];
  if (modifier) await page.keyboard.down(modifier);
  await page.mouse.move(at(from), y);
  await page.mouse.down();
  await page.mouse.move(at(0.5 * (from + to)), y);
  await page.mouse.move(at(to), y);
  await page.mouse.up();
  if (modifier) await page.keyboard.up(modifier);
}
const WHOLE = "the whole record";
// How many pixels of a canvas are reddish, as the simulated trace is.
const vermillion = (figure) =>
  figure.locator("canvas").first().evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 100 && data[i] > data[i + 2] + 60) count++;
    return count;
  });

test("a drag zooms into what it marks, a double click and a button go back", async () => {
  const { page, heard, close } = await open(browser, pages.calibration);
  const figure = await explored(page, WHOLE);
  const home = await range(figure);
  assert.ok(home[1] - home[0] > 700, `a record of ${home} µs`);
  await drag(figure, 0.4, 0.5);
  const near = await range(figure);
  assert.ok(Math.abs((near[1] - near[0]) / (home[1] - home[0]) - 0.1) < 0.01, String(near));
  assert.ok(Math.abs((near[0] - home[0]) / (home[1] - home[0]) - 0.4) < 0.01, String(near));
  await shoot(page, "calibration-zoomed");
  await figure.locator(".u-over").dblclick();
  assert.deepEqual(await range(figure), home);
  await drag(figure, 0.2, 0.7);
  assert.ok((await span(figure)) < 0.6 * (home[1] - home[0]));
  await figure.getByRole("button", { name: /^Reset/ }).click();
  assert.deepEqual(await range(figure), home);
  assert.deepEqual(heard.complaints, []);
  await close();
});

test("a spike of a microsecond can be looked at over the whole width", async () => {
  const { page, close } = await open(browser, pages.calibration);
  const figure = await explored(page, WHOLE);
  for (let i = 0; i < 9; i++) await figure.getByRole("button", { name: /^Zoom in/ }).click();
  assert.ok((await span(figure)) < 2, `${await span(figure)} µs`);
  await close();
});

test("shift and a drag move along, the span stays", async () => {
  const { page, close } = await open(browser, pages.calibration);
  const figure = await explored(page, WHOLE);
  await drag(figure, 0.4, 0.6);
  const before = await range(figure);
  await drag(figure, 0.75, 0.25, "Shift");
  const later = await range(figure);
  const width = before[1] - before[0];
  assert.ok(Math.abs(later[1] - later[0] - width) < 1e-6 * width, "same span");
  assert.ok(Math.abs((later[0] - before[0]) / width - 0.5) < 0.02, `${before} to ${later}`);
  await close();
});

test("keys zoom, move, read and reset", async () => {
  const { page, close } = await open(browser, pages.calibration);
  const figure = await explored(page, WHOLE);
  const home = await range(figure);
  await figure.locator(".plot").focus();
  await page.keyboard.press("+");
  assert.ok(Math.abs((await span(figure)) / (home[1] - home[0]) - 0.5) < 1e-6);
  const before = await range(figure);
  await page.keyboard.press("ArrowRight");
  assert.ok((await range(figure))[0] > before[0]);
  await page.keyboard.press("Shift+ArrowRight");
  assert.match(await figure.locator(".reading").textContent(), /^[\d.]+ µs +synthetic: .?[\d.]+ mm\/s +simulated: /);
  await page.keyboard.press("0");
  assert.deepEqual(await range(figure), home);
  await close();
});

test("the values under the pointer are those of the record", async () => {
  const { page, close } = await open(browser, pages.calibration);
  const figure = await explored(page, WHOLE);
  const box = await figure.locator(".u-over").boundingBox();
  const read = async (share) => {
    await page.mouse.move(box.x + share * box.width, box.y + 20);
    const found = (await figure.locator(".reading").textContent()).match(/(.*?) µs   synthetic: (.*?) mm\/s   simulated: (.*?) mm\/s/);
    return found.slice(1).map((it) => Number(it.replace("\u2212", "-")));
  };
  const [home, recorded] = [await range(figure), await import("node:fs")];
  const file = recorded.readFileSync(new URL("../../measurements/twin-annulus/vib.csv", import.meta.url), "utf8");
  const rows = file.split("\n").filter((line) => /^[-\d]/.test(line)).map((line) => line.split(",").map(Number));
  const level = Math.max(...rows.map((row) => row[1]));
  let largest = 0;
  for (let share = 0.3; share < 0.7; share += 0.0021) {
    const [time, synthetic, simulated] = await read(share);
    assert.ok(Math.abs(time - (home[0] + share * (home[1] - home[0]))) < 2, `${time} µs at ${share}`);
    assert.ok(Math.abs(synthetic - simulated) < 60, "the fit follows its record");
    largest = Math.max(largest, synthetic);
  }
  // Read every 1.8 µs, a spike may be met beside its top.
  assert.ok(largest > 100 && largest < 1.2 * 1e3 * level, `${largest} mm/s of ${1e3 * level}`);
  await close();
});

test("a trace goes and comes back by its name in the legend", async () => {
  const { page, close } = await open(browser, pages.calibration);
  const figure = await explored(page, WHOLE);
  const simulated = figure.locator(".legend").getByRole("button", { name: "simulated" });
  assert.equal(await simulated.getAttribute("aria-pressed"), "true");
  await page.waitForTimeout(100);
  const before = await vermillion(figure);
  assert.ok(before > 200, `${before} pixels`);
  await simulated.press("Enter");
  await page.waitForTimeout(100);
  assert.equal(await simulated.getAttribute("aria-pressed"), "false");
  assert.equal(await vermillion(figure), 0);
  await simulated.click();
  await page.waitForTimeout(100);
  assert.equal(await vermillion(figure), before);
  await close();
});

test("figures that show the same record, and panels over the same time, go together", async () => {
  const calibration = await open(browser, pages.calibration);
  const whole = await explored(calibration.page, WHOLE);
  const onset = await explored(calibration.page, "after the onset");
  const drive = await explored(calibration.page, "Displacement of the piston");
  const [homes, alone] = [[await range(whole), await range(onset)], await range(drive)];
  assert.notDeepEqual(homes[0], homes[1], "each opens where it is printed");
  await whole.scrollIntoViewIfNeeded();
  await drag(whole, 0.5, 0.6);
  assert.deepEqual(await range(onset), await range(whole));
  assert.deepEqual(await range(drive), alone, "the drive has a clock of its own");
  await onset.getByRole("button", { name: /^Reset/ }).click();
  assert.deepEqual([await range(whole), await range(onset)], homes);
  await calibration.close();

  const replay = await open(browser, pages.replay);
  const both = await explored(replay.page, "Displacement of the piston and velocity");
  await drag(both, 0.2, 0.4);
  assert.deepEqual(await range(both, 1), await range(both, 0));
  assert.ok((await span(both, 1)) < 150);
  await replay.close();
});

test("the printed drawing comes back", async () => {
  const { page, close } = await open(browser, pages.calibration);
  const figure = await explored(page, WHOLE);
  assert.ok(!(await figure.locator(".sheet").isVisible()));
  await figure.getByRole("button", { name: /^As printed/ }).click();
  assert.ok(await figure.locator(".sheet svg").isVisible());
  assert.equal(await figure.locator("canvas").count(), 0);
  await close();
});

test("a table sorts by a column's head, by mouse and key, and goes back to its order", async () => {
  const { page, close } = await open(browser, pages.sweep);
  const column = (index) => page.$$eval("tbody tr", (rows, i) => rows.map((row) => row.cells[i].textContent.replace("\u2212", "-")).map(parseFloat), index);
  const head = page.locator("th").nth(2);
  const printed = await column(2);
  const ascending = [...printed].sort((a, b) => a - b);
  assert.notDeepEqual(printed, ascending);
  await head.getByRole("button").click();
  assert.equal(await head.getAttribute("aria-sort"), "ascending");
  assert.deepEqual(await column(2), ascending);
  await head.getByRole("button").press("Enter");
  assert.equal(await head.getAttribute("aria-sort"), "descending");
  assert.deepEqual(await column(2), ascending.reverse());
  await head.getByRole("button").press("Space");
  assert.equal(await head.getAttribute("aria-sort"), null);
  assert.deepEqual(await column(2), printed);
  await close();
});

test("a long table folds", async () => {
  const { page, close } = await open(browser, pages.replay);
  const table = page.locator("details table");
  assert.ok(await table.isVisible());
  await page.locator("summary").press("Enter");
  assert.ok(!(await table.isVisible()));
  await close();
});

test("the chain plays, pauses, and goes where the slider says", async () => {
  const { page, heard, close } = await open(browser, pages.replay);
  const figure = page.locator("figure.motion");
  const state = () => figure.evaluate((it) => [it.querySelector("[data-clock]").textContent, [...it.querySelectorAll("[data-x]")].map((one) => one.getAttribute("transform")).join()]);
  const slider = figure.getByRole("slider");
  const printed = await state();
  await slider.focus();
  await page.keyboard.press("Home");
  const start = await state();
  assert.equal(start[0], "0.00 µs");
  assert.notEqual(start[1], printed[1]);
  await page.keyboard.press("ArrowRight");
  assert.notEqual((await state())[0], start[0]);
  await figure.getByRole("button", { name: "Faster" }).click();
  await figure.getByRole("button", { name: "Play" }).press("Enter");
  await page.waitForTimeout(600);
  await figure.getByRole("button", { name: "Pause" }).click();
  const paused = await state();
  assert.ok(parseFloat(paused[0]) > 5, paused[0]);
  await page.waitForTimeout(200);
  assert.deepEqual(await state(), paused);
  await shoot(page, "replay-playing");
  assert.deepEqual(heard.complaints, []);
  await close();
});
