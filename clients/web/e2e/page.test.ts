/** The page in a headless Chromium against the fake server: what people see when all is well and when not. */
import assert from 'node:assert/strict';
import { after, afterEach, before, beforeEach, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import type { PageStatus } from '../src/page_status';
import { launchChromium } from './chromium.mjs';
import { FakeServer } from './fake_server';
import { notBlank } from './screenshot.mjs';
import { untilOn } from './until';
import { openWatched } from './watched_page';

let browser: Browser;
let server: FakeServer;
let page: Page;
let consoleErrors: string[];

before(async () => {
  browser = await launchChromium();
});
after(() => browser.close());

beforeEach(async () => {
  server = await FakeServer.start({ surfels: 10_000, epochsPerS: 5 });
  ({ page, consoleErrors } = await openWatched(browser));
});
afterEach(async () => {
  await page.close();
  await server.stop();
});

async function openSession(id = server.session.id): Promise<void> {
  await page.goto(`${server.url}/#/sessions/${id}`);
}

const until = (expression: string): Promise<PageStatus> => untilOn(page, expression);

test('the list leads to a session', async () => {
  await page.goto(server.url);
  await page.getByRole('link', { name: 'phantom-1' }).click();
  const status = await until("misSlam.page === 'session' && misSlam.following");
  assert.equal(status.session, 'phantom-1');
  assert.deepEqual(consoleErrors, []);
});

test('the list shows a picture of each model, asked for once in a while', async () => {
  await page.goto(server.url);
  const picture = page.getByRole('img', { name: 'Model of session phantom-1' });
  await picture.waitFor();
  await page.waitForFunction(() => document.querySelector('img')?.naturalWidth !== 0);
  await page.waitForTimeout(3500);
  assert.equal(server.picturesServed, 1);
  assert.deepEqual(consoleErrors, []);
});

test('the place of a picture is kept while there is none', async () => {
  const empty = { ...server.session.summary(), surfels: 0 };
  await page.route('**/api/sessions', (route) => route.fulfill({ json: [empty] }));
  await page.goto(server.url);
  const open = page.getByRole('link', { name: 'phantom-1' });
  const place = await open.locator('.thumbnail').boundingBox();
  assert.ok(place !== null && place.width > 80 && place.height > 60, JSON.stringify(place));
  assert.equal(server.picturesServed, 0);
  assert.deepEqual(consoleErrors, []);
});

test('a session shows its model, image and figures without errors', async () => {
  await openSession();
  const status = await until('misSlam.following && misSlam.previews > 2 && misSlam.framesDrawn > 5');
  assert.ok([9500, 10_000].includes(status.surfels), `${status.surfels} surfels`);
  assert.equal(status.state, 'live');
  assert.equal(status.tracking, 'tracked');
  assert.equal(await page.locator('main').getAttribute('data-state'), 'live');
  assert.ok(await notBlank(page));
  assert.deepEqual([status.errors, consoleErrors], [[], []]);
});

test('an empty canvas is told from one with a model', async () => {
  await openSession('nobody');
  await page.getByText('No such session').waitFor();
  assert.equal(await notBlank(page), false);
});

test('a digest that does not match is answered by a new snapshot', async () => {
  await openSession();
  await until('misSlam.following');
  await page.waitForTimeout(3500);
  server.session.model.corruptNext = true;
  const status = await until('misSlam.resyncs > 0 && misSlam.following');
  assert.match(status.errors.join(), /digest/);
  assert.equal(server.session.resyncs, 1);
});

test('the model fades while a live session is silent and comes back', async () => {
  await openSession();
  await until('misSlam.following');
  server.session.pause();
  const silent = await until('misSlam.stale && misSlam.ageMs > 2000');
  assert.equal(silent.state, 'live');
  await page.getByText('No new model data').waitFor();
  server.session.resume();
  await until('!misSlam.stale');
});

test('a lost source is said in a banner and the model is held', async () => {
  await openSession();
  await until('misSlam.following');
  server.session.loseSource();
  const status = await until("misSlam.state === 'source_lost'");
  await page.locator('.banner', { hasText: 'Source lost' }).waitFor();
  assert.ok(status.surfels > 9000);
  assert.equal(status.stale, false);
});

test('a broken connection is made again and the model seeded anew', async () => {
  await openSession();
  const before = await until('misSlam.following');
  server.breakConnections();
  await until("misSlam.connection !== 'open'");
  const after = await until(`misSlam.following && misSlam.epoch > ${before.epoch}`);
  assert.ok(after.surfels > 9000);
});

test('the view is turned and followed by keyboard', async () => {
  await openSession();
  await until('misSlam.following');
  const canvas = page.locator('.stage canvas');
  await canvas.focus();
  await page.keyboard.press('c');
  const follow = page.getByRole('button', { name: 'Follow scope' });
  assert.equal(await follow.getAttribute('aria-pressed'), 'true');
  await page.keyboard.press('ArrowLeft');
  assert.equal(await follow.getAttribute('aria-pressed'), 'false');
});

test('a narrow screen needs no sideways scrolling', async () => {
  await page.setViewportSize({ width: 400, height: 800 });
  await openSession();
  await until('misSlam.following');
  const overflow = await page.evaluate('document.documentElement.scrollWidth - window.innerWidth');
  assert.equal(overflow, 0);
  assert.ok(await notBlank(page));
});
