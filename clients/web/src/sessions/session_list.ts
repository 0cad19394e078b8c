import { describePage, listStatus } from '../page_status';
import { element, setData, setText } from '../ui/dom';
import type { Page } from '../ui/page';
import { age, count, perSecond, statusWording, trackingWording } from '../ui/wording';
import { fetchSessions, type SessionSummary } from './api';
import { Thumbnail } from './thumbnail';

const REFRESH_MS = 1500;

/** The sessions of the server, refreshed while shown. */
export class SessionList implements Page {
  readonly root = element('main', { class: 'list', 'data-page': 'sessions' });
  readonly heading = element('h1', {}, 'Sessions');
  private readonly problem = element('p', { class: 'notice', role: 'status', hidden: '' });
  private readonly empty = element('div', { class: 'empty', hidden: '' });
  private readonly rows = element('ul', { class: 'sessions', 'aria-label': 'Sessions' });
  private readonly closing = new AbortController();
  private shown = '';
  private thumbnails: readonly Thumbnail[] = [];
  private timer = 0;

  constructor() {
    this.empty.append(
      element('h2', {}, 'No sessions yet'),
      element('p', {}, 'A session appears here as soon as a cart connects or a recording is played.'),
    );
    this.root.append(this.problem, this.empty, this.rows);
    document.title = 'MIS-SLAM · Sessions';
    describePage(() => listStatus([]));
    void this.refresh();
  }

  close(): void {
    this.closing.abort();
    window.clearTimeout(this.timer);
  }

  private async refresh(): Promise<void> {
    try {
      this.show(await fetchSessions(this.closing.signal));
      this.problem.hidden = true;
    } catch (error) {
      if (this.closing.signal.aborted) return;
      const reason = error instanceof Error ? error.message : String(error);
      setText(this.problem, `The server cannot be reached (${reason}). Trying again …`);
      this.problem.hidden = false;
    }
    this.timer = window.setTimeout(() => void this.refresh(), REFRESH_MS);
  }

  private show(sessions: readonly SessionSummary[]): void {
    const ids = sessions.map((session) => session.session);
    describePage(() => listStatus(ids));
    setData(this.root, 'sessions', String(sessions.length));
    this.empty.hidden = sessions.length > 0;
    // Rows that are still the same stay, so that the keyboard's focus stays on them.
    if (ids.join('\n') !== this.shown) {
      // So do their pictures: each is drawn by the server.
      const held = new Map(this.thumbnails.map((thumbnail) => [thumbnail.session, thumbnail]));
      this.thumbnails = ids.map((id) => held.get(id) ?? new Thumbnail(id));
      this.rows.replaceChildren(...ids.map((id, i) => row(id, this.thumbnails[i] as Thumbnail)));
    }
    this.shown = ids.join('\n');
    sessions.forEach((session, i) => {
      fillRow(this.rows.children[i] as HTMLElement, session);
      this.thumbnails[i]?.show(session, performance.now());
    });
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
  const status = statusWording(session.status);
  setData(item, 'state', session.status);
  setText(part('status'), status.text);
  setData(part('status'), 'tone', status.tone);
  setText(part('health'), session.text === '' ? trackingWording(session.tracking).text : session.text);
  const figures = [
    `${count(session.surfels)} surfels`,
    `video ${perSecond(session.receivedHz)}`,
    `model ${age(session.modelAgeMs)} old`,
    session.viewers === 1 ? '1 viewer' : `${count(session.viewers)} viewers`,
  ];
  setText(part('figures'), figures.join(' · '));
}
