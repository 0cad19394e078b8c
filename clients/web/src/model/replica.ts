import type { ModelEpoch, SnapshotChunk } from '../generated/mis_slam/v1/model_pb';
import { surfelDigest } from './digest';
import { NO_NODES, type Nodes, nodesAfter, nodesDigest, unpackNodes, unpackTransforms } from './nodes';
import { unpackIds } from './numbers';
import { type SurfelBlock, unpackSurfels, unpackVersions, WORDS_PER_RECORD } from './packed_surfels';
import { ProtocolError } from './protocol_error';
import type { SurfelStore } from './surfel_store';
import { Warp } from './warp';

/** A snapshot under way; its chunks may come in any order. */
interface Seeding {
  readonly kind: 'seeding';
  readonly epoch: number;
  readonly digest: number;
  readonly count: number;
  readonly seenChunks: Set<number>;
  readonly seenIds: Set<number>;
  nodes: Nodes;
}

/**
 * Where the replica stands: it waits for a snapshot, takes its chunks in, or follows the epochs.
 * Transitions happen in `applyChunk`, `applyEpoch` and `forget` only.
 */
type Phase = { readonly kind: 'waiting' } | Seeding | { readonly kind: 'following'; readonly epoch: number };

/** What a message of the model lane did. */
export type Applied =
  /** Nothing: an epoch while a snapshot is awaited or under way. */
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
  private nodes = NO_NODES;
  private reachM = 0;
  private maxErrorM: number | undefined;

  constructor(private readonly store: SurfelStore) {}

  /** The epoch that the store was last equal to; 0 for none. */
  get epoch(): number {
    return this.heldEpoch;
  }

  /** Whether the store is equal to the server's model at `epoch`. */
  get following(): boolean {
    return this.phase.kind === 'following';
  }

  /** How far the model is from the server's own, at most; unknown until an epoch tells. */
  get errorM(): number | undefined {
    return this.maxErrorM;
  }

  /** The next thing taken in is a snapshot: after a new connection or an error. */
  forget(): void {
    this.phase = { kind: 'waiting' };
  }

  /** Digest over surfels and nodes. */
  get digest(): number {
    return modulo32(this.store.digest + nodesDigest(this.nodes));
  }

  /** Deformation nodes held. */
  get nodeCount(): number {
    return this.nodes.ids.length;
  }

  applyChunk(chunk: SnapshotChunk): Applied {
    return this.orForget(() => {
      const seeding = this.seedingFor(chunk);
      if (chunk.index >= chunk.count) {
        throw new ProtocolError(`snapshot chunk ${chunk.index} of ${chunk.count}`);
      }
      const { ids, records } = unpackSurfels(chunk.surfels);
      const versions = unpackVersions(chunk.versions, chunk.epoch, ids.length);
      if (chunk.nodes !== undefined) seeding.nodes = unpackNodes(chunk.nodes);
      ids.forEach((id, i) => {
        seeding.seenIds.add(id);
        this.store.put(id, versions[i] as number, records, i * WORDS_PER_RECORD);
      });
      seeding.seenChunks.add(chunk.index);
      if (seeding.seenChunks.size < chunk.count) return 'seeding';
      this.store.retain(seeding.seenIds);
      this.nodes = seeding.nodes;
      this.reachM = chunk.nodeReachM;
      expectDigest(chunk.epoch, this.digest, chunk.digest);
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
      const transforms = unpackTransforms(epoch.nodeTransforms, this.nodes.ids.length);
      const removedNodes = unpackIds('removed_node_ids', epoch.removedNodeIds);
      const nodes = nodesAfter(this.nodes, transforms, removedNodes, unpackNodes(epoch.addedNodes));
      const removed = unpackIds('removed_ids', epoch.removedIds);
      const added = unpackSurfels(epoch.added);
      const updated = unpackSurfels(epoch.updated);
      const surfels = this.digestAfter(epoch.epoch, removed, added, updated);
      expectDigest(epoch.epoch, modulo32(surfels + nodesDigest(nodes)), epoch.digest);
      if (transforms.length > 0) this.store.deform(new Warp(this.nodes, this.reachM, transforms));
      this.nodes = nodes;
      this.reachM = epoch.nodeReachM;
      this.maxErrorM = epoch.maxErrorM;
      for (const id of removed) this.store.remove(id);
      this.putAll(epoch.epoch, updated);
      this.putAll(epoch.epoch, added);
      return this.follow(epoch.epoch);
    });
  }

  /** The snapshot that a chunk is of: the one under way, or a new one. */
  private seedingFor(chunk: SnapshotChunk): Seeding {
    const { epoch, digest, count } = chunk;
    const phase = this.phase;
    const underWay = phase.kind === 'seeding' && phase.epoch === epoch && phase.digest === digest;
    if (underWay && phase.count === count) return phase;
    const started = { seenChunks: new Set<number>(), seenIds: new Set<number>(), nodes: NO_NODES };
    const seeding: Seeding = { kind: 'seeding', epoch, digest, count, ...started };
    this.phase = seeding;
    return seeding;
  }

  /** The digest that the surfels will have, found before anything is changed. */
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
