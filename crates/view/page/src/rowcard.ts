// The row of the chosen point: its inputs as arguments, and every cell.

import { copyButton, el } from "./dom";
import { digits } from "./format";
import type { MapView } from "./mapview";
import { setArguments } from "./rodview";
import type { Row, Values } from "./wire";

export class RowCard {
  readonly element = el("section", { class: "row-card" });

  constructor(private readonly map: MapView) {
    this.element.append(el("h2", {}, "Point"), el("p", { class: "note" }, "Click a point: its row, its inputs, and the rod that leads there."));
    map.onChosen((row, inputs) => this.show(row, inputs));
  }

  private show(row: Row, inputs: Values): void {
    const { description } = this.map.source;
    // Rounded numbers need no more digits.
    const told = description.engine ? inputs : Object.fromEntries(Object.entries(inputs).map(([name, x]) => [name, Number(x.toPrecision(5))]));
    const text = setArguments(told);
    const cells = row.cells.map(({ name, unit, value }) => {
      const words = value === null ? "\u2013" : typeof value === "number" ? digits(value) : String(value);
      return el("tr", { "data-column": name }, el("th", { scope: "row" }, name), el("td", { class: "value", title: String(value), "data-exact": String(value) }, words), el("td", { class: "unit" }, unit));
    });
    const isRounded = description.engine ? null : el("p", { class: "note" }, "Numbers of this page are rounded to 16 bits over their range.");
    this.element.replaceChildren(
      el("h2", {}, `Row ${row.row}`),
      el("code", { class: "arguments" }, text || "no inputs"),
      copyButton(() => text, "Copy arguments"),
      isRounded ?? "",
      el("div", { class: "cells", tabindex: 0 }, el("table", {}, el("tbody", {}, ...cells))),
    );
  }
}
