import assert from 'node:assert/strict';
import { test } from 'node:test';
import { unpackIds, unpackSurfels, unpackVersions } from '../src/model/packed_surfels';
import { surfelOf } from '../src/model/surfel_record';

function bytesOf(...words: number[]): Uint8Array {
  return new Uint8Array(Uint32Array.from(words).buffer);
}

test('ids are read wherever in a message they begin', () => {
  const message = new Uint8Array([0xaa, ...bytesOf(1, 0xffffffff)]);
  assert.deepEqual([...unpackIds('ids', message.subarray(1))], [1, 0xffffffff]);
});

test('ids that do not strictly increase are refused', () => {
  assert.throws(() => unpackIds('ids', bytesOf(1, 5, 5)), /id 5 at index 2 does not come after 5/);
  assert.throws(() => unpackIds('ids', bytesOf(9, 3)), /id 3 at index 1 does not come after 9/);
});

test('ragged arrays are refused', () => {
  assert.throws(
    () => unpackIds('removed_ids', new Uint8Array(5)),
    /removed_ids has 5 bytes, no multiple of 4/,
  );
  const packed = { ids: bytesOf(1), records: new Uint8Array(15) };
  assert.throws(() => unpackSurfels(packed), /records has 15 bytes, no multiple of 16/);
});

test('arrays that do not belong together are refused', () => {
  const packed = { ids: bytesOf(1, 2), records: new Uint8Array(16) };
  assert.throws(() => unpackSurfels(packed), /records has 1 elements for 2 ids/);
  assert.throws(() => unpackVersions(bytesOf(1), 2), /versions has 1 elements for 2 ids/);
});

test('a message with too many surfels is refused', () => {
  assert.throws(() => unpackIds('ids', new Uint8Array(4 * ((1 << 20) + 1))), /the limit is 1048576/);
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
