// Magnets and coils around the rod: cylinders and cuboids with their moments from the south to the north pole, and their names.

import {
  Box3,
  BoxGeometry,
  BufferGeometry,
  CylinderGeometry,
  DoubleSide,
  Group,
  LatheGeometry,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  Quaternion,
  SphereGeometry,
  Vector2,
  Vector3,
} from "three";
import { Arrow } from "./arrow3";
import { el } from "./dom";
import { compact } from "./format";
import type { Stage } from "./stage";
import type { Cuboid, Cylinder, FieldSource, Style, Vector } from "./wire";

const SIDES = 48;
/** Of a coil's bore over its diameter, as in the figures. */
const BORE = 0.55;
/** The arrow of a moment over the body's length along it, and over the rod's length at least. */
const ARROW = 0.8;
const LEAST_ARROW = 0.16;
/** Radius of a magnet without a size, over the rod's length. */
const DOT = 0.03;
/** A rod keeps at least this share of the box's widest extent. */
const LEAST_SHARE = 1 / 3;

interface Shown {
  body: Mesh;
  arrow: Arrow;
  label: HTMLElement;
  at: Vector3;
}

export class SourceMeshes {
  readonly group = new Group();
  private readonly labels = el("div", { class: "axis-labels is-frame", "aria-hidden": "true" });
  private shown: Shown[] = [];
  private forms = "";

  constructor(
    private readonly stage: Stage,
    private readonly style: Style,
    private readonly length: number,
  ) {
    stage.add(this.group);
    stage.host.append(this.labels);
    stage.onFrame(() => this.place());
  }

  show(sources: FieldSource[]): void {
    // Bodies are made anew where one has another form; else they are moved.
    const forms = JSON.stringify(sources.map(({ name, body }) => [name, body && dimensions(body)]));
    if (forms !== this.forms) this.make(sources);
    this.forms = forms;
    sources.forEach((source, k) => {
      const { body, arrow, label, at } = this.shown[k]!;
      const perMetre = this.stage.perMetre;
      at.set(...source.position).multiplyScalar(perMetre);
      body.position.copy(at);
      body.quaternion.copy(turn(source.body));
      const moment = new Vector3(...source.moment);
      if (moment.length() > 0) moment.setLength(this.arrowLength(source) * perMetre);
      arrow.point(at.clone().addScaledVector(moment, -0.5), moment);
      label.textContent = source.current === null ? source.name : `${source.name}, ${compact(source.current, 2)} A`;
    });
  }

  /** Names of what is drawn, and where (m). */
  drawn(): { name: string; position: number[] }[] {
    return this.shown.map(({ label, body }) => ({
      name: label.textContent ?? "",
      position: body.position.clone().divideScalar(this.stage.perMetre).toArray(),
    }));
  }

  private arrowLength({ body, moment }: FieldSource): number {
    const least = LEAST_ARROW * this.length;
    if (!body) return least;
    const along = (direction: Vector) => Math.abs(new Vector3(...moment).normalize().dot(new Vector3(...direction)));
    if (isCuboid(body)) return Math.max(least, ARROW * body.size.reduce((sum, x, k) => sum + x * along(body.edges[k]!), 0));
    const share = along(body.axis);
    return Math.max(least, ARROW * (body.length * share + body.diameter * Math.sqrt(Math.max(0, 1 - share * share))));
  }

  private make(sources: FieldSource[]): void {
    this.group.clear();
    this.labels.replaceChildren();
    const { perMetre } = this.stage;
    this.shown = sources.map((source) => {
      const colour = this.style.colours[source.kind]!;
      const looks = { color: colour, transparent: true, opacity: 0.38, depthWrite: false, side: DoubleSide };
      const body = new Mesh(geometry(source, this.length, perMetre), new MeshLambertMaterial(looks));
      body.renderOrder = -1;
      const arrow = new Arrow(this.style.colours.dipole!, 0.008 * this.length * perMetre);
      const label = this.labels.appendChild(el("span"));
      this.group.add(body, arrow.group);
      return { body, arrow, label, at: new Vector3() };
    });
  }

  /** Names stand at their bodies, unless one in front is written there. */
  private place(): void {
    const taken: [number, number][] = [];
    for (const { label, at } of this.shown) {
      const [x, y] = this.stage.project(at);
      label.hidden = taken.some(([u, v]) => Math.abs(u - x) < 70 && Math.abs(v - y) < 13);
      if (label.hidden) continue;
      taken.push([x, y]);
      label.style.transform = `translate(${x.toFixed(1)}px, ${(y - 12).toFixed(1)}px) translate(-50%, -50%)`;
    }
  }
}

function isCuboid(body: Cylinder | Cuboid): body is Cuboid {
  return "size" in body;
}

/** Lengths that tell its form. */
function dimensions(body: Cylinder | Cuboid): number[] {
  return isCuboid(body) ? body.size : [body.length, body.diameter];
}

/** From the axes of its geometry to the world: a cylinder stands along y. */
function turn(body: Cylinder | Cuboid | null): Quaternion {
  if (body && isCuboid(body)) {
    const [x, y, z] = body.edges.map((edge) => new Vector3(...edge));
    return new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(x!, y!, z!));
  }
  return new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), new Vector3(...(body?.axis ?? [0, 1, 0])).normalize());
}

function geometry(source: FieldSource, length: number, perMetre: number): BufferGeometry {
  const { body, kind } = source;
  if (!body) return new SphereGeometry(DOT * length * perMetre, 24, 16);
  if (isCuboid(body)) {
    const [x, y, z] = body.size;
    return new BoxGeometry(x * perMetre, y * perMetre, z * perMetre);
  }
  const [radius, half] = [0.5 * body.diameter * perMetre, 0.5 * body.length * perMetre];
  if (kind === "magnet") return new CylinderGeometry(radius, radius, 2 * half, SIDES);
  const bore = BORE * radius;
  const section: [number, number][] = [[bore, -half], [radius, -half], [radius, half], [bore, half], [bore, -half]];
  return new LatheGeometry(section.map(([r, y]) => new Vector2(r, y)), SIDES);
}

/** A box of a rod, wider by the sources that leave the rod a third of it; coils of an array all or none. */
export function widened(box: Box3, sources: FieldSource[], perMetre: number): Box3 {
  const widest = (of: Box3) => Math.max(...of.getSize(new Vector3()).toArray());
  const groups = new Map<string, Box3>();
  for (const source of sources) {
    const key = source.kind === "magnet" ? `magnet ${source.name}` : source.name.replace(/ \d+$/, "");
    const reach = source.body ? 0.5 * Math.hypot(...dimensions(source.body)) * perMetre : 0;
    const at = new Vector3(...source.position).multiplyScalar(perMetre);
    const own = new Box3(at.clone().subScalar(reach), at.clone().addScalar(reach));
    groups.set(key, (groups.get(key) ?? new Box3()).union(own));
  }
  const wider = box.clone();
  for (const group of groups.values()) {
    const both = wider.clone().union(group);
    if (widest(box) >= LEAST_SHARE * widest(both)) wider.copy(both);
  }
  return wider;
}
