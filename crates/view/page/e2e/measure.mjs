// Updates a second, frame times over the empty scene, size of the export. Writes page.json and page.md.

import { statSync, writeFileSync } from "node:fs";
import { cpus } from "node:os";
import { join } from "node:path";
import { folder, launch, open, run, serve, settled } from "./harness.mjs";

const out = process.argv[2];
const results = process.env.RODSWEEP_RESULTS;
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

/** Times of frames (ms) while the camera turns, everything drawn. */
async function frames(page, setUp) {
  return page.evaluate(
    async ([count, setUp]) => {
      const { stage, map } = window.rodsweep;
      const hidden = [];
      if (setUp === "empty") {
        for (const child of stage.scene.children) if (child.visible && !child.isCamera && !child.isLight) hidden.push(child);
        hidden.forEach((child) => (child.visible = false));
      }
      if (map) map.cloud.object.geometry.setDrawRange(0, map.cloud.count);
      const times = [];
      for (let k = 0; k < count; k++) {
        stage.camera.position.applyAxisAngle(stage.camera.up, 0.02);
        stage.camera.lookAt(stage.controls.target);
        const begun = performance.now();
        stage.renderer.render(stage.scene, stage.camera);
        // One pixel is read, so that the frame is done.
        const gl = stage.renderer.getContext();
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
        times.push(performance.now() - begun);
        await new Promise((done) => setTimeout(done));
      }
      hidden.forEach((child) => (child.visible = true));
      return times;
    },
    [FRAMES, setUp],
  );
}

const scene = await serve("sweeps/scenes/p6.toml", "--keep");
let page = await open(browser, scene.address);
const { rate, solve } = await updates(page);
await settled(page);
const rodFrame = median(await frames(page, "rod"));
const emptyFrame = median(await frames(page, "empty"));
const isSoftware = await page.evaluate(() => window.rodsweep.stage.isSoftware);
await page.context().close();
await scene.stop();

const map = await serve(results, "--keep");
page = await open(browser, map.address);
const mapFrame = median(await frames(page, "map"));
const points = await page.evaluate(() => window.rodsweep.map.cloud.count);
await page.context().close();
await map.stop();
const path = join(folder(), "map.html");
await run("view", results, "--export", path);
const exportBytes = statSync(path).size;
await browser.close();

const record = {
  date: new Date().toISOString().slice(0, 10),
  machine: `${cpus().length} x ${cpus()[0].model}`,
  renderer: isSoftware ? "software (SwiftShader)" : "GPU",
  updates_per_second: rate,
  solve_and_shape_ms: 1e3 * median(solve),
  frame_ms: { empty: emptyFrame, rod: rodFrame, map: mapFrame },
  frame_over_empty: { rod: rodFrame / emptyFrame, map: mapFrame / emptyFrame },
  map_points: points,
  export_bytes: exportBytes,
};
writeFileSync(join(out, "page.json"), `${JSON.stringify(record, null, 2)}\n`);
const row = (words, value) => `| ${words} | ${value} |\n`;
writeFileSync(
  join(out, "page.md"),
  `# The page in a browser\n\n${record.date}, ${record.machine}, WebGL: ${record.renderer}. Made by \`benches/view/run\`.\n\n` +
    "| what | measured |\n|---|---|\n" +
    row("rods drawn a second while a slider moves", rate.toFixed(0)) +
    row("solve with Jacobian, shape and JSON (median)", `${record.solve_and_shape_ms.toFixed(2)} ms`) +
    row("frame of the rod over that of the empty scene", record.frame_over_empty.rod.toFixed(2)) +
    row(`frame of the map, ${points} points, over that of the empty scene`, record.frame_over_empty.map.toFixed(2)) +
    row("export of the map", `${(exportBytes / 1e6).toFixed(1)} MB`),
);
console.log(JSON.stringify(record, null, 2));
