/** The program that the server's end-to-end tests start. */
import assert from 'node:assert/strict';
import { execFile } from 'node:child_process';
import { mkdtemp, readFile, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import type { PageStatus } from '../src/page_status';
import { FakeServer } from './fake_server';

let server: FakeServer;
before(async () => {
  server = await FakeServer.start({ surfels: 2500, epochsPerS: 5 });
});
after(() => server.stop());

interface Outcome {
  readonly code: number;
  readonly lines: readonly { status?: PageStatus; console?: string; end?: string; not_blank?: boolean }[];
}

function observe(...args: string[]): Promise<Outcome> {
  return new Promise((resolve) => {
    execFile(process.execPath, ['e2e/observe.mjs', ...args], (error, stdout) => {
      const lines = stdout.split('\n').filter((line) => line !== '');
      resolve({ code: Number(error?.code ?? 0), lines: lines.map((line) => JSON.parse(line)) });
    });
  });
}

test('a session is observed until a condition holds, and pictured', async () => {
  const folder = await mkdtemp(join(tmpdir(), 'mis-slam-web-'));
  try {
    const picture = join(folder, 'page.png');
    const until = 'misSlam.following && misSlam.framesDrawn > 5';
    const args = ['--session', 'phantom-1', '--seconds', '60', '--until', until, '--screenshot', picture];
    const { code, lines } = await observe(server.url, ...args);
    assert.equal(code, 0);
    assert.ok(lines.some(({ status }) => status !== undefined && status.surfels >= 2000));
    assert.deepEqual(
      lines.filter((line) => line.console !== undefined),
      [],
    );
    assert.deepEqual(lines.at(-1), { end: 'until', not_blank: true });
    assert.deepEqual([...(await readFile(picture)).subarray(1, 4)], [...Buffer.from('PNG')]);
  } finally {
    await rm(folder, { recursive: true });
  }
});

test('a condition that does not come true ends with 1', async () => {
  const { code, lines } = await observe(server.url, '--seconds', '1', '--until', 'misSlam.surfels > 1e9');
  assert.equal(code, 1);
  assert.deepEqual(lines.at(-1), { end: 'time', not_blank: false });
});

test('wrong usage ends with 2', async () => {
  assert.equal((await observe()).code, 2);
  assert.equal((await observe(server.url, '--colour', 'red')).code, 2);
});
