// Rows that are not to be trusted: the page says so first, live and exported.

import assert from "node:assert/strict";
import { cpSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { ROOT, folder, launch, open, run, serve, settled, shot } from "./harness.mjs";

const place = folder();
const directory = join(place, "coils");
let browser;

before(async () => {
  browser = await launch();
  cpSync(join(ROOT, "tests/data/two_coil_elsewhere"), directory, { recursive: true });
});

after(() => browser.close());

async function warns(page) {
  const bar = page.locator("#distrust");
  assert.ok(await bar.isVisible());
  assert.match(await bar.innerText(), /^DISTRUSTED: \d+ of 256 samples/);
  assert.match(await page.title(), /^DISTRUSTED: /);
  await bar.locator("summary").click();
  assert.match(await bar.locator("pre").innerText(), /coilA\.current\.x/);
  const rows = await page.evaluate(() => window.rodsweep.source.description.map.wrong_rows);
  assert.ok(rows.length > 0);
  assert.equal(await page.evaluate((row) => window.rodsweep.map.isWrong(row), rows[0]), true);
  return rows[0];
}

test("the page begins with what speaks against its rows", async () => {
  await assert.rejects(run("view", directory, "--export", join(place, "none.html")), { code: 4 });
  const server = await serve(directory, "--keep", "--accept-distrusted");
  const page = await open(browser, server.address);
  const row = await warns(page);
  await page.fill(".row-form input", String(row));
  await page.press(".row-form input", "Enter");
  await page.waitForSelector(`.row-card h2:text-is("Row ${row}")`);
  await settled(page);
  assert.match(await page.locator(".row-card").innerText(), /found this row wrong/);
  assert.match(await page.locator("#right").innerText(), /not checked against the reference/);
  await shot(page, "distrusted");
  assert.deepEqual(page.troubles, []);
  await page.context().close();
  assert.equal(await server.stop(), 0);
});

test("an exported page carries the mark", async () => {
  const file = join(place, "coils.html");
  await run("view", directory, "--export", file, "--accept-distrusted");
  assert.ok(readFileSync(file, "utf8").includes("DISTRUSTED: "));
  const page = await open(browser, pathToFileURL(file).href, { offline: true });
  await warns(page);
  assert.deepEqual(page.troubles, []);
  await page.context().close();
});
