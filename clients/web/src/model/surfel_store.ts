import { surfelDigest } from './digest';
import { DirtyPages, type SlotRange } from './dirty_pages';
import { WORDS_PER_RECORD } from './packed_surfels';
import { ProtocolError } from './protocol_error';
import { SlotMap } from './slot_map';
import { positionOf } from './surfel_record';

/** Surfels that a page holds at most: 64 MiB on the GPU. */
export const MAX_MODEL_SURFELS = 1 << 22;

const FIRST_CAPACITY = 1 << 14;

/**
 * The surfels that the page shows: packed records in slots, as the GPU buffer has them, with the version
 * (epoch of the last change) of each and the digest over all.
 */
export class SurfelStore {
  private readonly slots = new SlotMap();
  private readonly dirty = new DirtyPages();
  private records = new Uint32Array(FIRST_CAPACITY * WORDS_PER_RECORD);
  private versions = new Uint32Array(FIRST_CAPACITY);
  private origins = new Float32Array(FIRST_CAPACITY * 3);
  private readonly newcomers = new DirtyPages();
  private digestSum = 0;

  /** Surfels held, in slots `0..size`. */
  get size(): number {
    return this.slots.size;
  }

  /** Packed records by slot, four words each; replaced by a larger array when the model outgrows it. */
  get words(): Uint32Array {
    return this.records;
  }

  /** Version by slot; replaced together with `words`. */
  get versionWords(): Uint32Array {
    return this.versions;
  }

  /** Where each surfel was when it came, by slot: x, y, z in metres; replaced together with `words`. */
  get originsM(): Float32Array {
    return this.origins;
  }

  /** The id of the surfel in `slot`, which must be below `size`. */
  id(slot: number): number {
    return this.slots.id(slot);
  }

  /** The slot of `id`, or undefined where it is not held. */
  slot(id: number): number | undefined {
    return this.slots.slot(id);
  }

  /** Digest over ids and versions; 0 for the empty model. */
  get digest(): number {
    return this.digestSum;
  }

  /** The version of `id`, or undefined where it is not held. */
  version(id: number): number | undefined {
    const slot = this.slots.slot(id);
    return slot === undefined ? undefined : this.versions[slot];
  }

  /** Adds the surfel or replaces it; `source` holds its record at word `offset`. */
  put(id: number, version: number, source: Uint32Array, offset: number): void {
    const heldSlots = this.size;
    const slot = this.slots.insert(id);
    if (slot < heldSlots) this.subtractDigest(id, this.versions[slot] as number);
    this.reserve(slot + 1);
    for (let i = 0; i < WORDS_PER_RECORD; i++) {
      this.records[slot * WORDS_PER_RECORD + i] = source[offset + i] as number;
    }
    this.versions[slot] = version;
    this.digestSum = (this.digestSum + surfelDigest(id, version)) >>> 0;
    this.dirty.mark(slot);
    if (slot < heldSlots) return;
    this.origins.set(positionOf(this.records, slot * WORDS_PER_RECORD), slot * 3);
    this.newcomers.mark(slot);
  }

  /** Removes the surfel; one that is not held changes nothing. */
  remove(id: number): void {
    const held = this.version(id);
    const freed = this.slots.remove(id);
    if (held === undefined || freed === undefined) return;
    this.subtractDigest(id, held);
    const { slot, movedFrom } = freed;
    if (slot === movedFrom) return;
    const start = movedFrom * WORDS_PER_RECORD;
    this.records.copyWithin(slot * WORDS_PER_RECORD, start, start + WORDS_PER_RECORD);
    this.versions[slot] = this.versions[movedFrom] as number;
    this.origins.copyWithin(slot * 3, movedFrom * 3, movedFrom * 3 + 3);
    this.dirty.mark(slot);
    this.newcomers.mark(slot);
  }

  /** Removes every surfel whose id is not in `kept`. */
  retain(kept: ReadonlySet<number>): void {
    // Downwards: the surfel that moves into a freed slot comes from above and was looked at before.
    for (let slot = this.size - 1; slot >= 0; slot--) {
      const id = this.slots.id(slot);
      if (!kept.has(id)) this.remove(id);
    }
  }

  clear(): void {
    this.slots.clear();
    this.dirty.clear();
    this.newcomers.clear();
    this.digestSum = 0;
  }

  /** The runs of slots that changed since the last call. */
  takeDirty(): SlotRange[] {
    return this.dirty.take(this.size);
  }

  /** The runs of slots whose surfel is another one since the last call. */
  takeNewcomers(): SlotRange[] {
    return this.newcomers.take(this.size);
  }

  private subtractDigest(id: number, version: number): void {
    this.digestSum = (this.digestSum - surfelDigest(id, version)) >>> 0;
  }

  private reserve(slots: number): void {
    const capacity = this.versions.length;
    if (slots <= capacity) return;
    if (slots > MAX_MODEL_SURFELS) {
      throw new ProtocolError(`the model has more than ${MAX_MODEL_SURFELS} surfels`);
    }
    this.records = grown(this.records);
    this.versions = grown(this.versions);
    const origins = new Float32Array(this.origins.length * 2);
    origins.set(this.origins);
    this.origins = origins;
  }
}

function grown(words: Uint32Array): Uint32Array<ArrayBuffer> {
  const larger = new Uint32Array(words.length * 2);
  larger.set(words);
  return larger;
}
