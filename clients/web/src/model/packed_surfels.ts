/**
 * Packed arrays of the model lane (protocol/SPEC.md): ids and versions as u32, surfels as 16-byte records,
 * all little-endian. All lengths are checked before anything is allocated.
 */
import { ProtocolError } from './protocol_error';

/** Words of 32 bits in one surfel record. */
export const WORDS_PER_RECORD = 4;
/** Surfels that one message may hold. */
export const MAX_SURFELS_PER_MESSAGE = 1 << 20;

const WORD_BYTES = 4;

/** A block of surfels: `records` holds four words for each id. */
export interface SurfelBlock {
  readonly ids: Uint32Array;
  readonly records: Uint32Array;
}

/** A strictly increasing array of ids. */
export function unpackIds(field: string, bytes: Uint8Array): Uint32Array {
  const ids = unpackWords(field, bytes, 1);
  for (let i = 1; i < ids.length; i++) {
    if (at(ids, i) <= at(ids, i - 1)) {
      throw new ProtocolError(
        `${field}: id ${at(ids, i)} at index ${i} does not come after ${at(ids, i - 1)}`,
      );
    }
  }
  return ids;
}

/** The versions that belong to `count` ids. */
export function unpackVersions(bytes: Uint8Array, count: number): Uint32Array {
  const versions = unpackWords('versions', bytes, 1);
  expectCount('versions', versions.length, count);
  return versions;
}

/** Ids and records, as many of the one as of the other; an absent block is an empty one. */
export function unpackSurfels(packed: { ids: Uint8Array; records: Uint8Array } | undefined): SurfelBlock {
  if (packed === undefined) return { ids: new Uint32Array(0), records: new Uint32Array(0) };
  const ids = unpackIds('ids', packed.ids);
  const records = unpackWords('records', packed.records, WORDS_PER_RECORD);
  expectCount('records', records.length / WORDS_PER_RECORD, ids.length);
  return { ids, records };
}

/** An element that is known to exist. */
function at(words: Uint32Array, index: number): number {
  return words[index] as number;
}

function unpackWords(field: string, bytes: Uint8Array, wordsPerElement: number): Uint32Array {
  const elementBytes = WORD_BYTES * wordsPerElement;
  if (bytes.length % elementBytes !== 0) {
    throw new ProtocolError(`${field} has ${bytes.length} bytes, no multiple of ${elementBytes}`);
  }
  const elements = bytes.length / elementBytes;
  if (elements > MAX_SURFELS_PER_MESSAGE) {
    throw new ProtocolError(`${field}: ${elements} elements; the limit is ${MAX_SURFELS_PER_MESSAGE}`);
  }
  // A copy, because the bytes may begin anywhere. Typed arrays are little-endian wherever browsers run.
  return new Uint32Array(bytes.slice().buffer);
}

function expectCount(field: string, got: number, expected: number): void {
  if (got !== expected) throw new ProtocolError(`${field} has ${got} elements for ${expected} ids`);
}
