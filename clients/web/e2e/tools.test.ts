/** The tools of a session's page in a headless Chromium against the fake server. */
import assert from 'node:assert/strict';
import { after, before, beforeEach, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import type { PageStatus } from '../src/page_status';
import { launchChromium } from './chromium.mjs';
import { FakeServer } from './fake_server';
import { changedShare, notBlank, viewPicture } from './screenshot.mjs';
import { TIMEOUT_MS, untilOn } from './until';

let browser: Browser;
let server: FakeServer;
let page: Page;

before(async () => {
  browser = await launchChromium();
  server = await FakeServer.start({ surfels: 10_000, epochsPerS: 2 });
});
after(async () => {
  await browser.close();
  await server.stop();
});

beforeEach(async () => {
  await page?.close();
  page = await browser.newPage({ viewport: { width: 900, height: 700 } });
  page.setDefaultTimeout(TIMEOUT_MS);
  await page.goto(`${server.url}/#/sessions/${server.session.id}`);
  await until('misSlam.following && misSlam.viewRests');
});

/** What the model covers of the view, at least. */
const HIDDEN_SHARE = 0.15;

const until = (expression: string): Promise<PageStatus> => untilOn(page, expression);

/** Clicks at a place of the canvas, in shares of its size from the left and the top. */
async function clickModel(x: number, y: number): Promise<void> {
  const box = (await page.locator('.stage canvas').boundingBox()) ?? assert.fail('no canvas');
  await page.mouse.click(box.x + x * box.width, box.y + y * box.height);
}

test('two clicks measure a distance, which is listed, drawn and removed', async () => {
  await page.getByRole('button', { name: 'Measure' }).click();
  await clickModel(0.45, 0.5);
  await page.locator('.mark-dot').waitFor();
  await clickModel(0.6, 0.5);
  const status = await until('misSlam.measuredMm.length === 1');
  const [distanceMm = 0] = status.measuredMm;
  assert.ok(distanceMm > 5 && distanceMm < 80, `${distanceMm} mm`);
  await page.locator('.measurements li', { hasText: 'over the surface' }).waitFor();
  await page.locator('.mark-label', { hasText: 'mm' }).waitFor();
  await page.getByRole('button', { name: 'Remove measurement 1' }).click();
  await until('misSlam.measuredMm.length === 0');
  assert.equal(await page.locator('.mark-label:visible').count(), 0);
});

test('a drag with the measuring tool turns the view and measures nothing', async () => {
  await page.keyboard.press('m');
  assert.equal(await page.getByRole('button', { name: 'Measure' }).getAttribute('aria-pressed'), 'true');
  const box = (await page.locator('.stage canvas').boundingBox()) ?? assert.fail('no canvas');
  await page.mouse.move(box.x + 0.5 * box.width, box.y + 0.5 * box.height);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.7 * box.width, box.y + 0.5 * box.height, { steps: 4 });
  await page.mouse.up();
  assert.equal(await page.locator('.mark-dot').count(), 0);
});

test('places are taken by keyboard at the middle of the view, and Escape puts the tool down', async () => {
  await page.keyboard.press('m');
  await page.locator('.stage canvas').focus();
  await page.keyboard.press('Enter');
  await page.locator('.mark-dot').waitFor();
  await page.keyboard.press('Escape');
  assert.equal(await page.locator('.mark-dot').count(), 0);
  assert.equal(await page.getByRole('button', { name: 'Measure' }).getAttribute('aria-pressed'), 'false');
});

test('every colouring shows the model, those by a figure with a legend', async () => {
  const legends: Record<string, RegExp | undefined> = {
    shape: undefined,
    normal: undefined,
    confidence: /Confidence: 0.0 – 100 %/,
    depth: /Distance from the scope: \d.* mm/,
    age: /Updates since/,
    deformation: /Moved since first seen: 0.0 – .* mm/,
    colour: undefined,
  };
  const pictures = new Set<string>();
  for (const [coloring, legend] of Object.entries(legends)) {
    await page.getByLabel('Show').selectOption(coloring);
    if (legend !== undefined) await page.locator('.legend', { hasText: legend }).waitFor();
    else assert.ok(await page.locator('.legend').isHidden());
    await page.waitForTimeout(300);
    assert.ok(await notBlank(page), coloring);
    pictures.add((await viewPicture(page)).toString('base64'));
  }
  assert.equal(pictures.size, Object.keys(legends).length);
});

test('what is cut away is neither seen nor touched', async () => {
  await page.keyboard.press('m');
  const view = page.locator('.stage canvas');
  const whole = await view.screenshot();
  await page.getByLabel('Cut away').selectOption('x');
  await page.getByLabel('Clipping depth, percent').fill('100');
  await page.waitForTimeout(300);
  assert.ok((await view.screenshot()).length < 0.8 * whole.length);
  await clickModel(0.5, 0.5);
  assert.equal(await page.locator('.mark-dot').count(), 0);
  await page.getByLabel('Cut away').selectOption('none');
  await clickModel(0.5, 0.5);
  await page.locator('.mark-dot').waitFor();
});

test('a model that is too old is hidden, which is said, and shown again', async () => {
  const withModel = await viewPicture(page);
  await page.getByLabel('Hide when older than').selectOption('2');
  server.session.pause();
  await until('misSlam.hidden');
  await page.locator('.banner', { hasText: 'hidden' }).waitFor();
  const endMs = Date.now() + TIMEOUT_MS;
  let changed = 0;
  // The frustum and the path of the scope stay.
  while (changed < HIDDEN_SHARE && Date.now() < endMs) {
    changed = await changedShare(page, withModel, await viewPicture(page));
  }
  assert.ok(changed >= HIDDEN_SHARE, `the model is still seen: ${changed} of the view changed`);
  server.session.resume();
  await until('!misSlam.hidden');
});

test('a note is written at a place, seen by another viewer, and erased', async () => {
  await page.keyboard.press('n');
  await clickModel(0.5, 0.5);
  await page.getByRole('form', { name: 'New note' }).waitFor();
  await page.getByLabel('Note', { exact: true }).fill('polyp, check');
  await page.getByLabel('Your name').fill('Ada');
  await page.getByRole('button', { name: 'Write' }).click();
  await page.locator('.mark-label.annotation', { hasText: 'polyp, check' }).waitFor();
  const other = await browser.newPage({ viewport: { width: 640, height: 480 } });
  await other.goto(page.url());
  await other.locator('.annotations li', { hasText: 'polyp, check (Ada)' }).waitFor();
  await other.getByRole('button', { name: 'Erase note: polyp, check' }).click();
  await until('misSlam.notes === 0');
  await other.close();
});

test('the view is saved as a picture', async () => {
  const [download] = await Promise.all([
    page.waitForEvent('download'),
    page.getByRole('button', { name: 'Picture' }).click(),
  ]);
  assert.match(download.suggestedFilename(), /^phantom-1-.*\.png$/);
});

test('latency and bandwidth are plotted on request', async () => {
  await page.getByText('Latency and bandwidth').click();
  await page.locator('.plots canvas').first().waitFor();
  assert.equal(await page.locator('.plots .u-title').count(), 3);
});
