/** Open sessions over HTTP (protocol/SPEC.md). */
import { ask, askWith, Refused, withToken } from './access';

/** What the list shows of a session; numbers are 0 and ages null where the server does not say. */
export interface SessionSummary {
  readonly session: string;
  readonly status: string;
  readonly text: string;
  readonly tracking: string;
  readonly receivedHz: number;
  readonly surfels: number;
  readonly epoch: number;
  readonly viewers: number;
  readonly modelAgeMs: number | null;
  /** The recording that it replays; null where a cart feeds it. */
  readonly replay: ReplaySummary | null;
}

/** Where the replay of a recording stands. */
export interface ReplaySummary {
  readonly recording: string;
  readonly paused: boolean;
  readonly ended: boolean;
}

/** All sessions, by id. Throws where the server cannot be reached or does not answer as it should. */
export async function fetchSessions(signal: AbortSignal): Promise<SessionSummary[]> {
  return parseSessions(await (await ask('/api/sessions', { signal })).json());
}

/** The session states of the answer, which is a list. */
export function parseSessions(body: unknown): SessionSummary[] {
  if (!Array.isArray(body))
    throw new Error('the server answered with something else than a list of sessions');
  return body.map(summaryOf).sort((a, b) => a.session.localeCompare(b.session));
}

/** Why the session cannot be viewed: its refusal, or undefined where there is none or the server cannot be asked. */
export async function refusalOf(session: string): Promise<Refused | undefined> {
  try {
    await ask(pathOf(session));
    return undefined;
  } catch (error) {
    return error instanceof Refused ? error : undefined;
  }
}

/** Starts the replay of a stored recording; gives the id of its session. */
export async function startReplay(recording: string): Promise<string> {
  const opened = await askWith('POST', '/api/sessions', { replay: { recording } });
  const { session } = (await opened.json()) as { session?: unknown };
  if (typeof session !== 'string') throw new Error('the server does not say which session it opened');
  return session;
}

/** A change of a replay; what is left out stays. */
export interface ReplayChange {
  readonly paused?: boolean;
  readonly position_s?: number;
  /** Times the recorded pace; 0: as fast as can be. */
  readonly rate?: number;
}

export async function changeReplay(session: string, change: ReplayChange): Promise<void> {
  await askWith('POST', `${pathOf(session)}/replay`, change);
}

/** Ends a session; what it leaves is then among the finished ones. */
export async function closeSession(session: string): Promise<void> {
  await ask(pathOf(session), { method: 'DELETE' });
}

/** A file of an open session, as it is now. */
export async function fetchFile(session: string, file: 'model.ply' | 'trajectory.tum'): Promise<Blob> {
  return (await ask(`${pathOf(session)}/${file}`)).blob();
}

function pathOf(session: string): string {
  return `/api/sessions/${encodeURIComponent(session)}`;
}

/** Address of the WebSocket on which a session is viewed. */
export function viewUrl(session: string): string {
  const scheme = window.location.protocol === 'https:' ? 'wss' : 'ws';
  return withToken(`${scheme}://${window.location.host}${pathOf(session)}/view`);
}

/** Address of a picture of a session's model; the epoch tells one picture from the next. */
export function pictureUrl(
  session: string,
  { width, height }: { readonly width: number; readonly height: number },
  epoch: number,
): string {
  return withToken(`${pathOf(session)}/view.png?width=${width}&height=${height}&epoch=${epoch}`);
}

function summaryOf(value: unknown): SessionSummary {
  const fields = (typeof value === 'object' && value !== null ? value : {}) as Record<string, unknown>;
  const text = (name: string) => (typeof fields[name] === 'string' ? (fields[name] as string) : '');
  const number = (name: string) => (typeof fields[name] === 'number' ? (fields[name] as number) : null);
  return {
    session: text('session'),
    status: text('status'),
    text: text('text'),
    tracking: text('tracking'),
    receivedHz: number('received_hz') ?? 0,
    surfels: number('surfels') ?? 0,
    epoch: number('epoch') ?? 0,
    viewers: number('viewers') ?? 0,
    modelAgeMs: number('model_age_ms'),
    replay: replayOf(fields.replay),
  };
}

function replayOf(value: unknown): ReplaySummary | null {
  if (typeof value !== 'object' || value === null) return null;
  const { recording, paused, ended } = value as Record<string, unknown>;
  return { recording: String(recording ?? ''), paused: paused === true, ended: ended === true };
}
