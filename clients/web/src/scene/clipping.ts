import type { Matrix4 } from 'three';
import type { Bounds } from './bounds';
import type { Plane, Point } from './picking';

/** What the clipping plane is perpendicular to: the line of sight when it was chosen, or an axis of the world. */
export const CLIP_DIRECTIONS = ['view', 'x', 'y', 'z'] as const;
export type ClipDirection = (typeof CLIP_DIRECTIONS)[number];

const AXES: Readonly<Record<Exclude<ClipDirection, 'view'>, Point>> = {
  x: [1, 0, 0],
  y: [0, 1, 0],
  z: [0, 0, 1],
};

/** The bounds leave out stray surfels (bounds.ts); the plane's way does not. */
const WAY_FACTOR = 1.3;

/** Unit vector of a direction; `lineOfSight` is where the viewer looks, in world. */
export function clipNormal(direction: ClipDirection, lineOfSight: Point): Point {
  return direction === 'view' ? lineOfSight : AXES[direction];
}

/** The plane that cuts away the first `share` (0 to 1) of the model along the unit vector. */
export function clipPlane(normal: Point, share: number, bounds: Bounds): Plane {
  const [x, y, z] = bounds.centre;
  const middle = normal[0] * x + normal[1] * y + normal[2] * z;
  const cutAt = middle + WAY_FACTOR * (2 * share - 1) * bounds.radiusM;
  return [...normal, -cutAt];
}

/** Where a camera looks, in world; its matrix is in three.js's axes (y up, z backward) and looks along -z. */
export function lineOfSight({ elements }: Matrix4): Point {
  const [x = 0, y = 0, z = 1] = elements.slice(8, 11);
  return [-x, y, z];
}
