import { surfacePath } from '../model/surface_path';
import type { SurfelStore } from '../model/surfel_store';
import type { Point } from '../scene/picking';
import { Anchor } from './anchor';

/** A length with its standard uncertainty, both in metres. */
export interface Length {
  readonly valueM: number;
  readonly uncertaintyM: number;
}

/** What a measurement says now. */
export interface Reading {
  readonly straight: Length;
  /** Over the surface; undefined where no way leads over it, for example across a gap. */
  readonly surface: Length | undefined;
  /** The way over the surface, or the straight line. */
  readonly line: readonly Point[];
  /** Both ends still lie on tissue that the model holds. */
  readonly held: boolean;
}

/** The graph's ways over the surface are longer than the surface's by about this share. */
const GRAPH_EXCESS = 0.02;
/** Rounding of positions in the packed records: 0.02 mm steps on three axes. */
const ROUNDING_M = 2e-5 / Math.sqrt(12);

/** The distance between two places on the tissue, which follow it. */
export class Measurement {
  private surfaceM: number | undefined;
  private way: readonly Point[] = [];
  private tracedAtEpoch = -1;
  readonly ends: readonly [Anchor, Anchor];

  constructor(
    private readonly store: SurfelStore,
    fromSurfel: number,
    toSurfel: number,
  ) {
    this.ends = [new Anchor(store, fromSurfel), new Anchor(store, toSurfel)];
  }

  /**
   * The reading at `epoch`. `modelErrorM` bounds how far a surfel shown may be from the server's. The way over
   * the surface is traced again where the epoch is another one.
   */
  read(epoch: number, modelErrorM: number): Reading {
    const [from, to] = this.ends;
    const slots = [from.follow(), to.follow()] as const;
    const held = slots[0] !== undefined && slots[1] !== undefined;
    if (held && epoch !== this.tracedAtEpoch) this.trace(slots as readonly [number, number], epoch);
    const endErrorM = Math.SQRT2 * Math.hypot(modelErrorM, ROUNDING_M);
    const straightM = Math.hypot(
      ...([0, 1, 2] as const).map((axis) => from.position[axis] - to.position[axis]),
    );
    const straight = { valueM: straightM, uncertaintyM: endErrorM };
    const surface =
      this.surfaceM === undefined
        ? undefined
        : { valueM: this.surfaceM, uncertaintyM: Math.hypot(endErrorM, GRAPH_EXCESS * this.surfaceM) };
    const line = this.way.length > 1 ? this.way : [from.position, to.position];
    return { straight, surface, line, held };
  }

  private trace([from, to]: readonly [number, number], epoch: number): void {
    this.tracedAtEpoch = epoch;
    const path = surfacePath(this.store, from, to);
    this.surfaceM = path?.lengthM;
    this.way = path?.points ?? [];
  }
}

/** `23.4 ± 0.3 mm`. */
export function lengthText({ valueM, uncertaintyM }: Length): string {
  const digits = uncertaintyM < 0.00095 ? 2 : 1;
  return `${(valueM * 1000).toFixed(Math.min(digits, 2))} ± ${(uncertaintyM * 1000).toFixed(digits)} mm`;
}
