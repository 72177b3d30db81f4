// The box around the drawing: back panes with a grid, ticks and axis labels as in the figures, and a scale bar.

import { Box3, BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineSegments, Vector3 } from "three";
import { el } from "./dom";
import { compact, roundUp, ticks } from "./format";
import type { Stage } from "./stage";
import { colourOf, onTheme } from "./theme";

const NAMES = ["x", "y", "z"] as const;
/** Least distance of labels (pixels). */
const SPACING = 46;

interface Pane {
  axis: number;
  end: "min" | "max";
  lines: LineSegments;
}

export class AxesBox {
  private readonly group = new Group();
  private readonly labels: HTMLElement;
  private readonly scaleBar: HTMLElement;
  private readonly scaleText: HTMLElement;
  private readonly material = new LineBasicMaterial();
  private panes: Pane[] = [];
  private pool: HTMLElement[] = [];

  constructor(
    private readonly stage: Stage,
    private readonly unit: string,
  ) {
    this.labels = el("div", { class: "axis-labels", "aria-hidden": "true" });
    this.scaleText = el("span");
    this.scaleBar = el("div", { class: "scale-bar" }, el("i"), this.scaleText);
    stage.host.append(this.labels, this.scaleBar);
    stage.add(this.group);
    stage.onFrame(() => this.update());
    onTheme(() => this.material.color.set(colourOf("--grid")));
  }

  /** Spans a box, widened to round limits nowhere: limits are those of the data. */
  setBox(box: Box3): void {
    this.group.clear();
    this.panes = [];
    const size = box.getSize(new Vector3());
    const step = roundUp(Math.max(size.x, size.y, size.z) / 8);
    for (let axis = 0; axis < 3; axis++) {
      for (const end of ["min", "max"] as const) {
        const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        const points: number[] = [];
        const line = (along: number, across: number, at: number) => {
          for (const from of ["min", "max"] as const) {
            const point = [0, 0, 0];
            point[axis] = box[end].getComponent(axis);
            point[along] = box[from].getComponent(along);
            point[across] = at;
            points.push(...point);
          }
        };
        for (const [along, across] of [[u, v], [v, u]] as const) {
          const [low, high] = [box.min.getComponent(across), box.max.getComponent(across)];
          line(along, across, low);
          line(along, across, high);
          ticks(low, high, step).forEach(({ value }) => line(along, across, value));
        }
        const geometry = new BufferGeometry();
        geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
        const lines = new LineSegments(geometry, this.material);
        lines.renderOrder = -4;
        this.panes.push({ axis, end, lines });
        this.group.add(lines);
      }
    }
    this.stage.invalidate();
  }

  /** Shows the panes behind the data, and writes labels at the edges in front. */
  private update(): void {
    const { stage } = this;
    const { toward } = stage.directions();
    for (const { axis, end, lines } of this.panes) lines.visible = toward[axis]! > 0 === (end === "min");
    let used = 0;
    const write = (text: string, x: number, y: number, kind: string) => {
      const label = (this.pool[used] ??= this.labels.appendChild(el("span")));
      used += 1;
      label.textContent = text;
      label.className = kind;
      label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
      label.hidden = false;
    };
    if (this.panes.length > 0) {
      const { min, max } = stage.box;
      const near = (axis: number) => (toward[axis]! > 0 ? max : min).getComponent(axis);
      const far = (axis: number) => (toward[axis]! > 0 ? min : max).getComponent(axis);
      const floor = toward[2] > 0 ? min.z : max.z;
      const place = (axis: number, at: number): Vector3 => {
        if (axis === 0) return new Vector3(at, near(1), floor);
        if (axis === 1) return new Vector3(near(0), at, floor);
        // Of the two outer upright edges, the left one.
        const edges = [new Vector3(near(0), far(1), at), new Vector3(far(0), near(1), at)];
        return edges.sort((a, b) => stage.project(a)[0] - stage.project(b)[0])[0]!;
      };
      const centre = stage.project(stage.box.getCenter(new Vector3()));
      for (let axis = 0; axis < 3; axis++) {
        const [low, high] = [min.getComponent(axis), max.getComponent(axis)];
        const [a, b] = [stage.project(place(axis, low)), stage.project(place(axis, high))];
        const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
        // Seen along the axis, its labels would lie upon each other.
        if (length < 60) continue;
        const normal = [-(b[1] - a[1]) / length, (b[0] - a[0]) / length];
        const middle = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
        const side = normal[0]! * (middle[0]! - centre[0]) + normal[1]! * (middle[1]! - centre[1]) > 0 ? 1 : -1;
        const out = (distance: number) => [side * distance * normal[0]!, side * distance * normal[1]!];
        const marks = ticks(low, high, Math.max(((high - low) * SPACING) / length, (high - low) / 9));
        for (const { value, label } of marks) {
          const [x, y] = stage.project(place(axis, value));
          const [dx, dy] = out(15);
          write(label, x + dx!, y + dy!, "tick");
        }
        const [dx, dy] = out(axis === 2 ? 52 : 37);
        write(`${NAMES[axis]!} (${this.unit})`, middle[0]! + dx!, middle[1]! + dy!, "axis");
      }
    }
    for (const rest of this.pool.slice(used)) rest.hidden = true;
    const length = roundUp(60 / stage.scale());
    this.scaleBar.style.width = `${(length * stage.scale()).toFixed(1)}px`;
    this.scaleText.textContent = `${compact(length)} ${this.unit}`;
  }
}
