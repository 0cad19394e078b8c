/** What finished sessions left behind. */
import { ask, withToken } from './access';

export interface FinishedRun {
  /** Its name, `SESSION.TIME`. */
  readonly run: string;
  readonly session: string;
  /** When it ended, milliseconds since 1970. */
  readonly endedMs: number;
  readonly files: readonly string[];
}

/** All of them, newest first. */
export async function fetchFinished(signal: AbortSignal): Promise<FinishedRun[]> {
  const body: unknown = await (await ask('/api/finished', { signal })).json();
  if (!Array.isArray(body)) throw new Error('the server answered with something else than a list');
  return body.map((fields) => ({
    run: String(fields?.run),
    session: String(fields?.session),
    endedMs: Number(fields?.ended_ms),
    files: Array.isArray(fields?.files) ? fields.files.map(String) : [],
  }));
}

/** Address of one of its files. */
export function finishedFileUrl({ run }: FinishedRun, file: string): string {
  return withToken(`/api/finished/${encodeURIComponent(run)}/${encodeURIComponent(file)}`);
}
