// The page: opens its source, builds what it shows, and ties it together.

import { Box3, Vector3 } from "three";
import { AxesBox } from "./box";
import { byId, el } from "./dom";
import { Dragging } from "./dragging";
import { labelFrame } from "./framelabels";
import { Legend } from "./legend";
import { MapPanel } from "./mappanel";
import { MapView } from "./mapview";
import { Readout, judge } from "./readout";
import { RodView } from "./rodview";
import { RowCard } from "./rowcard";
import { SliderPanel } from "./sliderpanel";
import { openSource, type Source } from "./source";
import { widened } from "./sources";
import { Stage } from "./stage";
import { setUpTheme } from "./theme";
import { symbol } from "./dom";

declare global {
  interface Window {
    /** For tests and measurements: what the page holds. */
    rodsweep?: { source: Source; stage: Stage | null; rod: RodView; map: MapView | null; dragging: Dragging | null };
  }
}

function hasWebGl(): boolean {
  try {
    const context = document.createElement("canvas").getContext("webgl2");
    context?.getExtension("WEBGL_lose_context")?.loseContext();
    return context !== null;
  } catch {
    return false;
  }
}

async function start(): Promise<void> {
  setUpTheme();
  const source = await openSource();
  const { description } = source;
  document.title = `${description.title} \u2013 rodsweep`;
  byId("title").textContent = description.title;
  byId("title").title = description.file;
  warnOfRows(source);
  const host = byId("stage");
  const stage = hasWebGl() ? new Stage(host, description) : null;
  const rod = new RodView(source, stage);
  const dragging = stage && description.engine && description.can_drag ? new Dragging(stage, rod) : null;
  const map = stage && description.map ? new MapView(source, stage, rod) : null;
  window.rodsweep = { source, stage, rod, map, dragging };
  const sliders = new SliderPanel(rod);
  const readout = new Readout(rod, dragging);
  const legend = new Legend(description.style);
  if (stage) {
    host.append(legend.element);
    labelFrame(stage, rod);
  }
  rod.onAnswer((answer) => {
    legend.show(answer, rod.lines?.isShown ?? false);
    sliders.show(rod.values);
  });
  showWarnings(rod, host);
  const box = stage ? new AxesBox(stage, description.length_unit.name) : null;
  if (stage && box) frame(stage, box, rod, sceneBox(rod));
  byId("view").addEventListener("click", () => {
    stage?.setView(description.style.azimuth, description.style.elevation);
  });
  byId("reset").addEventListener("click", () => sliders.reset());
  byId("reset").hidden = !description.engine;
  if (!stage) showStills(source, host);
  if (!description.engine) tellExport(source);

  const left = byId("left");
  const right = byId("right");
  const panel = map ? new MapPanel(map) : null;
  if (map && panel) {
    const card = new RowCard(map);
    right.append(card.element, readout.element);
    if (description.engine) tabs(left, [["Map", panel.element], ["Inputs", sliders.element]]);
    else left.append(panel.element);
  } else {
    if (description.engine) left.append(sliders.element);
    else document.body.classList.add("has-no-left");
    right.append(readout.element);
  }
  if (description.engine) right.append(el("p", { class: "note" }, "Rods that are solved here are not checked against the reference."));
  if (source.rod) rod.take(source.rod);
  else rod.want(true);
  if (stage && box && map && panel) {
    const first = new Promise<void>((done) => {
      const wait = () => (rod.answer || !rod.isPending() ? done() : void requestAnimationFrame(wait));
      wait();
    });
    await Promise.all([panel.start(), first]);
    frame(stage, box, rod, framed(widened(map.bounds(rodPoints(rod)), description.sources, stage.perMetre)));
  }
  document.body.classList.add("is-ready");
}

/** Places of the drawn rod (shown units). */
function rodPoints(rod: RodView): Vector3[] {
  const { metres } = rod.source.description.length_unit;
  const places = (rod.answer?.shape?.stretches ?? []).map(({ positions }) => positions);
  return places.flatMap((p) => Array.from({ length: p.length / 3 }, (_, k) => new Vector3(p[3 * k]!, p[3 * k + 1]!, p[3 * k + 2]!).divideScalar(metres)));
}

/** What is shown of a scene. */
function sceneBox(rod: RodView): Box3 {
  const { region, length_unit } = rod.source.description;
  const corner = (side: 0 | 1) => new Vector3(...region.map((limits) => limits[side] / length_unit.metres));
  return new Box3(corner(0), corner(1));
}

/** A little wider than what it holds, no narrower than the figures draw it. */
function framed(bounds: Box3): Box3 {
  const size = bounds.getSize(new Vector3());
  const widest = Math.max(size.x, size.y, size.z);
  const wide = new Vector3(...[size.x, size.y, size.z].map((x) => 1.1 * Math.max(x, 0.6 * widest)));
  return new Box3().setFromCenterAndSize(bounds.getCenter(new Vector3()), wide);
}

/** Shows a box; the field's arrow stands at its floor. */
function frame(stage: Stage, box: AxesBox, rod: RodView, shown: Box3): void {
  stage.setBox(shown);
  box.setBox(shown);
  rod.placeField(new Vector3(0.86, 0.4, 0.04).multiply(shown.getSize(new Vector3())).add(shown.min));
}

/** Says first what speaks against the rows. */
function warnOfRows(source: Source): void {
  const { distrusted, distrust } = source.description;
  if (distrusted === null) return;
  const details = el("details", {}, el("summary", {}, "Where, and what helps"), el("pre", {}, distrust ?? ""));
  byId("distrust").replaceChildren(el("b", {}, distrusted), details);
  byId("distrust").hidden = false;
  document.title = `DISTRUSTED: ${document.title}`;
}

function showWarnings(rod: RodView, host: HTMLElement): void {
  const banner = el("div", { class: "banner", hidden: true });
  host.append(banner);
  rod.onAnswer((answer, error) => {
    const { kind, title, brief } = judge(answer?.solution ?? null, error);
    const isShown = kind === "warn" || kind === "bad";
    banner.hidden = !isShown;
    banner.className = `banner is-${kind}`;
    if (isShown) banner.replaceChildren(symbol(kind), el("b", {}, title), el("span", {}, brief));
  });
}

function showStills(source: Source, host: HTMLElement): void {
  const { stills } = source.description;
  const names = Array.isArray(stills) ? stills : Object.keys(stills);
  const figures = names.map((name) => el("figure", {}, el("img", { src: source.still(name), alt: name, loading: "lazy" }), el("figcaption", {}, name)));
  const words = "This browser shows no WebGL, which the view in space needs. Here are the figures instead; numbers beside them are live.";
  host.append(el("div", { class: "stills", tabindex: 0 }, el("p", { class: "note" }, words), ...figures));
}

function tellExport(source: Source): void {
  const { map, version, file } = source.description;
  const data = source.description as unknown as { blocks: { group: string; name: string; step?: number }[] };
  const steps = data.blocks.filter((block) => block.name.startsWith("tip.position")).map((block) => block.step ?? 0);
  const rounding = steps.length > 0 ? ` Positions are rounded by at most ${(0.5e6 * Math.max(...steps)).toFixed(1)}\u202f\u00b5m, other columns to 65\u202f535 steps of their range.` : "";
  const left = map && map.columns.some((column) => column.derivative) ? " Derivatives are left out." : "";
  const words = `Exported from ${file} by rodsweep ${version}. This page has no engine: rods are not solved here.${rounding}${left}`;
  byId("foot").textContent = words;
  byId("foot").hidden = false;
}

/** Panels of which one is shown. */
function tabs(host: HTMLElement, panels: [string, HTMLElement][]): void {
  const list = el("div", { class: "tabs", role: "tablist" });
  const choose = (chosen: number, takesFocus: boolean) => {
    panels.forEach(([, panel], k) => (panel.hidden = k !== chosen));
    [...list.children].forEach((tab, k) => {
      tab.setAttribute("aria-selected", String(k === chosen));
      (tab as HTMLElement).tabIndex = k === chosen ? 0 : -1;
      if (takesFocus && k === chosen) (tab as HTMLElement).focus();
    });
  };
  panels.forEach(([name, panel], k) => {
    panel.id ||= `panel-${name.toLowerCase()}`;
    panel.setAttribute("role", "tabpanel");
    const tab = el("button", { type: "button", role: "tab", "aria-controls": panel.id }, name);
    tab.addEventListener("click", () => choose(k, false));
    tab.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (step) choose((k + step + panels.length) % panels.length, true);
    });
    list.append(tab);
  });
  host.append(list, ...panels.map(([, panel]) => panel));
  choose(0, false);
}

start().catch((error: unknown) => {
  byId("stage").append(el("p", { class: "failure", role: "alert" }, error instanceof Error ? error.message : String(error)));
  document.body.classList.add("is-ready");
});
