/** What goes over the WebSocket: one protobuf envelope in each message. */
import { create, fromBinary, toBinary } from '@bufbuild/protobuf';
import { HelloSchema, ResyncSchema } from '../generated/mis_slam/v1/control_pb';
import {
  type FromServer,
  FromServerSchema,
  type ToServer,
  ToServerSchema,
} from '../generated/mis_slam/v1/envelope_pb';
import { ProtocolError } from '../model/protocol_error';

/** The protocol versions that this page speaks. */
const OLDEST_VERSION = 1;
const NEWEST_VERSION = 1;
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

function encode(body: ToServer['body']): Uint8Array<ArrayBuffer> {
  // Copied because the library's type allows shared memory, which WebSockets do not take.
  return new Uint8Array(toBinary(ToServerSchema, create(ToServerSchema, { body })));
}

/** What the server says; `body.case` is undefined for what this page does not know. */
export function decodeFromServer(bytes: Uint8Array): FromServer['body'] {
  try {
    return fromBinary(FromServerSchema, bytes).body;
  } catch (error) {
    throw new ProtocolError(`not a FromServer message: ${error instanceof Error ? error.message : error}`);
  }
}
