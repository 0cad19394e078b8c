import { Backoff } from './backoff';
import { encodeHello } from './messages';

/** How the connection to the server stands. */
export type ConnectionState = 'connecting' | 'open' | 'waiting';

/** What a connection reports. */
export interface ConnectionEvents {
  /** A message came. */
  message(bytes: Uint8Array): void;
  /** The state changed; in `waiting` the next attempt comes by itself. */
  changed(state: ConnectionState): void;
}

/** Session states come a few times a second: after this silence the network has to be taken for broken. */
const SILENCE_LIMIT_MS = 5000;
const SILENCE_CHECK_MS = 1000;

/** A WebSocket that greets the server and reconnects by itself until it is closed. */
export class Connection {
  private readonly backoff = new Backoff();
  private readonly silenceCheck: number;
  private socket: WebSocket | undefined;
  private retry: number | undefined;
  private lastHeardMs = 0;

  constructor(
    private readonly url: string,
    private readonly events: ConnectionEvents,
  ) {
    this.silenceCheck = window.setInterval(() => this.dropIfSilent(), SILENCE_CHECK_MS);
    this.open();
  }

  /** Sends now; without an open socket the message is meaningless and is dropped. */
  send(bytes: Uint8Array<ArrayBuffer>): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(bytes);
  }

  /** Closes for good. */
  close(): void {
    window.clearInterval(this.silenceCheck);
    window.clearTimeout(this.retry);
    this.detach()?.close(1000);
  }

  private open(): void {
    this.events.changed('connecting');
    this.lastHeardMs = performance.now();
    const socket = new WebSocket(this.url);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      socket.send(encodeHello());
      this.events.changed('open');
    };
    socket.onmessage = ({ data }) => this.heard(data);
    socket.onclose = () => this.closed();
    this.socket = socket;
  }

  private heard(data: unknown): void {
    if (!(data instanceof ArrayBuffer)) return;
    this.lastHeardMs = performance.now();
    this.backoff.reset();
    this.events.message(new Uint8Array(data));
  }

  private closed(): void {
    this.detach();
    this.events.changed('waiting');
    this.retry = window.setTimeout(() => this.open(), this.backoff.nextDelayMs());
  }

  private dropIfSilent(): void {
    if (this.socket === undefined || performance.now() - this.lastHeardMs < SILENCE_LIMIT_MS) return;
    // The closing handshake of a dead connection can take a minute: it is not waited for.
    this.socket.close();
    this.closed();
  }

  /** Forgets the socket, so that what it still says is not heard. */
  private detach(): WebSocket | undefined {
    const socket = this.socket;
    if (socket !== undefined) {
      socket.onopen = null;
      socket.onmessage = null;
      socket.onclose = null;
    }
    this.socket = undefined;
    return socket;
  }
}
