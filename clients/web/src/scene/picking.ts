import type { SurfelStore } from '../model/surfel_store';

export type Point = readonly [number, number, number];
/** Unit normal and offset of a plane in world; its negative side is cut away. */
export type Plane = readonly [number, number, number, number];

/** A ray in world coordinates; the direction has unit length. */
export interface Ray {
  readonly origin: Point;
  readonly direction: Point;
}

/** Discs are drawn larger than the surfel by this factor (surfel_shader.ts). */
const OVERLAP = Math.SQRT2;
/** No disc is larger; spares most surfels the decoding of their normal. */
const MAX_DISC_M = 0.01;

/** The slot of the first disc that the ray meets on the side of `clip` that is shown. */
export function pickSurfel(store: SurfelStore, ray: Ray, clip?: Plane): number | undefined {
  let nearest: number | undefined;
  let nearestM = Number.POSITIVE_INFINITY;
  for (let slot = 0; slot < store.size; slot++) {
    const centre = store.position(slot);
    const toCentre = minus(centre, ray.origin);
    const along = dot(toCentre, ray.direction);
    if (along <= 0 || along - MAX_DISC_M > nearestM) continue;
    if (dot(toCentre, toCentre) - along * along > MAX_DISC_M ** 2) continue;
    if (clip !== undefined && signedDistance(clip, centre) < 0) continue;
    const hitM = meetsDisc(store, slot, ray);
    if (hitM === undefined || hitM >= nearestM) continue;
    nearestM = hitM;
    nearest = slot;
  }
  return nearest;
}

/** Distance along the ray to the disc in `slot`, or undefined where the ray misses it. */
function meetsDisc(store: SurfelStore, slot: number, ray: Ray): number | undefined {
  const positionM = store.position(slot);
  const normal = store.normal(slot);
  const radiusM = store.radiusM(slot);
  const facing = dot(normal, ray.direction);
  if (Math.abs(facing) < 1e-3) return undefined;
  const alongM = dot(minus(positionM, ray.origin), normal) / facing;
  const { origin, direction } = ray;
  const hit: Point = [
    origin[0] + alongM * direction[0],
    origin[1] + alongM * direction[1],
    origin[2] + alongM * direction[2],
  ];
  return alongM > 0 && lengthOf(minus(hit, positionM)) <= OVERLAP * radiusM ? alongM : undefined;
}

export function signedDistance(plane: Plane, point: Point): number {
  return plane[0] * point[0] + plane[1] * point[1] + plane[2] * point[2] + plane[3];
}

export function minus(a: Point, b: Point): Point {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

export function dot(a: Point, b: Point): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function lengthOf(vector: Point): number {
  return Math.hypot(...vector);
}
