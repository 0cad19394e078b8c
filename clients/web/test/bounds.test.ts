import assert from 'node:assert/strict';
import { test } from 'node:test';
import { FakeModel } from '../e2e/fake_model';
import { Replica } from '../src/model/replica';
import { SurfelStore } from '../src/model/surfel_store';
import { boundsWithScope, modelBounds, outgrows } from '../src/scene/bounds';

test('the bounds of a patch lie around its middle', () => {
  const store = new SurfelStore();
  const replica = new Replica(store);
  for (const chunk of new FakeModel(10_000).snapshot()) replica.applyChunk(chunk);
  const bounds = modelBounds(store);
  assert.ok(bounds);
  assert.ok(Math.hypot(bounds.centre[0], bounds.centre[1]) < 0.003);
  assert.ok(Math.abs(bounds.centre[2] - 0.09) < 0.006);
  assert.ok(bounds.radiusM > 0.045 && bounds.radiusM < 0.065, `${bounds.radiusM} m`);
});

test('an empty model has no bounds', () => {
  assert.equal(modelBounds(new SurfelStore()), undefined);
});

test('a near scope is taken into view, one inside or far off changes nothing', () => {
  const bounds = { centre: [0, 0, 0.1], radiusM: 0.06 } as const;
  const near = boundsWithScope(bounds, [0, 0, 0]);
  assert.ok(Math.abs(near.radiusM - 0.08) < 1e-12);
  assert.ok(Math.abs(near.centre[2] - 0.08) < 1e-12);
  assert.equal(boundsWithScope(bounds, [0, 0, 0.12]), bounds);
  assert.equal(boundsWithScope(bounds, [0, 0, -5]), bounds);
});

test('a view is outgrown by a larger or shifted model, not by breathing', () => {
  const fitted = { centre: [0, 0, 0.1], radiusM: 0.06 } as const;
  assert.equal(outgrows({ centre: [0.002, 0, 0.1], radiusM: 0.062 }, fitted), false);
  assert.equal(outgrows({ centre: [0, 0, 0.1], radiusM: 0.07 }, fitted), true);
  assert.equal(outgrows({ centre: [0.03, 0, 0.1], radiusM: 0.05 }, fitted), true);
});
