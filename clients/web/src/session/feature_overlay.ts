import type { ImageFeatures } from '../generated/mis_slam/v1/image_pb';
import { element } from '../ui/dom';
import { remembered } from '../ui/settings';

/** Steps of a pixel in which features come. */
const STEPS_PER_PX = 4;
/** Half the side of a mark, in pixels of an image this wide; wider images get larger marks. */
const MARK_PX = 3;
const MARK_FOR_WIDTH_PX = 640;

const COLORS = { matched: '#7cf08a', deforming: '#ffab40', others: '#8fb4ff' } as const;
const LEGEND = 'Green: matched to the map. Orange: on tissue that deforms. Blue: others.';

/** The tracker's features over the scope's image, where they are wanted. */
export class FeatureOverlay {
  private readonly button = element(
    'button',
    { type: 'button', class: 'feature-toggle', title: `${LEGEND} (T)`, 'aria-keyshortcuts': 't' },
    'Features',
  );
  readonly canvas = element('canvas', { class: 'features', role: 'img', 'aria-label': LEGEND, hidden: '' });
  private readonly kept = remembered('features', 0);
  private found: ImageFeatures | undefined;
  private stampNs: bigint | undefined;
  private drawn = 0;

  /** `wanted` is told when they are wanted or not any more. */
  constructor(private readonly wanted: (on: boolean) => void) {
    this.button.addEventListener('click', () => this.turn(!this.on));
    this.reflect();
  }

  /** Whether they are wanted. */
  get on(): boolean {
    return this.kept.value === 1;
  }

  /** The button that asks for them. */
  get toggle(): HTMLButtonElement {
    return this.button;
  }

  /** Features in the image shown. */
  get count(): number {
    return this.drawn;
  }

  /** Features came, of an image that is shown or will be. */
  take(features: ImageFeatures): void {
    this.found = features;
    this.draw();
  }

  /** Another image is shown. */
  imageShown(stampNs: bigint, width: number, height: number): void {
    this.stampNs = stampNs;
    this.canvas.width = width;
    this.canvas.height = height;
    this.draw();
  }

  private turn(on: boolean): void {
    this.kept.value = on ? 1 : 0;
    this.found = undefined;
    this.reflect();
    this.draw();
    this.wanted(on);
  }

  private reflect(): void {
    this.button.setAttribute('aria-pressed', String(this.on));
    this.canvas.hidden = !this.on;
  }

  /** Those of another image than the one shown would lie beside what they mark. */
  private draw(): void {
    const context = this.canvas.getContext('2d');
    if (context === null) return;
    const { width, height } = this.canvas;
    context.clearRect(0, 0, width, height);
    this.drawn = 0;
    if (!this.on || this.found === undefined || this.found.stampNs !== this.stampNs) return;
    const markPx = MARK_PX * Math.max(1, width / MARK_FOR_WIDTH_PX);
    context.lineWidth = markPx / 3;
    const { others, matched, deforming } = this.found;
    this.drawn += marks(context, others, COLORS.others, markPx);
    this.drawn += marks(context, matched, COLORS.matched, markPx);
    this.drawn += moves(context, deforming, markPx);
  }
}

/** A square about each place; how many there were. */
function marks(
  context: CanvasRenderingContext2D,
  places: readonly number[],
  color: string,
  markPx: number,
): number {
  context.strokeStyle = color;
  for (let i = 0; i + 1 < places.length; i += 2) mark(context, px(places[i]), px(places[i + 1]), markPx);
  return Math.floor(places.length / 2);
}

/** A square about each place, and a line from where it was. */
function moves(context: CanvasRenderingContext2D, places: readonly number[], markPx: number): number {
  context.strokeStyle = COLORS.deforming;
  for (let i = 0; i + 3 < places.length; i += 4) {
    const [x, y] = [px(places[i]), px(places[i + 1])];
    mark(context, x, y, markPx);
    context.beginPath();
    context.moveTo(px(places[i + 2]), px(places[i + 3]));
    context.lineTo(x, y);
    context.stroke();
  }
  return Math.floor(places.length / 4);
}

function mark(context: CanvasRenderingContext2D, x: number, y: number, markPx: number): void {
  context.strokeRect(x - markPx, y - markPx, 2 * markPx, 2 * markPx);
}

/** Pixel centres are at integers in the protocol, and half a pixel further on a canvas. */
function px(steps: number | undefined): number {
  return (steps ?? 0) / STEPS_PER_PX + 0.5;
}
