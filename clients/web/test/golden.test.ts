/** The golden model lane, which the Rust tests check too: both replicas make the same of the same bytes. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { create, toBinary } from '@bufbuild/protobuf';
import { type FromServer, FromServerSchema } from '../src/generated/mis_slam/v1/envelope_pb';
import { CompressedSchema, SnapshotChunkSchema } from '../src/generated/mis_slam/v1/model_pb';
import { Replica } from '../src/model/replica';
import { NORMAL_SIZE, PLACE_SIZE, SurfelStore } from '../src/model/surfel_store';
import { decodeFromServer } from '../src/stream/messages';

interface State {
  epoch: number;
  digest: number;
  nodes: number;
  surfels: number[][];
}

const golden = JSON.parse(readFileSync('../../protocol/golden/model_lane.json', 'utf8')) as {
  epochs: { hex: string; after: State }[];
  snapshot: string[];
};

function body(hex: string): FromServer['body'] {
  return decodeFromServer(new Uint8Array(Buffer.from(hex, 'hex')));
}

function follower() {
  const store = new SurfelStore();
  const replica = new Replica(store);
  replica.applyChunk(create(SnapshotChunkSchema, { count: 1 }));
  return { store, replica };
}

test('a replica makes of the golden epochs what is written beside them', () => {
  const { store, replica } = follower();
  for (const { hex, after } of golden.epochs) {
    const message = body(hex);
    assert.equal(message.case, 'epoch');
    if (message.case === 'epoch') replica.applyEpoch(message.value);
    assert.deepEqual(
      [replica.epoch, replica.digest, replica.nodeCount],
      [after.epoch, after.digest, after.nodes],
    );
    assert.equal(store.size, after.surfels.length);
    for (const [id, ...expected] of after.surfels) {
      const slot = store.slot(id as number);
      assert.ok(slot !== undefined);
      const got = [
        ...store.places.subarray(PLACE_SIZE * slot, PLACE_SIZE * slot + 3),
        ...store.normals.subarray(NORMAL_SIZE * slot, NORMAL_SIZE * (slot + 1)),
      ];
      const worst = Math.max(...expected.map((value, i) => Math.abs(value - (got[i] as number))));
      assert.ok(worst < 5e-7, `surfel ${id} is off by ${worst} at epoch ${after.epoch}`);
    }
  }
});

test('a late joiner comes to the same digest', () => {
  const replica = new Replica(new SurfelStore());
  for (const hex of [...golden.snapshot].reverse()) {
    const message = body(hex);
    assert.equal(message.case, 'snapshot');
    if (message.case === 'snapshot') replica.applyChunk(message.value);
  }
  assert.ok(replica.following);
  assert.equal(replica.digest, golden.epochs.at(-1)?.after.digest);
});

test('a message within a message that lies about itself is refused', () => {
  const zstd = Uint8Array.of(0x28, 0xb5, 0x2f, 0xfd);
  const compressed = (sizeBytes: number) => {
    const value = create(CompressedSchema, { sizeBytes, zstd });
    return decodeFromServer(
      toBinary(FromServerSchema, create(FromServerSchema, { body: { case: 'compressed', value } })),
    );
  };
  assert.throws(() => compressed(2 ** 31), /the limit is/);
  assert.throws(() => compressed(1000), /not a FromServer message/);
});
