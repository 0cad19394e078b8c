import type { SurfelStore } from '../model/surfel_store';

/** A sphere in world coordinates, metres. */
export interface Bounds {
  readonly centre: readonly [number, number, number];
  readonly radiusM: number;
}

const SAMPLES = 4000;
/** Share of the surfels inside the sphere: a few stray ones must not make the organ small on the screen. */
const INSIDE = 0.97;

/** A sphere around nearly all surfels, from an even sample of them; undefined for the empty model. */
export function modelBounds(store: SurfelStore): Bounds | undefined {
  if (store.size === 0) return undefined;
  const step = Math.max(1, Math.floor(store.size / SAMPLES));
  const points: [number, number, number][] = [];
  for (let slot = 0; slot < store.size; slot += step) points.push(store.position(slot));
  const middleOf = (axis: 0 | 1 | 2) => {
    const sorted = points.map((point) => point[axis]).sort((a, b) => a - b);
    return (quantile(sorted, 1 - INSIDE) + quantile(sorted, INSIDE)) / 2;
  };
  const centre: [number, number, number] = [middleOf(0), middleOf(1), middleOf(2)];
  const distances = points
    .map((p) => Math.hypot(p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]))
    .sort((a, b) => a - b);
  return { centre, radiusM: Math.max(quantile(distances, INSIDE), 1e-4) };
}

/** The scope joins the view where it makes the sphere larger by this factor at most. */
const SCOPE_MAX_GROWTH = 1.6;

/** The smallest sphere around a sphere and a point, or the sphere itself where the point is too far off. */
export function boundsWithScope(bounds: Bounds, scope: readonly [number, number, number]): Bounds {
  const [x, y, z] = bounds.centre;
  const offset = [scope[0] - x, scope[1] - y, scope[2] - z] as const;
  const distanceM = Math.hypot(...offset);
  const radiusM = (distanceM + bounds.radiusM) / 2;
  if (distanceM <= bounds.radiusM || radiusM > SCOPE_MAX_GROWTH * bounds.radiusM) return bounds;
  const share = (radiusM - bounds.radiusM) / distanceM;
  return { centre: [x + share * offset[0], y + share * offset[1], z + share * offset[2]], radiusM };
}

/** Whether a sphere sticks out of another one by more than a tenth of that one's radius. */
export function outgrows(bounds: Bounds, fitted: Bounds): boolean {
  const offset = bounds.centre.map((value, axis) => value - (fitted.centre[axis] ?? 0));
  return Math.hypot(...offset) + bounds.radiusM > 1.1 * fitted.radiusM;
}

function quantile(sorted: readonly number[], share: number): number {
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] ?? 0;
}
