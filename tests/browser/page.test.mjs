// The page that `packaging/page` makes: files in, report out, from file://, against the program on the same files.
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { axe, launch, open, root, shoot } from "./browser.mjs";

const PAGE = process.env.GRANCHAIN_PAGE ?? join(root, "target/page/granchain.html");
const PROGRAM = process.env.GRANCHAIN_PROGRAM ?? join(root, "target/release/granchain");
const FIT = 180_000; // ms
let browser;
before(async () => (browser = await launch()));
after(() => browser?.close());

const text = (name) => readFileSync(join(root, "measurements", name), "utf8");
const [VIB, HORN] = [text("twin-annulus/vib.csv"), text("twin-annulus/horn_tip.csv")];
const rows = (csv) => csv.split("\n").filter((line) => /^[-\d]/.test(line)).map((line) => line.split(",").map(Number));
// One file of an oscilloscope: horn at 2 µm/V, bead at 125 mm/s/V.
const SCOPE = () => {
  const [bead, horn] = [rows(VIB), rows(HORN)];
  const line = ([time, velocity], index) => `${time},${(horn[index][1] / 2000).toFixed(6)},${(velocity / 125).toFixed(6)}`;
  return `time_us,CH1 (V),CH2 (V)\n${bead.slice(0, horn.length).map(line).join("\n")}\n`;
};

// The page open, and the hands of a user.
async function opened(options) {
  const session = await open(browser, PAGE, options);
  const { page, heard } = session;
  const status = () => page.locator("#status").textContent();
  const settled = async (timeout = 30_000) => {
    await page.waitForFunction(() => document.getElementById("cancel").disabled && !/…$/.test(document.getElementById("status").textContent), null, { timeout });
    return { status: await status(), refused: await page.locator("#refused").textContent(), warned: await page.locator("#warned").textContent() };
  };
  await settled();
  const choose = async (files) => {
    const made = Object.entries(files).map(([name, content]) => ({ name, mimeType: "", buffer: Buffer.from(content) }));
    await page.locator("#files").setInputFiles(made);
    await page.locator("#named").waitFor();
    return settled();
  };
  const fill = async (id, value) => {
    const field = page.locator(`#${id}`);
    if ((await field.evaluate((it) => it.tagName)) === "SELECT") await field.selectOption(value);
    else await field.fill(value);
    await field.blur();
    return settled();
  };
  const press = async (name, timeout) => {
    await page.getByRole("button", { name, exact: true }).click();
    return settled(timeout);
  };
  const result = () => page.locator("#done").evaluate((it) => JSON.parse(it.dataset.result));
  const records = () => page.locator("#named").evaluate((it) => JSON.parse(it.dataset.records));
  // The worker's own address is no request; nothing else is asked for.
  heard.outward = () => heard.outside().filter((it) => !it.startsWith("blob:null/") && !it.startsWith("blob:file://"));
  return { ...session, choose, fill, press, settled, status, result, records };
}

// The command on the page, typed where the files are; the folder that it wrote.
function program(files, command, ...more) {
  const folder = mkdtempSync(join(tmpdir(), "granchain-page-"));
  for (const [name, content] of Object.entries(files)) writeFileSync(join(folder, name), content);
  const line = command.replace(/^granchain/, `"${PROGRAM}"`);
  execFileSync("bash", ["-c", `${line} --out out --quiet ${more.join(" ")}`], { cwd: folder, stdio: ["ignore", "ignore", "inherit"] });
  const read = (name) => JSON.parse(readFileSync(join(folder, "out", name), "utf8"));
  const inspect = (name, ...flags) => JSON.parse(execFileSync(PROGRAM, ["inspect", name, "--json", ...flags], { cwd: folder, encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] }));
  return { read, inspect };
}

// Numbers of one tree are those of the other.
function same(found, expected, tolerance, where = "") {
  if (typeof expected === "number") {
    assert.ok(Math.abs(found - expected) <= tolerance * Math.max(Math.abs(expected), 1e-12), `${where}: ${found}, expected ${expected}`);
  } else if (expected && typeof expected === "object") {
    for (const key of Object.keys(expected)) same(found?.[key], expected[key], tolerance, `${where}.${key}`);
  } else assert.equal(found, expected, where);
}

function sameFit(page, own) {
  assert.equal(page.verdict, own.verdict);
  for (const [name, { value, low, high }] of Object.entries(own.parameters)) {
    const found = page.parameters[name];
    // Of a record that is not explained no interval is quoted, and the values are those of the most similar run.
    if (low === null) {
      assert.deepEqual([found.low, found.high], [null, null]);
      continue;
    }
    const tenth = 0.1 * 0.5 * (high - low);
    for (const [a, b] of [[found.value, value], [found.low, low], [found.high, high]]) {
      assert.ok(Math.abs(a - b) <= tenth, `${name}: ${a}, the program has ${b}, a tenth of a half-width is ${tenth}`);
    }
  }
}

test("the twin is read, run and fitted as the program does it, and the report saved", { timeout: 600_000 }, async () => {
  assert.ok(statSync(PAGE).size <= 4e6, `${statSync(PAGE).size} bytes`);
  const files = { "vib.csv": VIB, "horn_tip.csv": HORN };
  const { page, heard, choose, press, result, records, close } = await opened();
  const { refused } = await choose(files);
  assert.equal(refused, "");
  const command = await page.locator("#command").textContent();
  const dry = program(files, command, "--dry-run");
  const [bead, horn] = await records();
  for (const [found, name] of [[bead, "vib.csv"], [horn, "horn_tip.csv"]]) {
    const { drive_frequency_hz, drive_frequency_from, warnings, assumptions, ...own } = dry.inspect(name);
    same(found, own, 1e-9, name);
  }
  await press("Dry run");
  same(await result(), dry.read("dry-run.json"), 1e-9, "features");
  assert.ok((await page.locator("#result figure").count()) >= 2);
  await shoot(page, "page-dry-run", { fullPage: true });

  const began = performance.now();
  const { status } = await press("Fit", FIT);
  assert.match(status, /^fitted in [\d.]+ s: within scatter/);
  const took = (performance.now() - began) / 1000;
  const one = program(files, command, "--threads", "1", "--cache", "none");
  sameFit(await result(), one.read("calibration.json"));
  const native = one.read("timing.json").total_s;
  console.log(`fit and report: ${took.toFixed(2)} s in the browser, ${native.toFixed(2)} s by the program on one thread, ${(took / native).toFixed(2)} times`);

  await page.locator("#result").getByRole("button", { name: /^Explore/ }).first().click();
  assert.ok((await page.locator("#result canvas").count()) >= 1);
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save the report" }).click()]);
  assert.equal(download.suggestedFilename(), "vib-report.html");
  const kept = join(tmpdir(), `granchain-page-${process.pid}.html`);
  await download.saveAs(kept);
  const report = await open(browser, kept);
  assert.match(await report.page.locator(".headline").textContent(), /^within scatter/i);
  assert.ok((await report.page.locator("figure").count()) >= 3);
  assert.deepEqual([report.heard.complaints, report.heard.outside()], [[], []]);
  await report.close();
  await page.evaluate(() => scrollTo(0, 0));
  await shoot(page, "page-fit");
  assert.deepEqual([heard.complaints, heard.outward()], [[], []]);
  await close();
});

test("one file of an oscilloscope in volts, and a record that no model reproduces, end as in the program", { timeout: 900_000 }, async () => {
  const { page, choose, fill, press, result, close } = await opened();
  const scope = { "scope.csv": SCOPE() };
  const asked = await choose(scope);
  // What only the laboratory knows is asked for; which column is the horn's is seen.
  assert.match(asked.refused, /scope\.csv.*volt/is);
  assert.equal(await page.locator("#channel").inputValue(), "CH2 (V)");
  assert.equal(await page.locator("#tip-channel").inputValue(), "CH1 (V)");
  assert.equal(await page.locator("#scale").getAttribute("aria-invalid"), "true");
  await fill("scale", "125 mm/s/V");
  assert.equal((await fill("tip-scale", "2 um/V")).refused, "");
  const command = await page.locator("#command").textContent();
  await press("Fit", FIT);
  sameFit(await result(), program(scope, command).read("calibration.json"));

  await page.getByRole("button", { name: "Choose other files" }).click();
  const invented = { "vib.csv": text("annulus-73khz/vib.csv"), "horn_tip.csv": text("annulus-73khz/horn_tip.csv") };
  await choose(invented);
  await press("Fit", 2 * FIT);
  const found = await result();
  assert.equal(found.verdict, "outside scatter");
  sameFit(found, program(invented, await page.locator("#command").textContent()).read("calibration.json"));
  await close();
});

test("a fit tells of its progress, the page stays alive, and it is cancelled at once", async () => {
  const { page, choose, press, settled, close } = await opened();
  await choose({ "vib.csv": VIB, "horn_tip.csv": HORN });
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await page.waitForFunction(() => document.getElementById("progress").value > 0.05, null, { timeout: 60_000 });
  const frame = await page.evaluate(() => new Promise((done) => {
    const from = performance.now();
    requestAnimationFrame(() => done(performance.now() - from));
  }));
  assert.ok(frame < 500, `${frame} ms to the next frame`);
  const began = performance.now();
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.waitForFunction(() => document.getElementById("status").textContent === "cancelled");
  assert.ok(performance.now() - began < 500, `${performance.now() - began} ms`);
  // The next run is a whole one.
  await settled();
  assert.match((await press("Dry run")).status, /^done in/);
  await close();
});

// What goes wrong most, and what the page says: where, and what to do.
const numbers = (csv, change) => csv.split("\n").map((line) => (/^[-\d]/.test(line) ? change(line.split(",")) : line)).join("\n");
const MISTAKES = {
  "a wrong unit": { files: { "vib.csv": VIB, "horn_tip.csv": HORN }, fields: { unit: "kg" }, says: /“Unit of the bead”.*expected the unit of a velocity.*found that of/s },
  "two files swapped": { files: { "a.csv": VIB, "b.csv": HORN }, fields: { horn: "a.csv" }, says: /b\.csv.*swapped/s },
  "an empty file": { files: { "vib.csv": "", "horn_tip.csv": HORN }, says: /vib\.csv: .*found an empty file; export it again/s },
  "a binary file": { files: { "vib.csv": Buffer.from([0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10, 0, 0, 0, 13]), "horn_tip.csv": HORN }, says: /vib\.csv: expected text, found .*export the record as CSV/s },
  "volts without a sensitivity": { files: { "vib.csv": VIB.replace("velocity_mm_per_s", "CH1 (V)"), "horn_tip.csv": HORN }, says: /vib\.csv.*volts.*“Sensitivity, bead”/s },
};

test("the commonest mistakes are answered with place and remedy, in the page's own words", { timeout: 300_000 }, async () => {
  const { page, choose, fill, press, close } = await opened();
  for (const [name, { files, fields = {}, says }] of Object.entries(MISTAKES)) {
    let said = await choose(files);
    for (const [id, value] of Object.entries(fields)) said = await fill(id, value);
    if (!said.refused && !said.warned) said = await press("Dry run");
    const all = `${said.refused}\n${said.warned}`;
    assert.match(all, says, name);
    assert.doesNotMatch(all, /--(?!evaluations)[a-z]/, name);
    await page.getByRole("button", { name: "Choose other files" }).click();
    await fill("frequency", "");
  }
  await close();
});

test("keys alone lead from the files to the verdict of a dry run, also in a narrow window", async () => {
  for (const width of [1200, 400]) {
    const { page, heard, choose, settled, close } = await opened({ width });
    await choose({ "vib.csv": VIB, "horn_tip.csv": HORN });
    await page.locator("#files").focus();
    const reached = [];
    for (let i = 0; i < 30 && reached.at(-1) !== "dry_run"; i++) {
      await page.keyboard.press("Tab");
      reached.push(await page.evaluate(() => document.activeElement.id));
    }
    for (const id of ["horn", "channel", "scale", "tip-scale", "scene", "settings", "frequency", "damping", "dry_run"]) assert.ok(reached.includes(id), id);
    await page.keyboard.press("Enter");
    await settled();
    assert.ok(await page.locator("#result figure").first().isVisible());
    assert.ok((await page.evaluate(() => document.documentElement.scrollWidth - innerWidth)) <= 0, `${width} px`);
    await shoot(page, `page-${width}`, { fullPage: true });
    assert.deepEqual([heard.complaints, heard.outward()], [[], []]);
    await page.evaluate(axe);
    const found = await page.evaluate(() => window.axe.run(document, { runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"], resultTypes: ["violations"] }));
    assert.deepEqual(found.violations.map((one) => `${one.id}: ${one.nodes[0].html.slice(0, 120)}`), []);
    await close();
  }
});
