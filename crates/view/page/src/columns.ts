// Reads typed columns: a head in JSON that tells what they are, then their bytes; told in docs/view.md.

import type { Numbers } from "./wire";

interface Head {
  rows: number;
  columns: { name: string; unit: string; kind: "f32" | "u32" | "u8" }[];
}

/** Head and columns are filled up to multiples of this (bytes). */
const ALIGNMENT = 4;

const ARRAYS = { f32: Float32Array, u32: Uint32Array, u8: Uint8Array };

/** Columns by name; their numbers are not copied. */
export function readColumns(buffer: ArrayBuffer): Map<string, Numbers> {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, ALIGNMENT, length))) as Head;
  let at = ALIGNMENT + length;
  return new Map(
    head.columns.map(({ name, kind }) => {
      const numbers = new ARRAYS[kind](buffer, at, head.rows);
      at += Math.ceil(numbers.byteLength / ALIGNMENT) * ALIGNMENT;
      return [name, numbers];
    }),
  );
}
