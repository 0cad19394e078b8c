/** Requests to the server: with the access token where there is one, and with its refusals as errors. */

const STORAGE_KEY = 'mis-slam.access-token';

/** The server does not do what it was asked for; `message` is its text for people. */
export class Refused extends Error {
  override readonly name = 'Refused';

  constructor(
    readonly status: number,
    /** A name of the list in protocol/SPEC.md; empty where the answer has none. */
    readonly reason: string,
    text: string,
  ) {
    super(text);
  }
}

let token = readToken();
let tokenWanted: (text: string) => void = () => undefined;

/** Says what is to happen where the server wants a token, or another one than it got. */
export function whenTokenWanted(listener: (text: string) => void): void {
  tokenWanted = listener;
}

/** Whether there is a token. */
export function hasToken(): boolean {
  return token !== '';
}

/** Uses this token from now on, as long as the tab is open. */
export function useToken(given: string): void {
  token = given.trim();
  try {
    window.sessionStorage.setItem(STORAGE_KEY, token);
  } catch {
    // Storage is switched off: the token lasts as long as the page.
  }
}

function readToken(): string {
  try {
    return window.sessionStorage.getItem(STORAGE_KEY) ?? '';
  } catch {
    return '';
  }
}

/** The headers that show the token. */
export function tokenHeaders(): Record<string, string> {
  return token === '' ? {} : { authorization: `Bearer ${token}` };
}

/** The address with the token in it, for what takes no headers: WebSockets, images, links. */
export function withToken(address: string): string {
  if (token === '') return address;
  return `${address}${address.includes('?') ? '&' : '?'}access_token=${encodeURIComponent(token)}`;
}

/** The answer to a request; throws [`Refused`], or what `fetch` throws where the server cannot be reached. */
export async function ask(path: string, request: RequestInit = {}): Promise<Response> {
  const headers = { accept: 'application/json', ...tokenHeaders(), ...request.headers };
  const response = await fetch(path, { ...request, headers });
  if (!response.ok) throw refusal(response.status, await response.text());
  return response;
}

/** Asks with a JSON body. */
export function askWith(method: string, path: string, body: unknown): Promise<Response> {
  const headers = { 'content-type': 'application/json' };
  return ask(path, { method, headers, body: JSON.stringify(body) });
}

/** What an answer other than success means; where a token is wanted, that is told as well. */
export function refusal(status: number, body: string): Refused {
  const { reason, text } = parsed(body);
  if (status === 401) tokenWanted(text);
  return new Refused(status, reason, text === '' ? `the server answered ${status}` : text);
}

function parsed(body: string): { reason: string; text: string } {
  try {
    const { reason, text } = JSON.parse(body) as Record<string, unknown>;
    return { reason: String(reason ?? ''), text: String(text ?? '') };
  } catch {
    return { reason: '', text: '' };
  }
}

/** Why a request failed, in a sentence for people. */
export function whyFailed(error: unknown): string {
  if (error instanceof Refused) {
    return error.status === 403 ? `Not allowed: ${error.message}.` : `The server refuses: ${error.message}.`;
  }
  const detail = error instanceof Error ? error.message : String(error);
  return `The server cannot be reached (${detail}).`;
}
