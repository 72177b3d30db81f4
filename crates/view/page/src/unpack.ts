// Reads the numbers of an exported page: 16 bits over a range, differences of neighbours, byte by byte, deflated.

import type { Numbers } from "./wire";

export interface Block {
  group: string;
  name: string;
  kind: "number" | "whole" | "code";
  count: number;
  unit?: string;
  low?: number;
  step?: number;
}

const NONE = 65535;

export async function unpack(text: string, blocks: Block[]): Promise<Map<string, Numbers>> {
  const packed = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const columns = new Map<string, Numbers>();
  let at = 0;
  for (const block of blocks) {
    const width = block.kind === "number" ? 2 : block.kind === "whole" ? 4 : 1;
    const key = block.group === "whole" ? block.name : `${block.group}/${block.name}`;
    columns.set(key, column(bytes.subarray(at, at + width * block.count), block));
    at += width * block.count;
  }
  return columns;
}

function column(bytes: Uint8Array, block: Block): Numbers {
  const { count } = block;
  if (block.kind === "code") return bytes.slice();
  if (block.kind === "whole") {
    const values = new Uint32Array(count);
    let value = 0;
    for (let k = 0; k < count; k++) {
      const byte = (plane: number) => bytes[plane * count + k]!;
      value = (value + (byte(0) | (byte(1) << 8) | (byte(2) << 16) | (byte(3) << 24))) >>> 0;
      values[k] = value;
    }
    return values;
  }
  const values = new Float32Array(count);
  let code = 0;
  for (let k = 0; k < count; k++) {
    code = (code + (bytes[k]! | (bytes[count + k]! << 8))) & 0xffff;
    values[k] = code === NONE ? NaN : block.low! + code * block.step!;
  }
  return values;
}
