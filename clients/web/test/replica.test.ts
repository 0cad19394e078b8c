import assert from 'node:assert/strict';
import { test } from 'node:test';
import { create } from '@bufbuild/protobuf';
import { FakeModel } from '../e2e/fake_model';
import { ModelEpochSchema, type SnapshotChunk } from '../src/generated/mis_slam/v1/model_pb';
import { Replica } from '../src/model/replica';
import { SurfelStore } from '../src/model/surfel_store';

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
  assert.deepEqual(seed(), ['seeding', 'seeding', 'seeding', 'current']);
  assert.equal(store.size, 10_000);
  assert.equal(replica.epoch, 1);
});

test('after many epochs the replica is what a late joiner gets', () => {
  const { server, store, replica, seed } = serverAndReplica();
  seed();
  for (let i = 1; i <= 20; i++) assert.equal(replica.applyEpoch(server.advance(i / 30)), 'current');
  const late = new SurfelStore();
  const lateReplica = new Replica(late);
  for (const chunk of server.snapshot()) lateReplica.applyChunk(chunk);
  assert.equal(store.digest, late.digest);
  assert.equal(store.size, server.size);
  assert.equal(replica.epoch, lateReplica.epoch);
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
  const removedIds = new Uint8Array(Uint32Array.of(99_999).buffer);
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

test('a missing chunk is noticed, and the rest of that snapshot is passed over', () => {
  const { server, replica } = serverAndReplica();
  const [first, , third, fourth] = server.snapshot();
  assert.ok(first && third && fourth);
  replica.applyChunk(first);
  assert.throws(() => replica.applyChunk(third), /chunk 2 of epoch 1 came out of order/);
  assert.equal(replica.applyChunk(fourth), 'ignored');
});

test('an empty model is one empty chunk', () => {
  const { replica, store, server, seed } = serverAndReplica();
  seed();
  const [chunk] = server.snapshot();
  assert.ok(chunk);
  const empty = { ...chunk, epoch: 9, count: 1, surfels: undefined, versions: new Uint8Array(0), digest: 0 };
  assert.equal(replica.applyChunk(empty as unknown as SnapshotChunk), 'current');
  assert.equal(store.size, 0);
});
