import { type FinishedRun, finishedFileUrl } from '../server/finished';
import { element } from '../ui/dom';
import { finishedLinks } from '../ui/downloads';

const THUMBNAIL = 'model.png';

/** What finished sessions left behind, with what can be taken away. */
export class FinishedList {
  private readonly rows = element('ul', { class: 'sessions', 'aria-label': 'Finished sessions' });
  readonly root = element(
    'section',
    { class: 'shelf', 'aria-label': 'Finished', hidden: '' },
    element('h2', {}, 'Finished'),
    this.rows,
  );
  private shown: readonly FinishedRun[] = [];

  /** Those that are shown. */
  get runs(): readonly string[] {
    return this.shown.map(({ run }) => run);
  }

  show(runs: readonly FinishedRun[]): void {
    // A run does not change any more: its name says which it is.
    const same = runs.length === this.shown.length && runs.every(({ run }, i) => run === this.shown[i]?.run);
    if (same) return;
    this.shown = runs;
    this.root.hidden = runs.length === 0;
    this.rows.replaceChildren(...runs.map(row));
  }
}

function row(run: FinishedRun): HTMLElement {
  const thumbnail = element('span', { class: 'thumbnail' });
  if (run.files.includes(THUMBNAIL)) {
    const src = finishedFileUrl(run, THUMBNAIL);
    const alt = `Model of finished session ${run.session}`;
    const image = element('img', { src, alt, loading: 'lazy', decoding: 'async' });
    image.addEventListener('error', () => {
      image.hidden = true;
    });
    thumbnail.append(image);
  }
  const ended = new Date(run.endedMs);
  return element(
    'li',
    { class: 'session', 'data-run': run.run },
    thumbnail,
    element('span', { class: 'session-name' }, run.session),
    element('time', { class: 'session-health', datetime: ended.toISOString() }, ended.toLocaleString()),
    element('span', { class: 'downloads' }, ...finishedLinks(run)),
  );
}
