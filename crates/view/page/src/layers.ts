// What `rodsweep workspace` measured: the boundary as a surface, the volume as voxels.

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  InstancedMesh,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  Plane,
  Vector3,
} from "three";
import type { Source } from "./source";
import type { Stage } from "./stage";
import type { Range } from "./filters";

export class Layers {
  /** Kept: what lies on the positive side of each. */
  readonly planes: Plane[] = [];
  private surface: Mesh | null = null;
  private voxels: InstancedMesh | null = null;

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
      const colour = this.source.description.style.colours.field!;
      const material = new MeshLambertMaterial({
        color: colour,
        transparent: true,
        opacity: 0.28,
        side: DoubleSide,
        depthWrite: false,
        clippingPlanes: this.planes,
      });
      this.surface = new Mesh(geometry, material);
      this.surface.renderOrder = 2;
      this.stage.add(this.surface);
    }
    if (this.surface) this.surface.visible = isShown;
    this.stage.invalidate();
  }

  /** Voxels coloured by a column, over its percentiles 1 to 99, which are told. */
  async showVoxels(column: string | null): Promise<Range | null> {
    let range: Range | null = null;
    if (this.voxels) {
      this.stage.remove(this.voxels);
      this.voxels.dispose();
      this.voxels = null;
    }
    const edge = this.source.description.map?.voxel;
    if (column && edge) {
      const columns = await this.source.voxels(column);
      const [x, y, z] = [columns.get("voxel.x")!, columns.get("voxel.y")!, columns.get("voxel.z")!];
      const values = columns.get(column)!;
      const sorted = Float32Array.from(values).filter(Number.isFinite).sort();
      const at = (share: number) => sorted[Math.round(share * (sorted.length - 1))] ?? 0;
      const [low, high] = [at(0.01), at(0.99)];
      range = { low, high };
      const steps = this.source.description.style.maps.sequential.map((hex) => new Color(hex));
      const side = 0.92 * edge * this.stage.perMetre;
      const material = new MeshLambertMaterial({ clippingPlanes: this.planes });
      const mesh = new InstancedMesh(new BoxGeometry(side, side, side), material, values.length);
      const place = new Matrix4();
      const grey = new Color(0x8c8c8c);
      for (let k = 0; k < values.length; k++) {
        const m = this.stage.perMetre;
        mesh.setMatrixAt(k, place.makeTranslation(x[k]! * m, y[k]! * m, z[k]! * m));
        const share = Math.max(0, Math.min(1, (values[k]! - low) / (high - low || 1)));
        mesh.setColorAt(k, Number.isFinite(values[k]!) ? steps[Math.round(255 * share)]! : grey);
      }
      mesh.frustumCulled = false;
      mesh.renderOrder = -2;
      this.voxels = mesh;
      this.stage.add(mesh);
    }
    this.stage.invalidate();
    return range;
  }

  cut(cuts: (Range | null)[]): void {
    this.planes.splice(0);
    cuts.forEach((cut, axis) => {
      if (!cut) return;
      const normal = new Vector3().setComponent(axis, 1);
      this.planes.push(new Plane(normal, -cut.low * this.stage.perMetre));
      this.planes.push(new Plane(normal.clone().negate(), cut.high * this.stage.perMetre));
    });
    this.stage.invalidate();
  }
}

function interleaved(columns: ArrayLike<number>[], factor: number): Float32Array | Uint32Array {
  const count = columns[0]!.length;
  const all = factor === 1 ? new Uint32Array(3 * count) : new Float32Array(3 * count);
  for (let k = 0; k < count; k++) columns.forEach((column, axis) => (all[3 * k + axis] = column[k]! * factor));
  return all;
}
