// Points drawn by hand into a picture, for WebGL without a GPU: there a point takes a microsecond, here some hundredths of
// it. The same discs as those of the shader, the nearest in front.

import { BufferAttribute, BufferGeometry, DataTexture, Matrix4, Mesh, NearestFilter, RGBAFormat, ShaderMaterial } from "three";
import type { Stage } from "./stage";

const VERTEX = `
void main() {
  gl_Position = vec4(position.xy, 0.0, 1.0);
}`;
const FRAGMENT = `
uniform sampler2D picture;
void main() {
  vec4 colour = texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
  if (colour.a == 0.0) discard;
  gl_FragColor = colour;
}`;

/** Steps of depth; with the steps of a palette they fill 30 bits. */
const DEPTHS = 2 ** 22 - 1;
const NOTHING = 2 ** 30;

/** What is drawn: places (m), and of each point its step of the palette, or less than 0 where it is hidden. */
export interface Dots {
  positions: Float32Array;
  shades: Int16Array;
  palette: Uint32Array;
  /** Another number whenever something of this has changed. */
  version: number;
}

export class Splat {
  /** Over the whole canvas. */
  readonly object: Mesh<BufferGeometry, ShaderMaterial>;
  /** Time of a point (ms), as it was last. */
  pace = 0;
  private width = 0;
  private height = 0;
  private pixels = new Uint32Array(0);
  /** Of each pixel: 256 times the step of the depth, and the step of the palette. So one comparison finds the nearest. */
  private nearest = new Int32Array(0);
  private texture: DataTexture | null = null;
  private shown = "";

  constructor(private readonly stage: Stage) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    const uniforms = { picture: { value: null } };
    const material = new ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms, depthTest: false, depthWrite: false });
    this.object = new Mesh(geometry, material);
    this.object.frustumCulled = false;
  }

  private resize(): void {
    const { width, height } = this.stage.renderer.domElement;
    if (this.texture && width === this.width && height === this.height) return;
    [this.width, this.height] = [width, height];
    this.pixels = new Uint32Array(width * height);
    this.nearest = new Int32Array(width * height);
    this.texture?.dispose();
    this.texture = new DataTexture(new Uint8Array(this.pixels.buffer), width, height, RGBAFormat);
    this.texture.minFilter = this.texture.magFilter = NearestFilter;
    this.object.material.uniforms.picture!.value = this.texture;
  }

  /** Draws the first `count` points as discs of a diameter (pixels); nothing where nothing has changed. */
  draw({ positions, shades, palette, version }: Dots, count: number, size: number): void {
    this.resize();
    const { camera, perMetre } = this.stage;
    camera.updateMatrixWorld();
    const m = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).elements;
    const now = `${version} ${count} ${size} ${this.width} ${this.height} ${m.join(" ")}`;
    if (now === this.shown) return;
    this.shown = now;
    const begun = performance.now();
    const { width, height, pixels, nearest } = this;
    nearest.fill(NOTHING);
    // From metres to pixels, upwards.
    const [sx, sy] = [0.5 * width * perMetre, 0.5 * height * perMetre];
    const [ux, uy, uz, u0] = [m[0]! * sx, m[4]! * sx, m[8]! * sx, (m[12]! * 0.5 + 0.5) * width];
    const [vx, vy, vz, v0] = [m[1]! * sy, m[5]! * sy, m[9]! * sy, (m[13]! * 0.5 + 0.5) * height];
    const sz = 0.5 * DEPTHS * perMetre;
    const [dx, dy, dz, d0] = [m[2]! * sz, m[6]! * sz, m[10]! * sz, (m[14]! * 0.5 + 0.5) * DEPTHS];
    const [reach, square] = [0.5 * size, 0.25 * size * size];
    for (let k = 0, at = 0; k < count; k++, at += 3) {
      const shade = shades[k]!;
      if (shade < 0) continue;
      const x = positions[at]!;
      const y = positions[at + 1]!;
      const z = positions[at + 2]!;
      // Of pixels, the middles count.
      const u = ux * x + uy * y + uz * z + u0 - 0.5;
      const v = vx * x + vy * y + vz * z + v0 - 0.5;
      const depth = Math.floor(Math.max(0, Math.min(DEPTHS, dx * x + dy * y + dz * z + d0)));
      const key = depth * 256 + shade;
      const left = Math.max(0, Math.ceil(u - reach));
      const right = Math.min(width - 1, Math.floor(u + reach));
      const top = Math.min(height - 1, Math.floor(v + reach));
      for (let row = Math.max(0, Math.ceil(v - reach)); row <= top; row++) {
        const rise = (row - v) * (row - v);
        for (let column = left; column <= right; column++) {
          if ((column - u) * (column - u) + rise <= square && key < nearest[row * width + column]!) nearest[row * width + column] = key;
        }
      }
    }
    for (let k = 0; k < pixels.length; k++) pixels[k] = nearest[k] === NOTHING ? 0 : palette[nearest[k]! & 255]!;
    this.texture!.needsUpdate = true;
    this.pace = (performance.now() - begun) / Math.max(count, 1);
  }
}
