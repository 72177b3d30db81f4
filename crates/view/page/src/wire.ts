// What goes over the wire; told in docs/view.md. Numbers are in SI units.

export type Vector = [number, number, number];

export interface Slider {
  name: string;
  group: string;
  unit: string;
  shown_unit: string;
  factor: number;
  value: number;
  low: number;
  high: number;
  limits: "sweep" | "kind";
  is_input: boolean;
}

export interface Style {
  azimuth: number;
  elevation: number;
  colours: Record<string, string> & { frame: string[] };
  maps: Record<"sequential" | "diverging", string[]>;
}

export interface ColumnInfo {
  name: string;
  unit: string;
  kind: "number" | "flag" | "status" | "text";
  derivative: boolean;
}

export interface StatusInfo {
  name: string;
  success: boolean;
  converged: boolean;
}

export interface MapInfo {
  rows: number;
  points: number;
  samples: number;
  has_rows: boolean;
  columns: ColumnInfo[];
  inputs: string[];
  colour: string;
  statuses: StatusInfo[];
  surface: boolean;
  voxels: ColumnInfo[] | null;
  voxel: number | null;
  /** Rows that the check of the run found wrong. */
  wrong_rows: number[];
}

export interface Description {
  kind: "scene" | "map";
  title: string;
  file: string;
  version: string;
  engine: boolean;
  style: Style;
  length: number;
  length_unit: { name: string; metres: number };
  /** Limits of x, y and z: what is shown of a scene. */
  region: [number, number][];
  field_varies: boolean;
  sources: FieldSource[];
  wall: Wall | null;
  sliders: Slider[];
  can_drag: boolean;
  map: MapInfo | null;
  /** What speaks against the rows, in a sentence and in full; null where nothing does. */
  distrusted: string | null;
  distrust: string | null;
  stills: string[] | Record<string, string>;
}

export interface Solution {
  status: string;
  converged: boolean;
  stable: boolean | null;
  stability_margin?: number;
  iterations: number;
  residual: number | null;
  error_estimate: number | null;
  load_fraction: number;
  tip: { position: Vector; quaternion: number[]; rotation: number[][] } | null;
  jacobian: { parameters: string[]; position: number[][] } | null;
  contact?: Contact | null;
  energy?: number | null;
  from_rest?: boolean;
  stability_index?: number;
}

export interface Stretch {
  name: string;
  kind: "flexible" | "rigid" | "coil" | "magnet";
  radius: number | null;
  positions: number[];
  rotations: number[];
  dipole: Vector | null;
}

export interface Shape {
  stretches: Stretch[];
  flux_density: Vector;
  tip_force: Vector;
  /** |B| where the field varies; null where it is not known. */
  flux_density_at_tip?: number | null;
  sources: FieldSource[];
  wall?: Wall;
}

/** What the tip may touch. */
export interface Wall {
  kind: "plane" | "sphere" | "cylinder";
  /** A point of the plane, the centre, a point of the axis. */
  position: Vector;
  /** Normal of a plane, axis of a cylinder; of length 1. */
  axis: Vector;
  radius: number;
  outside: boolean;
  tip_radius: number;
  /** Of a wall that holds the tip, where it is given. */
  friction: number | null;
}

/** The tip at the wall. */
export interface Contact {
  touching: boolean;
  gap: number;
  normal_force: number;
  force: Vector;
  normal: Vector;
  friction_ratio: number | null;
  holds: boolean | null;
  angle: number;
  body_gap: number;
  force_error: number | null;
}

/** A magnet or a coil around the rod. */
export interface FieldSource {
  name: string;
  kind: "magnet" | "electromagnet";
  position: Vector;
  moment: Vector;
  current: number | null;
  body: Cylinder | Cuboid | null;
}

export interface Cylinder {
  axis: Vector;
  length: number;
  diameter: number;
}

/** Directions of its edges, and their lengths. */
export interface Cuboid {
  edges: [Vector, Vector, Vector];
  size: Vector;
}

/** Lines of the field, and their number: others have another. */
export interface FieldLines {
  number: number;
  lines: FieldLine[];
}

/** From where B comes to where it goes. */
export interface FieldLine {
  positions: number[];
  flux_density: number[];
  /** How well each place is seen. */
  weights: number[];
}

export interface RodAnswer {
  solution: Solution;
  stability_index: number | null;
  shape: Shape | null;
  engine: string;
  seconds: number;
  rest?: Vector[] | null;
  /** Of a field that varies, where the page does not have them yet. */
  lines?: FieldLines;
}

export interface Branches {
  branches: Solution[];
  balanced: boolean;
  searches: number;
  shapes: (Shape | null)[];
}

export interface DragAnswer {
  values: Record<string, number>;
  outcome: string;
  /** Inputs whose limits hold the tip back. */
  held: string[];
  tip: Vector;
  residual: number;
}

export interface Statistics {
  name: string;
  unit: string;
  count: number;
  map: "sequential" | "diverging";
  low: number;
  high: number;
  clipped: [boolean, boolean];
  shares: number[];
  percentiles: number[];
}

export interface Row {
  row: number;
  cells: { name: string; unit: string; value: number | string | boolean | null }[];
}

export type Values = Record<string, number>;
export type Numbers = Float32Array | Uint32Array | Uint8Array;
