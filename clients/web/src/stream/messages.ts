/** What goes over the WebSocket: one protobuf envelope in each message. */
import { create, fromBinary, toBinary } from '@bufbuild/protobuf';
import { decompress } from 'fzstd';
import { HelloSchema, ResyncSchema, type View } from '../generated/mis_slam/v1/control_pb';
import {
  type FromServer,
  FromServerSchema,
  type ToServer,
  ToServerSchema,
} from '../generated/mis_slam/v1/envelope_pb';
import type { SharedChange } from '../generated/mis_slam/v1/shared_pb';
import { ProtocolError } from '../model/protocol_error';

/** The protocol versions that this page speaks. */
const OLDEST_VERSION = 1;
const NEWEST_VERSION = 1;
/** Bytes of a message once it is decompressed. */
const MAX_MESSAGE_BYTES = 64 * 2 ** 20;
const SOFTWARE = 'mis-slam-web 0.1.0';

/** The first message of the page. */
export function encodeHello(): Uint8Array<ArrayBuffer> {
  const hello = create(HelloSchema, {
    oldestVersion: OLDEST_VERSION,
    newestVersion: NEWEST_VERSION,
    software: SOFTWARE,
  });
  return encode({ case: 'hello', value: hello });
}

/** Asks for a snapshot. */
export function encodeResync(heldEpoch: number): Uint8Array<ArrayBuffer> {
  return encode({ case: 'resync', value: create(ResyncSchema, { heldEpoch }) });
}

/** Says what this viewer wants, until the next time. */
export function encodeView(view: View): Uint8Array<ArrayBuffer> {
  return encode({ case: 'view', value: view });
}

/** Asks for a change of what viewers share. */
export function encodeSharedChange(change: SharedChange): Uint8Array<ArrayBuffer> {
  return encode({ case: 'sharedChange', value: change });
}

function encode(body: ToServer['body']): Uint8Array<ArrayBuffer> {
  // Copied because the library's type allows shared memory, which WebSockets do not take.
  return new Uint8Array(toBinary(ToServerSchema, create(ToServerSchema, { body })));
}

/** What the server says; `body.case` is undefined for what this page does not know. */
export function decodeFromServer(bytes: Uint8Array): FromServer['body'] {
  try {
    const { body } = fromBinary(FromServerSchema, bytes);
    if (body.case !== 'compressed') return body;
    const inner = fromBinary(FromServerSchema, decompressed(body.value)).body;
    if (inner.case === 'compressed') throw new Error('compressed twice');
    return inner;
  } catch (error) {
    throw new ProtocolError(`not a FromServer message: ${error instanceof Error ? error.message : error}`);
  }
}

function decompressed({ sizeBytes, zstd }: { sizeBytes: number; zstd: Uint8Array }): Uint8Array {
  if (sizeBytes > MAX_MESSAGE_BYTES) throw new Error(`${sizeBytes} bytes; the limit is ${MAX_MESSAGE_BYTES}`);
  const plain = decompress(zstd, new Uint8Array(sizeBytes));
  if (plain.length !== sizeBytes) throw new Error(`${plain.length} bytes instead of ${sizeBytes}`);
  return plain;
}
