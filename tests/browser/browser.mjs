// The browser, the pages it opens, and what every page is held to.
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, readdirSync, existsSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

export const root = join(dirname(fileURLToPath(import.meta.url)), "../..");
export const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const screenshots = join(root, "target/screenshots");
mkdirSync(screenshots, { recursive: true });

export function launch() {
  return chromium.launch({
    executablePath: "/usr/bin/chromium",
    headless: true,
    args: [
      "--no-sandbox",
      "--disable-gpu",
      "--disable-quic",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
      "--mute-audio",
      "--autoplay-policy=no-user-gesture-required",
    ],
  });
}

const scene = ["--scene", "annulus", "--model", "chain"];
const COMMANDS = {
  calibration: ["calibrate", "--plan", "calibrations/twin-annulus.toml", "--model", "chain"],
  joint: ["calibrate", "--plan", "calibrations/twin-levels.toml", "--model", "chain"],
  replay: ["replay", ...scene],
  sweep: ["sweep", ...scene, "--vary", "alpha=0.2:1:0.2"],
  spectrum: ["spectrum", "measurements/twin-annulus/vib.csv"],
  effects: ["scene", "explain", "annulus", "--measure", "--set", "model.kind=chain"],
};

// Pages that the program makes now, by name; once for all files of tests where ./run names a folder for them.
// GRANCHAIN_ONLY names the one that a quick run looks at.
const only = process.env.GRANCHAIN_ONLY;

export function made(names = only ? [only] : Object.keys(COMMANDS)) {
  const folder = process.env.GRANCHAIN_PAGES ?? mkdtempSync(join(tmpdir(), "granchain-pages-"));
  const options = { cwd: root, stdio: ["ignore", "ignore", "inherit"] };
  const page = (name) => {
    const out = join(folder, name);
    if (existsSync(join(out, "report.html"))) return [name, join(out, "report.html")];
    execFileSync(join(root, "target/release/granchain"), [...COMMANDS[name], "--quiet", "--out", out], options);
    return [name, join(out, "report.html")];
  };
  return Object.fromEntries(names.map(page));
}

export function committed() {
  const pages = {};
  if (only) return pages;
  for (const name of readdirSync(join(root, "reports"))) {
    const page = join(root, "reports", name, "report.html");
    if (existsSync(page)) pages[name] = page;
  }
  return pages;
}

// A page opened, with everything it asked for and complained of.
export async function open(browser, path, options = {}) {
  const { width = 1200, height = 900, media, ...context } = options;
  const session = await browser.newContext({ viewport: { width, height }, ...context });
  const page = await session.newPage();
  if (media) await page.emulateMedia({ media });
  const heard = { requests: [], complaints: [] };
  page.on("request", (request) => heard.requests.push(request.url()));
  page.on("console", (message) => message.type() === "error" && heard.complaints.push(message.text()));
  page.on("pageerror", (error) => heard.complaints.push(String(error)));
  const url = pathToFileURL(path).href;
  await page.goto(url);
  // The page itself and what stands in it are no requests.
  heard.outside = () => heard.requests.filter((it) => it !== url && !it.startsWith("data:"));
  return { page, heard, close: () => session.close() };
}

export function shoot(page, name, more = {}) {
  return page.screenshot({ path: join(screenshots, `${name}.png`), ...more });
}
