import { pictureUrl, type SessionSummary } from '../server/sessions';
import { element } from '../ui/dom';

/** Drawing it takes its turn on the server's GPU: a model changes little in this time. */
const REFRESH_MS = 15_000;
/** Twice what is shown, for dense screens. */
const SIZE_PX = { width: 192, height: 144 } as const;

/** The picture of a session's model in the list. Its place is kept while there is none. */
export class Thumbnail {
  private readonly image: HTMLImageElement;
  readonly root: HTMLElement;
  private askedMs = Number.NEGATIVE_INFINITY;

  constructor(readonly session: string) {
    const { width, height } = SIZE_PX;
    this.image = element('img', {
      alt: `Model of session ${session}`,
      width: String(width),
      height: String(height),
      loading: 'lazy',
      decoding: 'async',
      hidden: '',
    });
    this.image.addEventListener('error', () => {
      this.image.hidden = true;
    });
    this.root = element('span', { class: 'thumbnail' }, this.image);
  }

  /** Asks for a new picture where one is due, there is something to be seen and somebody may be looking. */
  show(summary: SessionSummary, nowMs: number): void {
    if (summary.surfels === 0 || document.hidden || nowMs - this.askedMs < REFRESH_MS) return;
    this.askedMs = nowMs;
    // A lazy image that is not displayed would never be loaded.
    this.image.hidden = false;
    this.image.src = pictureUrl(this.session, SIZE_PX, summary.epoch);
  }
}
