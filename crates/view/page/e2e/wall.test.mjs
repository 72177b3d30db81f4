// The wall beside the rod: it is drawn, follows its sliders, and presses.

import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { ROOT, folder, launch, open, run, serve, settled, shot } from "./harness.mjs";

let browser;
const home = folder();

/** The scene of a golden file, as a file of its own. */
function scene(name) {
  const golden = JSON.parse(readFileSync(join(ROOT, "tests/data/wall", `${name}.json`), "utf8"));
  const path = join(home, `${name}.toml`);
  writeFileSync(path, golden.scene);
  return path;
}

before(async () => {
  browser = await launch();
});

after(async () => {
  await browser.close();
});

const drawn = (page) => page.evaluate(() => window.rodsweep.rod.wall.drawn());

test("a plane follows its slider and presses more the nearer it comes", async () => {
  const server = await serve(scene("p6-tissue"), "--keep");
  for (const theme of ["light", "dark"]) {
    const page = await open(browser, server.address, { theme });
    const first = await drawn(page);
    // A patch and its rim.
    assert.equal(first.bodies, 2);
    assert.equal(first.label, "1.88 mN");
    assert.ok(first.arrow[2] > 0, "the arrow that pushes stands on the side of the wall");
    assert.match(await page.locator(".legend").textContent(), /force of the wall f, 1\.88 mN/);
    assert.equal(await page.locator('[data-value="wall.force"]').textContent(), "1.875");
    await shot(page, `wall-plane-${theme}`);
    await page.evaluate(() => window.rodsweep.rod.set({ "wall.position.z": 0.078, "wall.rotation.y": 0.2 }));
    await settled(page);
    const second = await drawn(page);
    assert.ok(parseFloat(second.label) > 2, second.label);
    await shot(page, `wall-plane-moved-${theme}`);
    await page.evaluate(() => window.rodsweep.rod.set({ "wall.position.z": 0.12, "wall.rotation.y": 0 }));
    await settled(page);
    assert.equal((await drawn(page)).label, "");
    assert.equal(await page.locator('[data-value="wall.force"]').textContent(), "not touched");
    assert.deepEqual(page.troubles, []);
    await page.context().close();
  }
  await server.stop();
});

test("a held tip, a chamber and a vessel", async () => {
  for (const [name, force] of [["p6-held", "65.1 mN"], ["p6-chamber", "69.5 mN"], ["p6-vessel", "0.250 mN"]]) {
    const server = await serve(scene(name), "--keep");
    const page = await open(browser, server.address);
    assert.equal((await drawn(page)).label, force, name);
    if (name === "p6-held") assert.match(await page.locator('[data-value="wall.friction"]').textContent(), /^0\.420, slips$/);
    await shot(page, `wall-${name}`);
    assert.deepEqual(page.troubles, []);
    await page.context().close();
    await server.stop();
  }
});

test("an exported page draws the wall without an engine", async () => {
  const file = join(home, "held.html");
  await run("view", scene("p6-held"), "--export", file);
  const page = await open(browser, pathToFileURL(file).href, { offline: true, theme: "dark" });
  const { bodies, label } = await drawn(page);
  assert.deepEqual([bodies, label], [2, "65.1 mN"]);
  await shot(page, "wall-exported");
  assert.deepEqual(page.troubles, []);
  await page.context().close();
});
