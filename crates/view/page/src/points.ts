// Tips as points: coloured by one column, hidden by a mask, thinned while the camera moves. A shader draws them, or,
// without a GPU, a loop.

import {
  BufferAttribute,
  BufferGeometry,
  DataTexture,
  DynamicDrawUsage,
  Group,
  NearestFilter,
  Points,
  RGBAFormat,
  ShaderMaterial,
  Sphere,
  Vector3,
} from "three";
import { Splat, type Dots } from "./splat";
import type { Stage } from "./stage";
import type { Statistics, Style } from "./wire";

/** A frame with more points than can be drawn in this time (ms) is thinned while the camera moves. */
const PATIENCE = 24;
const FEWEST = 20000;
/** A click takes a point within so many pixels. */
const NEAR = 9;

const VERTEX = `
attribute float value;
attribute float shown;
uniform float size;
uniform float low;
uniform float high;
varying float share;
void main() {
  share = clamp((value - low) / (high - low), 0.0, 1.0);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  // What is hidden lies beyond the space that is drawn.
  if (shown < 0.5 || value != value) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = size;
}`;
const FRAGMENT = `
uniform sampler2D palette;
varying float share;
void main() {
  vec2 p = gl_PointCoord - 0.5;
  if (dot(p, p) > 0.25) discard;
  gl_FragColor = vec4(texture2D(palette, vec2((share * 255.0 + 0.5) / 256.0, 0.5)).rgb, 1.0);
}`;

export class Cloud {
  readonly object = new Group();
  /** Of each point, in metres. */
  readonly positions: Float32Array;
  readonly rows: Uint32Array;
  readonly mask: Uint8Array;
  /** Points that have come. */
  count = 0;
  /** Share of the points that the last frame drew. */
  drawn = 0;
  /** Whether something stands between the points, which they must hide or be hidden by. */
  isMixed = false;
  private readonly points: Points<BufferGeometry, ShaderMaterial>;
  private readonly splat: Splat | null;
  private readonly dots: Dots;
  private isShaded = false;
  private size = 3;
  private range: Pick<Statistics, "low" | "high" | "map"> = { low: 0, high: 1, map: "sequential" };
  private readonly value: BufferAttribute;
  private readonly shown: BufferAttribute;
  private readonly place: BufferAttribute;
  private readonly palettes = new Map<string, DataTexture>();
  private moving = Infinity;

  constructor(
    private readonly stage: Stage,
    private readonly style: Style,
    total: number,
  ) {
    this.positions = new Float32Array(3 * total);
    this.rows = new Uint32Array(total);
    this.mask = new Uint8Array(total);
    const geometry = new BufferGeometry();
    this.place = new BufferAttribute(new Float32Array(3 * total), 3);
    this.value = new BufferAttribute(new Float32Array(total), 1).setUsage(DynamicDrawUsage);
    this.shown = new BufferAttribute(this.mask, 1).setUsage(DynamicDrawUsage);
    geometry.setAttribute("position", this.place);
    geometry.setAttribute("value", this.value);
    geometry.setAttribute("shown", this.shown);
    geometry.setDrawRange(0, 0);
    // Seen or not, it is drawn: a test of its size would take longer.
    geometry.boundingSphere = new Sphere(new Vector3(), Infinity);
    const uniforms = { size: { value: 3 }, low: { value: 0 }, high: { value: 1 }, palette: { value: this.palette("sequential") } };
    const material = new ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms });
    this.points = new Points(geometry, material);
    this.points.frustumCulled = false;
    this.splat = stage.isSoftware ? new Splat(stage) : null;
    this.dots = { positions: this.positions, shades: new Int16Array(this.splat ? total : 0), palette: new Uint32Array(256), version: 0 };
    for (const object of this.splat ? [this.points, this.splat.object] : [this.points]) {
      object.renderOrder = -2;
      this.object.add(object);
    }
    // The rod is drawn over the tips and voxels, as in the figures.
    const curtain = new Points(new BufferGeometry(), material);
    curtain.renderOrder = -1;
    curtain.frustumCulled = false;
    curtain.onAfterRender = (renderer) => renderer.clearDepth();
    stage.add(this.object, curtain);
    stage.onFrame((isMoving) => this.prepare(isMoving));
  }

  private palette(name: "sequential" | "diverging"): DataTexture {
    let texture = this.palettes.get(name);
    if (!texture) {
      const data = new Uint8Array(4 * 256);
      this.style.maps[name].forEach((hex, k) => {
        const code = parseInt(hex.slice(1), 16);
        data.set([code >> 16, (code >> 8) & 255, code & 255, 255], 4 * k);
      });
      texture = new DataTexture(data, 256, 1, RGBAFormat);
      texture.minFilter = texture.magFilter = NearestFilter;
      texture.needsUpdate = true;
      this.palettes.set(name, texture);
    }
    return texture;
  }

  /** Takes positions of points from one place on. */
  take(from: number, axes: [Float32Array, Float32Array, Float32Array], rows: Uint32Array): void {
    const { perMetre } = this.stage;
    const place = this.place.array as Float32Array;
    for (let k = 0; k < rows.length; k++) {
      for (let axis = 0; axis < 3; axis++) {
        const x = axes[axis]![k]!;
        this.positions[3 * (from + k) + axis] = x;
        // A point that is nowhere is hidden; its place must be a number.
        place[3 * (from + k) + axis] = Number.isFinite(x) ? x * perMetre : 0;
      }
    }
    this.rows.set(rows, from);
    this.count = Math.max(this.count, from + rows.length);
    this.place.addUpdateRange(3 * from, 3 * rows.length);
    this.place.needsUpdate = true;
  }

  /** Colours points by values from one place on. */
  takeValues(from: number, values: ArrayLike<number>): void {
    (this.value.array as Float32Array).set(values, from);
    this.value.needsUpdate = true;
    this.isShaded = false;
    this.stage.invalidate();
  }

  colour(statistics: Statistics): void {
    this.range = statistics;
    this.isShaded = false;
    const { uniforms } = this.points.material;
    uniforms.low!.value = statistics.low;
    uniforms.high!.value = statistics.high;
    uniforms.palette!.value = this.palette(statistics.map);
    this.stage.invalidate();
  }

  /** The mask has changed. */
  refresh(shown: number): void {
    this.shown.needsUpdate = true;
    this.isShaded = false;
    // Few points are drawn large, many so that they just cover each other, as in the figures.
    const { width, height } = this.stage;
    const size = 0.94 * Math.sqrt((0.25 * width * height) / Math.max(shown, 1));
    const ratio = this.stage.renderer.getPixelRatio();
    this.size = ratio * Math.min(7, Math.max(1.8, size));
    this.points.material.uniforms.size!.value = this.size;
    this.stage.invalidate();
  }

  /** Before a frame: as many points as there is time for, drawn by whom it takes less. */
  private prepare(isMoving: boolean): void {
    const splat = this.isMixed ? null : this.splat;
    this.points.visible = splat === null;
    if (this.splat) this.splat.object.visible = splat !== null;
    const drawn = isMoving ? Math.floor(Math.min(this.count, splat ? PATIENCE / splat.pace : this.thinned())) : this.count;
    this.drawn = this.count > 0 ? drawn / this.count : 0;
    if (!splat) this.points.geometry.setDrawRange(0, drawn);
    else if (this.object.visible) {
      this.shade();
      splat.draw(this.dots, drawn, this.size);
    }
  }

  private thinned(): number {
    const times = this.stage.frameTimes;
    const last = times[times.length - 1] ?? 0;
    if (last > PATIENCE) this.moving = Math.max(FEWEST, Math.min(this.moving, this.count) / 2);
    else if (last < 0.75 * PATIENCE) this.moving = Math.min(this.count, this.moving * 1.1);
    return this.moving;
  }

  /** Steps of the palette for those that are drawn by hand, as the shader has them. */
  private shade(): void {
    if (this.isShaded) return;
    this.isShaded = true;
    const { shades, palette } = this.dots;
    const { low, high, map } = this.range;
    const value = this.value.array as Float32Array;
    const factor = 255 / (high - low);
    for (let k = 0; k < this.count; k++) {
      const step = Math.floor((value[k]! - low) * factor + 0.5);
      shades[k] = this.mask[k] === 0 || Number.isNaN(step) ? -1 : Math.max(0, Math.min(255, step));
    }
    palette.set(new Uint32Array((this.palette(map).image.data as Uint8Array).buffer));
    this.dots.version += 1;
  }

  /** The point below a pixel: of those near enough, the one in front. */
  pick(x: number, y: number): number | null {
    if (!this.object.visible) return null;
    const { right, up, toward } = this.stage.directions();
    const { perMetre } = this.stage;
    const scale = this.stage.scale();
    const origin = this.stage.unproject(x, y, this.stage.controls.target);
    const value = this.value.array as Float32Array;
    let best: number | null = null;
    let nearest = -Infinity;
    for (let k = 0; k < this.count; k++) {
      if (this.mask[k] === 0 || Number.isNaN(value[k])) continue;
      const [dx, dy, dz] = [
        this.positions[3 * k]! * perMetre - origin.x,
        this.positions[3 * k + 1]! * perMetre - origin.y,
        this.positions[3 * k + 2]! * perMetre - origin.z,
      ];
      const u = (dx * right[0] + dy * right[1] + dz * right[2]) * scale;
      const v = (dx * up[0] + dy * up[1] + dz * up[2]) * scale;
      const distance = Math.hypot(u, v);
      if (distance > NEAR) continue;
      // A pixel beside the pointer counts as much as a tenth of a shown unit of depth.
      const depth = dx * toward[0] + dy * toward[1] + dz * toward[2] - (distance / scale) * 2;
      if (depth > nearest) [best, nearest] = [k, depth];
    }
    return best;
  }

  at(point: number): Vector3 {
    const { perMetre } = this.stage;
    return new Vector3(...this.positions.subarray(3 * point, 3 * point + 3)).multiplyScalar(perMetre);
  }
}
