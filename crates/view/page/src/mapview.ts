// The map: tips of a result directory, their colours, filters and cuts, and the point that was chosen.

import { Box3, Group, Mesh, MeshBasicMaterial, RingGeometry, Vector3 } from "three";
import { Filters, type Histogram } from "./filters";
import { Layers } from "./layers";
import { Cloud } from "./points";
import { distance, type RodView } from "./rodview";
import type { Source } from "./source";
import type { Stage } from "./stage";
import { colourOf, onTheme } from "./theme";
import type { MapInfo, Numbers, Row, Statistics, Values, Vector } from "./wire";

/** Tips nearer than this are one equilibrium, over the rod's length: runs have errors of their own. */
const SAME = 1e-4;
const POSITION = ["tip.position.x", "tip.position.y", "tip.position.z"];

export class MapView {
  readonly info: MapInfo;
  readonly cloud: Cloud;
  readonly filters: Filters;
  readonly layers: Layers;
  readonly codes: Uint8Array;
  /** Columns at the points, as far as they were asked for. */
  readonly columns = new Map<string, Float32Array>();
  readonly statistics = new Map<string, Statistics>();
  colouring = "";
  row: Row | null = null;
  private readonly asked = new Map<string, Promise<void>>();
  private readonly ring: Mesh;
  private readonly listeners: (() => void)[] = [];
  private readonly chosen: ((row: Row, inputs: Values) => void)[] = [];
  private isStale = false;
  private readonly wrong: Set<number>;
  /** Rings around the points that the check of the run found wrong. */
  private readonly marks = new Group();

  constructor(
    readonly source: Source,
    private readonly stage: Stage,
    private readonly rod: RodView,
  ) {
    this.info = source.description.map!;
    this.wrong = new Set(this.info.wrong_rows);
    stage.add(this.marks);
    this.cloud = new Cloud(stage, source.description.style, this.info.points);
    this.codes = new Uint8Array(this.info.points);
    this.filters = new Filters(this.info.statuses);
    this.layers = new Layers(stage, source);
    const size = 0.014 * source.description.length * stage.perMetre;
    const material = new MeshBasicMaterial({ depthTest: false });
    this.ring = new Mesh(new RingGeometry(0.7 * size, size, 32), material);
    this.ring.visible = false;
    this.ring.renderOrder = 5;
    stage.add(this.ring);
    stage.onFrame(() => {
      this.ring.quaternion.copy(stage.camera.quaternion);
      this.marks.children.forEach((mark) => mark.quaternion.copy(stage.camera.quaternion));
    });
    onTheme(() => material.color.set(colourOf("--ink")));
    let pressed: [number, number] | null = null;
    const canvas = stage.renderer.domElement;
    canvas.addEventListener("pointerdown", (event) => (pressed = [event.offsetX, event.offsetY]));
    canvas.addEventListener("pointerup", (event) => {
      // A click, not a turn of the view.
      const isClick = pressed && Math.hypot(event.offsetX - pressed[0], event.offsetY - pressed[1]) < 4;
      if (isClick && stage.controls.enabled) void this.pick(event.offsetX, event.offsetY);
    });
  }

  /** Called after points have come, or what is shown has changed. */
  onChange(listener: () => void): void {
    this.listeners.push(listener);
  }

  onChosen(listener: (row: Row, inputs: Values) => void): void {
    this.chosen.push(listener);
  }

  /** Loads positions and the first colour, slice by slice. */
  async load(): Promise<void> {
    await this.source.points(["row", "status", ...POSITION], (columns, from) => {
      const axes = POSITION.map((name) => columns.get(name)!) as [Float32Array, Float32Array, Float32Array];
      this.codes.set(columns.get("status") as Uint8Array, from);
      const rows = columns.get("row") as Uint32Array;
      this.cloud.take(from, axes, rows);
      this.mark(rows, axes);
      this.change();
    });
  }

  /** Whether the check of the run found a row wrong. */
  isWrong(row: number): boolean {
    return this.wrong.has(row);
  }

  /** Rings around wrong rows. */
  private mark(rows: Uint32Array, [x, y, z]: [Float32Array, Float32Array, Float32Array]): void {
    if (this.wrong.size === 0) return;
    const size = 0.012 * this.source.description.length * this.stage.perMetre;
    const shape = new RingGeometry(0.6 * size, size, 24);
    const material = new MeshBasicMaterial({ depthTest: false, color: 0xd00000 });
    rows.forEach((row, k) => {
      if (!this.wrong.has(row) || Number.isNaN(x[k]!)) return;
      const ring = new Mesh(shape, material);
      ring.position.set(x[k]!, y[k]!, z[k]!).multiplyScalar(this.stage.perMetre);
      ring.renderOrder = 4;
      this.marks.add(ring);
    });
  }

  /** Bounds of the tips (shown units) and of some other places. */
  bounds(others: Vector3[]): Box3 {
    const box = new Box3().setFromPoints(others);
    const { positions, count } = this.cloud;
    const point = new Vector3();
    for (let k = 0; k < count; k++) {
      if (Number.isNaN(positions[3 * k]!) || !this.info.statuses[this.codes[k]!]?.success) continue;
      point.fromArray(positions, 3 * k).multiplyScalar(this.stage.perMetre);
      box.expandByPoint(point);
    }
    return box;
  }

  /** A column at all points, with its statistics. */
  async column(name: string): Promise<Float32Array> {
    const known = this.columns.get(name);
    if (known && this.statistics.has(name)) {
      await this.asked.get(name);
      return known;
    }
    const values = new Float32Array(this.info.points).fill(NaN);
    this.columns.set(name, values);
    const load = async () => {
      this.statistics.set(name, await this.source.statistics(name));
      await this.source.points([name], (columns, from) => values.set(columns.get(name) as Numbers, from));
    };
    const asked = load();
    this.asked.set(name, asked);
    await asked;
    return values;
  }

  async colourBy(name: string): Promise<Statistics> {
    const values = await this.column(name);
    const statistics = this.statistics.get(name)!;
    this.colouring = name;
    this.cloud.takeValues(0, values);
    this.cloud.colour(statistics);
    this.change();
    return statistics;
  }

  /** Masks and histograms follow with the next frame. */
  change(): void {
    if (this.isStale) return;
    this.isStale = true;
    requestAnimationFrame(() => {
      this.isStale = false;
      const { mask, count, positions } = this.cloud;
      this.layers.cut(this.filters.cuts);
      this.cloud.refresh(this.filters.apply(mask, count, this.codes, positions, this.columns));
      this.listeners.forEach((listener) => listener());
    });
  }

  /** Voxels by a column, or none. */
  showVoxels(column: string | null): Promise<Statistics | null> {
    this.cloud.isMixed = column !== null;
    return this.layers.showVoxels(column);
  }

  histogram(name: string): Histogram | null {
    const values = this.columns.get(name);
    const statistics = this.statistics.get(name);
    if (!values || !statistics || statistics.count === 0) return null;
    const range = { low: statistics.percentiles[0]!, high: statistics.percentiles[8]! };
    return this.filters.histogram(values, this.cloud.count, range, this.codes, this.cloud.mask);
  }

  /** Points of each status. */
  statusCounts(): number[] {
    const counts = this.info.statuses.map(() => 0);
    for (let k = 0; k < this.cloud.count; k++) counts[this.codes[k]!]! += 1;
    return counts;
  }

  async pick(x: number, y: number): Promise<void> {
    const point = this.cloud.pick(x, y);
    if (point !== null) await this.choose(point);
  }

  /** The rod of a row: that from rest or, where the row is another equilibrium, the one whose tip is nearest. */
  private async solve(inputs: Values, row: Row): Promise<void> {
    this.rod.values = { ...inputs };
    const answer = await this.source.solve(inputs, false, this.rod.lines?.known() ?? null);
    const cells = POSITION.map((name) => row.cells.find((cell) => cell.name === name)?.value);
    const at = cells as Vector;
    const isFar = (tip: Vector) => distance(tip, at) > SAME * this.source.description.length;
    if (!cells.every(Number.isFinite) || (answer.solution.tip && !isFar(answer.solution.tip.position))) {
      this.rod.take(answer);
      return;
    }
    const { branches, shapes } = await this.source.branches(inputs);
    const far = (k: number) => (branches[k]!.tip ? distance(branches[k]!.tip!.position, at) : Infinity);
    const nearest = branches.map((_, k) => k).sort((a, b) => far(a) - far(b))[0];
    if (nearest === undefined || far(nearest) === Infinity) this.rod.take(answer);
    else {
      const solution = branches[nearest]!;
      this.rod.take({ ...answer, solution, shape: shapes[nearest] ?? null, stability_index: solution.stability_index ?? null });
    }
  }

  /** Shows a row by its number, drawn or not; false where this page knows no such row. */
  async chooseRow(row: number): Promise<boolean> {
    const point = this.cloud.rows.subarray(0, this.cloud.count).indexOf(row);
    const isThere = Number.isInteger(row) && row >= 0 && row < this.info.rows;
    if (point < 0 && !(isThere && this.source.description.engine)) return false;
    await this.show(await this.source.row(point, row));
    return true;
  }

  /** Shows the row of a point. */
  async choose(point: number): Promise<void> {
    await this.show(await this.source.row(point, this.cloud.rows[point]!));
  }

  /** Shows a row, and the rod that leads there. */
  private async show(row: Row): Promise<void> {
    this.row = row;
    const at = POSITION.map((name) => row.cells.find((cell) => cell.name === name)?.value);
    this.ring.visible = at.every(Number.isFinite);
    if (this.ring.visible) this.ring.position.set(...(at as Vector)).multiplyScalar(this.stage.perMetre);
    const inputs: Values = {};
    for (const cell of row.cells) {
      if (this.info.inputs.includes(cell.name) && typeof cell.value === "number") inputs[cell.name] = cell.value;
    }
    if (this.source.description.engine) await this.solve(inputs, row);
    this.chosen.forEach((listener) => listener(row, inputs));
    this.stage.invalidate();
  }
}
