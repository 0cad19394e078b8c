import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Backoff } from '../src/stream/backoff';
import { DataAge, isStale } from '../src/stream/data_age';
import { RateMeter } from '../src/stream/rate_meter';

test('data go stale after half a second of silence while the session is live, and only then', () => {
  assert.equal(isStale('live', 500, false), false);
  assert.equal(isStale('live', 501, false), true);
  assert.equal(isStale('degraded', 501, false), true);
  assert.equal(isStale('source_lost', 60_000, false), false);
  assert.equal(isStale('live', null, false), false);
  assert.equal(isStale('live', 60_000, true), false);
});

test('the age counts what the data had when they came', () => {
  const shown = new DataAge();
  assert.equal(shown.ageMs(0), null);
  shown.heard(1000);
  shown.serverSays(1100, 340);
  assert.equal(shown.ageMs(1100), 340);
  assert.equal(shown.silenceMs(1100), 100);
  shown.heard(1200);
  assert.equal(shown.ageMs(1250), 290);
});

test('an age that the server says of newer data does not make those shown younger', () => {
  const shown = new DataAge();
  shown.heard(1000);
  shown.serverSays(1500, 20);
  assert.equal(shown.ageMs(1500), 500);
});

test('rates cover the last two seconds', () => {
  const meter = new RateMeter();
  for (let ms = 0; ms < 4000; ms += 100) meter.add(ms, 50);
  assert.equal(meter.eventsPerS(3900), 10);
  assert.equal(meter.amountPerS(3900), 500);
  assert.equal(meter.eventsPerS(10_000), 0);
});

test('attempts to connect become rarer up to a limit, and start anew once data came', () => {
  const backoff = new Backoff(() => 0);
  const delays = Array.from({ length: 8 }, () => backoff.nextDelayMs());
  assert.deepEqual(delays, [250, 500, 1000, 2000, 4000, 8000, 8000, 8000]);
  backoff.reset();
  assert.equal(backoff.nextDelayMs(), 250);
});
