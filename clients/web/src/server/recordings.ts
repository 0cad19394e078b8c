/** Recordings that the server can replay: listed, uploaded. */
import { ask, Refused, refusal, tokenHeaders } from './access';

export interface Recording {
  readonly recording: string;
  readonly bytes: number;
}

/** All recordings, by name. */
export async function fetchRecordings(signal: AbortSignal): Promise<Recording[]> {
  const body: unknown = await (await ask('/api/recordings', { signal })).json();
  if (!Array.isArray(body)) throw new Error('the server answered with something else than a list');
  return body.map((fields) => ({ recording: String(fields?.recording), bytes: Number(fields?.bytes) }));
}

/** Bytes with which every MCAP file begins. */
const MCAP_MAGIC = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];

/** Whether a file begins as recordings do. */
export async function isMcap(file: Blob): Promise<boolean> {
  const start = new Uint8Array(await file.slice(0, MCAP_MAGIC.length).arrayBuffer());
  return start.length === MCAP_MAGIC.length && MCAP_MAGIC.every((byte, i) => start[i] === byte);
}

const NAME_MAX_CHARS = 100;

/** A name that the server takes for a file of this name, other than those that are there: `my scan.mcap` is `my_scan.mcap`. */
export function recordingName(fileName: string, taken: readonly string[]): string {
  const plain = fileName
    .replace(/\.mcap$/i, '')
    .replaceAll(/[^A-Za-z0-9_.-]+/g, '_')
    .replace(/^\.+/, '')
    .slice(0, NAME_MAX_CHARS);
  const stem = plain === '' ? 'recording' : plain;
  for (let number = 1; ; number++) {
    const name = number === 1 ? `${stem}.mcap` : `${stem}-${number}.mcap`;
    if (!taken.includes(name)) return name;
  }
}

/** An upload under way. */
export interface Upload {
  /** Ends when the server has checked and kept it; throws as [`ask`], or `AbortError` after `abort`. */
  readonly done: Promise<void>;
  abort(): void;
}

/** Uploads a recording; `progress` is told the bytes that are on their way. */
export function upload(name: string, file: Blob, progress: (bytes: number) => void): Upload {
  // Not by fetch, which does not tell how far it is.
  const request = new XMLHttpRequest();
  request.open('PUT', `/api/recordings/${encodeURIComponent(name)}`);
  for (const [header, value] of Object.entries(tokenHeaders())) request.setRequestHeader(header, value);
  request.upload.onprogress = ({ loaded }) => progress(loaded);
  const done = new Promise<void>((resolve, reject) => {
    request.onload = () => {
      if (request.status >= 200 && request.status < 300) resolve();
      else reject(refusal(request.status, request.responseText));
    };
    request.onerror = () => reject(new Error('the connection broke'));
    request.onabort = () => reject(new DOMException('The upload was cancelled', 'AbortError'));
  });
  request.send(file);
  return { done, abort: () => request.abort() };
}

/** Why an upload failed, in words. */
export function whyNotUploaded(error: unknown): string {
  if (error instanceof DOMException && error.name === 'AbortError') return 'The upload was cancelled.';
  if (!(error instanceof Refused)) {
    const detail = error instanceof Error ? error.message : String(error);
    return `The upload failed: ${detail}.`;
  }
  switch (error.reason) {
    case 'oversized_message':
      return `The file is too large: ${error.message}.`;
    case 'invalid_recording':
      return `This recording cannot be replayed: ${error.message}.`;
    case 'storage_full':
      return `The server has no room: ${error.message}.`;
    case 'unknown_recording':
      return 'This server keeps no recordings.';
    case 'forbidden':
      return `Not allowed: ${error.message}.`;
    default:
      return `The upload failed: ${error.message}.`;
  }
}
