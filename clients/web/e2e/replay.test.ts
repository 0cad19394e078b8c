/** The page of a session that replays a recording, in a headless Chromium against the fake server. */
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, before, beforeEach, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import type { PageStatus } from '../src/page_status';
import { launchChromium } from './chromium.mjs';
import { FakeServer } from './fake_server';
import { TIMEOUT_MS, untilHere, untilOn } from './until';

let browser: Browser;
let server: FakeServer;
let page: Page;

before(async () => {
  browser = await launchChromium();
});
after(async () => {
  await browser.close();
  await server?.stop();
});

beforeEach(async () => {
  await page?.close();
  await server?.stop();
  server = await FakeServer.start({ surfels: 2000, epochsPerS: 2, replay: true });
  page = await browser.newPage({ viewport: { width: 900, height: 700 } });
  page.setDefaultTimeout(TIMEOUT_MS);
  await page.goto(`${server.url}/#/sessions/${server.session.id}`);
  await until('misSlam.following && misSlam.viewRests');
});

const until = (expression: string): Promise<PageStatus> => untilOn(page, expression);
const slider = () => page.getByRole('slider', { name: 'Time in the recording' });

test('a replay is paused and goes on, and while it rests nothing is called stale', async () => {
  await page.getByRole('button', { name: 'Pause' }).click();
  await until('misSlam.replay.paused');
  await page.locator('.heading .pill', { hasText: 'Replay paused' }).waitFor();
  const paused = await until('misSlam.ageMs > 4000');
  assert.deepEqual([paused.stale, paused.hidden], [false, false]);
  assert.equal(await page.locator('.banner:visible').count(), 0);
  await page.keyboard.press('k');
  await until(`!misSlam.replay.paused && misSlam.epoch > ${paused.epoch}`);
});

test('the slider moves the replay by keyboard, and measurements of the last world go', async () => {
  await page.getByRole('button', { name: 'Measure' }).click();
  const box = (await page.locator('.stage canvas').boundingBox()) ?? assert.fail('no canvas');
  for (const x of [0.45, 0.6]) await page.mouse.click(box.x + x * box.width, box.y + 0.5 * box.height);
  await until('misSlam.measuredMm.length === 1');
  await slider().focus();
  await page.keyboard.press('End');
  const moved = await until('misSlam.replay.positionS > 55');
  assert.equal(moved.replay?.durationS, 60);
  assert.match((await slider().getAttribute('aria-valuetext')) ?? '', /of 1:00$/);
  await until('misSlam.measuredMm.length === 0');
  await page.getByRole('button', { name: 'Again' }).waitFor();
  await page.locator('.heading .pill', { hasText: 'Replay ended' }).waitFor();
  await page.keyboard.press('k');
  await until('misSlam.replay.positionS < 50 && !misSlam.replay.ended');
});

test('the rate is chosen from a list', async () => {
  await page.getByLabel('Rate of the replay').selectOption({ label: '4×' });
  await until('misSlam.replay.rate === 4');
  await page.getByLabel('Rate of the replay').selectOption({ label: 'Fastest' });
  await until('misSlam.replay.rate === 0');
});

test('what the server refuses is said in the timeline', async () => {
  await page.route('**/replay', (route) =>
    route.fulfill({ status: 403, json: { reason: 'forbidden', text: 'the token allows "view"' } }),
  );
  await page.getByRole('button', { name: 'Pause' }).click();
  await page.getByText('Not allowed: the token allows "view".').waitFor();
});

test('features are asked for, drawn on the image, and not sent any more', async () => {
  await page.getByRole('button', { name: 'Features' }).click();
  await until('misSlam.features > 60');
  await page.getByRole('button', { name: 'Features' }).click();
  await until('misSlam.features === 0');
});

test('the model as it is now is saved', async () => {
  const saved = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Model (PLY)' }).click();
  const download = await saved;
  assert.match(download.suggestedFilename(), /^phantom-1-.*-model\.ply$/);
  assert.equal(await readFile(await download.path(), 'utf8'), 'ply\n');
  await page.getByRole('button', { name: 'Trajectory (TUM)' }).click();
  await page.getByText('The server refuses: no such session.').waitFor();
});

test('the files of a session that has ended are those that it left', async () => {
  const [left] = server.files.finished;
  assert.ok(left);
  server.files.finished.unshift({ ...left, run: 'phantom-1.1-0', session: 'phantom-1' });
  await page.route('**/api/sessions/phantom-1', (route) =>
    route.fulfill({ status: 404, json: { reason: 'unknown_session', text: 'no session' } }),
  );
  server.breakConnections();
  const link = page.locator('.files').getByRole('link', { name: 'Trajectory (TUM)' });
  assert.equal(await link.getAttribute('download'), 'phantom-1.1-0-trajectory.tum');
});

test('a device that can hold few surfels asks for no more', async () => {
  await page.getByLabel('Surfels at most').selectOption('30000');
  await untilHere(page, () => server.session.wishes?.maxSurfels === 30_000);
  await page.reload();
  await until('misSlam.following');
  assert.equal(await page.getByLabel('Surfels at most').inputValue(), '30000');
});
