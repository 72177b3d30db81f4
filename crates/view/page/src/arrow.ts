// Reads the Arrow IPC streams of this program: columns of float32, uint32 and uint8 without nulls or compression.

import type { Numbers } from "./wire";

const SCHEMA = 1;
const BATCH = 3;
const INT = 2;
const FLOAT = 3;

/** A place in a flatbuffer. */
class Flat {
  constructor(
    readonly data: DataView,
    readonly at: number,
  ) {}

  /** The place of a slot of the table that stands here, if it is filled. */
  slot(number: number): Flat | null {
    const directory = this.at - this.data.getInt32(this.at, true);
    const place = 4 + 2 * number;
    if (place >= this.data.getUint16(directory, true)) return null;
    const offset = this.data.getUint16(directory + place, true);
    return offset === 0 ? null : new Flat(this.data, this.at + offset);
  }

  follow(): Flat {
    return new Flat(this.data, this.at + this.data.getUint32(this.at, true));
  }

  text(): string {
    const length = this.data.getUint32(this.at, true);
    return new TextDecoder().decode(new Uint8Array(this.data.buffer, this.data.byteOffset + this.at + 4, length));
  }

  items(): number {
    return this.data.getUint32(this.at, true);
  }

  item(index: number, width: number): Flat {
    return new Flat(this.data, this.at + 4 + index * width);
  }

  byte(): number {
    return this.data.getUint8(this.at);
  }

  short(): number {
    return this.data.getInt16(this.at, true);
  }

  int(): number {
    return this.data.getInt32(this.at, true);
  }

  long(): number {
    return Number(this.data.getBigInt64(this.at, true));
  }
}

type Kind = "f32" | "u32" | "u8";

/** Columns by name. */
export function readArrow(buffer: ArrayBuffer): Map<string, Numbers> {
  const data = new DataView(buffer);
  const names: string[] = [];
  const kinds: Kind[] = [];
  const columns = new Map<string, Numbers>();
  let at = 0;
  while (at + 8 <= buffer.byteLength && data.getUint32(at, true) === 0xffffffff) {
    const length = data.getUint32(at + 4, true);
    if (length === 0) break;
    const message = new Flat(data, at + 8).follow();
    const kind = message.slot(1)?.byte();
    const header = message.slot(2)?.follow();
    const body = at + 8 + length;
    const bodyLength = message.slot(3)?.long() ?? 0;
    if (!header) throw new Error("the stream of points is damaged");
    if (kind === SCHEMA) readSchema(header, names, kinds);
    if (kind === BATCH) {
      const buffers = header.slot(2)?.follow();
      const rows = header.slot(0)?.long() ?? 0;
      // Each column has a buffer of validity, which is empty, and one of values.
      names.forEach((name, k) => {
        const place = body + (buffers?.item(2 * k + 1, 16).long() ?? 0);
        columns.set(name, numbers(buffer, kinds[k]!, place, rows));
      });
    }
    at = body + bodyLength;
  }
  return columns;
}

function readSchema(schema: Flat, names: string[], kinds: Kind[]): void {
  const fields = schema.slot(1)?.follow();
  for (let k = 0; fields && k < fields.items(); k++) {
    const field = fields.item(k, 4).follow();
    names.push(field.slot(0)?.follow().text() ?? "");
    const kind = field.slot(2)?.byte();
    const width = field.slot(3)?.follow().slot(0)?.int();
    if (kind === FLOAT) kinds.push("f32");
    else if (kind === INT && width === 32) kinds.push("u32");
    else if (kind === INT && width === 8) kinds.push("u8");
    else throw new Error("a column of the points is of an unknown kind");
  }
}

function numbers(buffer: ArrayBuffer, kind: Kind, at: number, rows: number): Numbers {
  if (kind === "f32") return new Float32Array(buffer, at, rows);
  return kind === "u32" ? new Uint32Array(buffer, at, rows) : new Uint8Array(buffer, at, rows);
}
