// The map's controls: colour, layers, cuts, statuses, filters with histograms.

import { ColourBar } from "./colourbar";
import { el } from "./dom";
import { spansDecades, type Range } from "./filters";
import { shownUnit, whole } from "./format";
import type { MapView } from "./mapview";
import { HistogramView, RangeInput } from "./ranges";

const FILTERS = ["stability.margin", "error_estimate"];

export class MapPanel {
  readonly element: HTMLElement;
  readonly bar: ColourBar;
  private readonly count = el("output", { class: "value" });
  private readonly statuses = el("div", { class: "checks" });
  private readonly filters = el("div", { class: "filters" });
  private readonly views = new Map<string, HistogramView>();
  private readonly note = el("p", { class: "note", role: "status" });

  constructor(private readonly map: MapView) {
    const { info } = map;
    this.bar = new ColourBar(map.source.description.style);
    const numbers = info.columns.filter(({ kind, derivative }) => kind !== "text" && kind !== "status" && (map.source.description.engine || !derivative));
    const options = (of: typeof numbers) => of.map(({ name }) => el("option", { value: name }, name));
    const colour = el(
      "select",
      { "aria-label": "Colour by" },
      el("optgroup", { label: "Columns" }, ...options(numbers.filter((column) => !column.derivative && column.name !== "sample"))),
    );
    if (numbers.some((column) => column.derivative)) {
      colour.append(el("optgroup", { label: "Derivatives" }, ...options(numbers.filter((column) => column.derivative))));
    }
    colour.addEventListener("change", () => void this.colourBy(colour.value));
    colour.value = info.colour;
    const add = el("select", { "aria-label": "Add a filter by a column" }, el("option", { value: "" }, "Add a filter\u2026"), ...options(numbers));
    add.addEventListener("change", () => {
      void this.addFilter(add.value);
      add.value = "";
    });
    const total = info.points < info.rows ? `${whole(info.points)} drawn of ${whole(info.rows)} rows` : `${whole(info.rows)} rows`;
    this.element = el(
      "div",
      { class: "map-panel" },
      el(
        "section",
        {},
        el("div", { class: "row" }, el("span", { class: "label" }, "points shown"), this.count),
        el("p", { class: "note" }, total),
        this.note,
      ),
      el("section", {}, el("h2", {}, "Colour"), colour, this.bar.element),
      this.layers(),
      el("section", {}, el("h2", {}, "Cut planes"), ...[0, 1, 2].map((axis) => this.cut(axis))),
      el("section", {}, el("h2", {}, "Filters"), this.filters, add),
      el("section", {}, el("h2", {}, "Status"), this.statuses),
    );
    map.onChange(() => this.refresh());
  }

  async start(): Promise<void> {
    await this.map.load();
    this.writeStatuses();
    await this.colourBy(this.map.info.colour);
    const known = this.map.info.columns.map((column) => column.name);
    const first = FILTERS.filter((name) => known.includes(name));
    for (const name of first.length > 0 ? first : [this.map.info.colour]) await this.addFilter(name);
  }

  private async colourBy(name: string): Promise<void> {
    try {
      this.note.textContent = "";
      this.bar.show(await this.map.colourBy(name));
      this.views.forEach((view, column) => view.colour(column === name ? (value) => this.bar.colour(value) : null));
    } catch (error) {
      this.note.textContent = error instanceof Error ? error.message : String(error);
    }
  }

  private cut(axis: number): HTMLElement {
    const name = "xyz"[axis]!;
    const statistics = el("div", { class: "cut" }, el("span", { class: "label" }, name));
    const column = `tip.position.${name}`;
    const { metres, name: unit } = this.map.source.description.length_unit;
    statistics.title = `${name} in ${unit}`;
    void this.map.source.statistics(column).then(({ percentiles, count }) => {
      if (count === 0) return;
      const limits = { low: percentiles[0]!, high: percentiles[8]! };
      const range = new RangeInput(`${name} in ${unit}`, limits, metres, (cut) => {
        this.map.filters.cuts[axis] = cut;
        this.map.change();
      });
      statistics.append(range.element);
    });
    return statistics;
  }

  private async addFilter(name: string): Promise<void> {
    if (name === "" || this.views.has(name)) return;
    const { filters } = this.map;
    await this.map.column(name);
    const statistics = this.map.statistics.get(name)!;
    if (statistics.count === 0) {
      this.note.textContent = `${name} has no numbers.`;
      return;
    }
    const limits = { low: statistics.percentiles[0]!, high: statistics.percentiles[8]! };
    const { unit, factor } = shownUnit(statistics.unit, Math.max(Math.abs(limits.low), Math.abs(limits.high)));
    const changed = (chosen: Range | null) => {
      if (chosen) filters.ranges.set(name, chosen);
      else filters.ranges.delete(name);
      this.map.change();
    };
    const range = new RangeInput(name, limits, factor, changed, spansDecades(limits));
    const view = new HistogramView(name, (brushed) => range.choose(brushed));
    if (name === this.map.colouring) view.colour((value) => this.bar.colour(value));
    const remove = el("button", { type: "button", class: "reset", "aria-label": `Remove the filter by ${name}`, title: "Remove" }, "\u00d7");
    const element = el(
      "div",
      { class: "filter" },
      el("div", { class: "row" }, el("span", { class: "label" }, `${name}${unit ? ` (${unit})` : ""}`), remove),
      view.element,
      range.element,
    );
    view.element.title = "Grey: all. Coloured: what passes every filter. Heights are square roots. Drag to choose a range.";
    remove.addEventListener("click", () => {
      filters.ranges.delete(name);
      this.views.delete(name);
      element.remove();
      this.map.change();
    });
    this.views.set(name, view);
    this.filters.append(element);
    this.map.change();
  }

  private writeStatuses(): void {
    const counts = this.map.statusCounts();
    this.statuses.replaceChildren(
      ...this.map.info.statuses.flatMap(({ name, success }, code) => {
        if (counts[code] === 0) return [];
        const box = el("input", { type: "checkbox", checked: success });
        box.addEventListener("change", () => {
          if (box.checked) this.map.filters.statuses.add(code);
          else this.map.filters.statuses.delete(code);
          this.map.change();
        });
        return [el("label", { class: "check" }, box, el("span", {}, name), el("span", { class: "value" }, whole(counts[code]!)))];
      }),
    );
  }

  private layers(): HTMLElement | null {
    const { info, layers } = this.map;
    const points = el("input", { type: "checkbox", checked: true });
    points.addEventListener("change", () => {
      this.map.cloud.object.visible = points.checked;
      this.map.change();
    });
    const children: HTMLElement[] = [el("label", { class: "check" }, points, el("span", {}, "Tips"))];
    if (info.surface) {
      const box = el("input", { type: "checkbox" });
      box.addEventListener("change", () => void layers.showSurface(box.checked));
      children.push(el("label", { class: "check" }, box, el("span", {}, "Boundary surface")));
    }
    if (info.voxels) {
      const names = info.voxels.filter(({ kind, name }) => kind === "number" && !name.startsWith("voxel.")).map(({ name }) => name);
      const select = el("select", { "aria-label": "Voxels" }, el("option", { value: "" }, "No voxels"), ...names.map((name) => el("option", { value: name }, `Voxels by ${name}`)));
      const bar = new ColourBar(this.map.source.description.style);
      bar.element.hidden = true;
      select.addEventListener("change", () => {
        void this.map.showVoxels(select.value || null).then((told) => {
          bar.element.hidden = !told || told.count === 0;
          if (told && told.count > 0) bar.show(told);
        });
      });
      children.push(select, bar.element);
    }
    if (!info.surface && !info.voxels) {
      children.push(el("p", { class: "note" }, "Boundary and voxels: run rodsweep workspace on the directory."));
    }
    return el("section", {}, el("h2", {}, "Layers"), ...children);
  }

  private refresh(): void {
    this.count.textContent = whole(this.map.filters.passing);
    for (const [name, view] of this.views) {
      const histogram = this.map.histogram(name);
      if (histogram) view.show(histogram);
    }
  }
}
