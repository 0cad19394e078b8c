// Opens the page in a headless Chromium and prints what it shows, for end-to-end tests of the server.
//
//   node observe.mjs URL [--session ID] [--seconds N] [--until EXPRESSION] [--screenshot FILE] [--size WxH]
//
// Prints one JSON object a line: {"status": …} four times a second (window.misSlam, see src/page_status.ts),
// {"console": "…"} for each console error and warning, at the end {"end": "until" | "time", "not_blank": …}.
// --until is a JavaScript expression in the page, for example "misSlam.surfels > 1000 && misSlam.following":
// once it holds, the screenshot is taken and the program ends with 0; with 1 where the time (default 30 s)
// runs out before. Without --until it ends with 0 after the time. Wrong usage: 2.
import { parseArgs } from 'node:util';
import { launchChromium } from './chromium.mjs';
import { notBlank } from './screenshot.mjs';

const INTERVAL_MS = 250;

/** @param {unknown} value */
function print(value) {
  process.stdout.write(`${JSON.stringify(value)}\n`);
}

function options() {
  const { values, positionals } = parseArgs({
    allowPositionals: true,
    options: {
      session: { type: 'string' },
      seconds: { type: 'string', default: '30' },
      until: { type: 'string' },
      screenshot: { type: 'string' },
      size: { type: 'string', default: '1280x800' },
    },
  });
  const [width, height] = (values.size ?? '').split('x').map(Number);
  const [url] = positionals;
  if (url === undefined || positionals.length > 1) throw new Error('exactly one URL is needed');
  if (!(width && height && Number(values.seconds) > 0)) throw new Error('--size or --seconds is no number');
  const address = new URL(values.session === undefined ? '#/' : `#/sessions/${values.session}`, url);
  return { ...values, seconds: Number(values.seconds), address: address.href, viewport: { width, height } };
}

/**
 * Prints the status until the condition holds or the time is over.
 * @param {import('playwright-core').Page} page
 * @param {{ seconds: number, until?: string | undefined }} given
 * @returns {Promise<'until' | 'time'>}
 */
async function watch(page, { seconds, until }) {
  const endMs = Date.now() + seconds * 1000;
  while (Date.now() < endMs) {
    const holds = until !== undefined && (await page.evaluate(until));
    print({ status: await page.evaluate('window.misSlam') });
    if (holds) return 'until';
    await page.waitForTimeout(INTERVAL_MS);
  }
  return 'time';
}

/** Advice of some graphics drivers about the reading back of pictures, which is what taking one does. */
const DRIVER_ADVICE = 'GL Driver Message (OpenGL, Performance';

/** @param {import('playwright-core').ConsoleMessage} message */
function isComplaint(message) {
  return ['error', 'warning'].includes(message.type()) && !message.text().includes(DRIVER_ADVICE);
}

/** @param {ReturnType<typeof options>} given */
async function observe(given) {
  const browser = await launchChromium();
  try {
    const page = await browser.newPage({ viewport: given.viewport });
    page.on('console', (message) => {
      if (isComplaint(message)) print({ console: message.text() });
    });
    page.on('pageerror', (error) => print({ console: String(error) }));
    // A held model is looked at however long a loaded machine takes to show it.
    await page.addInitScript("localStorage.setItem('mis-slam.hide-after-s', '0')");
    await page.goto(given.address);
    const end = await watch(page, given);
    if (given.screenshot !== undefined) await page.screenshot({ path: given.screenshot });
    print({ end, not_blank: await notBlank(page) });
    return given.until !== undefined && end === 'time' ? 1 : 0;
  } finally {
    await browser.close();
  }
}

try {
  process.exitCode = await observe(options());
} catch (error) {
  console.error(error instanceof Error ? error.message : error);
  process.exitCode = 2;
}
