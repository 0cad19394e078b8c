/** Numbers and states as people read them. */
import { STALE_AFTER_MS } from '../stream/data_age';

/** How a state is coloured. */
export type Tone = 'good' | 'warning' | 'bad' | 'quiet';

interface Wording {
  readonly text: string;
  readonly tone: Tone;
}

const STATUS: Readonly<Record<string, Wording>> = {
  waiting: { text: 'Waiting for video', tone: 'quiet' },
  live: { text: 'Live', tone: 'good' },
  degraded: { text: 'Degraded', tone: 'warning' },
  source_lost: { text: 'Source lost', tone: 'bad' },
  closed: { text: 'Closed', tone: 'quiet' },
  recovering: { text: 'Recovering', tone: 'warning' },
};

const TRACKING: Readonly<Record<string, Wording>> = {
  not_initialized: { text: 'Starting', tone: 'quiet' },
  tracked: { text: 'Tracking', tone: 'good' },
  recovered: { text: 'Tracking (recovered)', tone: 'good' },
  lost: { text: 'Tracking lost', tone: 'bad' },
};

const UNKNOWN: Wording = { text: 'Unknown', tone: 'quiet' };

/** Wording of a session status by its name on the wire, such as `source_lost`. */
export function statusWording(name: string): Wording {
  return STATUS[name] ?? UNKNOWN;
}

/** How a replay stands, as far as it changes what a session's status means. */
export interface ReplayStanding {
  readonly paused: boolean;
  readonly ended: boolean;
}

/** The same for a session that may replay a recording: one that is paused or at its end has lost no source. */
export function sessionWording(name: string, replay: ReplayStanding | null): Wording {
  if (replay === null || name === 'closed' || name === 'degraded') return statusWording(name);
  if (replay.ended) return { text: 'Replay ended', tone: 'quiet' };
  return replay.paused ? { text: 'Replay paused', tone: 'quiet' } : { text: 'Replay', tone: 'good' };
}

/** The same for a viewer, to whom a status is worth nothing while the server cannot be heard. */
export function viewedStatusWording(
  name: string,
  connection: string,
  replay: ReplayStanding | null,
): Wording {
  return connection === 'open' ? sessionWording(name, replay) : { text: 'Not connected', tone: 'bad' };
}

/** Wording of a tracking outcome by its name on the wire, such as `not_initialized`. */
export function trackingWording(name: string): Wording {
  return TRACKING[name] ?? UNKNOWN;
}

/** `0.24 s`, `12 s`, `3 min`; a dash where nothing is known. */
export function age(ms: number | null | undefined): string {
  if (ms === null || ms === undefined) return '–';
  if (ms < 9950) return `${(ms / 1000).toFixed(ms < 995 ? 2 : 1)} s`;
  if (ms < 120_000) return `${Math.round(ms / 1000)} s`;
  return `${Math.round(ms / 60_000)} min`;
}

/** Data older than half a second are to be noticed, whatever the reason. */
export function ageTone(ms: number | null): Tone {
  return ms !== null && ms > STALE_AFTER_MS ? 'warning' : 'quiet';
}

/** `1 234 567`, with narrow spaces. */
export function count(value: number): string {
  return String(Math.round(value)).replace(/\B(?=(\d{3})+$)/g, '\u202f');
}

/** `4.2 GB`, `17 MB`, `900 kB`. */
export function bytes(value: number): string {
  for (const [unit, size] of [
    ['GB', 1e9],
    ['MB', 1e6],
  ] as const) {
    if (value >= 0.9995 * size) return `${(value / size).toFixed(value < 10 * size ? 1 : 0)} ${unit}`;
  }
  return `${Math.ceil(value / 1000)} kB`;
}

/** A time span as clocks show it: `0:07`, `12:34`, `1:02:03`. */
export function clock(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds));
  const two = (value: number) => String(value).padStart(2, '0');
  const [hours, minutes] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60];
  return hours > 0 ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

/** `29.7/s`. */
export function perSecond(value: number): string {
  return `${value.toFixed(1)}/s`;
}

/** `640 kbit/s`, `12.4 Mbit/s`. */
export function bitRate(bitsPerS: number): string {
  const kbit = bitsPerS / 1000;
  return kbit < 10_000 ? `${Math.round(kbit)} kbit/s` : `${(kbit / 1000).toFixed(1)} Mbit/s`;
}
