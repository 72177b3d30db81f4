// Ellipsoids at the tip, from the Jacobian: where small changes of the inputs move it, and how it gives way to a force.

import { Group, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshLambertMaterial, SphereGeometry, WireframeGeometry } from "three";
import type { Slider, Solution, Style } from "./wire";

/** Share of an input's range that makes the ellipsoid of manipulability. */
export const INPUT_SHARE = 0.1;

/** Rows of a symmetric matrix. */
type Matrix = [number, number, number][];

/** Half axes (m, longest first) with their directions. */
export interface Axes {
  lengths: number[];
  directions: number[][];
}

/** Tips for inputs within a ball of a small share of their half ranges: J S, its singular values and vectors. */
export function manipulability(solution: Solution, sliders: Slider[]): Axes | null {
  const jacobian = solution.jacobian;
  if (!jacobian) return null;
  const matrix: Matrix = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
  let count = 0;
  jacobian.parameters.forEach((name, k) => {
    const slider = sliders.find((slider) => slider.name === name && slider.is_input);
    if (!slider) return;
    count += 1;
    const scale = INPUT_SHARE * 0.5 * (slider.high - slider.low);
    const column = jacobian.position.map((row) => row[k]! * scale);
    for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) matrix[i]![j]! += column[i]! * column[j]!;
  });
  if (count === 0) return null;
  const { values, vectors } = eigen(matrix);
  return { lengths: values.map((value) => Math.sqrt(Math.max(0, value))), directions: vectors };
}

/** Displacements by a force of any direction and of one newton: d p / d F (m/N). */
export function compliance(solution: Solution): Axes | null {
  const jacobian = solution.jacobian;
  const at = ["x", "y", "z"].map((axis) => jacobian?.parameters.indexOf(`loads.tip_force.${axis}`) ?? -1);
  if (!jacobian || at.some((k) => k < 0)) return null;
  const c = jacobian.position.map((row) => at.map((k) => row[k]!));
  const matrix: Matrix = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
  // C C^T: its roots are the displacements, whatever the sign of an unstable direction.
  for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) matrix[i]![j] = c[i]!.reduce((sum, x, k) => sum + x * c[j]![k]!, 0);
  const { values, vectors } = eigen(matrix);
  return { lengths: values.map((value) => Math.sqrt(Math.max(0, value))), directions: vectors };
}

/** Eigenvalues, largest first, and unit vectors of a symmetric matrix (Jacobi's rotations). */
export function eigen(matrix: Matrix): { values: number[]; vectors: number[][] } {
  const a = matrix.map((row) => [...row]);
  const v = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  for (let sweep = 0; sweep < 30; sweep++) {
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]] as const) {
      if (a[p]![q] === 0) continue;
      const theta = (a[q]![q]! - a[p]![p]!) / (2 * a[p]![q]!);
      const t = Math.sign(theta || 1) / (Math.abs(theta) + Math.hypot(1, theta));
      const c = 1 / Math.hypot(1, t);
      const s = t * c;
      for (let k = 0; k < 3; k++) {
        const [x, y] = [a[k]![p]!, a[k]![q]!];
        a[k]![p] = c * x - s * y;
        a[k]![q] = s * x + c * y;
      }
      for (let k = 0; k < 3; k++) {
        const [x, y] = [a[p]![k]!, a[q]![k]!];
        a[p]![k] = c * x - s * y;
        a[q]![k] = s * x + c * y;
        const [u, w] = [v[k]![p]!, v[k]![q]!];
        v[k]![p] = c * u - s * w;
        v[k]![q] = s * u + c * w;
      }
    }
  }
  const order = [0, 1, 2].sort((i, j) => a[j]![j]! - a[i]![i]!);
  return { values: order.map((k) => a[k]![k]!), vectors: order.map((k) => [v[0]![k]!, v[1]![k]!, v[2]![k]!]) };
}

export class Ellipsoid {
  readonly group = new Group();

  constructor(style: Style, name: "manipulability" | "compliance") {
    const colour = style.colours[name]!;
    const sphere = new SphereGeometry(1, 36, 24);
    const surface = new MeshLambertMaterial({ color: colour, transparent: true, opacity: 0.35, depthWrite: false });
    const lines = new LineBasicMaterial({ color: colour, transparent: true, opacity: 0.5 });
    const grid = new LineSegments(new WireframeGeometry(new SphereGeometry(1, 12, 8)), lines);
    this.group.add(new Mesh(sphere, surface), grid);
    this.group.matrixAutoUpdate = false;
    this.group.visible = false;
  }

  /** Draws half axes (shown units) around the tip's group, whose child it is. */
  show(axes: Axes, scale: number): void {
    const [a, b, c] = axes.lengths.map((length) => Math.max(length * scale, 1e-4));
    const [x, y, z] = axes.directions as [number[], number[], number[]];
    this.group.visible = true;
    this.group.matrix = new Matrix4().set(
      x[0]! * a!, y[0]! * b!, z[0]! * c!, 0,
      x[1]! * a!, y[1]! * b!, z[1]! * c!, 0,
      x[2]! * a!, y[2]! * b!, z[2]! * c!, 0,
      0, 0, 0, 1,
    );
    this.group.matrixWorldNeedsUpdate = true;
  }

  hide(): void {
    this.group.visible = false;
  }
}
