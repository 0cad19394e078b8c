import type { Matrix4 } from 'three';
import type { SurfelStore } from '../model/surfel_store';
import type { Coloring, ValueRange } from './coloring';

const SAMPLES = 3000;
/** A few outliers must not take the contrast from all others. */
const TAIL = 0.02;
const LEAST_DEFORMATION_M = 1e-3;
const LEAST_AGE_EPOCHS = 10;

/** What the values of a colouring depend on beside the surfels. */
export interface Viewpoint {
  readonly epoch: number;
  readonly scopeFromWorld: Matrix4;
}

/** The range of values that the colour map has to cover now, from an even sample of the surfels. */
export function valueRangeOf(coloring: Coloring, store: SurfelStore, viewpoint: Viewpoint): ValueRange {
  switch (coloring) {
    case 'depth':
      return spread(sample(store, (slot) => depthM(store, slot, viewpoint.scopeFromWorld)));
    case 'age': {
      const ages = sample(store, (slot) => viewpoint.epoch - (store.versionWords[slot] ?? 0));
      return { low: 0, high: Math.max(spread(ages).high, LEAST_AGE_EPOCHS) };
    }
    case 'deformation': {
      const moved = sample(store, (slot) => movedM(store, slot));
      return { low: 0, high: Math.max(spread(moved).high, LEAST_DEFORMATION_M) };
    }
    default:
      return { low: 0, high: 1 };
  }
}

/** How far the surfel in `slot` is from where it was when it came, in metres. */
export function movedM(store: SurfelStore, slot: number): number {
  const [x, y, z] = store.position(slot);
  const [x0 = x, y0 = y, z0 = z] = store.originsM.subarray(slot * 3, slot * 3 + 3);
  return Math.hypot(x - x0, y - y0, z - z0);
}

function depthM(store: SurfelStore, slot: number, { elements }: Matrix4): number {
  const [x, y, z] = store.position(slot);
  const row = (column: number) => elements[4 * column + 2] ?? 0;
  return row(0) * x + row(1) * y + row(2) * z + row(3);
}

function sample(store: SurfelStore, figureOf: (slot: number) => number): number[] {
  const step = Math.max(1, Math.floor(store.size / SAMPLES));
  const values: number[] = [];
  for (let slot = 0; slot < store.size; slot += step) values.push(figureOf(slot));
  return values.sort((a, b) => a - b);
}

function spread(sorted: readonly number[]): ValueRange {
  const at = (share: number) => sorted[Math.round(share * (sorted.length - 1))] ?? 0;
  return { low: at(TAIL), high: at(1 - TAIL) };
}
