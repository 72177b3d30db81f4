// The row of the chosen point: its inputs as arguments, and every cell.

import { copyButton, el } from "./dom";
import { digits, parse } from "./format";
import type { MapView } from "./mapview";
import { setArguments } from "./rodview";
import type { Row, Values } from "./wire";

export class RowCard {
  readonly element = el("section", { class: "row-card" });
  private readonly title = el("h2", {}, "Point");
  private readonly number = el("input", { type: "text", inputmode: "numeric", class: "number", "aria-label": "Row" });
  private readonly words = el("p", { class: "note", role: "status" }, "Click a point or give a row: its inputs, and the rod that leads there.");
  private readonly content = el("div", {});

  constructor(private readonly map: MapView) {
    // What a click does, by keyboard.
    const form = el("form", { class: "row-form" }, el("span", { class: "label" }, "row"), this.number, el("button", { type: "submit", class: "small" }, "Show"));
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      void this.find(parse(this.number.value));
    });
    this.element.append(this.title, form, this.words, this.content);
    map.onChosen((row, inputs) => this.show(row, inputs));
  }

  private async find(row: number): Promise<void> {
    if (await this.map.chooseRow(row)) return;
    const { rows, points } = this.map.info;
    this.words.classList.remove("is-wrong");
    this.words.textContent =
      Number.isInteger(row) && row >= 0 && row < rows && points < rows
        ? "This row is not among the points that are drawn."
        : `Give a whole number from 0 to ${rows - 1}.`;
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
    this.title.textContent = `Row ${row.row}`;
    const isWrong = this.map.isWrong(row.row);
    this.words.textContent = isWrong ? "The check of the run found this row wrong." : "";
    this.words.classList.toggle("is-wrong", isWrong);
    this.number.value = String(row.row);
    this.content.replaceChildren(
      el("code", { class: "arguments" }, text || "no inputs"),
      copyButton(() => text, "Copy arguments"),
      isRounded ?? "",
      el("div", { class: "cells", tabindex: 0 }, el("table", {}, el("tbody", {}, ...cells))),
    );
  }
}
