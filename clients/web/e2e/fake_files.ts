import { readFile } from 'node:fs/promises';
import type { IncomingMessage, ServerResponse } from 'node:http';

/** An answer other than success, as the server words it. */
interface Refusal {
  readonly status: number;
  readonly reason: string;
  readonly text: string;
}

/** A run of another session. */
const FINISHED = {
  run: 'phantom-0.1760000000000-0',
  session: 'phantom-0',
  ended_ms: 1_760_000_000_000,
  files: ['model.ply', 'model.png', 'trajectory.tum', 'report.json'],
};

/** What the server keeps on its disk: recordings and finished runs. */
export class FakeFiles {
  readonly recordings: { recording: string; bytes: number }[] = [];
  readonly finished = [FINISHED];
  /** With what uploads are refused. */
  refuseUploads: Refusal | undefined;
  /** Uploads are only answered once this is let go. */
  holdUploads: Promise<void> | undefined;

  /** Answers what is about files; false where this is not. */
  async answer(path: string, request: IncomingMessage, response: ServerResponse): Promise<boolean> {
    if (path === '/api/recordings') sendJson(response, 200, this.recordings);
    else if (path === '/api/finished') sendJson(response, 200, this.finished);
    else if (path.startsWith('/api/recordings/')) await this.upload(path, request, response);
    else if (path.endsWith('/model.png')) {
      response.writeHead(200, { 'content-type': 'image/jpeg' }).end(await readFile('e2e/left.jpg'));
    } else if (path.startsWith('/api/finished/')) sendText(response, `what ${path} holds`);
    else return false;
    return true;
  }

  private async upload(path: string, request: IncomingMessage, response: ServerResponse): Promise<void> {
    let bytes = 0;
    for await (const piece of request) bytes += (piece as Buffer).length;
    await this.holdUploads;
    const refused = this.refuseUploads;
    if (refused !== undefined) {
      sendJson(response, refused.status, { reason: refused.reason, text: refused.text });
      return;
    }
    const recording = { recording: decodeURIComponent(path.split('/').at(-1) ?? ''), bytes };
    this.recordings.push(recording);
    sendJson(response, 201, recording);
  }
}

export function sendJson(response: ServerResponse, status: number, body: unknown): void {
  response.writeHead(status, { 'content-type': 'application/json' }).end(JSON.stringify(body));
}

export function sendText(response: ServerResponse, text: string): void {
  response.writeHead(200, { 'content-type': 'text/plain' }).end(text);
}
