import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Refused, whyFailed, withToken } from '../src/server/access';
import { isMcap, recordingName, whyNotUploaded } from '../src/server/recordings';
import { bytes, clock, sessionWording, viewedStatusWording } from '../src/ui/wording';

test('names of files become names that the server takes and nobody has', () => {
  assert.equal(recordingName('my scan (2).MCAP', []), 'my_scan_2_.mcap');
  assert.equal(recordingName('../etc.mcap', []), '_etc.mcap');
  assert.equal(recordingName('.mcap', []), 'recording.mcap');
  assert.equal(recordingName('a.mcap', ['a.mcap', 'a-2.mcap']), 'a-3.mcap');
  assert.ok(recordingName(`${'x'.repeat(300)}.mcap`, []).length <= 128);
});

test('recordings are told by their first bytes', async () => {
  const magic = new Uint8Array([0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a]);
  assert.equal(await isMcap(new Blob([magic, 'rest'])), true);
  assert.equal(await isMcap(new Blob([magic.slice(0, 7)])), false);
  assert.equal(await isMcap(new Blob(['no recording'])), false);
});

test('refusals are said in words', () => {
  assert.equal(whyFailed(new Refused(403, 'forbidden', 'no')), 'Not allowed: no.');
  assert.equal(whyFailed(new Refused(503, 'shutting_down', 'no')), 'The server refuses: no.');
  assert.match(whyFailed(new TypeError('Failed to fetch')), /cannot be reached/);
  assert.match(whyNotUploaded(new Refused(404, 'unknown_recording', 'no')), /keeps no recordings/);
  assert.match(whyNotUploaded(new Error('the connection broke')), /the connection broke/);
});

test('without a token addresses stay as they are', () => {
  assert.equal(withToken('/api/x?y=1'), '/api/x?y=1');
});

test('a replay at rest has lost no source', () => {
  const replay = (paused: boolean, ended: boolean) => ({ paused, ended });
  assert.equal(sessionWording('source_lost', replay(false, true)).text, 'Replay ended');
  assert.equal(sessionWording('live', replay(true, false)).text, 'Replay paused');
  assert.equal(sessionWording('live', replay(false, false)).tone, 'good');
  assert.equal(sessionWording('degraded', replay(false, false)).text, 'Degraded');
  assert.equal(sessionWording('live', null).text, 'Live');
  assert.equal(viewedStatusWording('live', 'waiting', null).tone, 'bad');
});

test('sizes and times read well', () => {
  assert.deepEqual([12, 900_000, 1_500_000, 17e6, 4.2e9].map(bytes), [
    '1 kB',
    '900 kB',
    '1.5 MB',
    '17 MB',
    '4.2 GB',
  ]);
  assert.deepEqual([7.9, 754, 3723, -1].map(clock), ['0:07', '12:34', '1:02:03', '0:00']);
});
