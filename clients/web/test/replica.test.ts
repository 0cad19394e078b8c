import assert from 'node:assert/strict';
import { test } from 'node:test';
import { create } from '@bufbuild/protobuf';
import { CLAIMED_ERROR_M, FakeModel } from '../e2e/fake_model';
import { packIds } from '../e2e/fake_pack';
import { ModelEpochSchema, type SnapshotChunk } from '../src/generated/mis_slam/v1/model_pb';
import { Replica } from '../src/model/replica';
import { PLACE_SIZE, SurfelStore } from '../src/model/surfel_store';

/** A server's model of 10 000 surfels and a replica that has not been seeded. */
function serverAndReplica() {
  const server = new FakeModel(10_000);
  const store = new SurfelStore();
  const replica = new Replica(store);
  const seed = (chunks: readonly SnapshotChunk[] = server.snapshot()) =>
    chunks.map((chunk) => replica.applyChunk(chunk));
  return { server, store, replica, seed };
}

test('a snapshot seeds the replica chunk by chunk', () => {
  const { store, replica, seed } = serverAndReplica();
  assert.deepEqual(seed(), ['seeding', 'seeding', 'seeding', 'seeding', 'current']);
  assert.equal(store.size, 10_000);
  assert.equal(replica.epoch, 1);
});

test('after many epochs the replica is what a late joiner gets', () => {
  const { server, store, replica, seed } = serverAndReplica();
  seed();
  assert.equal(replica.errorM, undefined);
  for (let i = 1; i <= 20; i++) assert.equal(replica.applyEpoch(server.advance(i / 30)), 'current');
  const late = new SurfelStore();
  const lateReplica = new Replica(late);
  for (const chunk of server.snapshot()) lateReplica.applyChunk(chunk);
  assert.equal(store.digest, late.digest);
  assert.equal(replica.digest, lateReplica.digest);
  assert.equal(store.size, server.size);
  assert.equal(replica.epoch, lateReplica.epoch);
  assert.equal(replica.errorM, CLAIMED_ERROR_M);
});

test('a replica that missed an epoch waits for a snapshot and keeps its model until then', () => {
  const { server, store, replica, seed } = serverAndReplica();
  seed();
  server.advance(0.1);
  assert.throws(() => replica.applyEpoch(server.advance(0.2)), /epoch 3 applies to 2, held is 1/);
  assert.equal(replica.following, false);
  assert.equal(store.size, 10_000);
  assert.equal(replica.applyEpoch(server.advance(0.3)), 'ignored');
  assert.equal(seed().at(-1), 'current');
  assert.equal(store.size, server.size);
});

test('an epoch with another digest changes nothing', () => {
  const { server, store, replica, seed } = serverAndReplica();
  seed();
  const before = store.digest;
  server.corruptNext = true;
  assert.throws(() => replica.applyEpoch(server.advance(0.1)), /digest/);
  assert.equal(store.digest, before);
  assert.equal(replica.epoch, 1);
});

test('an epoch that changes a surfel which is not held is refused', () => {
  const { replica, seed } = serverAndReplica();
  seed();
  const removedIds = packIds([99_999]);
  const epoch = create(ModelEpochSchema, { epoch: 2, baseEpoch: 1, removedIds });
  assert.throws(() => replica.applyEpoch(epoch), /changed surfel 99999 is not held/);
});

test('a snapshot replaces the old model without emptying it first', () => {
  const { server, store, replica, seed } = serverAndReplica();
  seed();
  server.advance(0.1);
  const [first, ...rest] = server.snapshot();
  assert.ok(first);
  replica.applyChunk(first);
  assert.equal(store.size, 10_000);
  for (const chunk of rest) replica.applyChunk(chunk);
  assert.equal(store.size, server.size);
  assert.ok(server.size < 10_000);
});

test('chunks may come in any order and twice', () => {
  const { server, replica } = serverAndReplica();
  const chunks = server.snapshot();
  const shuffled = [chunks[3], chunks[0], chunks[3], chunks[4], chunks[1], chunks[2]];
  const applied = shuffled.map((chunk) => replica.applyChunk(chunk as SnapshotChunk));
  assert.deepEqual(applied, ['seeding', 'seeding', 'seeding', 'seeding', 'seeding', 'current']);
});

test('a new snapshot starts over', () => {
  const { server, replica, seed } = serverAndReplica();
  replica.applyChunk(server.snapshot()[0] as SnapshotChunk);
  server.advance(0.1);
  assert.equal(seed().at(-1), 'current');
  assert.equal(replica.epoch, 2);
});

test('an impossible chunk is refused', () => {
  const { server, replica } = serverAndReplica();
  const [chunk] = server.snapshot();
  assert.ok(chunk);
  assert.throws(() => replica.applyChunk({ ...chunk, index: chunk.count }), /chunk 5 of 5/);
});

test('an empty model is one chunk without nodes', () => {
  const { replica, store, server, seed } = serverAndReplica();
  seed();
  const [chunk] = server.snapshot();
  assert.ok(chunk);
  const empty = { ...chunk, epoch: 9, count: 1, nodes: undefined, digest: 0 };
  assert.equal(replica.applyChunk(empty as unknown as SnapshotChunk), 'current');
  assert.equal(store.size, 0);
});

test('surfels that are not sent anew follow the nodes', () => {
  const { server, store, replica, seed } = serverAndReplica();
  seed();
  for (let i = 1; i <= 10; i++) replica.applyEpoch(server.advance(i / 10));
  const truth = new SurfelStore();
  const joiner = new Replica(truth);
  for (const chunk of server.snapshot()) joiner.applyChunk(chunk);
  const errors: number[] = [];
  const rises: number[] = [];
  const start = new SurfelStore();
  const first = new Replica(start);
  for (const chunk of new FakeModel(10_000).snapshot()) first.applyChunk(chunk);
  for (let id = 0; id < 9000; id++) {
    const z = (of: SurfelStore) => of.places[PLACE_SIZE * (of.slot(id) as number) + 2] as number;
    errors.push(Math.abs(z(store) - z(truth)));
    rises.push(Math.abs(z(truth) - z(start)));
  }
  assert.ok(Math.max(...rises) > 0.002, `${Math.max(...rises)} m`);
  assert.ok(Math.max(...errors) < 0.0002, `${Math.max(...errors)} m`);
});
