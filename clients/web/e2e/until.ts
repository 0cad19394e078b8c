import type { Page } from 'playwright-core';
import type { PageStatus } from '../src/page_status';

/** Generous: two cores may have to draw, serve and build at once. */
export const TIMEOUT_MS = 60_000;

/**
 * Waits until a JavaScript expression over `misSlam` holds. Asked from outside again and again, because the
 * content security policy lets nothing inside the page evaluate text.
 */
export async function untilOn(page: Page, expression: string): Promise<PageStatus> {
  const endMs = Date.now() + TIMEOUT_MS;
  while (Date.now() < endMs) {
    if (await page.evaluate(expression)) return page.evaluate('misSlam');
    await page.waitForTimeout(50);
  }
  throw new Error(`${expression} did not come true; ${JSON.stringify(await page.evaluate('misSlam'))}`);
}

/** Waits until something holds on this side, such as what the fake server was told. */
export async function untilHere(page: Page, holds: () => boolean): Promise<void> {
  const endMs = Date.now() + TIMEOUT_MS;
  while (!holds()) {
    if (Date.now() > endMs) throw new Error(`${holds} did not come true`);
    await page.waitForTimeout(20);
  }
}
