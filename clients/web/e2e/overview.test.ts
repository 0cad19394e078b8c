/** The overview in a headless Chromium against the fake server: recordings, finished runs, access. */
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, afterEach, before, beforeEach, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import type { PageStatus } from '../src/page_status';
import { launchChromium } from './chromium.mjs';
import { FakeServer } from './fake_server';
import { untilOn } from './until';
import { openWatched } from './watched_page';

const MCAP = Buffer.concat([Buffer.from([0x89]), Buffer.from('MCAP0\r\n'), Buffer.alloc(5000)]);

let browser: Browser;
let server: FakeServer;
let page: Page;
let consoleErrors: string[];

before(async () => {
  browser = await launchChromium();
});
after(() => browser.close());

beforeEach(async () => {
  server = await FakeServer.start({ surfels: 1000, epochsPerS: 2 });
  ({ page, consoleErrors } = await openWatched(browser));
});
afterEach(async () => {
  await page.close();
  await server.stop();
});

const until = (expression: string): Promise<PageStatus> => untilOn(page, expression);

async function open(): Promise<void> {
  await page.goto(server.url);
  await until('misSlam.sessions?.length === 1 && misSlam.finished?.length === 1');
}

function choose(name: string, buffer: Buffer): Promise<void> {
  const file = { name, mimeType: 'application/octet-stream', buffer };
  return page.getByLabel('Upload a recording').setInputFiles(file);
}

const message = () => page.locator('.uploader .message');

test('a recording is uploaded with its progress, listed and replayed', async () => {
  await open();
  let answer = () => {};
  server.files.holdUploads = new Promise((resolve) => {
    answer = resolve;
  });
  await choose('my liver.mcap', MCAP);
  await page.getByRole('progressbar', { name: 'Upload' }).waitFor();
  await page.getByText('my_liver.mcap is being checked').waitFor();
  answer();
  await until("misSlam.recordings.includes('my_liver.mcap')");
  assert.deepEqual(server.files.recordings, [{ recording: 'my_liver.mcap', bytes: MCAP.length }]);
  await page.getByText('my_liver.mcap is on the server').waitFor();
  await page.getByRole('button', { name: 'Replay my_liver.mcap' }).click();
  const status = await until("misSlam.page === 'session' && misSlam.following");
  assert.equal(status.session, 'phantom-1');
  assert.deepEqual(consoleErrors, []);
});

test('a recording is dropped, and one of the same name gets another', async () => {
  server.files.recordings.push({ recording: 'liver.mcap', bytes: 7 });
  await open();
  const data = await page.evaluateHandle(
    (bytes) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([new Uint8Array(bytes)], 'liver.mcap'));
      return transfer;
    },
    [...MCAP],
  );
  await page.locator('.uploader').dispatchEvent('drop', { dataTransfer: data });
  const { recordings } = await until('misSlam.recordings.length === 2');
  assert.deepEqual(recordings, ['liver.mcap', 'liver-2.mcap']);
});

test('why a recording is not taken is said in words', async () => {
  await open();
  await choose('notes.mcap', Buffer.from('no recording at all'));
  await page.getByText('notes.mcap is no MCAP recording').waitFor();
  assert.deepEqual(server.files.recordings, []);
  const refusals = [
    { status: 413, reason: 'oversized_message', said: /too large: at most 16384 MiB/ },
    { status: 507, reason: 'storage_full', said: /no room: at most 16384 MiB/ },
    { status: 422, reason: 'invalid_recording', said: /cannot be replayed: at most 16384 MiB/ },
  ];
  for (const { status, reason, said } of refusals) {
    server.files.refuseUploads = { status, reason, text: 'at most 16384 MiB' };
    await choose('liver.mcap', MCAP);
    await message().getByText(said).waitFor();
  }
});

test('an upload can be cancelled', async () => {
  await open();
  server.files.holdUploads = new Promise(() => {});
  await choose('liver.mcap', MCAP);
  await page.getByRole('button', { name: 'Cancel' }).click();
  await page.getByText('The upload was cancelled').waitFor();
  await page.getByLabel('Upload a recording').waitFor();
});

test('finished sessions are listed with a picture and their files', async () => {
  await open();
  const run = page.locator('[data-run]');
  await run.getByRole('img', { name: 'Model of finished session phantom-0' }).waitFor();
  const saved = page.waitForEvent('download');
  await run.getByRole('link', { name: 'Model (PLY)' }).click();
  const download = await saved;
  assert.equal(download.suggestedFilename(), 'phantom-0.1760000000000-0-model.ply');
  assert.match(await readFile(await download.path(), 'utf8'), /finished\/phantom-0.*model\.ply/);
  assert.equal(await run.getByRole('link', { name: 'Recording' }).count(), 0);
});

test('a server that wants a token gets it, for as long as the tab is open', async () => {
  server.token = 'good.token';
  await page.goto(server.url);
  const field = page.getByLabel('Access token');
  await field.fill('bad.token');
  await page.keyboard.press('Enter');
  await page.getByText('The server refuses this token: no token, or one that is not valid').waitFor();
  await field.fill(' good.token ');
  await page.getByRole('button', { name: 'Continue' }).click();
  await until('misSlam.sessions?.length === 1');
  await page.getByRole('link', { name: 'phantom-1' }).click();
  await until('misSlam.following');
  await page.reload();
  await until('misSlam.following');
  const other = await browser.newPage();
  await other.goto(server.url);
  await other.getByLabel('Access token').waitFor();
  await other.close();
});

test('a token that ends while a session is viewed is asked for again', async () => {
  await page.goto(`${server.url}/#/sessions/phantom-1`);
  await until('misSlam.following');
  server.token = 'good.token';
  server.breakConnections();
  await page.getByLabel('Access token').fill('good.token');
  await page.getByRole('button', { name: 'Continue' }).click();
  await until("misSlam.page === 'session' && misSlam.following");
});

test('the overview needs no sideways scrolling on a narrow screen', async () => {
  await page.setViewportSize({ width: 400, height: 800 });
  server.files.recordings.push({ recording: `${'a_long_name_'.repeat(8)}.mcap`, bytes: 3e9 });
  await open();
  await page.getByText('3.0 GB').waitFor();
  assert.equal(await page.evaluate('document.documentElement.scrollWidth - window.innerWidth'), 0);
});
