const WINDOW_MS = 2000;

/** Events and amounts per second over the last two seconds, from times in milliseconds that never decrease. */
export class RateMeter {
  private samples: { timeMs: number; amount: number }[] = [];

  add(nowMs: number, amount = 1): void {
    this.samples.push({ timeMs: nowMs, amount });
    this.forget(nowMs);
  }

  /** Events per second. */
  eventsPerS(nowMs: number): number {
    this.forget(nowMs);
    return (this.samples.length * 1000) / WINDOW_MS;
  }

  /** Amount per second. */
  amountPerS(nowMs: number): number {
    this.forget(nowMs);
    return (this.samples.reduce((sum, sample) => sum + sample.amount, 0) * 1000) / WINDOW_MS;
  }

  private forget(nowMs: number): void {
    const firstKept = this.samples.findIndex((sample) => sample.timeMs > nowMs - WINDOW_MS);
    this.samples = firstKept < 0 ? [] : this.samples.slice(firstKept);
  }
}
