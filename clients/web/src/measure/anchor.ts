import type { SurfelStore } from '../model/surfel_store';
import type { Point } from '../scene/picking';

/** A surfel that vanished is replaced by the nearest one within this distance. */
const REBIND_WITHIN_M = 0.002;

/** A place on the tissue: it is bound to a surfel and moves with it. */
export class Anchor {
  private positionM: Point;

  /** `lastSeen` is where the surfel was, for where it is not held (any more). */
  constructor(
    private readonly store: SurfelStore,
    private surfel: number,
    lastSeen: Point = [0, 0, 0],
  ) {
    const slot = store.slot(surfel);
    this.positionM = slot === undefined ? lastSeen : store.position(slot);
  }

  /** The surfel that it is bound to. */
  get surfelId(): number {
    return this.surfel;
  }

  /** Where it is now, or was last. */
  get position(): Point {
    return this.positionM;
  }

  /** Follows the surfel, or the nearest one where it is gone; undefined where none is near. */
  follow(): number | undefined {
    const slot = this.store.slot(this.surfel) ?? this.nearestSlot();
    if (slot === undefined) return undefined;
    this.surfel = this.store.id(slot);
    this.positionM = this.store.position(slot);
    return slot;
  }

  private nearestSlot(): number | undefined {
    let nearest: number | undefined;
    let nearestM = REBIND_WITHIN_M;
    for (let slot = 0; slot < this.store.size; slot++) {
      const [x, y, z] = this.store.position(slot);
      const distanceM = Math.hypot(x - this.positionM[0], y - this.positionM[1], z - this.positionM[2]);
      if (distanceM >= nearestM) continue;
      nearestM = distanceM;
      nearest = slot;
    }
    return nearest;
  }
}
