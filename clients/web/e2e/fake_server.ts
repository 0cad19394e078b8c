import { readFile } from 'node:fs/promises';
import { createServer, type IncomingMessage, type Server, type ServerResponse } from 'node:http';
import type { AddressInfo } from 'node:net';
import { join, normalize } from 'node:path';
import { type WebSocket, WebSocketServer } from 'ws';
import { FakeSession } from './fake_session';

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
}

/**
 * Serves the page of dist/ and one synthetic session by the rules of protocol/SPEC.md, so that the page is
 * tested alone. Run from the root of the web client.
 */
export class FakeServer {
  readonly session: FakeSession;
  /** How often a picture of the model was asked for. */
  picturesServed = 0;
  private readonly http: Server;
  private readonly sockets = new WebSocketServer({ noServer: true });

  private constructor(options: FakeServerOptions) {
    this.session = new FakeSession('phantom-1', options.surfels, options.epochsPerS);
    this.http = createServer((request, response) => void this.answer(request, response));
    this.http.on('upgrade', (request, socket, head) => {
      if (request.url !== `/api/sessions/${this.session.id}/view`) {
        socket.end('HTTP/1.1 404 Not Found\r\nConnection: close\r\n\r\n');
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

  private async answer(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const path = (request.url ?? '/').split('?')[0] ?? '/';
    if (path === '/api/sessions') sendJson(response, 200, [this.session.summary()]);
    else if (path === `/api/sessions/${this.session.id}/view.png`) {
      this.picturesServed += 1;
      await sendFile(response, 'favicon.svg');
    } else if (path.startsWith('/api/')) {
      sendJson(response, 404, { reason: 'unknown_session', text: 'no such session' });
    } else await sendFile(response, path === '/' ? 'index.html' : path);
  }
}

function sendJson(response: ServerResponse, status: number, body: unknown): void {
  response.writeHead(status, { 'content-type': 'application/json' }).end(JSON.stringify(body));
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
