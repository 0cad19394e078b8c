/**
 * `window.misSlam`: what the page shows, for end-to-end tests and support. Read-only; each reading is a
 * fresh frozen object. The same is reflected as data attributes of `<main>`.
 */

/** Errors kept; older ones are forgotten. */
const MAX_ERRORS = 20;

export interface PageStatus {
  /** Which page is shown. */
  readonly page: 'sessions' | 'session' | 'access';
  /** The session shown, or null in the list. */
  readonly session: string | null;
  /** Sessions in the list, or null in a session. */
  readonly sessions: readonly string[] | null;
  /** Recordings and finished runs in their lists, or null in a session. */
  readonly recordings: readonly string[] | null;
  readonly finished: readonly string[] | null;
  /** The WebSocket: `none`, `connecting`, `open`, `waiting` (for the next attempt). */
  readonly connection: string;
  /** The session's status as in SPEC.md: `waiting`, `live`, `degraded`, `source_lost`, `closed`, `unspecified`. */
  readonly state: string;
  /** The tracking outcome as in SPEC.md: `tracked`, `lost`, …, `unspecified`. */
  readonly tracking: string;
  /** Surfels held and drawn. */
  readonly surfels: number;
  /** Surfels that the server says its model has. */
  readonly serverSurfels: number;
  /** Epoch of the model held, proven by its digest; 0 for none. */
  readonly epoch: number;
  /** Whether the model held is the server's at `epoch` and epochs are followed. */
  readonly following: boolean;
  /** Age of the model shown, in milliseconds; null before the first. */
  readonly ageMs: number | null;
  /** Whether the model is shown faded because it is stale. */
  readonly stale: boolean;
  /** Whether the model is not shown at all because it is too old. */
  readonly hidden: boolean;
  /** Straight distances of the measurements, in millimetres. */
  readonly measuredMm: readonly number[];
  /** Poses and preview images received. */
  readonly poses: number;
  readonly previews: number;
  /** Where the replay of a recording stands; null where a cart feeds the session. */
  readonly replay: ReplayStatus | null;
  /** Features drawn over the image; 0 while they are not wanted. */
  readonly features: number;
  /** Images of the 3-D view drawn. */
  readonly framesDrawn: number;
  /** Whether the 3-D view shows the model and rests: it glides to no other place. */
  readonly viewRests: boolean;
  /** How often the model was asked for again. */
  readonly resyncs: number;
  /** Notes on the tissue. */
  readonly notes: number;
  /** Where the headset has the model: room_from_world, 16 numbers by columns; null without one. */
  readonly headset: readonly number[] | null;
  /** The last errors, oldest first: of the protocol, of the page. */
  readonly errors: readonly string[];
}

export interface ReplayStatus {
  readonly positionS: number;
  readonly durationS: number;
  readonly paused: boolean;
  readonly rate: number;
  readonly ended: boolean;
}

/** What each page says about itself; the rest of the status is the same for all. */
export type PartOfPage = Omit<PageStatus, 'errors'>;

/** The status of a page that shows nothing. */
export const EMPTY_STATUS: PartOfPage = {
  page: 'sessions',
  session: null,
  sessions: null,
  recordings: null,
  finished: null,
  connection: 'none',
  state: 'unspecified',
  tracking: 'unspecified',
  surfels: 0,
  serverSurfels: 0,
  epoch: 0,
  following: false,
  ageMs: null,
  stale: false,
  hidden: false,
  measuredMm: [],
  poses: 0,
  previews: 0,
  replay: null,
  features: 0,
  framesDrawn: 0,
  viewRests: false,
  resyncs: 0,
  notes: 0,
  headset: null,
};

const errors: string[] = [];
let describe: () => PartOfPage = () => EMPTY_STATUS;

/** Says where the status comes from, from now on. */
export function describePage(source: () => PartOfPage): void {
  describe = source;
}

/** Keeps an error for the status. */
export function recordError(error: unknown): void {
  errors.push(error instanceof Error ? `${error.name}: ${error.message}` : String(error));
  if (errors.length > MAX_ERRORS) errors.shift();
}

export function pageStatus(): PageStatus {
  return Object.freeze({ ...describe(), errors: Object.freeze([...errors]) });
}

/** Makes `window.misSlam` and notes errors that nobody caught. */
export function exposeStatus(): void {
  Object.defineProperty(window, 'misSlam', { get: pageStatus, configurable: false });
  window.addEventListener('error', (event) => recordError(event.error ?? event.message));
  window.addEventListener('unhandledrejection', (event) => recordError(event.reason));
}
