// A range between two thumbs, and a histogram with such a range below it.

import { el } from "./dom";
import type { Histogram, Range } from "./filters";
import { brief, parse } from "./format";
import { colourOf, onTheme } from "./theme";

const STEPS = 1000;

/** Two thumbs on one track, with a number beside each. Values are in the unit of the limits, shown over `factor`. */
export class RangeInput {
  readonly element: HTMLElement;
  private readonly thumbs: HTMLInputElement[];
  private readonly texts: HTMLInputElement[];
  private readonly bar: HTMLElement;
  private value: Range;

  constructor(
    label: string,
    private limits: Range,
    private readonly factor: number,
    private readonly changed: (range: Range | null) => void,
    private readonly isLogarithmic = false,
  ) {
    this.value = { ...limits };
    const thumb = (end: "low" | "high") => {
      const words = `${label}, ${end === "low" ? "lowest" : "highest"}`;
      const input = el("input", { type: "range", min: 0, max: STEPS, step: 1, "aria-label": words });
      input.addEventListener("input", () => {
        this.set({ ...this.value, [end]: fromShare(Number(input.value) / STEPS, this.limits, this.isLogarithmic) }, end);
      });
      return input;
    };
    const text = (end: "low" | "high") => {
      const words = `${label}, ${end === "low" ? "lowest" : "highest"}, as a number`;
      const input = el("input", { type: "text", inputmode: "decimal", class: "number", "aria-label": words });
      input.addEventListener("change", () => {
        const typed = parse(input.value) * this.factor;
        this.set({ ...this.value, [end]: Number.isFinite(typed) ? typed : this.limits[end] }, end);
      });
      return input;
    };
    this.thumbs = [thumb("low"), thumb("high")];
    this.texts = [text("low"), text("high")];
    this.bar = el("i");
    this.element = el(
      "div",
      { class: "range" },
      this.texts[0]!,
      el("div", { class: "range-track" }, this.bar, ...this.thumbs),
      this.texts[1]!,
    );
    this.write();
  }

  private set(range: Range, end: "low" | "high"): void {
    if (range.low > range.high) range[end] = end === "low" ? range.high : range.low;
    this.value = range;
    this.write();
    this.changed(this.isWhole() ? null : { ...range });
  }

  isWhole(): boolean {
    const slack = 1e-9 * (this.limits.high - this.limits.low);
    return this.value.low <= this.limits.low + slack && this.value.high >= this.limits.high - slack;
  }

  reset(): void {
    this.value = { ...this.limits };
    this.write();
    this.changed(null);
  }

  /** Chooses a range, as by the thumbs. */
  choose(range: Range): void {
    this.set({ low: Math.max(range.low, this.limits.low), high: Math.min(range.high, this.limits.high) }, "low");
  }

  private write(): void {
    const share = (x: number) => toShare(x, this.limits, this.isLogarithmic);
    const ends = [this.value.low, this.value.high];
    this.thumbs.forEach((thumb, k) => {
      thumb.value = String(Math.round(share(ends[k]!) * STEPS));
      thumb.setAttribute("aria-valuetext", brief(ends[k]! / this.factor));
    });
    this.texts.forEach((text, k) => (text.value = brief(ends[k]! / this.factor)));
    this.bar.style.left = `${100 * share(this.value.low)}%`;
    this.bar.style.right = `${100 - 100 * share(this.value.high)}%`;
  }
}

/** Where a number stands between limits, 0 to 1, by equal differences or equal ratios. */
export function toShare(x: number, { low, high }: Range, isLogarithmic: boolean): number {
  const share = isLogarithmic ? Math.log(x / low) / Math.log(high / low) : (x - low) / (high - low || 1);
  return Math.max(0, Math.min(1, share));
}

/** The number there. */
export function fromShare(share: number, { low, high }: Range, isLogarithmic: boolean): number {
  if (share <= 0) return low;
  if (share >= 1) return high;
  return isLogarithmic ? low * (high / low) ** share : low + share * (high - low);
}

/** A histogram: all points behind, those that pass in front. Dragging across it chooses a range. */
export class HistogramView {
  readonly element: HTMLCanvasElement;
  private data: Histogram | null = null;
  private paint: (share: number) => string = () => colourOf("--accent");

  constructor(label: string, brushed: (range: Range) => void) {
    this.element = el("canvas", { class: "histogram", role: "img", "aria-label": `Histogram of ${label}` });
    let begun: number | null = null;
    const at = (event: PointerEvent) => {
      const rect = this.element.getBoundingClientRect();
      const share = Math.max(0, Math.min(1, (event.clientX - rect.left) / rect.width));
      return this.data ? fromShare(share, this.data, this.data.isLogarithmic) : 0;
    };
    this.element.addEventListener("pointerdown", (event) => {
      begun = at(event);
      this.element.setPointerCapture(event.pointerId);
    });
    this.element.addEventListener("pointermove", (event) => {
      if (begun === null || !this.data) return;
      const now = at(event);
      if (now !== begun) brushed({ low: Math.min(begun, now), high: Math.max(begun, now) });
    });
    this.element.addEventListener("pointerup", () => (begun = null));
    new ResizeObserver(() => this.draw()).observe(this.element);
    onTheme(() => this.draw());
  }

  /** Colours of the bars, by their share of the colour range. */
  colour(paint: ((value: number) => string) | null): void {
    this.paint = paint ?? (() => colourOf("--accent"));
    this.draw();
  }

  show(data: Histogram): void {
    this.data = data;
    this.draw();
  }

  private draw(): void {
    const { element, data } = this;
    const ratio = devicePixelRatio || 1;
    const [width, height] = [element.clientWidth, element.clientHeight];
    if (!data || width === 0) return;
    element.width = width * ratio;
    element.height = height * ratio;
    const canvas = element.getContext("2d");
    if (!canvas) return;
    canvas.scale(ratio, ratio);
    const most = Math.max(1, ...data.all);
    const bins = data.all.length;
    const step = width / bins;
    const bar = (bin: number, count: number, colour: string) => {
      // Square roots show what is rare, too.
      const tall = Math.sqrt(count / most) * (height - 2);
      canvas.fillStyle = colour;
      canvas.fillRect(bin * step, height - tall, Math.max(1, step - 1), tall);
    };
    const behind = colourOf("--bar");
    for (let bin = 0; bin < bins; bin++) {
      bar(bin, data.all[bin]!, behind);
      const value = fromShare((bin + 0.5) / bins, data, data.isLogarithmic);
      bar(bin, data.passing[bin]!, this.paint(value));
    }
    // What is as dark or as light as the panel keeps its outline.
    canvas.fillStyle = colourOf("--muted");
    data.passing.forEach((count, bin) => {
      if (count > 0) canvas.fillRect(bin * step, height - Math.sqrt(count / most) * (height - 2), Math.max(1, step - 1), 1);
    });
  }
}
