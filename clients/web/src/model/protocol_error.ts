/** What the server sent is not what SPEC.md allows; the model then has to be asked for again. */
export class ProtocolError extends Error {
  override readonly name = 'ProtocolError';
}
