import type { SessionSummary } from '../server/sessions';
import { element, setData, setText } from '../ui/dom';
import { age, count, perSecond, sessionWording, trackingWording } from '../ui/wording';
import { Thumbnail } from './thumbnail';

/** The open sessions. */
export class SessionList {
  private readonly empty = element(
    'div',
    { class: 'empty', hidden: '' },
    element('h2', {}, 'No sessions yet'),
    element('p', {}, 'A session appears here as soon as a cart connects or a recording is played.'),
  );
  private readonly rows = element('ul', { class: 'sessions', 'aria-label': 'Sessions' });
  readonly root = element('section', { 'aria-label': 'Open sessions' }, this.empty, this.rows);
  private shown: readonly string[] = [];
  private thumbnails: readonly Thumbnail[] = [];

  /** Those that are shown. */
  get ids(): readonly string[] {
    return this.shown;
  }

  /** Shows these; whether there are others than before. */
  show(sessions: readonly SessionSummary[]): boolean {
    const ids = sessions.map((session) => session.session);
    // Rows that are still the same stay, so that the keyboard's focus stays on them.
    const changed = ids.join('\n') !== this.shown.join('\n');
    if (changed) {
      // So do their pictures: each is drawn by the server.
      const held = new Map(this.thumbnails.map((thumbnail) => [thumbnail.session, thumbnail]));
      this.thumbnails = ids.map((id) => held.get(id) ?? new Thumbnail(id));
      this.rows.replaceChildren(...ids.map((id, i) => row(id, this.thumbnails[i] as Thumbnail)));
    }
    this.empty.hidden = ids.length > 0;
    this.shown = ids;
    sessions.forEach((session, i) => {
      fillRow(this.rows.children[i] as HTMLElement, session);
      this.thumbnails[i]?.show(session, performance.now());
    });
    return changed;
  }
}

function row(session: string, thumbnail: Thumbnail): HTMLElement {
  const link = element(
    'a',
    { href: `#/sessions/${encodeURIComponent(session)}`, class: 'session' },
    thumbnail.root,
    element('span', { class: 'session-name' }, session),
    element('span', { class: 'pill', 'data-part': 'status' }),
    element('span', { class: 'session-health', 'data-part': 'health' }),
    element('span', { class: 'session-figures', 'data-part': 'figures' }),
  );
  return element('li', { 'data-session': session }, link);
}

function fillRow(item: HTMLElement, session: SessionSummary): void {
  const part = (name: string) => item.querySelector<HTMLElement>(`[data-part=${name}]`) as HTMLElement;
  const status = sessionWording(session.status, session.replay);
  setData(item, 'state', session.status);
  setText(part('status'), status.text);
  setData(part('status'), 'tone', status.tone);
  setText(part('health'), health(session));
  const figures = [
    `${count(session.surfels)} surfels`,
    `video ${perSecond(session.receivedHz)}`,
    `model ${age(session.modelAgeMs)} old`,
    session.viewers === 1 ? '1 viewer' : `${count(session.viewers)} viewers`,
  ];
  setText(part('figures'), figures.join(' · '));
}

function health({ text, tracking, replay }: SessionSummary): string {
  const state = text === '' ? trackingWording(tracking).text : text;
  return replay === null ? state : `${replay.recording} · ${state}`;
}
