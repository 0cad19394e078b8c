import type { ReplayStatus } from '../page_status';
import { whyFailed } from '../server/access';
import type { ReplayChange } from '../server/sessions';
import { element, setData, setText } from '../ui/dom';
import { clock } from '../ui/wording';

/** What the timeline asks the server for. */
export interface TimelineActions {
  change(change: ReplayChange): Promise<void>;
  end(): Promise<void>;
}

/** What it shows. */
export interface TimelineState {
  /** Undefined where a cart feeds the session. */
  readonly replay: (ReplayStatus & { readonly recording: string }) | undefined;
  /** From the first pair to the newest. */
  readonly spanS: number;
  /** Whether pairs come now. */
  readonly live: boolean;
  /** Whether there is a session to be controlled. */
  readonly reachable: boolean;
}

/** Times the recorded pace; 0 is as fast as pairs are taken. */
const RATES = [0.25, 0.5, 1, 2, 4, 0] as const;
/** Arrow keys move by this. */
const STEP_S = 0.1;
/** A seek costs a reconstruction: of several in a row only the last is asked for. */
const SEEK_AFTER_MS = 400;
/** The server's position is not shown while a seek is under way, but for no longer than this. */
const SEEK_PATIENCE_MS = 3000;

/** The time of the session: how long it has run, or where the replay is, with what moves it. */
export class Timeline {
  private readonly mode = element('span', { class: 'timeline-mode' });
  private readonly play = element('button', {
    type: 'button',
    class: 'play',
    title: 'Play or pause (K)',
    'aria-keyshortcuts': 'k',
  });
  private readonly slider = element('input', {
    type: 'range',
    min: '0',
    step: String(STEP_S),
    'aria-label': 'Time in the recording',
    title: 'Another time begins the model anew',
  });
  private readonly time = element('span', { class: 'timeline-time' });
  private readonly rate = element('select', { 'aria-label': 'Rate of the replay' });
  private readonly endButton = element(
    'button',
    { type: 'button', title: 'End the replay; its results are kept' },
    'End',
  );
  private readonly controls = [this.play, this.slider, this.rate, this.endButton];
  private readonly message = element('p', { class: 'timeline-message', role: 'status', hidden: '' });
  readonly root = element(
    'section',
    { class: 'timeline', 'aria-label': 'Timeline' },
    this.play,
    this.mode,
    this.slider,
    this.time,
    this.rate,
    this.endButton,
    this.message,
  );
  /** What the button that plays asks for. */
  private next: ReplayChange = {};
  private seeking: { readonly toS: number; readonly sinceMs: number } | undefined;
  private seekTimer = 0;

  constructor(private readonly actions: TimelineActions) {
    for (const rate of RATES) this.rate.append(element('option', { value: String(rate) }, rateText(rate)));
    this.play.addEventListener('click', () => this.ask(actions.change(this.next)));
    this.slider.addEventListener('input', () => this.choose(Number(this.slider.value)));
    this.rate.addEventListener('change', () => this.ask(actions.change({ rate: Number(this.rate.value) })));
    this.endButton.addEventListener('click', () => this.ask(actions.end()));
  }

  show({ replay, spanS, live, reachable }: TimelineState): void {
    setData(this.root, 'kind', replay === undefined ? 'live' : 'replay');
    for (const control of this.controls) {
      control.hidden = replay === undefined;
      control.disabled = !reachable;
    }
    if (replay !== undefined) this.showReplay(replay);
    else {
      setText(this.mode, live ? 'Live' : 'No video');
      setData(this.mode, 'tone', live ? 'good' : 'quiet');
      setText(this.time, clock(spanS));
    }
  }

  dispose(): void {
    window.clearTimeout(this.seekTimer);
  }

  private showReplay(replay: NonNullable<TimelineState['replay']>): void {
    this.next = replay.ended ? { position_s: 0, paused: false } : { paused: !replay.paused };
    setText(this.mode, replay.recording);
    setData(this.mode, 'tone', 'quiet');
    setText(this.play, replay.ended ? 'Again' : replay.paused ? 'Play' : 'Pause');
    this.slider.max = String(replay.durationS);
    if (this.hasArrived(replay)) this.seeking = undefined;
    const positionS = this.seeking?.toS ?? replay.positionS;
    this.slider.value = String(positionS);
    this.showTime(positionS, replay.durationS);
    if (document.activeElement !== this.rate) this.showRate(replay.rate);
  }

  private hasArrived({ positionS }: ReplayStatus): boolean {
    if (this.seeking === undefined) return true;
    const { toS, sinceMs } = this.seeking;
    return Math.abs(positionS - toS) < 0.5 || performance.now() - sinceMs > SEEK_PATIENCE_MS;
  }

  private showTime(positionS: number, durationS: number): void {
    const text = `${clock(positionS)} of ${clock(durationS)}`;
    setText(this.time, text);
    this.slider.setAttribute('aria-valuetext', text);
  }

  /** The rate as it is, be it one that the list lacks. */
  private showRate(rate: number): void {
    if (![...this.rate.options].some(({ value }) => Number(value) === rate)) {
      this.rate.append(element('option', { value: String(rate) }, rateText(rate)));
    }
    this.rate.value = String(rate);
  }

  private choose(toS: number): void {
    this.seeking = { toS, sinceMs: performance.now() };
    this.showTime(toS, Number(this.slider.max));
    window.clearTimeout(this.seekTimer);
    this.seekTimer = window.setTimeout(
      () => this.ask(this.actions.change({ position_s: toS })),
      SEEK_AFTER_MS,
    );
  }

  private ask(asked: Promise<void>): void {
    asked.then(
      () => this.say(''),
      (error: unknown) => this.say(whyFailed(error)),
    );
  }

  private say(text: string): void {
    this.message.hidden = text === '';
    setText(this.message, text);
  }
}

function rateText(rate: number): string {
  return rate === 0 ? 'Fastest' : `${rate}×`;
}
