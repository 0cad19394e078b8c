/** Packed surfels of the model lane (protocol/SPEC.md). All lengths are checked before anything is allocated. */
import { expectCount, unpackIds, unpackNumbers } from './numbers';
import { ProtocolError } from './protocol_error';

/** Words of 32 bits in one surfel record. */
export const WORDS_PER_RECORD = 4;

const RECORD_BYTES = 4 * WORDS_PER_RECORD;

/** A block of surfels: `records` holds four words for each id. */
export interface SurfelBlock {
  readonly ids: Uint32Array;
  readonly records: Uint32Array;
}

/** The versions that belong to `count` ids in a snapshot of `epoch`. */
export function unpackVersions(bytes: Uint8Array, epoch: number, count: number): Uint32Array {
  const ages = unpackNumbers('versions', bytes);
  expectCount('versions', ages.length, count);
  return Uint32Array.from(ages, (age) => epoch - age);
}

/** Ids and records, as many of the one as of the other; an absent block is an empty one. */
export function unpackSurfels(packed: { ids: Uint8Array; records: Uint8Array } | undefined): SurfelBlock {
  if (packed === undefined) return { ids: new Uint32Array(0), records: new Uint32Array(0) };
  const ids = unpackIds('ids', packed.ids);
  const planes = packed.records;
  if (planes.length % RECORD_BYTES !== 0) {
    throw new ProtocolError(`records has ${planes.length} bytes, no multiple of ${RECORD_BYTES}`);
  }
  const count = ids.length;
  expectCount('records', planes.length / RECORD_BYTES, count);
  // From planes to records. Typed arrays are little-endian wherever browsers run.
  const bytes = new Uint8Array(planes.length);
  for (let place = 0; place < RECORD_BYTES; place++) {
    for (let i = 0; i < count; i++) bytes[RECORD_BYTES * i + place] = planes[place * count + i] as number;
  }
  return { ids, records: new Uint32Array(bytes.buffer) };
}
