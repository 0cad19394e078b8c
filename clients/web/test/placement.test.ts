import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Matrix4, Quaternion, Vector3 } from 'three';
import { Grab } from '../src/xr/grab';
import { firstPlacement, roomFromMarker, scaleOf } from '../src/xr/placement';

const CENTRE = new Vector3(0.01, -0.02, 0.08);

function near(actual: Vector3, expected: readonly [number, number, number], toleranceM = 1e-6): void {
  const message = `${actual.toArray()} is not ${expected}`;
  assert.ok(actual.distanceTo(new Vector3(...expected)) < toleranceM, message);
}

test('the model first appears before the eyes, upright and in life size', () => {
  const turn = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), Math.PI / 2);
  const head = new Matrix4().compose(new Vector3(1, 1.6, 2), turn, new Vector3(1, 1, 1));
  const placement = firstPlacement(CENTRE, head);
  // A quarter turn to the left looks along -x.
  near(CENTRE.clone().applyMatrix4(placement), [1 - 0.55, 1.4, 2]);
  const up = new Vector3(0, -1, 0).transformDirection(placement);
  near(up, [0, 1, 0]);
  assert.ok(Math.abs(scaleOf(placement) - 1) < 1e-9);
});

function grabbing() {
  const hands = [new Matrix4(), new Matrix4()];
  const grab = new Grab((hand) => hands[hand] as Matrix4);
  const move = (hand: number, x: number, y: number, z: number) => {
    hands[hand] = new Matrix4().makeTranslation(x, y, z);
  };
  return { grab, move };
}

test('one hand carries the model along', () => {
  const { grab, move } = grabbing();
  move(0, 0, 1, 0);
  grab.take(0, new Matrix4());
  move(0, 0.3, 1.1, 0);
  near(new Vector3().setFromMatrixPosition(grab.moved(new Matrix4())), [0.3, 0.1, 0]);
});

test('two hands drawn apart make it larger, about their middle', () => {
  const { grab, move } = grabbing();
  move(0, -0.1, 1, 0);
  move(1, 0.1, 1, 0);
  grab.take(0, new Matrix4());
  grab.take(1, new Matrix4());
  move(0, -0.2, 1, 0);
  move(1, 0.2, 1, 0);
  const placement = grab.moved(new Matrix4());
  assert.ok(Math.abs(scaleOf(placement) - 2) < 1e-9);
  near(new Vector3(0, 1, 0).applyMatrix4(placement), [0, 1, 0]);
});

test('the scale has limits', () => {
  const { grab, move } = grabbing();
  move(0, -0.1, 1, 0);
  move(1, 0.1, 1, 0);
  grab.take(0, new Matrix4());
  grab.take(1, new Matrix4());
  move(1, 500, 1, 0);
  assert.ok(Math.abs(scaleOf(grab.moved(new Matrix4())) - 20) < 1e-6);
});

test('a hand that lets go leaves the model where it is, in the other hand', () => {
  const { grab, move } = grabbing();
  move(0, -0.1, 1, 0);
  move(1, 0.1, 1, 0);
  grab.take(0, new Matrix4());
  grab.take(1, new Matrix4());
  move(1, 0.3, 1, 0);
  const stretched = grab.moved(new Matrix4());
  grab.release(1, stretched);
  assert.ok(
    grab.moved(stretched).elements.every((value, i) => Math.abs(value - (stretched.elements[i] ?? 0)) < 1e-9),
  );
  grab.release(0, stretched);
  assert.equal(grab.active, false);
});

test('three touched points give a frame, and points on a line none', () => {
  const origin = new Vector3(1, 1, 1);
  const frame = roomFromMarker(origin, new Vector3(1.2, 1, 1), new Vector3(1.1, 1, 0.8));
  assert.ok(frame !== undefined);
  near(new Vector3(0.1, 0, 0).applyMatrix4(frame), [1.1, 1, 1]);
  near(new Vector3(0, 0, 1).transformDirection(frame), [0, 1, 0]);
  assert.equal(roomFromMarker(origin, new Vector3(1.2, 1, 1), new Vector3(1.4, 1, 1)), undefined);
  assert.equal(roomFromMarker(origin, new Vector3(1.01, 1, 1), new Vector3(1, 1.2, 1)), undefined);
});
