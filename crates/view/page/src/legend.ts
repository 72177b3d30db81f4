// What the colours in space mean, in the words of the figures.

import { el } from "./dom";
import { compact } from "./format";
import { norm } from "./rodmesh";
import type { RodAnswer, Style } from "./wire";

export class Legend {
  readonly element = el("div", { class: "legend" });
  private words = "";

  constructor(private readonly style: Style) {}

  show(answer: RodAnswer | null, hasLines: boolean): void {
    const shape = answer?.shape;
    // What is drawn in grey keeps its legend.
    if (!shape && this.words) return;
    const entries: [string, string, string][] = [];
    const { colours } = this.style;
    if (shape) {
      const kinds = new Set(shape.stretches.map((stretch) => stretch.kind));
      if (kinds.has("flexible")) entries.push(["line", "var(--flexible)", "flexible"]);
      if (kinds.has("rigid")) entries.push(["line", colours.rigid!, "rigid"]);
      if (kinds.has("coil")) entries.push(["line", colours.coil!, "coil (rigid)"]);
      if (kinds.has("magnet")) entries.push(["line", colours.coil!, "magnet (rigid)"]);
      const dipole = Math.max(...shape.stretches.map((stretch) => norm(stretch.dipole)));
      if (dipole > 0) entries.push(["arrow", colours.dipole!, `dipole moment \u00b5, ${compact(dipole, 2)} A\u00b7m\u00b2`]);
      const field = norm(shape.flux_density);
      const letter = shape.sources.length > 0 ? "uniform field B\u2080" : "field B";
      if (field > 0) entries.push(["arrow", colours.field!, `${letter}, ${compact(field, 3)} T`]);
      const around = new Set(shape.sources.map((source) => source.kind));
      if (around.has("magnet")) entries.push(["line", colours.magnet!, "magnet, arrow from S to N"]);
      if (around.has("electromagnet")) entries.push(["line", colours.electromagnet!, "electromagnet, size not to scale"]);
      if (hasLines) {
        const size = shape.flux_density_at_tip ?? null;
        const atTip = size === null ? "" : `; |B| = ${compact(1e3 * size, 3)} mT at the tip`;
        entries.push(["arrow", colours.line!, `lines of B${atTip}`]);
      }
      const force = norm(shape.tip_force);
      if (force > 0) entries.push(["arrow", colours.force!, `tip force F, ${compact(1e3 * force, 2)} mN`]);
      const { wall } = shape;
      const contact = answer?.solution.contact ?? null;
      if (wall) entries.push(["line", colours.wall!, "wall"]);
      const push = contact?.touching ? norm(contact.force) : 0;
      if (push > 0) entries.push(["arrow", colours.wall_force!, `force of the wall f, ${compact(1e3 * push, 3)} mN`]);
      entries.push(["frame", "", "tip frame d\u2081 d\u2082 d\u2083"]);
    }
    entries.push(["dash", colours.grey!, "at rest"]);
    const words = JSON.stringify(entries);
    if (words === this.words) return;
    this.words = words;
    this.element.replaceChildren(
      ...entries.map(([kind, colour, text]) => {
        const mark = el("i", { class: `mark is-${kind}` });
        if (kind === "frame") mark.append(...colours.frame.map((colour) => marked(el("b"), colour)));
        return el("span", {}, marked(mark, colour), text);
      }),
    );
  }
}

function marked(element: HTMLElement, colour: string): HTMLElement {
  if (colour) element.style.setProperty("--colour", colour);
  return element;
}
