// Dragging the tip: `control`'s search for the currents, live, for the two directions of the picture; the depth is free.
// The numbers beside it do the same by keyboard, for all three.

import { BufferGeometry, Line, LineBasicMaterial, Mesh, MeshBasicMaterial, RingGeometry, Vector3 } from "three";
import { el } from "./dom";
import type { RodView } from "./rodview";
import type { Stage } from "./stage";
import { colourOf, onTheme } from "./theme";
import { outcomeInWords } from "./outcome";
import type { DragAnswer, Vector } from "./wire";

/** The tip is taken within so many pixels. */
const REACH = 16;
/** A search that is still on its way after so many answers is as near as it gets. */
const PATIENCE = 12;

/** What is searched for: a place (m), perhaps with a direction along which it is free. */
interface Goal {
  target: Vector;
  along: Vector | null;
}

export class Dragging {
  last: DragAnswer | null = null;
  private isBusy = false;
  private wanted: Goal | null = null;
  private begins = true;
  private isHeld = false;
  private tries = 0;
  private readonly target: Mesh;
  private readonly leash: Line;
  private readonly note = el("div", { class: "drag-note", "aria-hidden": "true", hidden: true });
  private readonly listeners: ((answer: DragAnswer | null, error: string | null) => void)[] = [];

  constructor(
    private readonly stage: Stage,
    private readonly rod: RodView,
  ) {
    const size = 0.012 * rod.source.description.length * stage.perMetre;
    const material = new MeshBasicMaterial({ depthTest: false });
    this.target = new Mesh(new RingGeometry(0.65 * size, size, 28), material);
    const line = new LineBasicMaterial({ depthTest: false });
    this.leash = new Line(new BufferGeometry().setFromPoints([new Vector3(), new Vector3()]), line);
    this.leash.frustumCulled = false;
    this.target.visible = this.leash.visible = false;
    stage.add(this.target, this.leash);
    stage.host.append(this.note);
    onTheme(() => {
      material.color.set(colourOf("--accent"));
      line.color.set(colourOf("--accent"));
    });
    const canvas = stage.renderer.domElement;
    // Before the controls of the camera, which listen to the canvas, too.
    canvas.addEventListener("pointerdown", (event) => this.down(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", () => this.release());
    canvas.addEventListener("pointercancel", () => this.release());
    // The leash ends at the rod, whenever that is drawn anew.
    stage.onFrame(() => this.leash.visible && this.stretch());
  }

  onAnswer(listener: (answer: DragAnswer | null, error: string | null) => void): void {
    this.listeners.push(listener);
  }

  /** Whether an answer is still to come. */
  isPending(): boolean {
    return this.isBusy || this.wanted !== null;
  }

  private isNear(event: PointerEvent): boolean {
    if (!this.rod.answer?.solution.tip || !this.rod.mesh.group.visible) return false;
    const [x, y] = this.stage.project(this.rod.mesh.tip.position);
    return Math.hypot(event.offsetX - x, event.offsetY - y) < REACH;
  }

  private down(event: PointerEvent): void {
    if (!this.isNear(event)) return;
    this.isHeld = this.begins = true;
    this.stage.controls.enabled = false;
    this.stage.renderer.domElement.setPointerCapture(event.pointerId);
  }

  private move(event: PointerEvent): void {
    const canvas = this.stage.renderer.domElement;
    if (!this.isHeld) {
      canvas.style.cursor = this.isNear(event) ? "grab" : "";
      return;
    }
    canvas.style.cursor = "grabbing";
    // As deep as the tip is now; the search may go where it likes along the direction of view.
    const place = this.stage.unproject(event.offsetX, event.offsetY, this.rod.mesh.tip.position);
    this.target.visible = this.leash.visible = true;
    this.target.position.copy(place);
    this.target.quaternion.copy(this.stage.camera.quaternion);
    this.stage.invalidate();
    const { perMetre } = this.stage;
    this.seek({ target: place.divideScalar(perMetre).toArray(), along: this.stage.directions().toward });
  }

  private release(): void {
    if (!this.isHeld) return;
    this.isHeld = false;
    this.stage.controls.enabled = true;
    this.stage.renderer.domElement.style.cursor = "";
    this.target.visible = this.leash.visible = false;
    this.note.hidden = true;
    this.stage.invalidate();
  }

  private stretch(): void {
    this.leash.geometry.setFromPoints([this.rod.mesh.tip.position, this.target.position]);
  }

  /** Searches for a place (m) from the values as they are. */
  find(target: Vector): void {
    this.begins = true;
    this.seek({ target, along: null });
  }

  private seek(goal: Goal): void {
    this.wanted = goal;
    this.tries = 0;
    void this.pump();
  }

  private async pump(): Promise<void> {
    if (this.isBusy || !this.wanted) return;
    this.isBusy = true;
    const [goal, begin] = [this.wanted, this.begins];
    this.wanted = null;
    this.begins = false;
    try {
      const answer = await this.rod.source.drag({ ...this.rod.values }, goal.target, goal.along, begin);
      this.last = answer;
      this.rod.set(answer.values);
      this.tell(answer);
      this.tries += 1;
      if (answer.outcome === "iteration-limit" && this.tries < PATIENCE) this.wanted ??= goal;
      this.listeners.forEach((listener) => listener(answer, null));
    } catch (error) {
      this.begins = true;
      this.listeners.forEach((listener) => listener(null, error instanceof Error ? error.message : String(error)));
    }
    this.isBusy = false;
    void this.pump();
  }

  /** Below the rod, what holds the tip back. */
  private tell(answer: DragAnswer): void {
    const isThere = answer.outcome === "reached" || answer.outcome === "iteration-limit";
    this.note.hidden = isThere || !this.isHeld;
    if (!isThere) this.note.textContent = outcomeInWords(answer, this.rod.source.description.sliders);
  }
}
