// The numbers of the scene: a slider and a number each, by groups; what is commanded stands open.

import { el } from "./dom";
import { decimalsFor, fixed, parse, toSi } from "./format";
import type { RodView } from "./rodview";
import type { Slider, Values } from "./wire";

const STEPS = 2000;

export class SliderPanel {
  readonly element: HTMLElement;
  private readonly rows = new Map<string, SliderRow>();

  constructor(private readonly rod: RodView) {
    const { sliders } = rod.source.description;
    this.element = el("div", { class: "sliders" });
    const groups = new Map<string, Slider[]>();
    sliders.forEach((slider) => groups.set(slider.group, [...(groups.get(slider.group) ?? []), slider]));
    for (const [name, members] of groups) {
      const isOpen = members.some((slider) => slider.is_input) || name === "flux density";
      const changed = el("span", { class: "changed" });
      const isShort = members.every((slider) => shortName(slider.name, name).length <= 1);
      const group = el("details", { class: `group${isShort ? " is-short" : ""}`, open: isOpen }, el("summary", {}, name, changed));
      for (const slider of members) {
        const row = new SliderRow(slider, name, (value, isLast) => this.rod.set({ [slider.name]: value }, isLast));
        this.rows.set(slider.name, row);
        group.append(row.element);
      }
      this.element.append(group);
    }
  }

  /** Shows values that came from elsewhere. */
  show(values: Values): void {
    for (const [name, row] of this.rows) row.show(values[name] ?? row.slider.value);
    for (const group of this.element.querySelectorAll("details")) {
      const count = group.querySelectorAll(".slider.is-changed").length;
      group.querySelector(".changed")!.textContent = count > 0 ? `${count} changed` : "";
    }
  }

  reset(): void {
    const values: Values = {};
    this.rows.forEach((row, name) => (values[name] = row.slider.value));
    this.rod.set(values, true);
  }
}

class SliderRow {
  readonly element: HTMLElement;
  private readonly thumb: HTMLInputElement;
  private readonly text: HTMLInputElement;

  constructor(
    readonly slider: Slider,
    group: string,
    private readonly changed: (value: number, isLast: boolean) => void,
  ) {
    const label = shortName(slider.name, group);
    const unit = slider.shown_unit;
    const words = `${slider.name}${unit ? ` in ${unit}` : ""}`;
    this.thumb = el("input", { type: "range", min: 0, max: STEPS, step: "any", "aria-label": words, "data-name": slider.name });
    this.text = el("input", { type: "text", inputmode: "decimal", class: "number", "aria-label": `${words}, as a number` });
    this.thumb.addEventListener("input", () => this.changed(this.thumbValue(), false));
    this.thumb.addEventListener("change", () => this.changed(this.thumbValue(), true));
    this.thumb.addEventListener("keydown", (event) => this.key(event));
    this.text.addEventListener("change", () => {
      const typed = toSi(parse(this.text.value), slider.factor);
      this.changed(Number.isFinite(typed) ? typed : slider.value, true);
    });
    const reset = el("button", { type: "button", class: "reset", title: "As in the file", "aria-label": `${label}: as in the file` }, "\u21ba");
    reset.addEventListener("click", () => this.changed(slider.value, true));
    this.element = el(
      "div",
      { class: "slider", title: `${slider.name}; limits ${slider.limits === "sweep" ? "of the sweep" : "by its kind"}` },
      el("span", { class: "label" }, label),
      this.thumb,
      this.text,
      el("span", { class: "unit" }, unit),
      reset,
    );
    this.show(slider.value);
  }

  private thumbValue(): number {
    const { low, high, factor } = this.slider;
    const value = low + (Number(this.thumb.value) / STEPS) * (high - low);
    // As many digits as a slider can tell, so that arguments stay short.
    const rounded = toSi(Number((value / factor).toFixed(decimalsFor((high - low) / factor) + 1)), factor);
    return Math.max(low, Math.min(high, rounded));
  }

  private key(event: KeyboardEvent): void {
    const direction = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!direction) return;
    event.preventDefault();
    const step = event.shiftKey ? STEPS / 20 : STEPS / 200;
    this.thumb.value = String(Math.max(0, Math.min(STEPS, Number(this.thumb.value) + direction * step)));
    this.changed(this.thumbValue(), true);
  }

  show(value: number): void {
    const { low, high, factor } = this.slider;
    const share = (value - low) / (high - low || 1);
    this.thumb.value = String(share * STEPS);
    // From zero, where zero lies between the limits.
    const origin = low < 0 && high > 0 ? -low / (high - low) : 0;
    const percent = (x: number) => `${100 * Math.max(0, Math.min(1, x))}%`;
    this.thumb.style.setProperty("--from", percent(Math.min(share, origin)));
    this.thumb.style.setProperty("--to", percent(Math.max(share, origin)));
    const decimals = decimalsFor((high - low) / factor);
    if (document.activeElement !== this.text) this.text.value = fixed(value / factor, decimals);
    this.thumb.setAttribute("aria-valuetext", `${this.text.value} ${this.slider.shown_unit}`);
    this.element.classList.toggle("is-changed", value !== this.slider.value);
  }
}

/** A name below its group's heading. */
function shortName(name: string, group: string): string {
  const parts = name.split(".");
  // The heading says the rest.
  if (/ currents?$/.test(group) || parts[0] === "field") return parts[parts.length - 1]!;
  if (parts.length === 1) return "";
  return parts.slice(1).join(" ").replaceAll("_", " ");
}
