/** The examples of protocol/SPEC.md, which the Rust tests check too: both sides read the same bytes alike. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { nodeDigest, surfelDigest } from '../src/model/digest';
import { unpackTransforms } from '../src/model/nodes';
import { MAX_SURFELS_PER_MESSAGE } from '../src/model/numbers';
import { unpackSurfels } from '../src/model/packed_surfels';
import { surfelOf } from '../src/model/surfel_record';

const specification = readFileSync('../../protocol/SPEC.md', 'utf8');

function close(got: number, expected: number, tolerance: number): void {
  assert.ok(Math.abs(got - expected) <= tolerance, `${got} is not ${expected} within ${tolerance}`);
}

test('the golden surfel decodes to the values that the specification gives', () => {
  const hex = /\b[0-9a-f]{32}\b/.exec(specification)?.[0];
  assert.ok(hex, 'SPEC.md has an example of 16 bytes');
  const records = new Uint8Array(Buffer.from(hex, 'hex'));
  const block = unpackSurfels({ ids: new Uint8Array([7]), records });
  const surfel = surfelOf(block.records, 0);
  assert.deepEqual([...block.ids], [7]);
  [0.0123, -0.0456, 0.0789].forEach((value, axis) => {
    close(surfel.positionM[axis] as number, value, 1.001e-5);
  });
  [0, 0.6, -0.8].forEach((value, axis) => {
    close(surfel.normal[axis] as number, value, 1.1e-3);
  });
  close(surfel.radiusM, 0.0008, 0.022 * 0.0008);
  assert.deepEqual(surfel.color, [200, 90, 70]);
  close(surfel.confidence, 0.5, 0.002);
});

test('the digest is that of the table in the specification', () => {
  const rows = [...specification.matchAll(/\| (\d+) \| (\d+) \| (0x[0-9a-f]{8}) \|/g)];
  assert.ok(rows.length >= 3, 'SPEC.md has a table of hashes');
  for (const [, id, version, hash] of rows) {
    assert.equal(surfelDigest(Number(id), Number(version)), Number(hash));
  }
});

test('the hashes of nodes are those of the table in the specification', () => {
  const rows = [...specification.matchAll(/\| (\d+) \| (-?\d+), (-?\d+), (-?\d+) \| (0x[0-9a-f]{8}) \|/g)];
  assert.ok(rows.length >= 2, 'SPEC.md has a table of node hashes');
  for (const [, id, x, y, z, hash] of rows) {
    assert.equal(nodeDigest(Number(id), Number(x), Number(y), Number(z)), Number(hash));
  }
});

test('the golden transform decodes to the codes that the specification gives', () => {
  const hex = /\b[0-9a-f]{48}\b/.exec(specification)?.[0];
  assert.ok(hex, 'SPEC.md has an example of 24 bytes');
  const codes = unpackTransforms(new Uint8Array(Buffer.from(hex, 'hex')), 1);
  assert.deepEqual([...codes], [250, -1, 0, 300, 0, 0, 0, -41, 0, 0, 0, 1]);
});

test('the limit of surfels in one message is that of the specification', () => {
  const limit = /surfels in one block \| (\d+)/.exec(specification)?.[1];
  assert.equal(MAX_SURFELS_PER_MESSAGE, Number(limit));
});
