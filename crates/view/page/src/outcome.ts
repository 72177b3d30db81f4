// How a search for currents ended, in words.

import { compact } from "./format";
import type { DragAnswer, Slider } from "./wire";

const OUTCOMES: Record<string, string> = {
  reached: "The tip is there.",
  "at-limit": "Out of reach within the limits of the inputs.",
  unreachable: "Out of reach: no limit is in the way, but the tip cannot go there.",
  stuck: "Every step leads away, or to no stable equilibrium nearby.",
  "iteration-limit": "Still on its way.",
};

export function outcomeInWords({ outcome, held, values }: DragAnswer, sliders: Slider[]): string {
  if (held.length === 0) return OUTCOMES[outcome] ?? outcome;
  const named = held.map((name) => {
    const slider = sliders.find((slider) => slider.name === name);
    const limit = slider ? ` (${compact(values[name]! / slider.factor)}\u202f${slider.shown_unit})` : "";
    return `${name}${limit}`;
  });
  return `Held back by the limit of ${named.join(", ")}.`;
}
