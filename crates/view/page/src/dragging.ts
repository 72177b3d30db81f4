// Dragging the tip: `control`'s search for the currents, live, in the plane of the picture. The numbers beside it do the
// same by keyboard.

import { BufferGeometry, Line, LineBasicMaterial, Mesh, MeshBasicMaterial, RingGeometry, Vector3 } from "three";
import type { RodView } from "./rodview";
import type { Stage } from "./stage";
import { colourOf, onTheme } from "./theme";
import type { DragAnswer, Vector } from "./wire";

/** A change of depth that is gone after, over the rod's length. */
const DEPTH = 1e-3;
/** The tip is taken within so many pixels. */
const REACH = 16;

export class Dragging {
  last: DragAnswer | null = null;
  private isBusy = false;
  private wanted: Vector | null = null;
  private begins = true;
  /** The tip as it was last, while it is held: the plane of the picture goes through it. */
  private held: Vector3 | null = null;
  private pointer: [number, number] = [0, 0];
  private readonly target: Mesh;
  private readonly leash: Line;
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
    this.held = this.rod.mesh.tip.position.clone();
    this.begins = true;
    this.stage.controls.enabled = false;
    this.stage.renderer.domElement.setPointerCapture(event.pointerId);
  }

  private move(event: PointerEvent): void {
    const canvas = this.stage.renderer.domElement;
    if (!this.held) {
      canvas.style.cursor = this.isNear(event) ? "grab" : "";
      return;
    }
    canvas.style.cursor = "grabbing";
    this.pointer = [event.offsetX, event.offsetY];
    this.pull();
  }

  /** Searches for the place below the pointer, as deep as the tip. */
  private pull(): void {
    if (!this.held) return;
    const place = this.stage.unproject(...this.pointer, this.held);
    this.mark(place);
    this.seek([place.x / this.stage.perMetre, place.y / this.stage.perMetre, place.z / this.stage.perMetre]);
  }

  private release(): void {
    if (!this.held) return;
    this.held = null;
    this.stage.controls.enabled = true;
    this.stage.renderer.domElement.style.cursor = "";
    this.target.visible = this.leash.visible = false;
    this.stage.invalidate();
  }

  /** Only the picture's two directions are asked for: as long as the tip comes nearer by it, the plane goes with it. */
  private deepen(answer: DragAnswer): void {
    if (!this.held || this.wanted) return;
    const tip = new Vector3(...answer.tip).multiplyScalar(this.stage.perMetre);
    const { toward } = this.stage.directions();
    const depth = tip.clone().sub(this.held).dot(new Vector3(...toward));
    this.held = tip;
    if (Math.abs(depth) > DEPTH * this.rod.source.description.length * this.stage.perMetre) this.pull();
  }

  private mark(place: Vector3): void {
    this.target.visible = this.leash.visible = true;
    this.target.position.copy(place);
    this.target.quaternion.copy(this.stage.camera.quaternion);
    this.leash.geometry.setFromPoints([this.rod.mesh.tip.position, place]);
    this.stage.invalidate();
  }

  /** Searches for a place (m); `afresh` begins at the values as they are. */
  seek(target: Vector, afresh = false): void {
    this.wanted = target;
    this.begins ||= afresh;
    void this.pump();
  }

  private async pump(): Promise<void> {
    if (this.isBusy || !this.wanted) return;
    this.isBusy = true;
    const [target, begin] = [this.wanted, this.begins];
    this.wanted = null;
    this.begins = false;
    try {
      const answer = await this.rod.source.drag({ ...this.rod.values }, target, begin, this.held === null);
      this.last = answer;
      this.rod.set(answer.values);
      this.deepen(answer);
      this.listeners.forEach((listener) => listener(answer, null));
    } catch (error) {
      this.begins = true;
      this.listeners.forEach((listener) => listener(null, error instanceof Error ? error.message : String(error)));
    }
    this.isBusy = false;
    void this.pump();
  }
}
