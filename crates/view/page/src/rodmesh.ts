// A rod in space: tube, coils, clamp, tip frame, arrows; colours are those of the figures.

import {
  BufferAttribute,
  BufferGeometry,
  BoxGeometry,
  Group,
  Line,
  LineDashedMaterial,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  SphereGeometry,
  Vector3,
} from "three";
import { Arrow } from "./arrow3";
import type { RodAnswer, Shape, Solution, Stretch, Style, Vector } from "./wire";

const SIDES = 18;
/** Of a rod that is no tube: radius over its length. */
const THIN = 1 / 90;
/** Thickness of stretches over the tube's. */
const THICKER = { flexible: 1, rigid: 1.35, coil: 1.85, magnet: 1.85 };
/** Lengths of arrows and symbols over the rod's length, as in the figures. */
const FIELD = 0.16;
const DIPOLE = 0.2;
const FORCE = 0.18;
const FRAME = 0.1;
const PLATE = 0.1;

/** How a rod looks. */
export type Look = "stable" | "unstable" | "stale" | "ghost";

export class RodMesh {
  readonly group = new Group();
  /** At the tip, in full precision. */
  readonly tip = new Group();
  private readonly tubes = new Map<string, Mesh<BufferGeometry, MeshLambertMaterial>>();
  private readonly arrows = new Map<string, Arrow>();
  private heads: Vector3[] = [];
  private readonly clamp: Mesh;
  private readonly handle: Mesh;
  private rest: Line | null = null;
  private isDark = false;
  private look: Look = "stable";

  constructor(
    private readonly style: Style,
    private readonly length: number,
    private readonly perMetre: number,
    private readonly isGhost = false,
  ) {
    const plate = PLATE * length * perMetre;
    this.clamp = new Mesh(new BoxGeometry(plate, plate, plate * 0.12), new MeshLambertMaterial({ color: 0xb4b4b4 }));
    const radius = 0.009 * length * perMetre;
    this.handle = new Mesh(new SphereGeometry(radius, 20, 14), new MeshLambertMaterial({ color: style.colours.field! }));
    this.group.add(this.tip);
    if (!isGhost) {
      this.tip.add(this.handle);
      this.group.add(this.clamp);
    }
  }

  setDark(isDark: boolean): void {
    this.isDark = isDark;
    this.tubes.forEach((tube) => this.paint(tube));
  }

  /** Draws an equilibrium. */
  show(shape: Shape, solution: Solution, look: Look): void {
    this.look = look;
    this.group.visible = true;
    const { perMetre } = this;
    const known = new Set<string>();
    const thick = shape.stretches.map((stretch) => stretch.radius ?? 0).reduce((a, b) => Math.max(a, b), 0);
    for (const [index, stretch] of shape.stretches.entries()) {
      const radius = (stretch.radius ?? (thick || THIN * this.length)) * THICKER[stretch.kind] * perMetre;
      const key = `${index}`;
      known.add(key);
      this.tube(key, stretch, this.isGhost ? 0.7 * radius : radius);
    }
    for (const [key, tube] of this.tubes) tube.visible = known.has(key);
    const tip = solution.tip!.position;
    this.tip.position.set(tip[0] * perMetre, tip[1] * perMetre, tip[2] * perMetre);
    if (!this.isGhost) this.symbols(shape, solution);
  }

  /** Of a rod that has no equilibrium: what was drawn last stays, as a shadow. */
  fade(): void {
    this.look = "stale";
    this.tubes.forEach((tube) => this.paint(tube));
  }

  private tube(key: string, stretch: Stretch, radius: number): void {
    let tube = this.tubes.get(key);
    if (!tube) {
      tube = new Mesh(tubeGeometry(stretch.positions.length / 3), new MeshLambertMaterial());
      tube.userData.kind = stretch.kind;
      this.tubes.set(key, tube);
      this.group.add(tube);
    }
    fillTube(tube.geometry, stretch, radius, this.perMetre, this.look === "unstable");
    this.paint(tube);
  }

  private paint(tube: Mesh<BufferGeometry, MeshLambertMaterial>): void {
    const kind = tube.userData.kind as Stretch["kind"];
    const { colours } = this.style;
    const flexible = this.isDark ? "#c9c9c9" : colours.flexible!;
    const plain = kind === "flexible" ? flexible : colours[kind === "magnet" ? "coil" : kind]!;
    const colour = this.look === "unstable" ? colours.wrong! : this.look === "stale" ? colours.grey! : plain;
    const opacity = this.look === "stale" ? 0.4 : this.isGhost ? 0.35 : 1;
    tube.material.color.set(colour);
    if (tube.material.transparent !== opacity < 1) tube.material.needsUpdate = true;
    Object.assign(tube.material, { opacity, transparent: opacity < 1, depthWrite: opacity === 1 });
  }

  private symbols(shape: Shape, solution: Solution): void {
    const { colours } = this.style;
    const length = this.length * this.perMetre;
    const at = (p: ArrayLike<number>, k = 0) =>
      new Vector3(p[3 * k]!, p[3 * k + 1]!, p[3 * k + 2]!).multiplyScalar(this.perMetre);
    const first = shape.stretches[0];
    if (first) {
      const r = first.rotations;
      const basis = new Matrix4().set(
        ...([r[0], r[1], r[2], 0, r[3], r[4], r[5], 0, r[6], r[7], r[8], 0, 0, 0, 0, 1] as Sixteen),
      );
      this.clamp.quaternion.setFromRotationMatrix(basis);
      this.clamp.position.copy(at(first.positions));
    }
    const tip = this.tip.position;
    const rotation = solution.tip!.rotation;
    const directors = [0, 1, 2].map((k) => new Vector3(...rotation.map((row) => FRAME * length * row[k]!)));
    directors.forEach((director, k) => this.arrow(`d${k}`, colours.frame[k]!, 0.0035 * length).point(tip, director));
    this.heads = directors.map((director) => director.clone().add(tip));
    const dipoles = shape.stretches.map((stretch) => norm(stretch.dipole));
    const largest = Math.max(...dipoles);
    shape.stretches.forEach((stretch, index) => {
      const arrow = stretch.kind === "coil" || stretch.kind === "magnet" ? this.arrow(`m${index}`, colours.dipole!, 0.006 * length) : null;
      const count = stretch.positions.length / 3;
      const middle = at(stretch.positions, 0).add(at(stretch.positions, count - 1)).multiplyScalar(0.5);
      const share = largest > 0 ? (DIPOLE * length) / largest : 0;
      arrow?.point(middle, new Vector3(...(stretch.dipole ?? [0, 0, 0])).multiplyScalar(share));
    });
    const force = new Vector3(...shape.tip_force);
    this.arrow("force", colours.force!, 0.006 * length).point(tip, force.setLength(force.length() > 0 ? FORCE * length : 0));
  }

  /** Where the arrows of the tip's directors end. */
  directorHeads(): Vector3[] {
    return this.heads;
  }

  /** The field stands beside the rod, at a corner of the box. */
  showField(field: Vector, corner: Vector3): void {
    const length = this.length * this.perMetre;
    const vector = new Vector3(...field);
    vector.setLength(vector.length() > 0 ? FIELD * length : 0);
    this.arrow("field", this.style.colours.field!, 0.006 * length).point(corner, vector);
  }

  /** The rod without loads, dashed. */
  showRest(points: Vector[] | null | undefined): void {
    if (this.rest) this.group.remove(this.rest);
    this.rest = null;
    if (!points || points.length < 2) return;
    const geometry = new BufferGeometry().setFromPoints(points.map((p) => new Vector3(...p).multiplyScalar(this.perMetre)));
    const dash = 0.02 * this.length * this.perMetre;
    const material = new LineDashedMaterial({ color: this.style.colours.grey!, dashSize: dash, gapSize: 0.8 * dash });
    this.rest = new Line(geometry, material);
    this.rest.computeLineDistances();
    this.group.add(this.rest);
  }

  private arrow(key: string, colour: string, radius: number): Arrow {
    let arrow = this.arrows.get(key);
    if (!arrow) {
      arrow = new Arrow(colour, radius);
      this.arrows.set(key, arrow);
      this.group.add(arrow.group);
    }
    return arrow;
  }
}

type Sixteen = [
  number, number, number, number, number, number, number, number,
  number, number, number, number, number, number, number, number,
];

export function norm(v: Vector | null): number {
  return v ? Math.hypot(...v) : 0;
}

/** Whether a rod can be drawn. */
export function isDrawable(answer: RodAnswer): answer is RodAnswer & { shape: Shape } {
  return answer.shape !== null && answer.solution.tip !== null;
}

/** Rings of a tube, closed at both ends by a point. */
function tubeGeometry(rings: number): BufferGeometry {
  const geometry = new BufferGeometry();
  const count = (rings + 2) * (SIDES + 1);
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * count), 3));
  geometry.setAttribute("normal", new BufferAttribute(new Float32Array(3 * count), 3));
  const index: number[] = [];
  for (let ring = 0; ring < rings + 1; ring++) {
    for (let side = 0; side < SIDES; side++) {
      const [a, b] = [ring * (SIDES + 1) + side, (ring + 1) * (SIDES + 1) + side];
      index.push(a, a + 1, b, b, a + 1, b + 1);
    }
  }
  geometry.setIndex(index);
  return geometry;
}

/** Rings across the directors of the rod; those of a coil tell its windings, those of an unstable rod its state. */
function fillTube(geometry: BufferGeometry, stretch: Stretch, radius: number, perMetre: number, isBroken: boolean): void {
  const { positions: p, rotations: r } = stretch;
  const rings = p.length / 3;
  const position = geometry.getAttribute("position") as BufferAttribute;
  const normal = geometry.getAttribute("normal") as BufferAttribute;
  for (let row = 0; row < rings + 2; row++) {
    const ring = Math.max(0, Math.min(rings - 1, row - 1));
    const isCap = row === 0 || row === rings + 1;
    const wound = stretch.kind === "coil" ? (ring % 2 === 0 ? 1 : 0.88) : isBroken && ring % 4 < 2 ? 0.45 : 1;
    const size = isCap ? 0 : radius * wound;
    for (let side = 0; side <= SIDES; side++) {
      const angle = (2 * Math.PI * side) / SIDES;
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      const at = row * (SIDES + 1) + side;
      const along = row === 0 ? -1 : 1;
      const n = [0, 1, 2].map((k) =>
        isCap ? along * r[9 * ring + 3 * k + 2]! : c * r[9 * ring + 3 * k]! + s * r[9 * ring + 3 * k + 1]!,
      );
      const out = [0, 1, 2].map((k) => c * r[9 * ring + 3 * k]! + s * r[9 * ring + 3 * k + 1]!);
      position.setXYZ(
        at,
        p[3 * ring]! * perMetre + size * out[0]!,
        p[3 * ring + 1]! * perMetre + size * out[1]!,
        p[3 * ring + 2]! * perMetre + size * out[2]!,
      );
      normal.setXYZ(at, n[0]!, n[1]!, n[2]!);
    }
  }
  position.needsUpdate = true;
  normal.needsUpdate = true;
  geometry.computeBoundingSphere();
}
