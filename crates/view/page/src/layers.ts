// What `rodsweep workspace` measured: the boundary as a surface, the volume as voxels.

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Color,
  InstancedMesh,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  Plane,
  Vector3,
} from "three";
import { film } from "./film";
import type { Range } from "./filters";
import type { Source } from "./source";
import type { Stage } from "./stage";
import { colourOf, onTheme } from "./theme";
import type { Numbers, Statistics } from "./wire";

/** A side of a voxel's cube over the voxel's: edges stay visible. */
const CUBE = 0.92;

export class Layers {
  /** Kept: what lies on the positive side of each. */
  private readonly planes: Plane[] = [];
  private cuts: (Range | null)[] = [];
  private surface: Mesh | null = null;
  private voxels: Voxels | null = null;

  constructor(
    private readonly stage: Stage,
    private readonly source: Source,
  ) {}

  async showSurface(isShown: boolean): Promise<void> {
    if (isShown && !this.surface) {
      const { positions, corners } = await this.source.surface();
      const points = interleaved(["x", "y", "z"].map((axis) => positions.get(axis)!), this.stage.perMetre);
      const index = interleaved(["a", "b", "c"].map((name) => corners.get(name)!), 1);
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", new BufferAttribute(points, 3));
      geometry.setIndex(new BufferAttribute(Uint32Array.from(index), 1));
      geometry.computeVertexNormals();
      const material = film(this.planes);
      onTheme(() => material.color.set(colourOf("--film")));
      this.surface = new Mesh(geometry, material);
      this.surface.renderOrder = 2;
      this.stage.add(this.surface);
    }
    if (this.surface) this.surface.visible = isShown;
    this.stage.invalidate();
  }

  /** Voxels coloured by a column; tells its numbers. */
  async showVoxels(column: string | null): Promise<Statistics | null> {
    const { map, style } = this.source.description;
    const found = column && map?.voxel ? await Promise.all([this.source.voxels(column), this.source.voxelStatistics(column)]) : null;
    if (this.voxels) this.stage.remove(this.voxels.mesh);
    this.voxels?.mesh.dispose();
    this.voxels = null;
    this.stage.invalidate();
    if (!found) return null;
    const [columns, told] = found;
    const steps = style.maps[told.map ?? "sequential"];
    this.voxels = new Voxels(columns, columns.get(column!)!, told, steps, map!.voxel!, this.stage.perMetre);
    this.voxels.cut(this.cuts);
    this.stage.add(this.voxels.mesh);
    return told;
  }

  cut(cuts: (Range | null)[]): void {
    this.cuts = cuts;
    this.planes.splice(0);
    cuts.forEach((cut, axis) => {
      if (!cut) return;
      const normal = new Vector3().setComponent(axis, 1);
      this.planes.push(new Plane(normal, -cut.low * this.stage.perMetre));
      this.planes.push(new Plane(normal.clone().negate(), cut.high * this.stage.perMetre));
    });
    this.voxels?.cut(cuts);
    this.stage.invalidate();
  }
}

class Voxels {
  readonly mesh: InstancedMesh;
  /** Of each voxel, in metres, and its place among all by its three numbers. */
  private readonly centres: [Numbers, Numbers, Numbers];
  private readonly cells: string[];
  private readonly numbers = new Map<string, number>();
  private readonly colours: Color[];

  constructor(
    columns: Map<string, Numbers>,
    values: Numbers,
    { low, high }: Statistics,
    steps: string[],
    private readonly edge: number,
    private readonly perMetre: number,
  ) {
    this.centres = [columns.get("voxel.x")!, columns.get("voxel.y")!, columns.get("voxel.z")!];
    this.cells = Array.from(values, (_, k) => this.cell(k, 0, 0));
    this.cells.forEach((cell, k) => this.numbers.set(cell, k));
    const palette = steps.map((hex) => new Color(hex));
    const grey = new Color(0x8c8c8c);
    const step = (value: number) => Math.round(255 * Math.max(0, Math.min(1, (value - low) / (high - low || 1))));
    this.colours = Array.from(values, (value) => (Number.isFinite(value) ? palette[step(value)]! : grey));
    const side = CUBE * edge * perMetre;
    this.mesh = new InstancedMesh(new BoxGeometry(side, side, side), new MeshLambertMaterial(), values.length);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = -3;
  }

  /** The cell of a voxel, or of one beside it. */
  private cell(k: number, axis: number, shift: number): string {
    const at = this.centres.map((of, a) => Math.round(of[k]! / this.edge - 0.25) + (a === axis ? shift : 0));
    return at.join();
  }

  /** Whole cubes between the cut planes; those that are covered on all sides are left out. */
  cut(cuts: (Range | null)[]): void {
    const isKept = (k: number) => cuts.every((cut, axis) => !cut || (this.centres[axis]![k]! >= cut.low && this.centres[axis]![k]! <= cut.high));
    const kept = this.cells.map((_, k) => isKept(k));
    const isOpen = (k: number) =>
      [0, 1, 2].some((axis) =>
        [-1, 1].some((shift) => {
          const other = this.numbers.get(this.cell(k, axis, shift));
          return other === undefined || !kept[other];
        }),
      );
    const place = new Matrix4();
    let count = 0;
    for (let k = 0; k < kept.length; k++) {
      if (!kept[k] || !isOpen(k)) continue;
      const [x, y, z] = this.centres.map((of) => of[k]! * this.perMetre);
      this.mesh.setMatrixAt(count, place.makeTranslation(x!, y!, z!));
      this.mesh.setColorAt(count, this.colours[k]!);
      count += 1;
    }
    this.mesh.count = count;
    this.mesh.instanceMatrix.needsUpdate = true;
    if (this.mesh.instanceColor) this.mesh.instanceColor.needsUpdate = true;
  }
}

function interleaved(columns: ArrayLike<number>[], factor: number): Float32Array | Uint32Array {
  const count = columns[0]!.length;
  const all = factor === 1 ? new Uint32Array(3 * count) : new Float32Array(3 * count);
  for (let k = 0; k < count; k++) columns.forEach((column, axis) => (all[3 * k + axis] = column[k]! * factor));
  return all;
}
