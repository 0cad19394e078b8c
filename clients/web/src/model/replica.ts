import type { ModelEpoch, SnapshotChunk } from '../generated/mis_slam/v1/model_pb';
import { surfelDigest } from './digest';
import {
  type SurfelBlock,
  unpackIds,
  unpackSurfels,
  unpackVersions,
  WORDS_PER_RECORD,
} from './packed_surfels';
import { ProtocolError } from './protocol_error';
import type { SurfelStore } from './surfel_store';

/**
 * Where the replica stands: it waits for chunk 0 of a snapshot, takes chunks in, or follows the epochs.
 * Transitions happen in `applyChunk`, `applyEpoch` and `forget` only.
 */
type Phase =
  | { readonly kind: 'waiting' }
  | { readonly kind: 'seeding'; readonly epoch: number; nextChunk: number; readonly seenIds: Set<number> }
  | { readonly kind: 'following'; readonly epoch: number };

/** What a message of the model lane did. */
export type Applied =
  /** Nothing: an epoch, or the rest of an old snapshot, while a snapshot is awaited or under way. */
  | 'ignored'
  /** A part of a snapshot is in. */
  | 'seeding'
  /** The model is the server's at `epoch`. */
  | 'current';

/**
 * Keeps a `SurfelStore` equal to the server's model: snapshots seed it, epochs bring it forward, the digest
 * proves that it is equal. What does not fit throws `ProtocolError` and leaves the replica waiting for a
 * snapshot, with the last good model still in the store.
 */
export class Replica {
  private phase: Phase = { kind: 'waiting' };
  private heldEpoch = 0;

  constructor(private readonly store: SurfelStore) {}

  /** The epoch that the store was last equal to; 0 for none. */
  get epoch(): number {
    return this.heldEpoch;
  }

  /** Whether the store is equal to the server's model at `epoch`. */
  get following(): boolean {
    return this.phase.kind === 'following';
  }

  /** The next thing taken in is a snapshot: after a new connection or an error. */
  forget(): void {
    this.phase = { kind: 'waiting' };
  }

  applyChunk(chunk: SnapshotChunk): Applied {
    // The rest of a snapshot that was given up.
    if (this.phase.kind === 'waiting' && chunk.index !== 0) return 'ignored';
    return this.orForget(() => {
      const seeding = this.seedingFor(chunk);
      const { ids, records } = unpackSurfels(chunk.surfels);
      const versions = unpackVersions(chunk.versions, ids.length);
      ids.forEach((id, i) => {
        seeding.seenIds.add(id);
        this.store.put(id, versions[i] as number, records, i * WORDS_PER_RECORD);
      });
      seeding.nextChunk = chunk.index + 1;
      if (seeding.nextChunk < chunk.count) return 'seeding';
      this.store.retain(seeding.seenIds);
      expectDigest(chunk.epoch, this.store.digest, chunk.digest);
      return this.follow(chunk.epoch);
    });
  }

  applyEpoch(epoch: ModelEpoch): Applied {
    const phase = this.phase;
    if (phase.kind !== 'following') return 'ignored';
    return this.orForget(() => {
      if (epoch.baseEpoch !== phase.epoch) {
        throw new ProtocolError(`epoch ${epoch.epoch} applies to ${epoch.baseEpoch}, held is ${phase.epoch}`);
      }
      const removed = unpackIds('removed_ids', epoch.removedIds);
      const added = unpackSurfels(epoch.added);
      const updated = unpackSurfels(epoch.updated);
      expectDigest(epoch.epoch, this.digestAfter(epoch.epoch, removed, added, updated), epoch.digest);
      for (const id of removed) this.store.remove(id);
      this.putAll(epoch.epoch, updated);
      this.putAll(epoch.epoch, added);
      return this.follow(epoch.epoch);
    });
  }

  private seedingFor(chunk: SnapshotChunk): Extract<Phase, { kind: 'seeding' }> {
    if (chunk.index === 0) {
      const seeding = {
        kind: 'seeding' as const,
        epoch: chunk.epoch,
        nextChunk: 0,
        seenIds: new Set<number>(),
      };
      this.phase = seeding;
      return seeding;
    }
    const phase = this.phase;
    if (phase.kind !== 'seeding' || phase.nextChunk !== chunk.index || phase.epoch !== chunk.epoch) {
      throw new ProtocolError(`chunk ${chunk.index} of epoch ${chunk.epoch} came out of order`);
    }
    return phase;
  }

  /** The digest that the model will have, found before anything is changed. */
  private digestAfter(epoch: number, removed: Uint32Array, added: SurfelBlock, updated: SurfelBlock): number {
    let digest = this.store.digest;
    for (const id of removed) digest -= surfelDigest(id, this.heldVersion(id));
    for (const id of updated.ids) digest += surfelDigest(id, epoch) - surfelDigest(id, this.heldVersion(id));
    for (const id of added.ids) {
      if (this.store.version(id) !== undefined) throw new ProtocolError(`added surfel ${id} is held already`);
      digest += surfelDigest(id, epoch);
    }
    return modulo32(digest);
  }

  private heldVersion(id: number): number {
    const version = this.store.version(id);
    if (version === undefined) throw new ProtocolError(`changed surfel ${id} is not held`);
    return version;
  }

  private putAll(version: number, { ids, records }: SurfelBlock): void {
    ids.forEach((id, i) => {
      this.store.put(id, version, records, i * WORDS_PER_RECORD);
    });
  }

  private follow(epoch: number): Applied {
    this.phase = { kind: 'following', epoch };
    this.heldEpoch = epoch;
    return 'current';
  }

  private orForget(apply: () => Applied): Applied {
    try {
      return apply();
    } catch (error) {
      this.forget();
      throw error;
    }
  }
}

function expectDigest(epoch: number, got: number, expected: number): void {
  if (got !== expected) throw new ProtocolError(`epoch ${epoch}: digest ${got}, the server's is ${expected}`);
}

/** Sums of a million 32-bit numbers are exact in a double (below 2^53), so one reduction at the end will do. */
function modulo32(sum: number): number {
  return sum - Math.floor(sum / 2 ** 32) * 2 ** 32;
}
