import assert from 'node:assert/strict';
import { test } from 'node:test';
import { GazeWatch, viewMessage } from '../src/session/wishes';

const AT_A_PAGE = { features: false, maxSurfels: 0, inHeadset: false, gaze: undefined };

test('a headset gets no more than it can draw, and what the person chose where that is less', () => {
  assert.equal(viewMessage(AT_A_PAGE).maxSurfels, 0);
  assert.equal(viewMessage({ ...AT_A_PAGE, inHeadset: true }).maxSurfels, 150_000);
  assert.equal(viewMessage({ ...AT_A_PAGE, inHeadset: true, maxSurfels: 30_000 }).maxSurfels, 30_000);
  assert.equal(viewMessage({ ...AT_A_PAGE, inHeadset: true, maxSurfels: 300_000 }).maxSurfels, 150_000);
  assert.equal(viewMessage({ ...AT_A_PAGE, gaze: { x: 1, y: 2, z: 3 } }).gazeInWorld?.yM, 2);
});

test('a gaze is told once it has gone elsewhere, and not too often', () => {
  const watch = new GazeWatch();
  const at = (x: number) => ({ x, y: 0, z: 0.1 });
  assert.equal(watch.hasMoved(undefined, 0), false);
  assert.equal(watch.hasMoved(at(0), 100), true);
  assert.equal(watch.hasMoved(at(0.1), 200), false);
  assert.equal(watch.hasMoved(at(0.02), 4000), false);
  assert.equal(watch.hasMoved(at(0.1), 4001), true);
});
