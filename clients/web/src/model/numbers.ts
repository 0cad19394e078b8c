/** Numbers of variable length and id lists (protocol/SPEC.md). */
import { ProtocolError } from './protocol_error';

/** Elements that one array may hold. */
export const MAX_SURFELS_PER_MESSAGE = 1 << 20;

const MAX_NUMBER_BYTES = 5;

/** All numbers in `bytes`: unsigned LEB128 of at most 32 bits. */
export function unpackNumbers(field: string, bytes: Uint8Array): Float64Array {
  let count = 0;
  for (const byte of bytes) if (byte < 0x80) count += 1;
  if (count > MAX_SURFELS_PER_MESSAGE) {
    throw new ProtocolError(`${field} has ${count} elements; the limit is ${MAX_SURFELS_PER_MESSAGE}`);
  }
  const numbers = new Float64Array(count);
  let index = 0;
  let number = 0;
  let length = 0;
  for (const byte of bytes) {
    number += (byte & 0x7f) * 2 ** (7 * length);
    length += 1;
    if (byte >= 0x80 && length < MAX_NUMBER_BYTES) continue;
    if (byte >= 0x80 || number > 0xffffffff) throw notANumber(field, index);
    numbers[index++] = number;
    number = 0;
    length = 0;
  }
  if (length > 0) throw notANumber(field, index);
  return numbers;
}

function notANumber(field: string, index: number): ProtocolError {
  return new ProtocolError(`${field}: number ${index} is no LEB128 of at most 32 bits`);
}

/** A strictly increasing array of ids, sent as the gaps between them. */
export function unpackIds(field: string, bytes: Uint8Array): Uint32Array {
  const gaps = unpackNumbers(field, bytes);
  const ids = new Uint32Array(gaps.length);
  let next = 0;
  for (let i = 0; i < gaps.length; i++) {
    const id = next + (gaps[i] as number);
    if (id > 0xffffffff) throw new ProtocolError(`${field}: an id is over 32 bits`);
    ids[i] = id;
    next = id + 1;
  }
  return ids;
}

/** As many elements as there should be. */
export function expectCount(field: string, got: number, expected: number): void {
  if (got !== expected) throw new ProtocolError(`${field} has ${got} elements for ${expected} ids`);
}
