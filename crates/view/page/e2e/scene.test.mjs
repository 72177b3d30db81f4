// The rod that follows the sliders.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { launch, open, run, serve, settled, shot } from "./harness.mjs";

const SCENE = "sweeps/scenes/p6.toml";
let browser;
let server;

before(async () => {
  browser = await launch();
  server = await serve(SCENE, "--keep");
});

after(async () => {
  await browser.close();
  assert.equal(await server.stop(), 0);
});

const slider = (page, name) => page.locator(`input[type=range][data-name="${name}"]`);

/** What the page draws and what `solve` says of the same arguments. */
async function agrees(page) {
  await settled(page);
  const drawn = await page.evaluate(() => window.rodsweep.rod.drawnTip());
  const words = (await page.evaluate(() => window.rodsweep.rod.setArguments())).split(" ").filter(Boolean);
  const solved = JSON.parse(await run("solve", SCENE, "--json", ...words));
  solved.tip.position.forEach((x, axis) => assert.ok(Math.abs(x - drawn[axis]) < 1e-9, `${x} is drawn at ${drawn[axis]}`));
  const shown = await page.locator('[data-value="tip.x"]').textContent();
  assert.equal(shown.replace("\u2212", "-"), (solved.tip.position[0] * 1e3).toFixed(4));
  return solved;
}

test("a slider moves, and the drawn tip is that of solve", async () => {
  const page = await open(browser, server.address);
  const before = await agrees(page);
  await slider(page, "coil.current.x").fill("1490");
  await slider(page, "coil.current.z").fill("400");
  const after = await agrees(page);
  assert.ok(Math.abs(after.tip.position[1] - before.tip.position[1]) > 1e-3, "the rod has moved");
  // A number, in the unit beside it; and the keyboard.
  const insertion = page.getByLabel("insertion in mm, as a number");
  await insertion.fill("88.5");
  await insertion.press("Enter");
  await agrees(page);
  assert.equal(await page.evaluate(() => window.rodsweep.rod.values.insertion), 88.5 / 1000);
  await slider(page, "coil.current.x").focus();
  await page.keyboard.press("ArrowRight");
  await agrees(page);
  assert.match(await page.locator(".status").textContent(), /Stable/);
  await shot(page, "rod-light");
  await page.getByRole("button", { name: "Reset inputs" }).click();
  await settled(page);
  assert.equal(await page.evaluate(() => window.rodsweep.rod.setArguments()), "");
  assert.deepEqual(page.troubles, []);
});

test("the camera is that of the figures", async () => {
  const page = await open(browser, server.address);
  const { style, seen } = await page.evaluate(() => ({
    style: window.rodsweep.source.description.style,
    seen: window.rodsweep.stage.directions(),
  }));
  const [a, e] = [style.azimuth, style.elevation].map((degrees) => (degrees * Math.PI) / 180);
  const right = [-Math.sin(a), Math.cos(a), 0];
  const toward = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
  [0, 1, 2].forEach((k) => {
    assert.ok(Math.abs(seen.right[k] - right[k]) < 1e-9);
    assert.ok(Math.abs(seen.toward[k] - toward[k]) < 1e-9);
  });
});

test("every equilibrium is listed and drawn, ellipsoids are shown", async () => {
  const page = await open(browser, server.address, { theme: "dark" });
  await slider(page, "coil.current.x").fill("1400");
  await slider(page, "coil.current.y").fill("167");
  await slider(page, "coil.current.z").fill("1667");
  await settled(page);
  await page.getByLabel("Manipulability").check();
  await page.getByLabel("Compliance").check();
  await page.getByRole("button", { name: "All equilibria" }).click();
  await page.waitForSelector(".equilibria tbody tr");
  const words = (await page.evaluate(() => window.rodsweep.rod.setArguments())).split(" ");
  const all = JSON.parse(await run("solve", SCENE, "--json", "--all-branches", ...words)).branches;
  assert.equal(await page.locator(".equilibria tbody tr").count(), all.length);
  assert.equal(await page.evaluate(() => window.rodsweep.rod.ghostCount()), all.length - 1);
  await page.getByLabel("Unstable ones, too").uncheck();
  const stable = all.filter((branch) => branch.stable).length;
  assert.equal(await page.evaluate(() => window.rodsweep.rod.ghostCount()), stable - 1);
  await page.getByLabel("Unstable ones, too").check();
  await shot(page, "rod-dark");
  assert.deepEqual(page.troubles, []);
});

/** Takes the tip and draws it over a place on the stage in a few moves, without letting go. */
async function drag(page, [x, y]) {
  const stage = await page.locator("#stage").boundingBox();
  const [u, v] = await drawnAt(page);
  await page.mouse.move(stage.x + u, stage.y + v);
  await page.mouse.down();
  for (let k = 1; k <= 6; k++) await page.mouse.move(stage.x + u + ((x - u) * k) / 6, stage.y + v + ((y - v) * k) / 6);
  await page.waitForFunction(() => window.rodsweep.dragging.last !== null);
  await settled(page);
}

const drawnAt = (page) => page.evaluate(() => window.rodsweep.stage.project(window.rodsweep.rod.mesh.tip.position).slice(0, 2));

test("the tip is dragged: it is below the pointer where currents lead there", async () => {
  const page = await open(browser, server.address);
  const limit = 0.3;
  // Near rest and far; the last goes on where the one before has ended.
  const currents = [[0.01, 0, 0.02], [0.03, -0.02, -0.05], [-0.12, 0.1, 0.15], [0.2, -0.25, 0.05], [0.28, 0.2, -0.28]];
  for (const [x, y, z] of currents) {
    const set = ["x", "y", "z"].map((axis, k) => `coil.current.${axis}=${[x, y, z][k]}`);
    const there = JSON.parse(await run("solve", SCENE, "--json", ...set.flatMap((word) => ["--set", word]))).tip.position;
    const place = await page.evaluate((p) => {
      const { stage, rod } = window.rodsweep;
      const at = rod.mesh.tip.position.clone().set(...p).multiplyScalar(stage.perMetre);
      return stage.project(at).slice(0, 2);
    }, there);
    await drag(page, place);
    await page.mouse.up();
    const [u, v] = await drawnAt(page);
    const off = Math.hypot(u - place[0], v - place[1]);
    assert.ok(off < 2, `${off} pixels beside the pointer, for the currents ${[x, y, z]}`);
    const found = await page.evaluate(() => Object.values(window.rodsweep.rod.values));
    assert.ok(found.every((value) => Math.abs(value) <= limit));
  }
  await agrees(page);
  assert.deepEqual(page.troubles, []);
});

test("where a limit holds the tip back, the page says which", async () => {
  const page = await open(browser, server.address);
  const [x, y] = await drawnAt(page);
  await drag(page, [x + 220, y + 190]);
  assert.match(await page.locator(".drag-note").textContent(), /Held back by the limit of coil\.current\.[xyz] \S?0\.300\sA/);
  assert.match(await page.locator(".readout").textContent(), /Held back by the limit of .*mm are missing/);
  await shot(page, "rod-dragged");
  await page.mouse.up();
  assert.equal(await page.locator(".drag-note").isVisible(), false);
  await agrees(page);
});

test("what is unstable or lost is told in words and shape", async () => {
  const page = await open(browser, server.address);
  const put = (status, change) =>
    page.evaluate(
      ([status, change]) => {
        const { rod } = window.rodsweep;
        const answer = structuredClone(rod.answer);
        Object.assign(answer.solution, { status }, change);
        if (change.tip === null) answer.shape = null;
        rod.take(answer);
      },
      [status, change],
    );
  await put("unstable", { stable: false, stability_margin: -0.2 });
  assert.match(await page.locator(".banner").textContent(), /Unstable.*no rod stays here/);
  assert.equal(await page.locator(".banner .symbol.is-warn").count(), 1);
  await shot(page, "rod-unstable");
  await put("fold", { tip: null, load_fraction: 0.4, converged: false });
  assert.match(await page.locator(".banner").textContent(), /No equilibrium.*40\.0/);
  assert.equal(await page.locator(".banner .symbol.is-bad").count(), 1);
  // A scene that makes no rod.
  await page.evaluate(() => window.rodsweep.rod.set({ "proximal.tube.inner_radius": 1 }));
  await page.waitForFunction(() => document.querySelector(".status").textContent.includes("No rod"));
  await page.getByRole("button", { name: "Reset inputs" }).click();
  await page.waitForFunction(() => document.querySelector(".status").textContent.includes("Stable"));
});

test("without WebGL the stills are shown, numbers go on", async () => {
  const plain = await launch(["--disable-3d-apis"]);
  const page = await open(plain, server.address);
  assert.match(await page.locator(".stills").textContent(), /no WebGL/);
  await page.waitForFunction(() => [...document.images].every((image) => image.complete && image.naturalWidth > 0));
  await slider(page, "coil.current.x").fill("1490");
  await settled(page);
  assert.notEqual(await page.locator('[data-value="tip.y"]').textContent(), "\u2212");
  await shot(page, "rod-no-webgl");
  await plain.close();
});

test("the program ends after its last window", async () => {
  const brief = await serve(SCENE);
  const page = await open(browser, brief.address);
  await page.reload();
  await page.waitForSelector("body.is-ready");
  await page.context().close();
  assert.equal(await brief.ended, 0);
});

test("a tablet has room for everything", async () => {
  const page = await open(browser, server.address, { width: 820, height: 1180 });
  const width = await page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(width <= 820, `${width} pixels wide`);
  for (const part of ["#stage", "#left", "#right"]) {
    const box = await page.locator(part).boundingBox();
    assert.ok(box.width > 300 && box.height > 250, `${part}: ${JSON.stringify(box)}`);
  }
  await shot(page, "rod-tablet");
});
