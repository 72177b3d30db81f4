// Which points are shown: by status, by ranges of columns, between cut planes. Histograms of what is left.

import type { StatusInfo } from "./wire";

export interface Range {
  low: number;
  high: number;
}

export const BINS = 56;

export interface Histogram {
  low: number;
  high: number;
  isLogarithmic: boolean;
  /** All points with a shown status, and those that pass everything. */
  all: Uint32Array;
  passing: Uint32Array;
}

/** Whether numbers of a range are told apart better by their ratios. */
export function spansDecades({ low, high }: Range): boolean {
  return low > 0 && high / low > 1000;
}

export class Filters {
  readonly statuses: Set<number>;
  readonly ranges = new Map<string, Range>();
  readonly cuts: (Range | null)[] = [null, null, null];
  passing = 0;

  constructor(known: StatusInfo[]) {
    this.statuses = new Set(known.flatMap((status, code) => (status.success ? [code] : [])));
  }

  /** Writes the mask; tells how many pass. Points whose number is none fail a range. */
  apply(mask: Uint8Array, count: number, codes: Uint8Array, positions: Float32Array, columns: Map<string, Float32Array>): number {
    const allowed = new Uint8Array(256);
    this.statuses.forEach((code) => (allowed[code] = 1));
    for (let k = 0; k < count; k++) mask[k] = allowed[codes[k]!]!;
    for (const [name, { low, high }] of this.ranges) {
      const values = columns.get(name);
      if (!values) continue;
      for (let k = 0; k < count; k++) if (!(values[k]! >= low && values[k]! <= high)) mask[k] = 0;
    }
    this.cuts.forEach((cut, axis) => {
      if (!cut) return;
      for (let k = 0; k < count; k++) {
        const x = positions[3 * k + axis]!;
        if (!(x >= cut.low && x <= cut.high)) mask[k] = 0;
      }
    });
    let passing = 0;
    for (let k = 0; k < count; k++) {
      // A point that is nowhere cannot be shown.
      if (mask[k] !== 0 && Number.isNaN(positions[3 * k]!)) mask[k] = 0;
      passing += mask[k]!;
    }
    this.passing = passing;
    return passing;
  }

  histogram(values: Float32Array, count: number, { low, high }: Range, codes: Uint8Array, mask: Uint8Array): Histogram {
    const all = new Uint32Array(BINS);
    const passing = new Uint32Array(BINS);
    const isLogarithmic = spansDecades({ low, high });
    const factor = BINS / ((isLogarithmic ? Math.log(high / low) : high - low) || 1);
    for (let k = 0; k < count; k++) {
      if (!this.statuses.has(codes[k]!)) continue;
      const x = values[k]!;
      if (!(x >= low && x <= high)) continue;
      const at = isLogarithmic ? Math.log(x / low) : x - low;
      const bin = Math.min(BINS - 1, Math.floor(at * factor));
      all[bin]! += 1;
      if (mask[k] !== 0) passing[bin]! += 1;
    }
    return { low, high, isLogarithmic, all, passing };
  }
}
