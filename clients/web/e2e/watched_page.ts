import type { Browser, Page } from 'playwright-core';
import { TIMEOUT_MS } from './until';

/** A page, and what it says on its console that is an error. */
export interface WatchedPage {
  readonly page: Page;
  readonly consoleErrors: string[];
}

export async function openWatched(browser: Browser): Promise<WatchedPage> {
  const page = await browser.newPage({ viewport: { width: 640, height: 480 } });
  page.setDefaultTimeout(TIMEOUT_MS);
  const consoleErrors: string[] = [];
  page.on('console', (message) => message.type() === 'error' && consoleErrors.push(message.text()));
  page.on('pageerror', (error) => consoleErrors.push(String(error)));
  return { page, consoleErrors };
}
