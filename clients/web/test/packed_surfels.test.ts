import assert from 'node:assert/strict';
import { test } from 'node:test';
import { packIds, packRecords } from '../e2e/fake_pack';
import { unpackIds } from '../src/model/numbers';
import { unpackSurfels, unpackVersions } from '../src/model/packed_surfels';
import { surfelOf } from '../src/model/surfel_record';

test('ids are read as gaps, up to the largest', () => {
  const ids = [0, 1, 2, 130, 131, 0xffffffff];
  assert.deepEqual([...unpackIds('ids', packIds(ids))], ids);
});

test('numbers that are cut short, too long or add up to too much are refused', () => {
  assert.throws(() => unpackIds('ids', Uint8Array.of(5, 0x80)), /ids: number 1 is no LEB128/);
  assert.throws(() => unpackIds('ids', Uint8Array.of(255, 255, 255, 255, 0x1f)), /number 0 is no LEB128/);
  assert.throws(() => unpackIds('ids', Uint8Array.of(128, 128, 128, 128, 128, 0)), /number 0 is no LEB128/);
  assert.throws(() => unpackIds('ids', Uint8Array.of(255, 255, 255, 255, 0x0f, 0)), /over 32 bits/);
});

test('records are read from planes', () => {
  const records = Uint8Array.from({ length: 48 }, (_, i) => i);
  const block = unpackSurfels({ ids: packIds([3, 5, 9]), records: packRecords(records) });
  assert.deepEqual(new Uint8Array(block.records.buffer), records);
});

test('ragged arrays are refused', () => {
  const packed = { ids: packIds([1]), records: new Uint8Array(15) };
  assert.throws(() => unpackSurfels(packed), /records has 15 bytes, no multiple of 16/);
});

test('arrays that do not belong together are refused', () => {
  const packed = { ids: packIds([1, 2]), records: new Uint8Array(16) };
  assert.throws(() => unpackSurfels(packed), /records has 1 elements for 2 ids/);
  assert.throws(() => unpackVersions(Uint8Array.of(1), 9, 2), /versions has 1 elements for 2 ids/);
});

test('a message with too many surfels is refused', () => {
  assert.throws(() => unpackIds('ids', new Uint8Array((1 << 20) + 1)), /the limit is 1048576/);
});

test('an absent block is an empty one', () => {
  assert.equal(unpackSurfels(undefined).ids.length, 0);
});

test('any 16 bytes decode to a finite surfel with a unit normal', () => {
  for (const word of [0, 0xffffffff, 0x80000000, 0x7fffffff, 0x00fff000]) {
    const surfel = surfelOf(new Uint32Array([word, word, word, word]), 0);
    assert.ok([...surfel.positionM, surfel.radiusM, surfel.confidence].every(Number.isFinite));
    assert.ok(Math.abs(Math.hypot(...surfel.normal) - 1) < 1e-9);
  }
});
