/** The HTTP side of the server (protocol/SPEC.md). */

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
}

/** All sessions, by id. Throws where the server cannot be reached or does not answer as it should. */
export async function fetchSessions(signal: AbortSignal): Promise<SessionSummary[]> {
  const response = await fetch('/api/sessions', { signal, headers: { accept: 'application/json' } });
  if (!response.ok) throw new Error(`the server answered ${response.status}`);
  return parseSessions(await response.json());
}

/** The session states of the answer, which is a list. */
export function parseSessions(body: unknown): SessionSummary[] {
  if (!Array.isArray(body))
    throw new Error('the server answered with something else than a list of sessions');
  return body.map(summaryOf).sort((a, b) => a.session.localeCompare(b.session));
}

/** Whether the session exists; false too where the server cannot be asked. */
export async function sessionIsUnknown(session: string): Promise<boolean> {
  try {
    const response = await fetch(`/api/sessions/${encodeURIComponent(session)}`);
    return response.status === 404;
  } catch {
    return false;
  }
}

/** Address of the WebSocket on which a session is viewed. */
export function viewUrl(session: string): string {
  const scheme = window.location.protocol === 'https:' ? 'wss' : 'ws';
  return `${scheme}://${window.location.host}/api/sessions/${encodeURIComponent(session)}/view`;
}

/** Address of a picture of a session's model; the epoch tells one picture from the next. */
export function pictureUrl(
  session: string,
  { width, height }: { readonly width: number; readonly height: number },
  epoch: number,
): string {
  return `/api/sessions/${encodeURIComponent(session)}/view.png?width=${width}&height=${height}&epoch=${epoch}`;
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
  };
}
