/**
 * Where the model is in the room of a headset: `room_from_world`, a rigid motion with a uniform scale. The room has
 * y up and metres; the world has y down and z forward (design: conventions).
 */
import { Matrix4, Quaternion, Vector3 } from 'three';

/** Of life size. */
const SCALE_MIN = 0.1;
const SCALE_MAX = 20;
/** The model first appears so far before the eyes and so far below them. */
const FIRST_DISTANCE_M = 0.55;
const FIRST_DROP_M = 0.2;
const UP = new Vector3(0, 1, 0);

/** Life size, upright, before the eyes of a head that looks along its -z. */
export function firstPlacement(centreInWorld: Vector3, roomFromHead: Matrix4): Matrix4 {
  const head = new Vector3().setFromMatrixPosition(roomFromHead);
  const forward = new Vector3(0, 0, -1).transformDirection(roomFromHead).setY(0);
  if (forward.lengthSq() < 1e-6) forward.set(0, 0, -1);
  forward.normalize();
  const turn = new Quaternion().setFromUnitVectors(new Vector3(0, 0, -1), forward);
  // Half a turn about x brings y up and the scope's line of sight to -z.
  const rotation = turn.multiply(new Quaternion(1, 0, 0, 0));
  const place = head.addScaledVector(forward, FIRST_DISTANCE_M).addScaledVector(UP, -FIRST_DROP_M);
  return new Matrix4()
    .compose(place, rotation, new Vector3(1, 1, 1))
    .multiply(new Matrix4().makeTranslation(centreInWorld.clone().negate()));
}

/** Where the model goes as one hand moves that took it at `start`. */
export function carried(placement: Matrix4, start: Matrix4, hand: Matrix4): Matrix4 {
  return hand.clone().multiply(start.clone().invert()).multiply(placement);
}

/** The places of two hands. */
export interface Hands {
  readonly first: Vector3;
  readonly second: Vector3;
}

/** Where the model goes as two hands move: it turns and grows with the line between them. */
export function stretched(placement: Matrix4, start: Hands, hands: Hands): Matrix4 {
  const before = start.second.clone().sub(start.first);
  const after = hands.second.clone().sub(hands.first);
  if (before.length() < 1e-3 || after.length() < 1e-3) return placement.clone();
  const scale = withinLimits(after.length() / before.length(), scaleOf(placement));
  const turn = new Quaternion().setFromUnitVectors(before.normalize(), after.normalize());
  const middleBefore = start.first.clone().add(start.second).multiplyScalar(0.5);
  const middle = hands.first.clone().add(hands.second).multiplyScalar(0.5);
  return new Matrix4()
    .compose(middle, turn, new Vector3(scale, scale, scale))
    .multiply(new Matrix4().makeTranslation(middleBefore.negate()))
    .multiply(placement);
}

/** The scale of a placement; 1 is life size. */
export function scaleOf(placement: Matrix4): number {
  return new Vector3().setFromMatrixColumn(placement, 0).length();
}

function withinLimits(factor: number, scale: number): number {
  return Math.min(Math.max(scale * factor, SCALE_MIN), SCALE_MAX) / scale;
}

/** Touched points closer than this, or closer to one line than this angle, say too little about a direction. */
const POINTS_APART_M = 0.03;
const POINTS_ANGLE_RAD = 0.15;

/**
 * The frame of three points that were touched in order: the first is its origin, the second lies on its x axis, the
 * third in its x-y plane. Two headsets whose wearers touch the same points have one frame. Undefined where the
 * points are too close together or on a line.
 */
export function roomFromMarker(origin: Vector3, onX: Vector3, inPlane: Vector3): Matrix4 | undefined {
  const x = onX.clone().sub(origin);
  const side = inPlane.clone().sub(origin);
  if (x.length() < POINTS_APART_M || side.length() < POINTS_APART_M) return undefined;
  const angle = x.angleTo(side);
  if (angle < POINTS_ANGLE_RAD || angle > Math.PI - POINTS_ANGLE_RAD) return undefined;
  x.normalize();
  const z = x.clone().cross(side).normalize();
  const y = z.clone().cross(x);
  return new Matrix4().makeBasis(x, y, z).setPosition(origin);
}
