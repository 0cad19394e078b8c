const FIRST_DELAY_MS = 250;
const LONGEST_DELAY_MS = 8000;

/** Waiting times between attempts to connect: doubling up to 8 s, each shortened at random by up to a half. */
export class Backoff {
  private failures = 0;

  /** `random` returns numbers in [0, 1). */
  constructor(private readonly random: () => number = Math.random) {}

  /** The time to wait before the next attempt, in milliseconds. */
  nextDelayMs(): number {
    const full = Math.min(FIRST_DELAY_MS * 2 ** this.failures, LONGEST_DELAY_MS);
    this.failures += 1;
    return full * (1 - 0.5 * this.random());
  }

  /** To be called once data flows again. */
  reset(): void {
    this.failures = 0;
  }
}
