// The wall that the tip touches: a patch of a plane, a film of a sphere or a cylinder within the box; its force as an arrow.

import {
  BufferGeometry,
  CylinderGeometry,
  DoubleSide,
  Group,
  LineBasicMaterial,
  LineLoop,
  Mesh,
  MeshLambertMaterial,
  Plane,
  Quaternion,
  SphereGeometry,
  Vector3,
} from "three";
import { Arrow } from "./arrow3";
import { el } from "./dom";
import { film } from "./film";
import { compact } from "./format";
import type { Stage } from "./stage";
import type { Contact, Style, Vector, Wall } from "./wire";

const SIDES = 72;
/** Length of the arrow over the rod's, as in the figures. */
const FORCE = 0.18;
/** Beyond the arrow (pixels). */
const GAP = 26;

export class WallMesh {
  readonly group = new Group();
  private readonly arrow: Arrow;
  private readonly label = el("span");
  private readonly labels = el("div", { class: "axis-labels is-frame", "aria-hidden": "true" }, this.label);
  /** Kept: what lies on the positive side of each. */
  private readonly planes: Plane[] = [];
  private readonly bodies = new Group();
  private readonly patch: MeshLambertMaterial;
  private readonly rim: LineBasicMaterial;
  private readonly round: MeshLambertMaterial;
  private readonly ball: Mesh;
  private wall: Wall | null = null;
  private boxed = "";
  private form = "";
  /** Both ends of the arrow. */
  private ends: [Vector3, Vector3] | null = null;

  constructor(
    private readonly stage: Stage,
    style: Style,
    private readonly length: number,
  ) {
    const color = style.colours.wall!;
    this.patch = new MeshLambertMaterial({ color, transparent: true, opacity: 0.26, side: DoubleSide, depthWrite: false });
    this.rim = new LineBasicMaterial({ color });
    this.round = film(this.planes);
    this.round.color.set(color);
    this.ball = new Mesh(new SphereGeometry(1, 32, 20), new MeshLambertMaterial({ color, transparent: true, opacity: 0.35, depthWrite: false }));
    this.arrow = new Arrow(style.colours.wall_force!, 0.006 * length * stage.perMetre);
    this.group.add(this.bodies, this.ball, this.arrow.group);
    stage.add(this.group);
    stage.host.append(this.labels);
    stage.onFrame(() => this.frame());
  }

  /** Draws a wall, and what it does to a tip (m). */
  show(wall: Wall, contact: Contact | null, tip: Vector | null): void {
    this.wall = wall;
    this.make();
    const { perMetre } = this.stage;
    this.ball.visible = tip !== null && wall.tip_radius > 0;
    if (tip) this.ball.position.set(...tip).multiplyScalar(perMetre);
    this.ball.scale.setScalar(wall.tip_radius * perMetre || 1);
    this.ends = null;
    this.arrow.group.visible = false;
    if (!tip || !contact?.touching) return;
    const vector = new Vector3(...contact.force);
    const size = vector.length();
    if (size === 0) return;
    vector.setLength(FORCE * this.length * perMetre);
    const at = new Vector3(...tip).multiplyScalar(perMetre);
    // One that pushes ends at the tip, one that pulls begins there: it stands on the side of the wall.
    const from = contact.normal_force < 0 ? at.clone() : at.clone().sub(vector);
    this.arrow.point(from, vector);
    this.ends = contact.normal_force < 0 ? [at, at.clone().add(vector)] : [at, from];
    this.label.textContent = size < 0.1 ? `${compact(1e3 * size, 3)} mN` : `${compact(size, 3)} N`;
  }

  /** What is drawn, for tests: corners or size of the surface, and the arrow (m). */
  drawn(): { bodies: number; label: string; arrow: Vector | null } {
    const { perMetre } = this.stage;
    const way = this.ends ? this.ends[1].clone().sub(this.ends[0]).divideScalar(perMetre) : null;
    return { bodies: this.bodies.children.length, label: this.ends ? (this.label.textContent ?? "") : "", arrow: way ? [way.x, way.y, way.z] : null };
  }

  private frame(): void {
    // The box may have changed since.
    this.make();
    this.labels.hidden = this.ends === null;
    if (!this.ends) return;
    const [x, y] = this.stage.project(this.ends[0]);
    const [u, v] = this.stage.project(this.ends[1]);
    const length = Math.hypot(u - x, v - y);
    const [dx, dy] = length > 1 ? [(u - x) / length, (v - y) / length] : [0, 1];
    this.label.style.transform = `translate(${(u + GAP * dx).toFixed(1)}px, ${(v + 12 * dy).toFixed(1)}px) translate(-50%, -50%)`;
  }

  /** Makes the surface anew where wall or box are others. */
  private make(): void {
    const { wall } = this;
    if (!wall) return;
    const { box, perMetre } = this.stage;
    const boxed = JSON.stringify([box.min, box.max]);
    const form = JSON.stringify([wall.kind, wall.position, wall.axis, wall.radius]);
    if (boxed === this.boxed && form === this.form) return;
    [this.boxed, this.form] = [boxed, form];
    this.bodies.children.forEach((body) => (body as Mesh).geometry.dispose());
    this.bodies.clear();
    const at = new Vector3(...wall.position).multiplyScalar(perMetre);
    const axis = new Vector3(...wall.axis);
    if (wall.kind === "plane") {
      const corners = this.cut(at, axis);
      if (corners.length < 3) return;
      const geometry = new BufferGeometry().setFromPoints(corners);
      geometry.setIndex(corners.slice(2).flatMap((_, k) => [0, k + 1, k + 2]));
      geometry.computeVertexNormals();
      const patch = new Mesh(geometry, this.patch);
      patch.renderOrder = 2;
      this.bodies.add(patch, new LineLoop(new BufferGeometry().setFromPoints(corners), this.rim));
      return;
    }
    this.planes.splice(0);
    for (let k = 0; k < 3; k++) {
      const normal = new Vector3().setComponent(k, 1);
      this.planes.push(new Plane(normal, -box.min.getComponent(k)), new Plane(normal.clone().negate(), box.max.getComponent(k)));
    }
    const radius = wall.radius * perMetre;
    const reach = 2 * box.getSize(new Vector3()).length() + box.getCenter(new Vector3()).distanceTo(at);
    const geometry =
      wall.kind === "sphere"
        ? new SphereGeometry(radius, SIDES, SIDES / 2)
        : new CylinderGeometry(radius, radius, 2 * reach, SIDES, 1, true);
    const body = new Mesh(geometry, this.round);
    body.position.copy(at);
    body.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), axis));
    body.renderOrder = 2;
    this.bodies.add(body);
  }

  /** Corners of what the box cuts out of a plane, in their order. */
  private cut(at: Vector3, normal: Vector3): Vector3[] {
    const { box } = this.stage;
    const corner = (index: number) => new Vector3(...[0, 1, 2].map((k) => ((index >> k) & 1 ? box.max : box.min).getComponent(k)));
    const found: Vector3[] = [];
    for (let from = 0; from < 8; from++) {
      for (let k = 0; k < 3; k++) {
        if ((from >> k) & 1) continue;
        const [a, b] = [corner(from), corner(from | (1 << k))];
        const [one, other] = [a, b].map((point) => point.clone().sub(at).dot(normal)) as [number, number];
        if (one * other <= 0 && one !== other) found.push(a.lerp(b, one / (one - other)));
      }
    }
    if (found.length === 0) return found;
    const middle = found.reduce((sum, point) => sum.add(point), new Vector3()).divideScalar(found.length);
    const u = found[0]!.clone().sub(middle).normalize();
    const v = normal.clone().cross(u);
    const angle = (point: Vector3) => Math.atan2(point.clone().sub(middle).dot(v), point.clone().sub(middle).dot(u));
    return found.sort((a, b) => angle(a) - angle(b));
  }
}
