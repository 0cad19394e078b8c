import { create } from '@bufbuild/protobuf';
import { type View, ViewSchema } from '../generated/mis_slam/v1/control_pb';

/** What a stand-alone headset draws at its display's rate. */
const HEADSET_SURFELS_MAX = 150_000;
/** The server thins the model anew for another gaze, so a glance aside is not told. */
const GAZE_INTERVAL_MS = 3000;
const GAZE_MOVED_M = 0.03;

/** A place in world coordinates. */
interface Place {
  readonly x: number;
  readonly y: number;
  readonly z: number;
}

/** What a page is to be sent. */
export interface WishesOf {
  readonly features: boolean;
  /** As the person at the page chose; 0: all. */
  readonly maxSurfels: number;
  readonly inHeadset: boolean;
  /** What the wearer of the headset looks at. */
  readonly gaze: Place | undefined;
}

/** The message that says it. */
export function viewMessage({ features, maxSurfels, inHeadset, gaze }: WishesOf): View {
  const chosen = maxSurfels === 0 ? Number.POSITIVE_INFINITY : maxSurfels;
  const most = inHeadset ? Math.min(chosen, HEADSET_SURFELS_MAX) : chosen;
  const place = gaze && { gazeInWorld: { xM: gaze.x, yM: gaze.y, zM: gaze.z } };
  return create(ViewSchema, { features, maxSurfels: Number.isFinite(most) ? most : 0, ...place });
}

/** Tells when the gaze has gone elsewhere. */
export class GazeWatch {
  private toldMs = Number.NEGATIVE_INFINITY;
  private told: Place | undefined;

  /** Whether this gaze is to be told; it then counts as told. */
  hasMoved(gaze: Place | undefined, nowMs: number): boolean {
    if (gaze === undefined || nowMs - this.toldMs < GAZE_INTERVAL_MS) return false;
    const { told } = this;
    const movedM = told && Math.hypot(gaze.x - told.x, gaze.y - told.y, gaze.z - told.z);
    if (movedM !== undefined && movedM < GAZE_MOVED_M) return false;
    [this.told, this.toldMs] = [gaze, nowMs];
    return true;
  }
}
