// Updates a second, frame times over the empty scene, what many points take, size of the export. Writes page.json and
// page.md.

import { statSync, writeFileSync } from "node:fs";
import { cpus } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { folder, launch, open, run, serve, settled } from "./harness.mjs";

const out = process.argv[2];
const results = process.env.RODSWEEP_RESULTS;
/** A directory of millions of rows, if there is one. */
const many = process.env.RODSWEEP_MANY;
const SECONDS = 5;
const FRAMES = 60;
const browser = await launch();
const median = (numbers) => [...numbers].sort((a, b) => a - b)[numbers.length >> 1];

/** Answers that were drawn while a slider was moved with every frame. */
async function updates(page) {
  return page.evaluate(async (seconds) => {
    const { rod } = window.rodsweep;
    const slider = document.querySelector('input[data-name="coil.current.z"]');
    const [begun, before] = [performance.now(), rod.updates];
    const solve = [];
    rod.onAnswer((answer) => answer && solve.push(answer.seconds));
    for (let k = 0; performance.now() - begun < 1000 * seconds; k++) {
      slider.value = String(1000 + 400 * Math.sin(0.05 * k));
      slider.dispatchEvent(new Event("input"));
      // The next event of a pointer, which comes sooner than a frame.
      await new Promise((done) => setTimeout(done, 4));
    }
    return { rate: (rod.updates - before) / ((performance.now() - begun) / 1000), solve };
  }, SECONDS);
}

/** Times of frames (ms) while the camera turns: of all that is there and of the empty scene, in turns, since machines are shared. */
async function frames(page) {
  const times = await page.evaluate(async (count) => {
    const { stage } = window.rodsweep;
    const shown = stage.scene.children.filter((child) => child.visible && !child.isCamera && !child.isLight);
    const times = { empty: [], all: [] };
    for (let k = 0; k < 2 * count; k++) {
      shown.forEach((child) => (child.visible = k % 2 === 1));
      stage.camera.position.applyAxisAngle(stage.camera.up, 0.02);
      stage.camera.lookAt(stage.controls.target);
      const begun = performance.now();
      stage.draw();
      // One pixel is read, so that the frame is done.
      const gl = stage.renderer.getContext();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      times[k % 2 === 1 ? "all" : "empty"].push(performance.now() - begun);
      await new Promise((done) => setTimeout(done));
    }
    return times;
  }, FRAMES);
  const [empty, all] = [median(times.empty), median(times.all)];
  return { frame_ms: { empty, all }, frame_over_empty: all / empty };
}

/** Of a page with points: seconds until all are there, frame times, points. */
async function ofMap(address, options) {
  const begun = performance.now();
  const page = await open(browser, address, options);
  const ready = (performance.now() - begun) / 1000;
  const measured = await frames(page);
  const points = await page.evaluate(() => window.rodsweep.map.cloud.count);
  await page.context().close();
  return { points, seconds_until_ready: ready, ...measured };
}

const scene = await serve("sweeps/scenes/p6.toml", "--keep");
const page = await open(browser, scene.address);
const { rate, solve } = await updates(page);
await settled(page);
const rod = await frames(page);
const isSoftware = await page.evaluate(() => window.rodsweep.stage.isSoftware);
await page.context().close();
await scene.stop();

async function ofDirectory(directory) {
  const server = await serve(directory, "--keep");
  const measured = await ofMap(server.address);
  await server.stop();
  return measured;
}
const map = await ofDirectory(results);
const million = many ? await ofDirectory(many) : null;
const path = join(folder(), "map.html");
await run("view", results, "--export", path);
const exported = { bytes: statSync(path).size, ...(await ofMap(pathToFileURL(path).href, { offline: true })) };
await browser.close();

const record = {
  date: new Date().toISOString().slice(0, 10),
  machine: `${cpus().length} x ${cpus()[0].model}`,
  renderer: isSoftware ? "software (SwiftShader)" : "GPU",
  updates_per_second: rate,
  // Over the frames of the empty scene that would fit into a second.
  updates_over_empty_frames: (rate * rod.frame_ms.empty) / 1000,
  solve_and_shape_ms: 1e3 * median(solve),
  rod,
  map,
  many: million,
  exported,
};
writeFileSync(join(out, "page.json"), `${JSON.stringify(record, null, 2)}\n`);
const row = (words, value) => `| ${words} | ${value} |\n`;
const times = ({ frame_over_empty, frame_ms }) => `${frame_over_empty.toFixed(2)} (${frame_ms.all.toFixed(0)} ms)`;
writeFileSync(
  join(out, "page.md"),
  `# The page in a browser\n\n${record.date}, ${record.machine}, WebGL: ${record.renderer}. Made by \`benches/view/run\`.\n\n` +
    "Frames are drawn while the view turns, with every point, and read back. The empty scene has neither rod nor box nor points.\n\n" +
    "| what | measured |\n|---|---|\n" +
    row("rods drawn a second while a slider moves", rate.toFixed(0)) +
    row("the same over the frames of the empty scene in a second", record.updates_over_empty_frames.toFixed(2)) +
    row("solve with Jacobian, shape and JSON (median)", `${record.solve_and_shape_ms.toFixed(2)} ms`) +
    row("frame of the rod over that of the empty scene", times(rod)) +
    row(`frame of the map, ${map.points} points, over that of the empty scene`, times(map)) +
    row("until the map is there", `${map.seconds_until_ready.toFixed(1)} s`) +
    (million ? row(`frame of ${million.points} points over that of the empty scene`, times(million)) : "") +
    (million ? row("until they are there", `${million.seconds_until_ready.toFixed(1)} s`) : "") +
    row("exported page of the map", `${(exported.bytes / 1e6).toFixed(1)} MB`) +
    row("its frame over that of the empty scene", times(exported)) +
    row("until it is there", `${exported.seconds_until_ready.toFixed(1)} s`),
);
console.log(JSON.stringify(record, null, 2));
