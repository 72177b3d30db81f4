// Starts the program and a browser without network, window or profile.

import { execFile, spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";
import { chromium } from "playwright-core";

export const ROOT = resolve(dirname(fileURLToPath(import.meta.url)), "../../../..");
export const PROGRAM = resolve(process.env.RODSWEEP_PROGRAM ?? join(ROOT, "target/release/rodsweep"));
/** Where pictures are put. */
export const SHOTS = process.env.RODSWEEP_SHOTS ? resolve(process.env.RODSWEEP_SHOTS) : null;
const FLAGS = [
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];
const SOFTWARE = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];

/** A folder that is gone at the end. */
export function folder() {
  const path = mkdtempSync(join(tmpdir(), "rodsweep-e2e-"));
  process.on("exit", () => rmSync(path, { recursive: true, force: true }));
  return path;
}

export function launch(flags = SOFTWARE) {
  const executablePath = process.env.RODSWEEP_CHROMIUM ?? "/usr/bin/chromium";
  return chromium.launch({ executablePath, headless: true, args: [...FLAGS, ...flags] });
}

/** What the program prints. */
export async function run(...words) {
  const { stdout } = await promisify(execFile)(PROGRAM, words, { cwd: ROOT, maxBuffer: 1 << 28 });
  return stdout;
}

/** `rodsweep view` of a source: its address, and an end. */
export async function serve(source, ...options) {
  const child = spawn(PROGRAM, ["view", source, "--no-open", ...options], { cwd: ROOT });
  const ended = new Promise((done) => child.on("exit", (code) => done(code)));
  const address = await new Promise((done, failed) => {
    let text = "";
    let errors = "";
    child.stderr.on("data", (data) => (errors += data));
    child.stdout.on("data", (data) => {
      text += data;
      if (text.includes("\n")) done(text.trim());
    });
    child.on("exit", () => failed(new Error(`the program ended: ${errors}`)));
  });
  return { address, ended, stop: () => (child.kill("SIGINT"), ended) };
}

/** A page that has shown everything; whatever goes wrong in it is an error. */
export async function open(browser, address, { theme = "light", width = 1280, height = 720, offline = false } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, colorScheme: theme, offline });
  const page = await context.newPage();
  const troubles = [];
  page.on("pageerror", (error) => troubles.push(error.message));
  page.on("console", (message) => message.type() === "error" && troubles.push(message.text()));
  page.requests = [];
  page.on("request", (request) => page.requests.push(request.url()));
  await page.goto(address);
  await page.waitForSelector("body.is-ready", { timeout: 60000 });
  page.troubles = troubles;
  await settled(page);
  return page;
}

/** Until every answer has come and is drawn. */
export async function settled(page) {
  await page.waitForFunction(() => !window.rodsweep.rod.isPending() && !window.rodsweep.dragging?.isPending());
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
}

export async function shot(page, name) {
  if (SHOTS) await page.screenshot({ path: join(SHOTS, `${name}.png`) });
}
