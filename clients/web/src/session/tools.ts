import { Anchor } from '../measure/anchor';
import { lengthText, Measurement, type Reading } from '../measure/measurement';
import type { SurfelStore } from '../model/surfel_store';
import type { Mark } from '../scene/marks';
import type { Stage } from '../scene/stage';

/** What a click on the model does. */
export type Tool = 'look' | 'measure' | 'annotate';

/** A pointer that moved farther than this between press and release turned the view and meant no place. */
const CLICK_SLACK_PX = 5;

/** What measurements depend on beside the surfels. */
export interface ModelState {
  readonly epoch: number;
  /** Bound of the distance between a surfel shown and the server's, in metres. */
  readonly errorM: number;
}

/** Reacts to what the tools make. */
export interface ToolEvents {
  /** A surfel was chosen to be annotated. */
  annotate(surfel: number): void;
  /** Measurements came or went. */
  changed(): void;
}

/** The tools that take places on the model, by pointer or (at the middle of the view) by Enter. */
export class Tools {
  private tool: Tool = 'look';
  private pending: Anchor | undefined;
  private measurements: Measurement[] = [];
  private lastMm: readonly number[] = [];
  private pressedAt: { x: number; y: number } | undefined;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly stage: Stage,
    private readonly store: SurfelStore,
    private readonly events: ToolEvents,
  ) {
    canvas.addEventListener('pointerdown', this.onPress);
    canvas.addEventListener('pointerup', this.onRelease);
    canvas.addEventListener('keydown', this.onKey);
  }

  get chosen(): Tool {
    return this.tool;
  }

  /** Chooses a tool; a measurement half made is forgotten. */
  choose(tool: Tool): void {
    this.tool = tool;
    this.pending = undefined;
    this.canvas.dataset.tool = tool;
    this.events.changed();
  }

  remove(index: number): void {
    this.measurements.splice(index, 1);
    this.events.changed();
  }

  /** Forgets all measurements. */
  clear(): void {
    this.measurements = [];
    this.pending = undefined;
    this.events.changed();
  }

  /** Whether anything has to be kept up with the model. */
  get inUse(): boolean {
    return this.measurements.length > 0 || this.pending !== undefined;
  }

  /** The straight distances last read, in millimetres. */
  get measuredMm(): readonly number[] {
    return this.lastMm;
  }

  readings(model: ModelState): Reading[] {
    const readings = this.measurements.map((measurement) => measurement.read(model.epoch, model.errorM));
    this.lastMm = readings.map(({ straight }) => straight.valueM * 1000);
    return readings;
  }

  /** What of the measurements is drawn on the model. */
  marks(readings: readonly Reading[]): Mark[] {
    const marks: Mark[] = readings.map((reading, i) => measurementMark(reading, i));
    if (this.pending === undefined) return marks;
    this.pending.follow();
    const { position } = this.pending;
    marks.push({ line: [], dots: [position], labelAt: position, text: '', kind: 'pending', dimmed: false });
    return marks;
  }

  dispose(): void {
    this.canvas.removeEventListener('pointerdown', this.onPress);
    this.canvas.removeEventListener('pointerup', this.onRelease);
    this.canvas.removeEventListener('keydown', this.onKey);
  }

  private readonly onPress = (event: PointerEvent): void => {
    this.pressedAt =
      event.isPrimary && event.button === 0 ? { x: event.clientX, y: event.clientY } : undefined;
  };

  private readonly onRelease = (event: PointerEvent): void => {
    const pressed = this.pressedAt;
    this.pressedAt = undefined;
    if (pressed === undefined || !event.isPrimary) return;
    const moved = Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y);
    if (moved <= CLICK_SLACK_PX) this.place(event.clientX, event.clientY);
  };

  private readonly onKey = (event: KeyboardEvent): void => {
    if (event.key !== 'Enter' || this.tool === 'look') return;
    event.preventDefault();
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    this.place(left + width / 2, top + height / 2);
  };

  private place(clientX: number, clientY: number): void {
    if (this.tool === 'look') return;
    const surfel = this.stage.pick(clientX, clientY);
    if (surfel === undefined) return;
    if (this.tool === 'annotate') this.events.annotate(surfel);
    else this.measureTo(surfel);
  }

  /** Takes a surfel as the next end of a measurement. */
  measureTo(surfel: number): void {
    if (this.pending === undefined) this.pending = new Anchor(this.store, surfel);
    else if (surfel !== this.pending.surfelId) {
      this.measurements.push(new Measurement(this.store, this.pending.surfelId, surfel));
      this.pending = undefined;
    }
    this.events.changed();
  }
}

function measurementMark({ line, straight, surface, held }: Reading, index: number): Mark {
  const ends = [line[0], line.at(-1)].filter((point) => point !== undefined);
  const middle = line[Math.floor(line.length / 2)] ?? [0, 0, 0];
  const text = `${index + 1}: ${lengthText(surface ?? straight)}`;
  return { line, dots: ends, labelAt: middle, text, kind: 'measurement', dimmed: !held };
}
