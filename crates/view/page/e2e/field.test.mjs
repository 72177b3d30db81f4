// Lines of the field around the rod.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { folder, launch, open, run, serve, settled, shot } from "./harness.mjs";

const ARM = "sweeps/scenes/arm_magnet.toml";
let browser;
let server;

before(async () => {
  browser = await launch();
  server = await serve(ARM, "--keep");
});

after(async () => {
  await browser.close();
  await server.stop();
});

const lines = (page) => page.evaluate(() => window.rodsweep.rod.lines.all());

/** Bodies of the requests for rods, from now on. */
function asked(page) {
  const bodies = [];
  page.on("request", (request) => request.url().endsWith("api/solve") && bodies.push(request.postDataJSON()));
  return bodies;
}

/** How many pixels of the stage differ from those before; `act` changes something. */
async function changedPixels(page, act) {
  const pixels = () =>
    page.evaluate(() => {
      const { stage } = window.rodsweep;
      stage.draw();
      const gl = stage.renderer.getContext();
      const all = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
      gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, all);
      window.pixels = [...(window.pixels ?? []), all].slice(-2);
    });
  await pixels();
  await act();
  await settled(page);
  await pixels();
  return page.evaluate(() => {
    const [one, other] = window.pixels;
    let count = 0;
    for (let k = 0; k < one.length; k += 4) if (one[k] !== other[k] || one[k + 2] !== other[k + 2]) count += 1;
    return count;
  });
}

test("lines of the magnet are drawn, follow its slider and not the rod's", async () => {
  const page = await open(browser, server.address);
  const first = await lines(page);
  assert.ok(first.length > 20, `${first.length} lines`);
  const box = await page.evaluate(() => {
    const { box, perMetre } = window.rodsweep.stage;
    return [box.min, box.max].map((corner) => corner.toArray().map((x) => x / perMetre));
  });
  for (const { positions } of first) positions.forEach((x, k) => assert.ok(x > box[0][k % 3] - 1e-4 && x < box[1][k % 3] + 1e-4));
  assert.match(await page.locator(".legend").textContent(), /lines of B; \|B\| = 45\.9 mT at the tip/);
  assert.equal(await page.locator('[data-value="field"]').textContent(), "45.92");
  await shot(page, "field-light");
  const bodies = asked(page);
  await page.evaluate(() => window.rodsweep.rod.set({ "loads.tip_force.y": 2e-3 }));
  await settled(page);
  assert.deepEqual(await lines(page), first);
  await page.evaluate(() => window.rodsweep.rod.set({ "magnets.arm.position.y": 0.03, "magnets.arm.rotation.y": 1.2 }));
  await settled(page);
  const moved = await lines(page);
  assert.ok(moved.length > 20 && JSON.stringify(moved) !== JSON.stringify(first));
  assert.deepEqual(bodies.map(({ lines }) => lines), [bodies[0].lines, bodies[0].lines]);
  assert.ok(bodies[0].lines > 0);
  await shot(page, "field-turned");
  assert.deepEqual(page.troubles, []);
  await page.context().close();
});

test("the switch hides the lines and spares the engine", async () => {
  const page = await open(browser, server.address, { theme: "dark" });
  await shot(page, "field-dark");
  const box = page.getByLabel("Lines of B");
  assert.ok(await box.isChecked());
  const off = await changedPixels(page, () => box.uncheck());
  assert.ok(off > 2000, `${off} pixels were lines`);
  assert.deepEqual(await lines(page), []);
  assert.doesNotMatch(await page.locator(".legend").textContent(), /lines of B/);
  const bodies = asked(page);
  await page.evaluate(() => window.rodsweep.rod.set({ "magnets.arm.position.y": 0.02 }));
  await settled(page);
  assert.ok(bodies.every((body) => !("lines" in body)) && bodies.length > 0);
  const before = await changedPixels(page, () => box.check());
  assert.ok(before > 2000, `${before} pixels are lines`);
  const fresh = await open(browser, server.address);
  await fresh.evaluate(() => window.rodsweep.rod.set({ "magnets.arm.position.y": 0.02 }));
  await settled(fresh);
  assert.deepEqual(await lines(page), await lines(fresh), "those of the values by now");
  assert.deepEqual([...page.troubles, ...fresh.troubles], []);
  await page.context().close();
  await fresh.context().close();
});

test("a uniform field has neither lines nor a switch", async () => {
  const uniform = await serve("sweeps/scenes/p6.toml", "--keep");
  const page = await open(browser, uniform.address);
  const bodies = asked(page);
  await page.evaluate(() => window.rodsweep.rod.set({ "coil.current.x": 0.1 }));
  await settled(page);
  assert.ok(bodies.length === 1 && !("lines" in bodies[0]));
  assert.equal(await page.evaluate(() => window.rodsweep.rod.lines), null);
  assert.equal(await page.getByLabel("Lines of B").count(), 0);
  assert.doesNotMatch(await page.locator("body").textContent(), /lines of B|at the tip \(mT\)/);
  assert.deepEqual(page.troubles, []);
  await page.context().close();
  await uniform.stop();
});

test("the exported page has the lines of its scene", async () => {
  const path = join(folder(), "arm.html");
  await run("view", ARM, "--export", path);
  const page = await open(browser, pathToFileURL(path).href, { offline: true });
  const live = await open(browser, server.address);
  assert.deepEqual(await lines(page), await lines(live));
  const off = await changedPixels(page, () => page.getByLabel("Lines of B").uncheck());
  assert.ok(off > 2000, `${off} pixels were lines`);
  await page.getByLabel("Lines of B").check();
  await settled(page);
  assert.ok((await lines(page)).length > 20);
  assert.deepEqual(page.troubles, []);
  await page.context().close();
  await live.context().close();
});
