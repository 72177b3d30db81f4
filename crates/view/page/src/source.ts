// Where numbers come from: the engine behind this page, or the page itself.

import { readColumns } from "./columns";
import { unpack, type Block } from "./unpack";
import type { Branches, Description, DragAnswer, Numbers, RodAnswer, Row, Statistics, Values, Vector } from "./wire";

export interface Source {
  readonly description: Description;
  /** The rod at first; only an exported page knows it without asking. */
  readonly rod: RodAnswer | null;
  /** With the number of the lines of the field that the page has, 0 for none; null where none are wanted. */
  solve(values: Values, rest: boolean, lines: number | null): Promise<RodAnswer>;
  branches(values: Values): Promise<Branches>;
  /** Along a direction, the place is free; else it is searched for precisely. */
  drag(values: Values, target: Vector, along: Vector | null, begin: boolean): Promise<DragAnswer>;
  /** Columns of the points in a shuffled order, slice by slice. */
  points(columns: string[], take: (columns: Map<string, Numbers>, from: number) => void): Promise<void>;
  statistics(column: string): Promise<Statistics>;
  row(point: number, row: number): Promise<Row>;
  surface(): Promise<{ positions: Map<string, Numbers>; corners: Map<string, Numbers> }>;
  voxels(column: string): Promise<Map<string, Numbers>>;
  voxelStatistics(column: string): Promise<Statistics>;
  still(name: string): string;
}

const SLICE = 131072;

export async function openSource(): Promise<Source> {
  const data = document.getElementById("data");
  if (data) {
    const exported = JSON.parse(data.textContent ?? "") as ExportedData;
    const packed = document.getElementById("packed")?.textContent ?? "";
    return new Exported(exported, exported.blocks.length > 0 ? await unpack(packed, exported.blocks) : new Map());
  }
  return new Live(await json<Description>("api/view"));
}

async function answered(response: Response): Promise<Response> {
  if (response.ok) return response;
  const text = await response.text();
  let message = text;
  try {
    message = (JSON.parse(text) as { error: string }).error;
  } catch {
    // Plain words.
  }
  throw new Error(message);
}

async function json<T>(path: string): Promise<T> {
  return (await answered(await fetch(path))).json() as Promise<T>;
}

class Live implements Source {
  readonly rod = null;

  constructor(readonly description: Description) {
    // As long as this stream is open, the program goes on.
    const alive = new EventSource("alive");
    alive.onerror = () => document.body.classList.add("is-alone");
    alive.onopen = () => document.body.classList.remove("is-alone");
  }

  private async post<T>(path: string, body: unknown): Promise<T> {
    const headers = { "content-type": "application/json" };
    return (await answered(await fetch(path, { method: "POST", headers, body: JSON.stringify(body) }))).json() as Promise<T>;
  }

  solve(values: Values, rest: boolean, lines: number | null): Promise<RodAnswer> {
    return this.post("api/solve", { values, rest, ...(lines !== null && { lines }) });
  }

  branches(values: Values): Promise<Branches> {
    return this.post("api/branches", { values });
  }

  drag(values: Values, target: Vector, along: Vector | null, begin: boolean): Promise<DragAnswer> {
    return this.post("api/drag", { values, target, along, begin, precise: along === null });
  }

  async points(columns: string[], take: (columns: Map<string, Numbers>, from: number) => void): Promise<void> {
    const names = columns.map((name) => `columns=${encodeURIComponent(name)}`).join("&");
    for (let from = 0; from < (this.description.map?.points ?? 0); from += SLICE) {
      take(await this.columns(`api/points?${names}&from=${from}&count=${SLICE}`), from);
    }
  }

  private async columns(path: string): Promise<Map<string, Numbers>> {
    return readColumns(await (await answered(await fetch(path))).arrayBuffer());
  }

  statistics(column: string): Promise<Statistics> {
    return json(`api/column?name=${encodeURIComponent(column)}`);
  }

  row(_point: number, row: number): Promise<Row> {
    return json(`api/row?row=${row}`);
  }

  async surface() {
    const [positions, corners] = await Promise.all([
      this.columns("api/surface/points"),
      this.columns("api/surface/triangles"),
    ]);
    return { positions, corners };
  }

  voxels(column: string): Promise<Map<string, Numbers>> {
    return this.columns(`api/voxels?column=${encodeURIComponent(column)}`);
  }

  voxelStatistics(column: string): Promise<Statistics> {
    return json(`api/voxels/column?name=${encodeURIComponent(column)}`);
  }

  still(name: string): string {
    return `stills/${encodeURIComponent(name)}`;
  }
}

interface ExportedData extends Description {
  rod: RodAnswer;
  blocks: Block[];
  statistics: Record<string, Statistics>;
  voxel_statistics: Record<string, Statistics>;
}

class Exported implements Source {
  readonly rod: RodAnswer;
  private readonly order: Uint32Array;

  constructor(
    readonly description: ExportedData,
    private readonly columns: Map<string, Numbers>,
  ) {
    this.rod = description.rod;
    this.order = shuffled(columns.get("row")?.length ?? 0);
  }

  private none(): never {
    throw new Error("this page has no engine");
  }

  async solve(): Promise<RodAnswer> {
    return this.none();
  }

  async branches(): Promise<Branches> {
    return this.none();
  }

  async drag(): Promise<DragAnswer> {
    return this.none();
  }

  async points(columns: string[], take: (columns: Map<string, Numbers>, from: number) => void): Promise<void> {
    take(new Map(columns.map((name) => [name, this.column(name)])), 0);
  }

  private column(name: string): Numbers {
    const values = this.columns.get(name) ?? this.columns.get(`points/${name}`);
    if (!values) throw new Error(`this page has no column ${name}`);
    const sorted = values.slice();
    this.order.forEach((row, place) => (sorted[place] = values[row]!));
    return sorted;
  }

  async statistics(column: string): Promise<Statistics> {
    return this.description.statistics[column] ?? this.none();
  }

  async row(point: number, row: number): Promise<Row> {
    const at = this.order[point]!;
    const blocks = this.description.blocks.filter((block) => block.group === "points");
    const status = this.description.map!.statuses[this.columns.get("status")![at]!]!.name;
    const cells: Row["cells"] = blocks.map(({ name, unit }) => {
      const value = this.columns.get(`points/${name}`)![at]!;
      return { name, unit: unit ?? "", value: Number.isFinite(value) ? value : null };
    });
    return { row, cells: [{ name: "status", unit: "", value: status }, ...cells] };
  }

  async surface() {
    const of = (prefix: string, names: string[]) =>
      new Map(names.map((name) => [name, this.columns.get(prefix + name)!] as [string, Numbers]));
    return { positions: of("surface/", ["x", "y", "z"]), corners: of("", ["a", "b", "c"]) };
  }

  async voxels(column: string): Promise<Map<string, Numbers>> {
    const names = ["voxel.x", "voxel.y", "voxel.z", column];
    return new Map(names.map((name) => [name, this.columns.get(`voxels/${name}`)!]));
  }

  async voxelStatistics(column: string): Promise<Statistics> {
    return this.description.voxel_statistics[column] ?? this.none();
  }

  still(name: string): string {
    return (this.description.stills as Record<string, string>)[name] ?? "";
  }
}

/** A fixed shuffled order, so that any beginning of it is a fair sample (Fisher and Yates; a xorshift generator). */
function shuffled(count: number): Uint32Array {
  const order = Uint32Array.from({ length: count }, (_, k) => k);
  let state = 0x9e3779b9;
  for (let k = count - 1; k > 0; k--) {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    const other = (state >>> 0) % (k + 1);
    [order[k], order[other]] = [order[other]!, order[k]!];
  }
  return order;
}
