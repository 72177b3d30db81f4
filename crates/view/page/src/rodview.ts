// The rod that follows the sliders: only the newest values are sent, one request at a time, drawn with the next frame.

import { Vector3 } from "three";
import { Ellipsoid, compliance, manipulability } from "./ellipsoid";
import { FieldLineMeshes } from "./fieldlines";
import { RodMesh, isDrawable, type Look } from "./rodmesh";
import type { Source } from "./source";
import { SourceMeshes } from "./sources";
import type { Stage } from "./stage";
import { onTheme } from "./theme";
import { WallMesh } from "./walls";
import type { Branches, RodAnswer, Shape, Solution, Values, Vector } from "./wire";

/** Longest half axis of the ellipsoid of compliance over the rod's length. */
const SOFT = 0.12;

export interface Shown {
  manipulability: boolean;
  compliance: boolean;
}

export class RodView {
  /** Values that differ from the file, SI. */
  values: Values = {};
  /** What is drawn. */
  answer: RodAnswer | null = null;
  readonly mesh: RodMesh;
  readonly shown: Shown = { manipulability: false, compliance: false };
  /** Answers drawn since the page was opened. */
  updates = 0;
  /** Force that the ellipsoid of compliance is drawn for (N). */
  softForce = 0;
  private readonly ellipsoids: Record<keyof Shown, Ellipsoid>;
  private readonly ghosts: RodMesh[] = [];
  private isBusy = false;
  private wanted: { rest: boolean } | null = null;
  private readonly listeners: ((answer: RodAnswer | null, error: string | null) => void)[] = [];
  /** Magnets and coils around it. */
  readonly sources: SourceMeshes | null;
  /** What the tip may touch. */
  readonly wall: WallMesh | null;
  /** Lines of the field, where it varies. */
  readonly lines: FieldLineMeshes | null;
  private fieldFrom = new Vector3();

  constructor(
    readonly source: Source,
    readonly stage: Stage | null,
  ) {
    const { style, length } = source.description;
    const perMetre = stage?.perMetre ?? 1;
    this.mesh = new RodMesh(style, length, perMetre);
    this.ellipsoids = {
      manipulability: new Ellipsoid(style, "manipulability"),
      compliance: new Ellipsoid(style, "compliance"),
    };
    this.sources = stage ? new SourceMeshes(stage, style, length) : null;
    this.wall = stage && source.description.wall ? new WallMesh(stage, style, length) : null;
    this.wall?.show(source.description.wall!, null, null);
    this.lines = stage && source.description.field_varies ? new FieldLineMeshes(stage, style) : null;
    this.mesh.tip.add(this.ellipsoids.manipulability.group, this.ellipsoids.compliance.group);
    stage?.add(this.mesh.group);
    onTheme((theme) => this.mesh.setDark(theme === "dark"));
  }

  onAnswer(listener: (answer: RodAnswer | null, error: string | null) => void): void {
    this.listeners.push(listener);
  }

  /** Where the arrow of the field stands (shown units). */
  placeField(from: Vector3): void {
    this.fieldFrom = from;
    if (this.answer) this.draw(this.answer);
  }

  set(values: Values, rest = false): void {
    for (const [name, value] of Object.entries(values)) {
      const slider = this.source.description.sliders.find((slider) => slider.name === name);
      if (slider && slider.value === value) delete this.values[name];
      else this.values[name] = value;
    }
    this.want(rest);
  }

  /** Solves for the values as they are by then. */
  want(rest = false): void {
    this.wanted = { rest: rest || (this.wanted?.rest ?? false) };
    void this.pump();
  }

  /** Whether an answer is still to come. */
  isPending(): boolean {
    return this.isBusy || this.wanted !== null;
  }

  private async pump(): Promise<void> {
    if (this.isBusy || !this.wanted) return;
    this.isBusy = true;
    const { rest } = this.wanted;
    this.wanted = null;
    try {
      this.take(await this.source.solve({ ...this.values }, rest, this.lines?.known() ?? null));
    } catch (error) {
      this.mesh.fade();
      this.stage?.invalidate();
      this.tell(null, error instanceof Error ? error.message : String(error));
    }
    this.isBusy = false;
    void this.pump();
  }

  /** Draws an answer. */
  take(answer: RodAnswer): void {
    this.clearGhosts();
    this.draw(answer);
    if (answer.rest !== undefined) this.mesh.showRest(answer.rest);
    this.updates += 1;
    this.tell(answer, null);
  }

  private tell(answer: RodAnswer | null, error: string | null): void {
    this.listeners.forEach((listener) => listener(answer, error));
  }

  private draw(answer: RodAnswer): void {
    this.answer = answer;
    if (!isDrawable(answer)) this.mesh.fade();
    else {
      const { shape, solution } = answer;
      const look: Look = solution.stable === false ? "unstable" : "stable";
      this.mesh.show(shape, solution, look);
      this.mesh.showField(shape.flux_density, this.fieldFrom);
      this.sources?.show(shape.sources);
      if (shape.wall) this.wall?.show(shape.wall, solution.contact ?? null, solution.tip!.position);
      if (answer.lines) this.lines?.show(answer.lines);
      this.drawEllipsoids(solution);
    }
    this.stage?.invalidate();
  }

  private drawEllipsoids(solution: Solution): void {
    const perMetre = this.stage?.perMetre ?? 1;
    const moves = this.shown.manipulability ? manipulability(solution, this.source.description.sliders) : null;
    if (moves) this.ellipsoids.manipulability.show(moves, perMetre);
    else this.ellipsoids.manipulability.hide();
    const gives = this.shown.compliance ? compliance(solution) : null;
    if (gives) {
      const longest = gives.lengths[0]!;
      // A round force whose displacement is seen well.
      const force = (SOFT * this.source.description.length) / longest;
      const power = 10 ** Math.floor(Math.log10(force));
      this.softForce = power * ([5, 2, 1].find((lead) => lead * power <= force) ?? 1);
      this.ellipsoids.compliance.show(gives, perMetre * this.softForce);
    } else this.ellipsoids.compliance.hide();
  }

  setShown(name: keyof Shown, isShown: boolean): void {
    this.shown[name] = isShown;
    if (this.answer?.solution.tip) this.drawEllipsoids(this.answer.solution);
    this.tell(this.answer, null);
    this.stage?.invalidate();
  }

  /** Shows lines of the field, those of the values by now, or hides them. */
  showLines(isShown: boolean): void {
    this.lines?.setShown(isShown);
    this.tell(this.answer, null);
    if (isShown && this.source.description.engine) this.want();
  }

  /** Every equilibrium, the others as ghosts. */
  async branches(): Promise<Branches> {
    const found = await this.source.branches({ ...this.values });
    this.showGhosts(found, () => true);
    return found;
  }

  showGhosts(found: Branches, isWanted: (solution: Solution) => boolean): void {
    this.clearGhosts();
    const here = this.answer?.solution.tip?.position;
    found.branches.forEach((solution, k) => {
      const shape: Shape | null = found.shapes[k] ?? null;
      if (!shape || !solution.tip || !isWanted(solution)) return;
      if (here && distance(solution.tip.position, here) < 1e-7) return;
      const { style, length } = this.source.description;
      const ghost = new RodMesh(style, length, this.stage?.perMetre ?? 1, true);
      ghost.setDark(document.documentElement.dataset.theme === "dark");
      ghost.show(shape, solution, solution.stable === false ? "unstable" : "ghost");
      this.ghosts.push(ghost);
      this.stage?.add(ghost.group);
    });
    this.stage?.invalidate();
  }

  ghostCount(): number {
    return this.ghosts.length;
  }

  private clearGhosts(): void {
    this.ghosts.splice(0).forEach((ghost) => this.stage?.remove(ghost.group));
  }

  /** The drawn tip (m). */
  drawnTip(): Vector {
    const at = this.mesh.tip.getWorldPosition(new Vector3()).divideScalar(this.stage?.perMetre ?? 1);
    return [at.x, at.y, at.z];
  }

  /** As arguments of the command line. */
  setArguments(): string {
    return setArguments(this.values);
  }
}

export function setArguments(values: Values): string {
  return Object.entries(values)
    .map(([name, value]) => `--set ${name}=${value}`)
    .join(" ");
}

export function distance(a: Vector, b: Vector): number {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}
