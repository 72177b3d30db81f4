// The colour bar of the map: ticks, unit, outliers, percentiles.

import { el } from "./dom";
import { compact, fixed, shownUnit, ticks } from "./format";
import type { Statistics, Style } from "./wire";

export class ColourBar {
  readonly element = el("figure", { class: "colour-bar" });
  private statistics: Statistics | null = null;

  constructor(private readonly style: Style) {}

  show(statistics: Statistics): void {
    this.statistics = statistics;
    const { low, high, clipped, percentiles, shares } = statistics;
    const { unit, factor } = shownUnit(statistics.unit, Math.max(Math.abs(low), Math.abs(high)));
    const stops = this.style.maps[statistics.map].filter((_, k) => k % 15 === 0);
    const bar = el("div", { class: `bar${clipped[0] ? " is-low" : ""}${clipped[1] ? " is-high" : ""}` });
    bar.style.setProperty("--first", stops[0]!);
    bar.style.setProperty("--last", stops[stops.length - 1]!);
    bar.style.setProperty("--stops", stops.join(", "));
    const power = commonPower(low / factor, high / factor);
    const scale = factor * 10 ** power;
    const marks = el("div", { class: "ticks" });
    for (const { value, label } of ticks(low / scale, high / scale, (high - low) / scale / 4.5)) {
      const mark = el("span", {}, label);
      mark.style.left = `${(100 * (value * scale - low)) / (high - low)}%`;
      marks.append(mark);
    }
    const small = power === 0 ? unit : `10${superscript(power)}${unit ? ` ${unit}` : ""}`;
    const rows = [0, 1, 4, 7, 8].map((k) =>
      el("span", {}, el("i", {}, shareName(shares[k]!)), compact(percentiles[k]! / factor)),
    );
    this.element.replaceChildren(
      el("figcaption", {}, statistics.name, small ? el("span", { class: "unit" }, ` (${small})`) : null),
      bar,
      marks,
      el("div", { class: "percentiles" }, ...rows),
    );
    this.element.title = clipped[0] || clipped[1] ? "Colours span percentiles 1 to 99, as in the figures" : "";
  }

  /** The colour of a value. */
  colour(value: number): string {
    const { low, high, map } = this.statistics!;
    const steps = this.style.maps[map];
    return steps[Math.max(0, Math.min(255, Math.round((255 * (value - low)) / (high - low))))]!;
  }
}

function shareName(share: number): string {
  return share === 0 ? "least" : share === 1 ? "most" : share === 0.5 ? "median" : `${fixed(100 * share, 0)}\u202f%`;
}

/** The power of ten, a multiple of three, to take out of an axis' numbers: 0 when they read well as they are. */
function commonPower(low: number, high: number): number {
  const largest = Math.max(Math.abs(low), Math.abs(high));
  return largest === 0 || (largest >= 0.01 && largest < 1e4) ? 0 : 3 * Math.floor(Math.log10(largest) / 3);
}

function superscript(power: number): string {
  const digits = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079";
  return String(power).replace("-", "\u207b").replace(/\d/g, (digit) => digits[Number(digit)]!);
}
