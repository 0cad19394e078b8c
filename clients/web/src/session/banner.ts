import type { Refused } from '../server/access';
import { element, setData, setText } from '../ui/dom';
import { age, type ReplayStanding, type Tone } from '../ui/wording';

/** What decides whether something has to be said across the 3-D view. */
export interface Situation {
  readonly connection: string;
  /** Why the server does not let the session be viewed; undefined where it does. */
  readonly refused: Refused | undefined;
  /** Where the session replays a recording. */
  readonly replay: ReplayStanding | null;
  readonly status: string;
  /** The server's reason for the status. */
  readonly statusText: string;
  readonly tracking: string;
  readonly notice: string;
  readonly silenceMs: number | null;
  readonly ageMs: number | null;
  readonly surfels: number;
  /** The model is too old to be shown. */
  readonly hidden: boolean;
}

export interface Message {
  readonly title: string;
  readonly detail: string;
  readonly tone: Tone;
}

/** Silence of the model lane that is worth words; the model fades long before. */
const WORTH_SAYING_MS = 3000;

/** The one most important thing to say, or nothing. */
export function messageFor(situation: Situation): Message | undefined {
  const { connection, refused, replay, status, tracking, surfels } = situation;
  const shown = situation.hidden ? 'is hidden: it is' : 'shown is';
  const held = surfels > 0 ? `The model ${shown} ${age(situation.ageMs)} old.` : '';
  if (refused?.status === 404 && surfels > 0) {
    return { title: 'Session ended', detail: 'This is what was last seen of it.', tone: 'quiet' };
  }
  if (refused?.status === 404) {
    return { title: 'No such session', detail: 'It has ended, or the address is wrong.', tone: 'bad' };
  }
  if (refused?.status === 403) return { title: 'Not allowed', detail: refused.message, tone: 'bad' };
  if (connection === 'waiting' || (connection === 'connecting' && situation.silenceMs !== null)) {
    return { title: 'Connection lost', detail: join('Reconnecting …', situation.notice, held), tone: 'bad' };
  }
  if (replay?.ended && status !== 'closed') return undefined;
  if (replay?.paused && surfels === 0) {
    return { title: 'Paused', detail: 'The model begins when the replay goes on.', tone: 'quiet' };
  }
  if (status === 'source_lost') {
    return { title: 'Source lost', detail: join(situation.statusText, held), tone: 'bad' };
  }
  if (status === 'closed') {
    return { title: 'Session closed', detail: join(situation.statusText, held), tone: 'quiet' };
  }
  if (tracking === 'lost') {
    return { title: 'Tracking lost', detail: join('The model is paused.', held), tone: 'warning' };
  }
  if (status === 'degraded') {
    return { title: 'Degraded', detail: situation.statusText, tone: 'warning' };
  }
  if (status === 'live' && !replay?.paused && (situation.silenceMs ?? 0) > WORTH_SAYING_MS) {
    return { title: 'No new model data', detail: held, tone: 'warning' };
  }
  if (situation.hidden) return { title: 'Model too old', detail: held, tone: 'warning' };
  if (surfels === 0) return emptyMessage(status);
  return undefined;
}

function emptyMessage(status: string): Message {
  const detail = status === 'live' ? 'The first surfels appear in a moment.' : 'No video has come yet.';
  return { title: 'Waiting for the model', detail, tone: 'quiet' };
}

function join(...sentences: string[]): string {
  return sentences.filter((sentence) => sentence !== '').join(' ');
}

/** Shows the message across the top of the 3-D view. */
export class Banner {
  private readonly title = element('strong');
  private readonly detail = element('span');
  readonly root = element('div', { class: 'banner', role: 'status', hidden: '' }, this.title, this.detail);

  show(message: Message | undefined): void {
    this.root.hidden = message === undefined;
    if (message === undefined) return;
    setText(this.title, message.title);
    setText(this.detail, message.detail);
    setData(this.root, 'tone', message.tone);
  }
}
