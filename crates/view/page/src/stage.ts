// The space in which things are drawn: camera of the figures, light, frames on demand. Lengths are in the shown unit.

import {
  AmbientLight,
  Box3,
  Color,
  DirectionalLight,
  Object3D,
  OrthographicCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { colourOf, onTheme } from "./theme";
import type { Description, Vector } from "./wire";

/** Room for labels around the box, in pixels. */
const RIM = { x: 78, y: 56 };

export class Stage {
  readonly scene = new Scene();
  readonly camera = new OrthographicCamera(-1, 1, 1, -1, -1e4, 1e4);
  readonly renderer: WebGLRenderer;
  readonly controls: OrbitControls;
  readonly isSoftware: boolean;
  /** Shown units in a metre. */
  readonly perMetre: number;
  /** Of the drawn frames (ms), the last ones. */
  readonly frameTimes: number[] = [];
  frames = 0;
  box = new Box3();
  width = 1;
  height = 1;
  private isStale = true;
  private readonly beforeFrame: ((isMoving: boolean) => void)[] = [];
  private moved = 0;
  /** When the frame before this one was drawn; 0 if it was not. */
  private begun = 0;

  constructor(
    readonly host: HTMLElement,
    description: Description,
  ) {
    this.perMetre = 1 / description.length_unit.metres;
    const probe = document.createElement("canvas").getContext("webgl2");
    const info = probe?.getExtension("WEBGL_debug_renderer_info");
    const name = probe && info ? String(probe.getParameter(info.UNMASKED_RENDERER_WEBGL)) : "";
    probe?.getExtension("WEBGL_lose_context")?.loseContext();
    this.isSoftware = /swiftshader|llvmpipe|software|basic render/i.test(name);
    this.renderer = new WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
    this.renderer.localClippingEnabled = true;
    this.renderer.setPixelRatio(this.isSoftware ? 1 : Math.min(devicePixelRatio, 2));
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "The rod in space. Arrow keys turn the view, plus and minus change its size.");
    host.prepend(canvas);
    this.camera.up.set(0, 0, 1);
    const light = new DirectionalLight(0xffffff, 1.6);
    light.position.set(-0.4, 0.7, 1);
    // It shines from beside the reader, wherever the camera is.
    this.camera.add(light, light.target);
    this.scene.add(this.camera, new AmbientLight(0xffffff, 1.9));
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => {
      this.moved = performance.now();
      this.invalidate();
    });
    canvas.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.resize()).observe(host);
    onTheme(() => {
      this.scene.background = new Color(colourOf("--stage"));
      this.invalidate();
    });
    this.setView(description.style.azimuth, description.style.elevation);
    this.resize();
    const loop = () => {
      requestAnimationFrame(loop);
      this.frame();
    };
    requestAnimationFrame(loop);
  }

  /** Draws again with the next frame. */
  invalidate(): void {
    this.isStale = true;
  }

  /** Called before each frame that is drawn; tells whether the camera moves. */
  onFrame(listener: (isMoving: boolean) => void): void {
    this.beforeFrame.push(listener);
  }

  private frame(): void {
    if (!this.isStale) {
      this.begun = 0;
      return;
    }
    this.isStale = false;
    const begun = performance.now();
    const isMoving = begun - this.moved < 200;
    this.draw(isMoving);
    // A GPU is still at work: that the next frame is late tells how long it takes.
    const late = this.begun > 0 && !this.isSoftware ? begun - this.begun : 0;
    this.frameTimes.push(Math.max(performance.now() - begun, late));
    if (this.frameTimes.length > 240) this.frameTimes.shift();
    this.begun = begun;
    // A last frame with everything, once the camera rests.
    if (isMoving) this.isStale = true;
  }

  /** Draws at once; less than everything while the camera moves, where there is no time for it. */
  draw(isMoving = false): void {
    this.beforeFrame.forEach((listener) => listener(isMoving));
    this.renderer.render(this.scene, this.camera);
    if (this.isSoftware) this.renderer.getContext().finish();
    this.frames += 1;
  }

  /** The camera of the figures, from an azimuth and an elevation (deg). */
  setView(azimuth: number, elevation: number): void {
    const [a, e] = [(azimuth * Math.PI) / 180, (elevation * Math.PI) / 180];
    const toward = new Vector3(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e));
    const centre = this.box.isEmpty() ? new Vector3() : this.box.getCenter(new Vector3());
    this.controls.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(toward, 10);
    this.controls.update();
    this.fit();
  }

  /** What is to be seen. */
  setBox(box: Box3): void {
    const before = this.controls.target.clone();
    this.box = box;
    const shift = box.getCenter(new Vector3()).sub(before);
    this.controls.target.add(shift);
    this.camera.position.add(shift);
    this.controls.update();
    this.fit();
  }

  /** Right, up and toward the reader, unit vectors. */
  directions(): { right: Vector; up: Vector; toward: Vector } {
    this.camera.updateMatrixWorld();
    const [x, y, z] = [new Vector3(), new Vector3(), new Vector3()];
    this.camera.matrixWorld.extractBasis(x, y, z);
    return { right: x.toArray(), up: y.toArray(), toward: z.toArray() };
  }

  private fit(): void {
    this.camera.zoom = 1;
    const { right, up, toward } = this.directions();
    const half = this.box.isEmpty() ? new Vector3(1, 1, 1) : this.box.getSize(new Vector3()).multiplyScalar(0.5);
    const reach = (d: Vector) => half.x * Math.abs(d[0]) + half.y * Math.abs(d[1]) + half.z * Math.abs(d[2]);
    const scale = Math.min((this.width / 2 - RIM.x) / reach(right), (this.height / 2 - RIM.y) / reach(up));
    const unit = 1 / Math.max(scale, 1e-9);
    Object.assign(this.camera, { left: -unit * this.width * 0.5, right: unit * this.width * 0.5 });
    Object.assign(this.camera, { top: unit * this.height * 0.5, bottom: -unit * this.height * 0.5 });
    const depth = 4 * (reach(toward) + half.length());
    Object.assign(this.camera, { near: -depth, far: depth + 20 });
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.host;
    if (clientWidth === 0 || clientHeight === 0) return;
    const { zoom } = this.camera;
    [this.width, this.height] = [clientWidth, clientHeight];
    this.renderer.setSize(clientWidth, clientHeight);
    this.fit();
    this.camera.zoom = zoom;
    this.camera.updateProjectionMatrix();
  }

  private key(event: KeyboardEvent): void {
    const turns: Record<string, [number, number]> = {
      ArrowLeft: [-1, 0],
      ArrowRight: [1, 0],
      ArrowUp: [0, 1],
      ArrowDown: [0, -1],
    };
    const turn = turns[event.key];
    if (turn) {
      const { toward } = this.directions();
      const step = event.shiftKey ? 15 : 5;
      const azimuth = (Math.atan2(toward[1], toward[0]) * 180) / Math.PI - step * turn[0];
      const elevation = (Math.asin(Math.max(-1, Math.min(1, toward[2]))) * 180) / Math.PI + step * turn[1];
      const { zoom } = this.camera;
      this.setView(azimuth, Math.max(-89, Math.min(89, elevation)));
      this.zoom(zoom);
    } else if (event.key === "+" || event.key === "=") this.zoom(this.camera.zoom * 1.15);
    else if (event.key === "-") this.zoom(this.camera.zoom / 1.15);
    else return;
    event.preventDefault();
  }

  private zoom(zoom: number): void {
    this.camera.zoom = zoom;
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  /** Pixels in a shown unit. */
  scale(): number {
    return (this.width * this.camera.zoom) / (this.camera.right - this.camera.left);
  }

  /** Where a place is on the canvas, in pixels; the third number is its depth. */
  project(point: Vector3): [number, number, number] {
    const p = point.clone().project(this.camera);
    return [(p.x * 0.5 + 0.5) * this.width, (0.5 - p.y * 0.5) * this.height, p.z];
  }

  /** The place below a pixel, as deep as another place. */
  unproject(x: number, y: number, like: Vector3): Vector3 {
    const depth = like.clone().project(this.camera).z;
    return new Vector3((x / this.width) * 2 - 1, 1 - (y / this.height) * 2, depth).unproject(this.camera);
  }

  add(...objects: Object3D[]): void {
    this.scene.add(...objects);
    this.invalidate();
  }

  remove(object: Object3D): void {
    this.scene.remove(object);
    this.invalidate();
  }
}
