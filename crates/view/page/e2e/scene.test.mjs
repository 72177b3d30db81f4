// The rod that follows the sliders.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { folder, launch, open, run, serve, settled, shot } from "./harness.mjs";

const SCENE = "sweeps/scenes/p6.toml";
const TWO = "sweeps/scenes/two_coil.toml";
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
  assert.match(await page.locator(".drag-note").textContent(), /Held back by the limit of coil\.current\.[xyz] \(\S?0\.300\sA\)/);
  assert.match(await page.locator(".readout").textContent(), /Held back by the limit of .*mm are missing/);
  await shot(page, "rod-dragged");
  await page.mouse.up();
  assert.equal(await page.locator(".drag-note").isVisible(), false);
  await agrees(page);
});

/** A scene of its own with values, settled. */
async function withValues(scene, values, then, theme) {
  const other = await serve(scene, "--keep");
  try {
    const page = await open(browser, other.address, { theme });
    await page.evaluate((values) => window.rodsweep.rod.set(values, true), values);
    await settled(page);
    await then(page, Object.entries(values).flatMap(([name, value]) => ["--set", `${name}=${value}`]));
    assert.deepEqual(page.troubles, []);
    await page.context().close();
  } finally {
    await other.stop();
  }
}

const coils = (...currents) =>
  Object.fromEntries(currents.map((current, k) => [`coil${1 + Math.floor(k / 3)}.current.${"xyz"[k % 3]}`, current]));

test("a fold is told, with the equilibrium beyond it", async () => {
  await withValues(TWO, coils(0.087, -0.08, -0.089, -0.079, -0.071, 0.04), async (page) => {
    assert.match(await page.locator(".banner").textContent(), /Fold.*an equilibrium beyond/);
    assert.match(await page.locator(".status").textContent(), /from rest to 74\.\d.%.*would snap/);
    assert.equal(await page.locator(".banner .symbol.is-warn").count(), 1);
    assert.equal(await page.locator('[data-value="index"]').textContent(), "0");
    await page.getByRole("button", { name: "All equilibria" }).click();
    await page.waitForSelector(".equilibria tbody tr");
    assert.match(await page.locator(".others").textContent(), /1 found, 1 stable/);
    await shot(page, "rod-fold");
  });
});

test("next to a fold lies an unstable equilibrium, drawn as a ghost and as the rod", async () => {
  const near = coils(-0.07, 0.014, -0.049, 0.072, -0.088, 0.036);
  await withValues(TWO, near, async (page, words) => {
    await page.getByRole("button", { name: "All equilibria" }).click();
    await page.waitForSelector(".equilibria tbody tr");
    const all = JSON.parse(await run("solve", TWO, "--json", "--all-branches", ...words)).branches;
    assert.deepEqual(all.map((branch) => branch.stable).sort(), [false, true, true]);
    assert.equal(await page.locator(".equilibria .symbol.is-warn").count(), 1);
    assert.equal(await page.evaluate(() => window.rodsweep.rod.ghostCount()), 2);
    await shot(page, "rod-ghosts");
    // As a row of a run with every equilibrium would show it.
    await page.evaluate(async () => {
      const { rod, source } = window.rodsweep;
      const { branches, shapes } = await source.branches({ ...rod.values });
      const k = branches.findIndex((branch) => branch.stable === false);
      rod.take({ ...rod.answer, solution: branches[k], shape: shapes[k], stability_index: branches[k].stability_index });
    });
    assert.match(await page.locator(".banner").textContent(), /Unstable.*no rod stays here/);
    assert.equal(await page.locator('[data-value="index"]').textContent(), "1");
    assert.match(await page.locator('[data-value="margin"]').textContent(), /^\u2212/);
    await shot(page, "rod-unstable");
  }, "dark");
});

test("a rod without equilibrium is told, the last one stays in grey", async () => {
  await withValues("crates/view/page/e2e/flip.toml", { "coil.current.z": -0.15 }, async (page) => {
    assert.match(await page.locator(".banner").textContent(), /No equilibrium.*grey/);
    assert.match(await page.locator(".status").textContent(), /fold: followed from rest to 80\.1/);
    assert.equal(await page.locator(".banner .symbol.is-bad").count(), 1);
    assert.equal(await page.locator('[data-value="tip.x"]').textContent(), "\u2013");
    await shot(page, "rod-lost");
    await page.getByRole("button", { name: "Reset inputs" }).click();
    await page.waitForFunction(() => document.querySelector(".status").textContent.includes("Stable"));
    // Values that make no rod.
    await page.evaluate(() => window.rodsweep.rod.set({ "rod.length": -1 }));
    await page.waitForFunction(() => document.querySelector(".status").textContent.includes("No rod"));
    page.troubles.splice(0);
  });
});

test("the rod is that of the still: camera, colours, unit", async () => {
  const page = await open(browser, server.address);
  const values = { "coil.current.x": 0.15, "coil.current.z": -0.18 };
  await page.evaluate((values) => window.rodsweep.rod.set(values, true), values);
  await settled(page);
  const still = join(folder(), "rod.svg");
  await run("solve", SCENE, "--plot", still, ...Object.entries(values).flatMap(([name, value]) => ["--set", `${name}=${value}`]));
  const svg = readFileSync(still, "utf8");
  const { stretches, colours, words } = await page.evaluate(() => {
    const { stage, rod, source } = window.rodsweep;
    const at = rod.mesh.tip.position;
    const place = (p, k) => stage.project(at.clone().set(p[3 * k], p[3 * k + 1], p[3 * k + 2]).multiplyScalar(stage.perMetre)).slice(0, 2);
    const stretches = rod.answer.shape.stretches.map(({ kind, positions: p }) => ({ kind, points: Array.from({ length: p.length / 3 }, (_, k) => place(p, k)) }));
    return { stretches, colours: source.description.style.colours, words: [...document.querySelectorAll(".axis-labels .axis")].map((label) => label.textContent) };
  });
  const lines = [...svg.matchAll(/<path d="M([^"Z]+)" fill="none" stroke="(#\w+)"/g)].map(([, d, colour]) => ({
    colour,
    points: d.split("L").map((pair) => pair.trim().split(/[ ,]+/).map(Number)),
  }));
  const off = ({ scale, shift }, points, line) =>
    Math.max(...points.map((p) => Math.min(...line.map((q) => Math.hypot(scale * p[0] + shift[0] - q[0], scale * p[1] + shift[1] - q[1])))));
  // One size and one shift take the coil of the page to that of a panel of the still: no turn, no stretch.
  const coil = stretches.find(({ kind }) => kind === "coil").points;
  const ends = (points) => [points[0], points[points.length - 1]];
  const fits = lines
    .filter(({ colour, points }) => colour === colours.coil && points.length > 20)
    .map(({ points }) => {
      const [[a, b], [p, q]] = [ends(coil), ends(points)];
      const scale = Math.hypot(q[0] - p[0], q[1] - p[1]) / Math.hypot(b[0] - a[0], b[1] - a[1]);
      const fit = { scale, shift: [p[0] - scale * a[0], p[1] - scale * a[1]] };
      return { ...fit, off: off(fit, coil, points) };
    })
    .sort((one, other) => one.off - other.off);
  assert.equal(fits.length, 4, "a coil in each panel");
  assert.ok(fits[0].off < 0.1, `${fits[0].off} pt beside the still`);
  assert.ok(fits[1].off > 1, "one panel alone is seen so");
  const flexible = lines.filter(({ colour, points }) => colour === colours.flexible && points.length > 20);
  assert.equal(flexible.length, 8);
  for (const { points } of stretches.filter(({ kind }) => kind === "flexible")) {
    const best = Math.min(...flexible.map((line) => off(fits[0], points, line.points)));
    assert.ok(best < 0.2, `${best} pt beside the still`);
  }
  for (const word of words) assert.ok(svg.includes(`>${word}</text>`), `the still has no ${word}`);
  assert.equal(words.length, 3);
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

test("a magnet beside the rod is drawn, within the view, and follows its slider", async () => {
  const server = await serve("sweeps/scenes/arm_magnet.toml");
  const page = await open(browser, server.address);
  const drawn = () => page.evaluate(() => window.rodsweep.rod.sources.drawn());
  assert.deepEqual(await drawn(), [{ name: "arm", position: [0.14, 0, 0.06] }]);
  // The box has grown for it: its far end is 170 mm away.
  assert.ok((await page.evaluate(() => window.rodsweep.stage.box.max.x)) > 165);
  await shot(page, "magnet-light");
  await page.evaluate(() => window.rodsweep.rod.set({ "magnets.arm.position.y": 0.03 }));
  await settled(page);
  const [moved] = await drawn();
  assert.ok(Math.abs(moved.position[1] - 0.03) < 1e-9, JSON.stringify(moved));
  assert.match(await page.locator(".legend").textContent(), /magnet, arrow from S to N/);
  assert.deepEqual(page.troubles, []);
  await page.close();
  await server.stop();
});

test("coils beyond the view are there when it is wider", async () => {
  const server = await serve("sweeps/scenes/coil_array.toml");
  const page = await open(browser, server.address);
  const names = (await page.evaluate(() => window.rodsweep.rod.sources.drawn())).map(({ name }) => name);
  assert.equal(names.length, 8);
  assert.deepEqual(names.slice(0, 2), ["array 1, 4.0 A", "array 2, \u22122.0 A"]);
  assert.ok((await page.evaluate(() => window.rodsweep.stage.box.max.x)) < 100, "the rod is not small");
  assert.deepEqual(page.troubles, []);
  await page.close();
  await server.stop();
});
