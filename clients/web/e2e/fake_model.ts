import { create } from '@bufbuild/protobuf';
import {
  type ModelEpoch,
  ModelEpochSchema,
  PackedSurfelsSchema,
  type SnapshotChunk,
  SnapshotChunkSchema,
} from '../src/generated/mis_slam/v1/model_pb';
import { surfelDigest } from '../src/model/digest';
import { FakeNodes } from './fake_nodes';
import { packIds, packNumbers, packRecords } from './fake_pack';
import { SyntheticSurface } from './synthetic_surface';

const CHUNK_SURFELS = 2500;
/** What every epoch says of how far it leaves its viewers from the model. */
export const CLAIMED_ERROR_M = 1.5e-4;
/** In each epoch one of so many surfels is sent anew; the others follow the nodes. */
const UPDATED_OF = 64;
/** Surfels that come and go at the edge of the patch. */
const CHANGING = 500;

/** The server's side of the model lane: versions, digest, epochs and snapshots of a synthetic surface. */
export class FakeModel {
  epoch = 1;
  /** The digest of the next epoch is sent wrong. */
  corruptNext = false;
  private readonly surface: SyntheticSurface;
  private readonly nodes: FakeNodes;
  private readonly versions = new Map<number, number>();
  private timeS = 0;

  constructor(surfels: number) {
    this.surface = new SyntheticSurface(surfels);
    this.nodes = new FakeNodes(this.surface);
    for (let id = 0; id < this.surface.size; id++) this.versions.set(id, 1);
  }

  get size(): number {
    return this.versions.size;
  }

  /** Deforms the surface and says what changed; the last surfels are removed and added in turn. */
  advance(timeS: number): ModelEpoch {
    const nodeTransforms = this.nodes.move(this.timeS, timeS);
    this.timeS = timeS;
    this.epoch += 1;
    const last = this.surface.size - CHANGING;
    const changing = Array.from({ length: CHANGING }, (_, i) => last + i);
    const held = this.versions.has(last);
    const updated: number[] = [];
    for (let id = this.epoch % UPDATED_OF; id < last; id += UPDATED_OF) updated.push(id);
    for (const id of updated) this.versions.set(id, this.epoch);
    for (const id of changing) held ? this.versions.delete(id) : this.versions.set(id, this.epoch);
    const wrong = this.corruptNext ? 1 : 0;
    this.corruptNext = false;
    return create(ModelEpochSchema, {
      epoch: this.epoch,
      baseEpoch: this.epoch - 1,
      nodeTransforms,
      nodeReachM: this.nodes.reachM,
      removedIds: packIds(held ? changing : []),
      added: this.block(held ? [] : changing),
      updated: this.block(updated),
      digest: (this.digest() ^ wrong) >>> 0,
      surfels: this.size,
      maxErrorM: CLAIMED_ERROR_M,
    });
  }

  snapshot(): SnapshotChunk[] {
    const ids = [...this.versions.keys()].sort((a, b) => a - b);
    const count = 1 + Math.ceil(ids.length / CHUNK_SURFELS);
    const header = { epoch: this.epoch, count, digest: this.digest(), nodeReachM: this.nodes.reachM };
    const nodes = create(SnapshotChunkSchema, { ...header, index: 0, nodes: this.nodes.packed });
    const surfels = Array.from({ length: count - 1 }, (_, run) => {
      const part = ids.slice(run * CHUNK_SURFELS, (run + 1) * CHUNK_SURFELS);
      const ages = part.map((id) => this.epoch - (this.versions.get(id) ?? 0));
      const block = { surfels: this.block(part), versions: packNumbers(ages) };
      return create(SnapshotChunkSchema, { ...header, index: run + 1, ...block });
    });
    return [nodes, ...surfels];
  }

  private block(ids: readonly number[]) {
    const records = packRecords(this.surface.pack(ids, this.timeS));
    return create(PackedSurfelsSchema, { ids: packIds(ids), records });
  }

  private digest(): number {
    let sum = this.nodes.digest;
    for (const [id, version] of this.versions) sum = (sum + surfelDigest(id, version)) >>> 0;
    return sum;
  }
}
