import { whyFailed } from '../server/access';
import { fetchFinished } from '../server/finished';
import { fetchFile } from '../server/sessions';
import { element, setText } from '../ui/dom';
import { finishedLinks, saveBlob, timeForName } from '../ui/downloads';

const LIVE_FILES = { 'model.ply': 'Model (PLY)', 'trajectory.tum': 'Trajectory (TUM)' } as const;
type LiveFile = keyof typeof LIVE_FILES;

/** Results are written after a session has closed: they are looked for again after this time. */
const LOOK_AGAIN_MS = 2000;

/** What can be taken away: the model and the trajectory as they are now, or the files that the ended session left. */
export class FilePanel {
  private readonly files = element('div', { class: 'downloads' });
  private readonly message = element('p', { class: 'message', role: 'status', hidden: '' });
  readonly root = element(
    'section',
    { class: 'card files', 'aria-label': 'Files' },
    element('h2', {}, 'Download'),
    this.files,
    this.message,
  );
  private readonly closing = new AbortController();
  private lookedMs = Number.NEGATIVE_INFINITY;
  private found = false;

  constructor(private readonly session: string) {
    const names = Object.keys(LIVE_FILES) as LiveFile[];
    this.files.append(...names.map((file) => this.liveButton(file)));
  }

  dispose(): void {
    this.closing.abort();
  }

  /** The session is not open any more: its files are looked for until they are there. */
  sessionEnded(nowMs: number): void {
    if (this.found || nowMs - this.lookedMs < LOOK_AGAIN_MS) return;
    this.lookedMs = nowMs;
    this.lookForFinished().catch((error: unknown) => this.say(whyFailed(error)));
  }

  private async lookForFinished(): Promise<void> {
    const runs = await fetchFinished(this.closing.signal);
    const newest = runs.find(({ session }) => session === this.session);
    this.found = newest !== undefined;
    if (newest === undefined) {
      this.files.replaceChildren();
      this.say('The session has ended. Nothing of it is kept yet.');
    } else {
      this.files.replaceChildren(...finishedLinks(newest));
      this.say('');
    }
  }

  private liveButton(file: LiveFile): HTMLButtonElement {
    const label = LIVE_FILES[file];
    const button = element('button', { type: 'button', class: 'download' }, label);
    button.addEventListener('click', () => void this.save(file, button));
    return button;
  }

  private async save(file: LiveFile, button: HTMLButtonElement): Promise<void> {
    button.disabled = true;
    try {
      saveBlob(await fetchFile(this.session, file), `${this.session}-${timeForName()}-${file}`);
      this.say('');
    } catch (error) {
      this.say(whyFailed(error));
    } finally {
      button.disabled = false;
    }
  }

  private say(text: string): void {
    if (this.closing.signal.aborted) return;
    this.message.hidden = text === '';
    setText(this.message, text);
  }
}
