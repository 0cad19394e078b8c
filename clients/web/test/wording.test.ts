import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Refused } from '../src/server/access';
import { parseSessions } from '../src/server/sessions';
import { messageFor, type Situation } from '../src/session/banner';
import { age, bitRate, count } from '../src/ui/wording';

const ALL_WELL: Situation = {
  connection: 'open',
  refused: undefined,
  replay: null,
  status: 'live',
  statusText: '',
  tracking: 'tracked',
  notice: '',
  silenceMs: 30,
  ageMs: 60,
  surfels: 1000,
  hidden: false,
};

const GONE = new Refused(404, 'unknown_session', 'no session');

test('nothing is said while all is well', () => {
  assert.equal(messageFor(ALL_WELL), undefined);
});

test('the most important of several troubles is said', () => {
  const lost: Situation = { ...ALL_WELL, status: 'source_lost', tracking: 'lost', ageMs: 12_000 };
  assert.deepEqual(messageFor(lost), {
    title: 'Source lost',
    detail: 'The model shown is 12 s old.',
    tone: 'bad',
  });
  assert.equal(messageFor({ ...lost, connection: 'waiting' })?.title, 'Connection lost');
  assert.equal(messageFor({ ...lost, surfels: 0, refused: GONE })?.title, 'No such session');
  assert.equal(messageFor({ ...lost, surfels: 1000, refused: GONE })?.title, 'Session ended');
  assert.equal(messageFor({ ...lost, status: 'live' })?.title, 'Tracking lost');
});

test('numbers read well', () => {
  assert.deepEqual(
    [age(null), age(70), age(994), age(3210), age(14_400), age(180_000)],
    ['–', '0.07 s', '0.99 s', '3.2 s', '14 s', '3 min'],
  );
  assert.equal(count(1234567).replaceAll('\u202f', ' '), '1 234 567');
  assert.deepEqual([bitRate(640_000), bitRate(12_400_000)], ['640 kbit/s', '12.4 Mbit/s']);
});

test('sessions are sorted, and fields that an older server does not send are left out', () => {
  const sessions = parseSessions([{ session: 'b', status: 'live', surfels: 3 }, { session: 'a' }]);
  assert.deepEqual(
    sessions.map((session) => [session.session, session.status, session.surfels]),
    [
      ['a', '', 0],
      ['b', 'live', 3],
    ],
  );
  assert.throws(() => parseSessions({ error: 'no' }), /something else than a list/);
});
