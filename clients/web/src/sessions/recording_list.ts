import type { Recording } from '../server/recordings';
import { element } from '../ui/dom';
import { bytes } from '../ui/wording';

/** Recordings that can be replayed, each with a button that does. */
export class RecordingList {
  private readonly rows = element('ul', { class: 'recordings', 'aria-label': 'Recordings' });
  readonly root = element(
    'section',
    { class: 'shelf', 'aria-label': 'Recordings to replay' },
    element('h2', {}, 'Recordings'),
    this.rows,
  );
  private shown: readonly Recording[] = [];

  constructor(private readonly replay: (recording: string) => void) {}

  /** Those that are shown. */
  get names(): readonly string[] {
    return this.shown.map(({ recording }) => recording);
  }

  show(recordings: readonly Recording[]): void {
    // Rows that are still the same stay, so that the keyboard's focus stays on them.
    if (JSON.stringify(recordings) === JSON.stringify(this.shown)) return;
    this.shown = recordings;
    this.rows.replaceChildren(...recordings.map((recording) => this.row(recording)));
  }

  /** While a session is being opened no other one is asked for. */
  wait(waiting: boolean): void {
    for (const button of this.rows.querySelectorAll('button')) button.disabled = waiting;
  }

  private row({ recording, bytes: size }: Recording): HTMLElement {
    const button = element(
      'button',
      { type: 'button', class: 'button', 'aria-label': `Replay ${recording}` },
      'Replay',
    );
    button.addEventListener('click', () => this.replay(recording));
    const name = element('span', { class: 'file-name' }, recording);
    const label = element('span', { class: 'file-size' }, bytes(size));
    return element('li', { 'data-recording': recording }, name, label, button);
  }
}
