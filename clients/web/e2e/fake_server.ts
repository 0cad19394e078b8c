import { readFile } from 'node:fs/promises';
import { createServer, type IncomingMessage, type Server, type ServerResponse } from 'node:http';
import type { AddressInfo } from 'node:net';
import { join, normalize } from 'node:path';
import { type WebSocket, WebSocketServer } from 'ws';
import { FakeFiles, sendJson, sendText } from './fake_files';
import { FakeSession, type ReplayChange } from './fake_session';

const TYPES: Readonly<Record<string, string>> = {
  html: 'text/html; charset=utf-8',
  js: 'text/javascript',
  css: 'text/css',
  svg: 'image/svg+xml',
};

/** As strict as the server's own. */
const HEADERS = {
  'content-security-policy': "default-src 'self'; img-src 'self' blob: data:; connect-src 'self' ws: wss:",
  'x-content-type-options': 'nosniff',
};

export interface FakeServerOptions {
  /** 0 takes a free one. */
  readonly port?: number;
  readonly surfels: number;
  readonly epochsPerS: number;
  /** Whether the session replays a recording. */
  readonly replay?: boolean;
}

/**
 * Serves the page of dist/ and one synthetic session by the rules of protocol/SPEC.md, so that the page is
 * tested alone. Run from the root of the web client.
 */
export class FakeServer {
  readonly session: FakeSession;
  readonly files = new FakeFiles();
  /** The one token that is good; without it none is wanted. */
  token: string | undefined;
  /** How often a picture of the model was asked for. */
  picturesServed = 0;
  private readonly http: Server;
  private readonly sockets = new WebSocketServer({ noServer: true });

  private constructor(options: FakeServerOptions) {
    const { surfels, epochsPerS, replay = false } = options;
    this.session = new FakeSession('phantom-1', surfels, epochsPerS, replay);
    this.http = createServer((request, response) => void this.answer(request, response));
    this.http.on('upgrade', (request, socket, head) => {
      const problem = this.problemOf(request);
      if (problem !== undefined) {
        socket.end(`HTTP/1.1 ${problem}\r\nConnection: close\r\n\r\n`);
        return;
      }
      this.sockets.handleUpgrade(request, socket, head, (viewer) => this.session.admit(viewer));
    });
  }

  static async start(options: FakeServerOptions): Promise<FakeServer> {
    const server = new FakeServer(options);
    await new Promise<void>((resolve) => server.http.listen(options.port ?? 0, '127.0.0.1', resolve));
    return server;
  }

  get url(): string {
    return `http://127.0.0.1:${(this.http.address() as AddressInfo).port}`;
  }

  /** Breaks all connections without a farewell, as a lost network does. */
  breakConnections(): void {
    for (const viewer of this.sockets.clients as Set<WebSocket>) viewer.terminate();
  }

  async stop(): Promise<void> {
    this.session.stop();
    this.breakConnections();
    this.http.closeAllConnections();
    await new Promise((resolve) => this.http.close(resolve));
  }

  /** Why a WebSocket is refused. */
  private problemOf(request: IncomingMessage): string | undefined {
    if (!this.mayAsk(request)) return '401 Unauthorized';
    return pathOf(request) === `/api/sessions/${this.session.id}/view` ? undefined : '404 Not Found';
  }

  private mayAsk(request: IncomingMessage): boolean {
    if (this.token === undefined) return true;
    const inQuery = new URLSearchParams(request.url?.split('?')[1]).get('access_token');
    return request.headers.authorization === `Bearer ${this.token}` || inQuery === this.token;
  }

  private async answer(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const path = pathOf(request);
    if (!path.startsWith('/api/')) await sendFile(response, path === '/' ? 'index.html' : path);
    else if (!this.mayAsk(request)) {
      sendJson(response, 401, { reason: 'unauthenticated', text: 'no token, or one that is not valid' });
    } else if (!(await this.files.answer(path, request, response))) {
      await this.answerAboutSessions(`${request.method} ${path}`, request, response);
    }
  }

  private async answerAboutSessions(
    wanted: string,
    request: IncomingMessage,
    response: ServerResponse,
  ): Promise<void> {
    const { session } = this;
    const base = `/api/sessions/${session.id}`;
    switch (wanted) {
      case 'GET /api/sessions':
        sendJson(response, 200, [session.summary()]);
        break;
      case 'POST /api/sessions':
        sendJson(response, 201, session.summary());
        break;
      case `POST ${base}/replay`:
        session.changeReplay((await bodyOf(request)) as ReplayChange);
        sendJson(response, 200, session.summary());
        break;
      case `GET ${base}/model.ply`:
        sendText(response, 'ply\n');
        break;
      case `GET ${base}/view.png`:
        this.picturesServed += 1;
        await sendFile(response, 'favicon.svg');
        break;
      default:
        sendJson(response, 404, { reason: 'unknown_session', text: 'no such session' });
    }
  }
}

function pathOf(request: IncomingMessage): string {
  return (request.url ?? '/').split('?')[0] ?? '/';
}

async function bodyOf(request: IncomingMessage): Promise<unknown> {
  const pieces: Buffer[] = [];
  for await (const piece of request) pieces.push(piece as Buffer);
  return JSON.parse(Buffer.concat(pieces).toString());
}

async function sendFile(response: ServerResponse, path: string): Promise<void> {
  const file = join('dist', normalize(`/${path}`));
  try {
    const bytes = await readFile(file);
    const type = TYPES[file.split('.').at(-1) ?? ''] ?? 'application/octet-stream';
    response.writeHead(200, { ...HEADERS, 'content-type': type }).end(bytes);
  } catch {
    response.writeHead(404).end();
  }
}
