// What came of the rod: status in words, shape and colour; tip, margin, estimate; other equilibria; ellipsoids.

import { copyButton, el, symbol } from "./dom";
import type { Dragging } from "./dragging";
import { INPUT_SHARE } from "./ellipsoid";
import { compact, fixed, parse } from "./format";
import { outcomeInWords } from "./outcome";
import type { RodView, Shown } from "./rodview";
import type { Branches, Contact, DragAnswer, RodAnswer, Solution, Vector } from "./wire";

/** Numbers of a contact with the wall. */
const WALL: { name: string; label: string; title: string; tell: (contact: Contact, metres: number) => string }[] = [
  {
    name: "wall.force",
    label: "normal force (mN)",
    title: "Of the wall on the rod; negative where it pulls",
    tell: (contact) => (contact.touching ? compact(1e3 * contact.normal_force, 4) : "not touched"),
  },
  {
    name: "wall.friction",
    label: "friction needed",
    title: "Coefficient that holding the tip takes",
    tell: ({ friction_ratio, holds }) => {
      const words = holds === null ? "" : holds ? ", holds" : ", slips";
      return friction_ratio === null ? `\u2013${words}` : compact(friction_ratio, 3) + words;
    },
  },
  {
    name: "wall.gap",
    label: "gap",
    title: "Between the tip's ball and the wall; negative where tissue yields",
    tell: ({ gap }, metres) => fixed(gap / metres, 3),
  },
  {
    name: "wall.angle",
    label: "angle from head on (\u00b0)",
    title: "Between the direction into the wall and the tip's tangent",
    tell: ({ angle }) => fixed((angle * 180) / Math.PI, 1),
  },
];

export class Readout {
  readonly element: HTMLElement;
  private readonly status = el("div", { class: "status", role: "status", "aria-live": "polite" });
  private readonly numbers: Record<string, HTMLElement> = {};
  private readonly margin = el("i");
  private readonly others = el("div", { class: "others" });
  private readonly arguments = el("code", { class: "arguments" });
  private readonly notes = el("p", { class: "note" });
  private readonly search = el("p", { class: "note search", role: "status" });
  private readonly tipInputs: HTMLInputElement[];
  private found: Branches | null = null;

  constructor(
    private readonly rod: RodView,
    private readonly dragging: Dragging | null,
  ) {
    const { description } = rod.source;
    const unit = description.length_unit.name;
    const number = (name: string, label: string, title = "") => {
      const cell = el("output", { class: "value", "data-value": name }, "\u2013");
      this.numbers[name] = cell;
      return el("div", { class: "row", title }, el("span", { class: "label" }, label), cell);
    };
    const isLive = description.engine;
    this.tipInputs = ["x", "y", "z"].map((axis) =>
      el("input", { type: "text", inputmode: "decimal", class: "number", "aria-label": `Tip ${axis} in ${unit}` }),
    );
    const go = el("button", { type: "submit", class: "small" }, "Find currents");
    const form = el("form", { class: "tip-form" }, ...this.tipInputs, go);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const metres = description.length_unit.metres;
      const target = this.tipInputs.map((input) => parse(input.value) * metres);
      if (target.every(Number.isFinite)) this.dragging?.find(target as Vector);
    });
    const toggle = (name: keyof Shown, label: string) => {
      const box = el("input", { type: "checkbox" });
      box.addEventListener("change", () => rod.setShown(name, box.checked));
      return el("label", { class: `check is-${name}` }, box, el("span", {}, label));
    };
    const all = el("button", { type: "button" }, "All equilibria");
    all.addEventListener("click", () => void this.findAll(all));
    const canDrag = isLive && description.can_drag && dragging !== null;
    this.element = el(
      "div",
      { class: "readout" },
      isLive ? null : el("section", {}, el("h2", {}, "Rod as in the file")),
      this.status,
      el(
        "section",
        {},
        el("h2", {}, "Tip"),
        ...["x", "y", "z"].map((axis, k) => number(`tip.${axis}`, `${axis} (${unit})`, k === 0 ? "Position, world frame" : "")),
        number("tangent", "tangent"),
      ),
      el(
        "section",
        {},
        el("h2", {}, "Equilibrium"),
        number("margin", "stability margin", "1 at rest, 0 at a fold, negative when unstable"),
        el("div", { class: "meter", "aria-hidden": "true" }, this.margin),
        number("index", "unstable modes"),
        number("estimate", "error estimate", "Of tip position over rod length or of tip rotation, whichever is larger"),
        number("load", "load reached from rest"),
        isLive ? number("time", "solved in") : null,
      ),
      description.wall ? el("section", {}, el("h2", {}, "At the wall"), ...WALL.map(({ name, label, title }) => number(name, name === "wall.gap" ? `${label} (${unit})` : label, title))) : null,
      canDrag ? el("section", {}, el("h2", {}, `Move the tip (${unit})`), form, this.search) : null,
      isLive ? el("section", {}, el("h2", {}, "Other equilibria"), all, this.others) : null,
      description.field_varies ? el("section", {}, el("h2", {}, "Field"), number("field", "|B| at the tip (mT)"), this.lineSwitch()) : null,
      rod.stage === null ? null : el(
        "section",
        {},
        el("h2", {}, "Ellipsoids at the tip"),
        toggle("manipulability", "Manipulability"),
        toggle("compliance", "Compliance"),
        this.notes,
      ),
      isLive
        ? el("section", {}, el("h2", {}, "As arguments"), this.arguments, copyButton(() => rod.setArguments(), "Copy arguments"))
        : null,
    );
    rod.onAnswer((answer, error) => this.show(answer, error));
    dragging?.onAnswer((answer, error) => this.tellSearch(answer, error));
  }

  private lineSwitch(): HTMLElement | null {
    if (!this.rod.lines) return null;
    const box = el("input", { type: "checkbox", checked: true });
    box.addEventListener("change", () => this.rod.showLines(box.checked));
    return el("label", { class: "check" }, box, el("span", {}, "Lines of B"));
  }

  private tellSearch(answer: DragAnswer | null, error: string | null): void {
    if (!answer) this.search.textContent = error ?? "";
    else {
      const { sliders, length_unit } = this.rod.source.description;
      const isThere = answer.outcome === "reached";
      const left = isThere ? "" : ` ${compact(answer.residual / length_unit.metres, 2)}\u202f${length_unit.name} are missing.`;
      this.search.textContent = outcomeInWords(answer, sliders) + left;
    }
  }

  private show(answer: RodAnswer | null, error: string | null): void {
    const solution = answer?.solution ?? null;
    const { kind, title, words } = judge(solution, error);
    this.status.className = `status is-${kind}`;
    this.status.replaceChildren(symbol(kind), el("b", {}, title), el("span", {}, words));
    const write = (name: string, text: string) => {
      const cell = this.numbers[name];
      if (cell && cell.textContent !== text) cell.textContent = text;
    };
    const metres = this.rod.source.description.length_unit.metres;
    const tip = solution?.tip ?? null;
    ["x", "y", "z"].forEach((axis, k) => {
      const text = tip ? fixed(tip.position[k]! / metres, 4) : "\u2013";
      write(`tip.${axis}`, text);
      const input = this.tipInputs[k]!;
      if (document.activeElement !== input) input.value = tip ? fixed(tip.position[k]! / metres, 2) : "";
    });
    write("tangent", tip ? tip.rotation.map((row) => fixed(row[2]!, 3)).join("  ") : "\u2013");
    const margin = solution?.stability_margin;
    write("margin", margin === undefined || margin === null ? "\u2013" : fixed(margin, 4));
    this.margin.style.width = `${100 * Math.max(0, Math.min(1, margin ?? 0))}%`;
    write("index", answer?.stability_index == null ? "\u2013" : String(answer.stability_index));
    write("estimate", solution?.error_estimate == null ? "\u2013" : compact(solution.error_estimate, 2));
    write("load", solution ? `${fixed(100 * solution.load_fraction, solution.load_fraction === 1 ? 0 : 1)}\u202f%` : "\u2013");
    write("time", answer && this.rod.source.description.engine ? `${fixed(1e3 * answer.seconds, 1)}\u202fms` : "\u2013");
    const atTip = answer?.shape?.flux_density_at_tip ?? null;
    write("field", atTip === null ? "\u2013" : compact(1e3 * atTip, 4));
    for (const { name, tell } of WALL) write(name, solution?.contact ? tell(solution.contact, metres) : "\u2013");
    this.arguments.textContent = this.rod.setArguments() || "none: the values of the file";
    this.others.replaceChildren();
    this.found = null;
    this.tellEllipsoids();
  }

  private tellEllipsoids(): void {
    const { shown, softForce } = this.rod;
    const words = [];
    if (shown.manipulability) words.push(`Manipulability: every input moves by ${100 * INPUT_SHARE}\u202f% of half its range.`);
    if (shown.compliance) words.push(`Compliance: any force of ${compact(softForce * 1e3)}\u202fmN.`);
    this.notes.textContent = words.join(" ");
  }

  private async findAll(button: HTMLButtonElement): Promise<void> {
    button.disabled = true;
    try {
      this.found = await this.rod.branches();
      this.list(this.found);
    } catch (error) {
      this.others.replaceChildren(el("p", { class: "note" }, error instanceof Error ? error.message : String(error)));
    }
    button.disabled = false;
  }

  private list(found: Branches): void {
    const { metres, name } = this.rod.source.description.length_unit;
    const stable = found.branches.filter((branch) => branch.stable).length;
    const words = `${found.branches.length} found, ${stable} stable${found.balanced ? "" : "; some are missing"}.`;
    const isUnstableShown = el("input", { type: "checkbox", checked: true });
    isUnstableShown.addEventListener("change", () =>
      this.rod.showGhosts(found, (branch) => branch.stable === true || isUnstableShown.checked),
    );
    const rows = found.branches.map((branch) => {
      const at = branch.tip ? branch.tip.position.map((x) => fixed(x / metres, 1)).join("  ") : "\u2013";
      const cells = [el("td", {}, symbol(branch.stable ? "good" : "warn"), branch.stable ? "stable" : "unstable")];
      cells.push(el("td", { class: "value" }, at), el("td", { class: "value" }, fixed(branch.stability_margin ?? NaN, 2)));
      return el("tr", {}, ...cells);
    });
    const head = el("tr", {}, el("th", {}, ""), el("th", {}, `tip (${name})`), el("th", {}, "margin"));
    this.others.replaceChildren(
      el("p", { class: "note" }, words),
      el("label", { class: "check" }, isUnstableShown, el("span", {}, "Unstable ones, too")),
      el("table", { class: "equilibria" }, el("thead", {}, head), el("tbody", {}, ...rows)),
    );
  }
}

type Kind = "good" | "warn" | "bad" | "wait";

/** A solution in words, and in a few of them. */
export function judge(solution: Solution | null, error: string | null): { kind: Kind; title: string; words: string; brief: string } {
  if (error) return { kind: "bad", title: "No rod", words: error, brief: "the last one stays in grey" };
  if (!solution) return { kind: "wait", title: "Solving", words: "", brief: "" };
  const status = solution.status;
  const share = solution.load_fraction;
  // Beyond the full load the wall comes.
  const path =
    share > 1
      ? `followed until the wall has come ${fixed(100 * (share - 1), 1)}\u202f% of its way`
      : `followed from rest to ${fixed(100 * share, 1)}\u202f% of the load`;
  if (status === "out-of-reach") {
    const words = "The anchor is farther from the base than the rod is long.";
    return { kind: "bad", title: "Out of reach", words, brief: "the last one stays in grey" };
  }
  if (!solution.tip) return { kind: "bad", title: "No equilibrium", words: `${status}: ${path}.`, brief: "the last one stays in grey" };
  if (solution.stable === false) {
    const words = status === "unstable" ? "No rod stays here." : `${status}: no rod stays here.`;
    return { kind: "warn", title: "Unstable", words, brief: "no rod stays here" };
  }
  if (status === "through-wall") {
    const words = "Another part of the rod than its tip is in the wall; the force there is not modelled.";
    return { kind: "warn", title: "Through the wall", words, brief: "the rod is in the wall" };
  }
  if (!solution.converged) return { kind: "warn", title: "Fold", words: `${path}: there the rod would snap.`, brief: "drawn: an equilibrium beyond" };
  return { kind: "good", title: "Stable", words: status === "ok" ? "reached from rest" : `${status}, reached from rest`, brief: "" };
}
