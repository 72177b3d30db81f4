// Lines of the external field in space: thin, each as strong as it is told, fainter far from the reader, with a head along B.

import {
  BufferAttribute,
  BufferGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  type Material,
  Mesh,
  MeshBasicMaterial,
  Plane,
  Vector3,
} from "three";
import type { Stage } from "./stage";
import { onTheme } from "./theme";
import type { FieldLine, FieldLines, Style } from "./wire";

/** Length of a head and its width (pixels). */
const HEAD = [8, 4.6] as const;
const SIDES = 8;
/** Lines that are seen on less than this have no head (pixels). */
const HEADED = 36;
/** How strong the weakest field is drawn, and what is farthest from the reader. */
const WEAKEST = 0.6;
const FARTHEST = 0.45;
/** Light lines on a dark stage are seen better than dark ones on a light stage. */
const OPACITY = { light: 1, dark: 0.85 };
/** Fields between these shares of all points are told apart; where they hardly differ, less is. */
const SHARES = [0.05, 0.95] as const;
const LEAST_FACTOR = 10;

interface Head {
  at: Vector3;
  along: Vector3;
  strength: number;
  /** Of what is seen of its line (shown units). */
  length: number;
}

export class FieldLineMeshes {
  readonly group = new Group();
  isShown = true;
  /** Of the lines that are drawn; 0 for none. */
  private number = 0;
  private readonly depth = { value: 0 };
  private readonly planes: Plane[] = [];
  private readonly lines: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly cones: Mesh<BufferGeometry, MeshBasicMaterial>;
  private heads: Head[] = [];
  private drawn: FieldLine[] = [];
  private scale = 0;

  constructor(
    private readonly stage: Stage,
    style: Style,
  ) {
    const looks = { color: style.colours.line!, vertexColors: true, transparent: true, depthWrite: false, clippingPlanes: this.planes };
    this.lines = new LineSegments(new BufferGeometry(), this.fading(new LineBasicMaterial(looks)));
    this.cones = new Mesh(new BufferGeometry(), this.fading(new MeshBasicMaterial(looks)));
    for (const part of [this.lines, this.cones]) {
      part.frustumCulled = false;
      part.renderOrder = -2;
      this.group.add(part);
    }
    onTheme((theme) => {
      for (const { material } of [this.lines, this.cones]) material.opacity = OPACITY[theme];
    });
    stage.add(this.group);
    stage.onFrame(() => this.follow());
  }

  /** Which lines the page has, for the request that brings others; null where none are wanted. */
  known(): number | null {
    return this.isShown ? this.number : null;
  }

  setShown(isShown: boolean): void {
    this.isShown = isShown;
    this.group.visible = isShown;
    this.stage.invalidate();
  }

  show({ number, lines }: FieldLines): void {
    if (number === this.number) return;
    this.number = number;
    this.drawn = lines;
    const strength = strengths(lines);
    const [positions, colours]: [number[], number[]] = [[], []];
    this.heads = [];
    for (const line of lines) {
      const at = places(line, this.stage.perMetre);
      const strong = line.weights.map((weight, k) => weight * strength(line.flux_density[k]!));
      for (let k = 1; k < at.length; k++) {
        for (const end of [k - 1, k]) {
          positions.push(...at[end]!.toArray());
          colours.push(1, 1, 1, strong[end]!);
        }
      }
      const head = middle(at, strong, line.weights);
      if (head) this.heads.push(head);
    }
    fill(this.lines.geometry, positions, colours);
    this.scale = 0;
    this.stage.invalidate();
  }

  /** What is drawn, in metres. */
  all(): FieldLine[] {
    return this.isShown ? this.drawn : [];
  }

  /** Heads keep their size on the screen, lines stay in the box. */
  private follow(): void {
    const { stage } = this;
    if (!this.isShown || stage.box.isEmpty()) return;
    this.planes.splice(0);
    for (let axis = 0; axis < 3; axis++) {
      const normal = new Vector3().setComponent(axis, 1);
      this.planes.push(new Plane(normal, -stage.box.min.getComponent(axis)));
      this.planes.push(new Plane(normal.clone().negate(), stage.box.max.getComponent(axis)));
    }
    const { near, far } = stage.camera;
    const { toward } = stage.directions();
    const half = stage.box.getSize(new Vector3()).multiplyScalar(0.5);
    const reach = half.x * Math.abs(toward[0]) + half.y * Math.abs(toward[1]) + half.z * Math.abs(toward[2]);
    // The box's middle is in the middle between near and far.
    this.depth.value = (far - near) / (2 * reach);
    if (stage.scale() === this.scale) return;
    this.scale = stage.scale();
    const [positions, colours]: [number[], number[]] = [[], []];
    for (const head of this.heads) if (head.length * this.scale > HEADED) cone(head, this.scale, positions, colours);
    fill(this.cones.geometry, positions, colours);
  }

  /** What is far from the reader is fainter. */
  private fading<M extends Material>(material: M): M {
    material.onBeforeCompile = (shader) => {
      shader.uniforms.fieldDepth = this.depth;
      const end = "#include <premultiplied_alpha_fragment>";
      const far = "clamp(0.5 + (gl_FragCoord.z - 0.5) * fieldDepth, 0.0, 1.0)";
      const fade = `gl_FragColor.a *= mix(1.0, ${FARTHEST.toFixed(2)}, ${far});`;
      shader.fragmentShader = `uniform float fieldDepth;\n${shader.fragmentShader.replace(end, `${fade}\n${end}`)}`;
    };
    return material;
  }
}

function places({ positions: p }: FieldLine, perMetre: number): Vector3[] {
  return Array.from({ length: p.length / 3 }, (_, k) => new Vector3(p[3 * k]!, p[3 * k + 1]!, p[3 * k + 2]!).multiplyScalar(perMetre));
}

/** How strong a field is drawn: by its logarithm, between what is weak and what is strong of all that is drawn. */
function strengths(lines: FieldLine[]): (fluxDensity: number) => number {
  const all = lines.flatMap((line) => line.flux_density.filter((b) => b > 0)).sort((a, b) => a - b);
  const [low, high] = SHARES.map((share) => Math.log(all[Math.floor(share * (all.length - 1))] ?? 1)) as [number, number];
  const [middle, half] = [0.5 * (low + high), 0.5 * Math.max(high - low, Math.log(LEAST_FACTOR))];
  return (b) => WEAKEST + (1 - WEAKEST) * Math.max(0, Math.min(1, 0.5 + (0.5 * (Math.log(b) - middle)) / half));
}

/** The head in the middle of what is seen of a line. */
function middle(at: Vector3[], strong: number[], weights: number[]): Head | null {
  const steps = at.slice(1).map((place, k) => 0.5 * (weights[k]! + weights[k + 1]!) * place.distanceTo(at[k]!));
  const length = steps.reduce((sum, step) => sum + step, 0);
  let left = 0.5 * length;
  for (const [k, step] of steps.entries()) {
    if (step > 0 && left <= step) {
      const along = at[k + 1]!.clone().sub(at[k]!);
      return { at: at[k]!.clone().addScaledVector(along, left / step), along: along.normalize(), strength: strong[k]!, length };
    }
    left -= step;
  }
  return null;
}

function cone({ at, along, strength }: Head, scale: number, positions: number[], colours: number[]): void {
  const [length, radius] = [HEAD[0] / scale, (0.5 * HEAD[1]) / scale];
  const one = new Vector3(...(Math.abs(along.z) < 0.9 ? [0, 0, 1] : [1, 0, 0])).cross(along).normalize();
  const other = along.clone().cross(one);
  const tip = at.clone().addScaledVector(along, 0.5 * length);
  const back = at.clone().addScaledVector(along, -0.5 * length);
  const rim = Array.from({ length: SIDES + 1 }, (_, k) => {
    const angle = (2 * Math.PI * k) / SIDES;
    return back.clone().addScaledVector(one, radius * Math.cos(angle)).addScaledVector(other, radius * Math.sin(angle));
  });
  for (let k = 0; k < SIDES; k++) {
    for (const corner of [tip, rim[k]!, rim[k + 1]!, back, rim[k + 1]!, rim[k]!]) {
      positions.push(...corner.toArray());
      colours.push(1, 1, 1, strength);
    }
  }
}

function fill(geometry: BufferGeometry, positions: number[], colours: number[]): void {
  geometry.dispose();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute("color", new BufferAttribute(new Float32Array(colours), 4));
}
