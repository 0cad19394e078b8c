/** Packing as the server does it (protocol/SPEC.md). */

/** An id list. */
export function packIds(ids: readonly number[]): Uint8Array {
  let next = 0;
  return packNumbers(
    ids.map((id) => {
      const gap = id - next;
      next = id + 1;
      return gap;
    }),
  );
}

/** Unsigned LEB128. */
export function packNumbers(numbers: readonly number[]): Uint8Array {
  const bytes: number[] = [];
  for (let number of numbers) {
    while (number >= 0x80) {
      bytes.push((number % 0x80) | 0x80);
      number = Math.floor(number / 0x80);
    }
    bytes.push(number);
  }
  return Uint8Array.from(bytes);
}

/** 16-byte records, one after the other, as planes. */
export function packRecords(records: Uint8Array): Uint8Array {
  const count = records.length / 16;
  return records.map((_, i) => records[(i % count) * 16 + Math.floor(i / count)] as number);
}

/** Twelve codes for each node, as planes. */
export function packTransforms(codes: readonly number[]): Uint8Array {
  const nodes = codes.length / 12;
  const planes = new Uint8Array(2 * codes.length);
  for (let i = 0; i < codes.length; i++) {
    const code = codes[i] as number;
    const folded = ((code << 1) ^ (code >> 15)) & 0xffff;
    const [component, node] = [i % 12, Math.floor(i / 12)];
    planes[2 * component * nodes + node] = folded & 0xff;
    planes[(2 * component + 1) * nodes + node] = folded >>> 8;
  }
  return planes;
}
