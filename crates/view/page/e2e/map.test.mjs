// The map of a result directory, and the page that it is exported to.

import assert from "node:assert/strict";
import { statSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { SHOTS, folder, launch, open, run, serve, settled, shot } from "./harness.mjs";

/** A whole directory, for instance of the whole map; else a small one is made. */
const directory = process.env.RODSWEEP_RESULTS ?? join(folder(), "run");
let browser;
let server;

before(async () => {
  browser = await launch();
  if (!process.env.RODSWEEP_RESULTS) {
    await run("run", "sweeps/workspace.toml", "--backend", "cpu", "--limit", "20000", "--out", directory, "--quiet");
  }
  server = await serve(directory, "--keep");
});

after(async () => {
  await browser.close();
  assert.equal(await server.stop(), 0);
});

/** A point that stands alone in front, with its place on the page. */
async function loneliest(page) {
  const stage = await page.locator("#stage").boundingBox();
  const found = await page.evaluate(() => {
    const { map, stage } = window.rodsweep;
    // Points in squares of some pixels: alone in its own and in those around.
    const at = (point) => stage.project(map.cloud.at(point));
    for (const size of [4, 3, 2, 1]) {
      const squares = new Map();
      const number = (x, y) => 65536 * Math.floor(y / size) + Math.floor(x / size);
      for (let point = 0; point < map.cloud.count; point++) {
        const square = number(...at(point));
        squares.set(square, (squares.get(square) ?? 0) + 1);
      }
      const around = [-size, 0, size];
      const isAlone = (x, y) => around.every((u) => around.every((v) => (squares.get(number(x + u, y + v)) ?? 0) === (u || v ? 0 : 1)));
      for (let point = 0; point < map.cloud.count; point++) {
        const [x, y] = at(point);
        if (map.cloud.mask[point] === 1 && isAlone(x, y) && map.cloud.pick(x, y) === point) return { point, x, y, row: map.cloud.rows[point] };
      }
    }
    return null;
  });
  return { ...found, x: stage.x + found.x, y: stage.y + found.y };
}

test("a click on a point gives its row and its rod", async () => {
  const page = await open(browser, server.address);
  await shot(page, "map-light");
  const { x, y, row } = await loneliest(page);
  await page.mouse.click(x, y);
  await page.waitForSelector(`.row-card h2:text-is("Row ${row}")`);
  await settled(page);
  const cell = (name) => page.locator(`tr[data-column="${name}"] td.value`).getAttribute("data-exact");
  const tip = await Promise.all(["x", "y", "z"].map(async (axis) => Number(await cell(`tip.position.${axis}`))));
  const drawn = await page.evaluate(() => window.rodsweep.rod.drawnTip());
  tip.forEach((value, axis) => assert.ok(Math.abs(value - drawn[axis]) < 1e-6 * 0.0943 * 2, `${tip} is drawn at ${drawn}`));
  const words = (await page.locator(".row-card .arguments").textContent()).split(" ");
  const solved = JSON.parse(await run("solve", "sweeps/scenes/p6.toml", "--json", ...words));
  solved.tip.position.forEach((value, axis) => assert.ok(Math.abs(value - drawn[axis]) < 1e-9));
  assert.equal(await cell("coil.current.x"), words[1].split("=")[1]);
  await shot(page, "map-point-light");
  assert.deepEqual(page.troubles, []);
});

test("points have the colours of the figures", async () => {
  const page = await open(browser, server.address);
  const { point, x, y } = await loneliest(page);
  const told = await page.evaluate((point) => {
    const { map, source } = window.rodsweep;
    const { low, high, map: name } = map.statistics.get(map.colouring);
    const share = Math.max(0, Math.min(1, (map.columns.get(map.colouring)[point] - low) / (high - low)));
    return source.description.style.maps[name][Math.floor(share * 255 + 0.5)];
  }, point);
  const pixels = await page.screenshot({ clip: { x: Math.floor(x), y: Math.floor(y), width: 1, height: 1 } });
  const seen = await page.evaluate(async (base64) => {
    const image = new Image();
    image.src = `data:image/png;base64,${base64}`;
    await image.decode();
    const canvas = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d");
    canvas.drawImage(image, 0, 0);
    return [...canvas.getImageData(0, 0, 1, 1).data.slice(0, 3)];
  }, pixels.toString("base64"));
  const expected = [1, 3, 5].map((k) => parseInt(told.slice(k, k + 2), 16));
  // A neighbour of the map may have been rounded to.
  seen.forEach((value, k) => assert.ok(Math.abs(value - expected[k]) <= 6, `${seen} in place of ${expected}`));
});

test("cuts and filters hide points, histograms follow", async () => {
  const page = await open(browser, server.address, { theme: "dark" });
  const state = () =>
    page.evaluate(() => {
      const { map } = window.rodsweep;
      const sum = (numbers) => numbers.reduce((a, b) => a + b, 0);
      return { passing: map.filters.passing, bars: sum(map.histogram("stability.margin").passing), all: sum(map.histogram("stability.margin").all) };
    });
  const whole = await state();
  assert.equal(whole.passing, whole.all);
  const high = page.getByLabel("stability.margin, lowest, as a number");
  await high.fill("1");
  await high.press("Enter");
  await page.waitForFunction((count) => window.rodsweep.map.filters.passing < count, whole.passing);
  const filtered = await state();
  assert.equal(filtered.bars, filtered.passing);
  assert.equal(filtered.all, whole.all);
  const exact = await page.evaluate(() => window.rodsweep.map.columns.get("stability.margin").filter((value) => value >= 1).length);
  assert.equal(filtered.passing, exact);
  const y = page.getByLabel("y in mm, highest, as a number");
  // Half of what is left lies beyond.
  const median = await page.evaluate(() => {
    const { cloud } = window.rodsweep.map;
    const left = [...cloud.mask.keys()].filter((k) => cloud.mask[k] === 1).map((k) => cloud.positions[3 * k + 1]);
    return 1e3 * left.sort((a, b) => a - b)[left.length >> 1];
  });
  await y.fill(median.toFixed(3));
  await y.press("Enter");
  await page.waitForFunction((count) => window.rodsweep.map.filters.passing < count, filtered.passing);
  await page.getByLabel("Add a filter by a column").selectOption("coil.current.z");
  await page.waitForSelector('canvas[aria-label="Histogram of coil.current.z"]');
  await page.getByLabel("Colour by").selectOption("coil.current.x");
  await page.waitForFunction(() => window.rodsweep.map.colouring === "coil.current.x");
  await shot(page, "map-dark");
  assert.deepEqual(page.troubles, []);
});

test("a row is found by keyboard, too", async () => {
  const page = await open(browser, server.address);
  const row = await page.evaluate(() => window.rodsweep.map.cloud.rows[3]);
  await page.getByLabel("Row", { exact: true }).fill(String(row));
  await page.keyboard.press("Enter");
  await page.waitForSelector(`.row-card h2:text-is("Row ${row}")`);
  await page.getByLabel("Row", { exact: true }).fill("123456789");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => /whole number from 0/.test(document.querySelector(".row-card").textContent));
  // Everything that can be used is reached by tabs, and shows that it is.
  await page.evaluate(() => document.activeElement.blur());
  const seen = new Set();
  for (let k = 0; k < 90; k++) {
    await page.keyboard.press("Tab");
    const at = await page.evaluate(() => {
      const here = document.activeElement;
      const ring = getComputedStyle(here).outlineStyle;
      return { name: here.getAttribute("aria-label") || here.textContent.trim().slice(0, 30) || here.id || here.tagName, ring, isBody: here === document.body };
    });
    if (!at.isBody) assert.notEqual(at.ring, "none", `${at.name} does not show that it has the focus`);
    seen.add(at.name);
  }
  for (const name of ["Colour by", "x in mm, lowest", "Add a filter by a column", "All equilibria", "Find currents", "Row"]) {
    assert.ok(seen.has(name), `${name} is not reached: ${[...seen].join("; ")}`);
  }
});

test("the boundary and the voxels of a workspace are drawn", async (t) => {
  const volume = join(folder(), "volume");
  await run("run", "sweeps/volume.toml", "--backend", "cpu", "--limit", "8192", "--out", volume, "--quiet");
  // Small cubes make the better picture, and take half a minute.
  await run("workspace", volume, ...(SHOTS ? [] : ["--voxel", "8mm"]), "--no-figures", "--quiet");
  const other = await serve(volume, "--keep");
  t.after(() => other.stop());
  for (const theme of ["light", "dark"]) {
    const page = await open(browser, other.address, { theme });
    const layers = (name) => page.evaluate((name) => window.rodsweep.map.layers[name], name);
    await page.getByLabel("Boundary surface").check();
    await page.waitForFunction(() => window.rodsweep.map.layers.surface?.visible);
    await settled(page);
    await shot(page, `surface-${theme}`);
    await page.getByLabel("Tips").uncheck();
    await page.getByLabel("Boundary surface").uncheck();
    await page.getByLabel("Voxels").selectOption("stability.margin");
    await page.waitForFunction(() => window.rodsweep.map.layers.voxels?.mesh.count > 0);
    assert.equal(await page.locator(".colour-bar:visible").count(), 2, "voxels have a bar of their own");
    await settled(page);
    const count = () => page.evaluate(() => window.rodsweep.map.layers.voxels.mesh.count);
    const whole = await count();
    const y = page.getByLabel("y in mm, highest, as a number");
    await y.fill("0");
    await y.press("Enter");
    await page.waitForFunction((whole) => window.rodsweep.map.layers.voxels.mesh.count < whole, whole);
    await settled(page);
    await shot(page, `voxels-${theme}`);
    assert.ok((await layers("surface")) !== null);
    assert.deepEqual(page.troubles, []);
    await page.context().close();
  }
});

test("the exported page opens with the network cut off", async () => {
  const path = join(folder(), "map.html");
  await run("view", directory, "--export", path);
  assert.ok(statSync(path).size <= 15e6, `${statSync(path).size} bytes`);
  const page = await open(browser, pathToFileURL(path).href, { offline: true });
  assert.deepEqual(page.requests.filter((url) => !url.startsWith("file:") && !url.startsWith("data:") && !url.startsWith("blob:")), []);
  assert.match(await page.locator("#foot").textContent(), /no engine.*rounded by at most/);
  assert.equal(await page.locator("input[data-name]").count(), 0, "no sliders");
  const { x, y, row } = await loneliest(page);
  await page.mouse.click(x, y);
  await page.waitForSelector(`.row-card h2:text-is("Row ${row}")`);
  const tip = await Promise.all(
    ["x", "y", "z"].map(async (axis) => Number(await page.locator(`tr[data-column="tip.position.${axis}"] td.value`).getAttribute("data-exact"))),
  );
  const live = await fetch(`${server.address}api/row?row=${row}`).then((response) => response.json());
  ["x", "y", "z"].forEach((axis, k) => {
    const exact = live.cells.find((cell) => cell.name === `tip.position.${axis}`).value;
    assert.ok(Math.abs(exact - tip[k]) < 2e-6, `${tip[k]} is not ${exact}`);
  });
  await shot(page, "export-light");
  assert.deepEqual(page.troubles, []);
});

test("an exported rod opens with the network cut off", async () => {
  const path = join(folder(), "rod.html");
  await run("view", "sweeps/scenes/p6.toml", "--export", path);
  const page = await open(browser, pathToFileURL(path).href, { offline: true, theme: "dark" });
  const solved = JSON.parse(await run("solve", "sweeps/scenes/p6.toml", "--json"));
  const drawn = await page.evaluate(() => window.rodsweep.rod.drawnTip());
  solved.tip.position.forEach((value, axis) => assert.ok(Math.abs(value - drawn[axis]) < 1e-9));
  await shot(page, "export-rod-dark");
  assert.deepEqual(page.troubles, []);
});
