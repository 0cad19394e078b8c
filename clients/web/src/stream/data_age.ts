/** Silence of a lane after which what it brought counts as stale, in milliseconds (design: 0.5 s). */
export const STALE_AFTER_MS = 500;

/**
 * Age of what a lane last brought. Times are milliseconds of this page's clock; the clocks of server and
 * page need not agree, because the server says ages, not times.
 */
export class DataAge {
  private heardMs: number | undefined;
  private ageWhenHeardMs = 0;

  /** Data came. `ageMs` is how old it was then, where the message says so. */
  heard(nowMs: number, ageMs = this.ageWhenHeardMs): void {
    this.heardMs = nowMs;
    this.ageWhenHeardMs = Math.max(0, ageMs);
  }

  /** The server says how old its newest data are now: what is shown is at least as old. */
  serverSays(nowMs: number, ageMs: number): void {
    if (this.heardMs !== undefined) this.ageWhenHeardMs = Math.max(0, ageMs - (nowMs - this.heardMs));
  }

  /** Time since data last came; null before the first. */
  silenceMs(nowMs: number): number | null {
    return this.heardMs === undefined ? null : nowMs - this.heardMs;
  }

  /** Age of what is shown: the silence and how old the data were when they came; null before the first. */
  ageMs(nowMs: number): number | null {
    const silence = this.silenceMs(nowMs);
    return silence === null ? null : silence + this.ageWhenHeardMs;
  }
}

/**
 * Whether the model has to be shown as stale: silence of the model lane while new data should come. A model
 * whose source is gone, or which has ended, is held as it is; its age is said in words. So is that of a replay
 * that rests: it is paused or at its end.
 */
export function isStale(status: string, silenceMs: number | null, replayRests: boolean): boolean {
  const expected = (status === 'live' || status === 'degraded') && !replayRests;
  return expected && silenceMs !== null && silenceMs > STALE_AFTER_MS;
}
