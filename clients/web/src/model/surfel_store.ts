import { surfelDigest } from './digest';
import { DirtyPages, type SlotRange } from './dirty_pages';
import { ProtocolError } from './protocol_error';
import { SlotMap } from './slot_map';
import { surfelOf } from './surfel_record';
import type { Warp } from './warp';

/** Surfels that a page holds at most: 128 MiB on the GPU. */
export const MAX_MODEL_SURFELS = 1 << 22;
/** Numbers per surfel in `places`: x, y, z, radius. */
export const PLACE_SIZE = 4;
/** Numbers per surfel in `normals`. */
export const NORMAL_SIZE = 3;

const FIRST_CAPACITY = 1 << 14;

/**
 * The surfels that the page shows, in slots as the GPU buffers have them, with the version (epoch of the last change)
 * of each and the digest over all. Arrays are replaced by larger ones when the model outgrows them.
 */
export class SurfelStore {
  private readonly slots = new SlotMap();
  private readonly dirty = new DirtyPages();
  private placeData = new Float32Array(FIRST_CAPACITY * PLACE_SIZE);
  private normalData = new Float32Array(FIRST_CAPACITY * NORMAL_SIZE);
  private colorData = new Uint32Array(FIRST_CAPACITY);
  private versions = new Uint32Array(FIRST_CAPACITY);
  private origins = new Float32Array(FIRST_CAPACITY * 3);
  private readonly newcomers = new DirtyPages();
  private digestSum = 0;

  /** Surfels held, in slots `0..size`. */
  get size(): number {
    return this.slots.size;
  }

  /** Centre and radius by slot, metres. */
  get places(): Float32Array {
    return this.placeData;
  }

  /** Unit normals by slot. */
  get normals(): Float32Array {
    return this.normalData;
  }

  /** Red, green, blue, confidence by slot, from the low byte up. */
  get colors(): Uint32Array {
    return this.colorData;
  }

  /** Version by slot. */
  get versionWords(): Uint32Array {
    return this.versions;
  }

  /** Where each surfel was when it came, by slot: x, y, z in metres. */
  get originsM(): Float32Array {
    return this.origins;
  }

  /** Centre of the surfel in `slot`, world, metres. */
  position(slot: number): [number, number, number] {
    return this.triple(this.placeData, slot * PLACE_SIZE);
  }

  /** Its unit normal. */
  normal(slot: number): [number, number, number] {
    return this.triple(this.normalData, slot * NORMAL_SIZE);
  }

  /** Radius of its disc, metres. */
  radiusM(slot: number): number {
    return this.placeData[slot * PLACE_SIZE + 3] as number;
  }

  private triple(data: Float32Array, at: number): [number, number, number] {
    return [data[at] as number, data[at + 1] as number, data[at + 2] as number];
  }

  /** The id of the surfel in `slot`, which must be below `size`. */
  id(slot: number): number {
    return this.slots.id(slot);
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

  /** The slot of `id`, or undefined where it is not held. */
  slot(id: number): number | undefined {
    return this.slots.slot(id);
  }

  /** Adds the surfel or replaces it; `source` holds its record at word `offset`. */
  put(id: number, version: number, source: Uint32Array, offset: number): void {
    const heldSlots = this.size;
    const slot = this.slots.insert(id);
    if (slot < heldSlots) this.subtractDigest(id, this.versions[slot] as number);
    this.reserve(slot + 1);
    const { positionM, normal, radiusM } = surfelOf(source, offset);
    this.placeData.set(positionM, slot * PLACE_SIZE);
    this.placeData[slot * PLACE_SIZE + 3] = radiusM;
    this.normalData.set(normal, slot * NORMAL_SIZE);
    this.colorData[slot] = source[offset + 3] as number;
    this.versions[slot] = version;
    this.digestSum = (this.digestSum + surfelDigest(id, version)) >>> 0;
    this.dirty.mark(slot);
    if (slot < heldSlots) return;
    this.origins.set(positionM, slot * 3);
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
    moveRow(this.placeData, PLACE_SIZE, movedFrom, slot);
    moveRow(this.normalData, NORMAL_SIZE, movedFrom, slot);
    moveRow(this.colorData, 1, movedFrom, slot);
    moveRow(this.versions, 1, movedFrom, slot);
    moveRow(this.origins, 3, movedFrom, slot);
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

  /** Moves all surfels. */
  deform(warp: Warp): void {
    for (let slot = 0; slot < this.size; slot++) {
      const moved = warp.apply(this.placeData, slot * PLACE_SIZE, this.normalData, slot * NORMAL_SIZE);
      if (moved) this.dirty.mark(slot);
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
    this.placeData = grown(this.placeData, Float32Array);
    this.normalData = grown(this.normalData, Float32Array);
    this.colorData = grown(this.colorData, Uint32Array);
    this.versions = grown(this.versions, Uint32Array);
    this.origins = grown(this.origins, Float32Array);
  }
}

function moveRow(data: Float32Array | Uint32Array, size: number, from: number, to: number): void {
  data.copyWithin(to * size, from * size, (from + 1) * size);
}

function grown<T extends Float32Array | Uint32Array>(data: T, make: new (length: number) => T): T {
  const larger = new make(data.length * 2);
  larger.set(data);
  return larger;
}
