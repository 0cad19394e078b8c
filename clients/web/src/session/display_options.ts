import { CLIP_DIRECTIONS, type ClipDirection } from '../scene/clipping';
import { COLORINGS, type Coloring, colorMapGradient } from '../scene/coloring';
import type { Legend } from '../scene/stage';
import { element, setText } from '../ui/dom';
import { remembered } from '../ui/settings';
import { count } from '../ui/wording';

/** What the controls do. */
export interface DisplayActions {
  coloring(coloring: Coloring): void;
  /** Undefined: nothing is cut away. */
  clip(direction: ClipDirection | undefined, share: number): void;
  moveClip(share: number): void;
  /** Surfels to be held at most; 0: all. */
  detail(maxSurfels: number): void;
}

const COLORING_NAMES: Readonly<Record<Coloring, string>> = {
  colour: 'Colour',
  shape: 'Shape',
  normal: 'Normals',
  confidence: 'Confidence',
  depth: 'Depth',
  age: 'Age',
  deformation: 'Deformation',
};
const CLIP_NAMES: Readonly<Record<ClipDirection, string>> = {
  view: 'From the front',
  x: 'From the left',
  y: 'From above',
  z: 'Along the scope’s start',
};
/** Times after which a model without news is hidden, in seconds; 0 never. */
const HIDE_AFTER_S = [0, 2, 5, 10, 30, 60];
const DEFAULT_HIDE_AFTER_S = 10;
const FIRST_CLIP_SHARE = 0.5;
/** What a device can be spared; 0: nothing. */
const MAX_SURFELS = [0, 300_000, 150_000, 75_000, 30_000];

/** How the model is shown: colouring with its legend, clipping plane, and when it is too old to be shown. */
export class DisplayOptions {
  private readonly coloring = select('Show', COLORINGS, (name) => COLORING_NAMES[name]);
  private readonly legendBar = element('div', { class: 'legend-bar' });
  private readonly legendText = element('p', { class: 'legend-text' });
  private readonly legend = element(
    'div',
    { class: 'legend', role: 'img', hidden: '' },
    this.legendBar,
    this.legendText,
  );
  private readonly clipping = select('Cut away', ['none', ...CLIP_DIRECTIONS] as const, (name) =>
    name === 'none' ? 'Nothing' : CLIP_NAMES[name],
  );
  private readonly share = element('input', {
    type: 'range',
    min: '0',
    max: '100',
    value: String(FIRST_CLIP_SHARE * 100),
    'aria-label': 'Clipping depth, percent',
    hidden: '',
  });
  private readonly hiding = select('Hide when older than', HIDE_AFTER_S.map(String), (seconds) =>
    seconds === '0' ? 'Never' : `${seconds} s`,
  );
  private readonly detail = select('Surfels at most', MAX_SURFELS.map(String), (surfels) =>
    surfels === '0' ? 'All' : count(Number(surfels)),
  );
  private readonly keptDetail = remembered('max-surfels', 0);
  private readonly hideAfter = remembered('hide-after-s', DEFAULT_HIDE_AFTER_S);
  readonly root = element(
    'section',
    { class: 'card options', 'aria-label': 'Display' },
    this.coloring.label,
    this.legend,
    this.clipping.label,
    this.share,
    this.hiding.label,
    this.detail.label,
  );

  constructor(private readonly actions: DisplayActions) {
    this.coloring.select.addEventListener('change', () => actions.coloring(this.coloring.value));
    this.clipping.select.addEventListener('change', () => this.chooseClip());
    this.share.addEventListener('input', () => actions.moveClip(this.clipShare));
    this.hiding.select.value = String(this.hideAfter.value);
    this.hiding.select.addEventListener('change', () => {
      this.hideAfter.value = Number(this.hiding.select.value);
    });
    this.detail.select.value = String(this.keptDetail.value);
    this.detail.select.addEventListener('change', () => {
      this.keptDetail.value = Number(this.detail.select.value);
      actions.detail(this.keptDetail.value);
    });
  }

  /** Surfels to be held at most; 0: all. */
  get maxSurfels(): number {
    return this.keptDetail.value;
  }

  /** Whether a model of this age is too old to be shown. */
  hides(ageMs: number | null): boolean {
    const limitS = this.hideAfter.value;
    return limitS > 0 && ageMs !== null && ageMs > 1000 * limitS;
  }

  /** Chooses the colouring `index` (from 0) of the list; false where there is none. */
  chooseColoring(index: number): boolean {
    const coloring = COLORINGS[index];
    if (coloring === undefined) return false;
    this.coloring.select.value = coloring;
    this.actions.coloring(coloring);
    return true;
  }

  showLegend(legend: Legend | undefined): void {
    this.legend.hidden = legend === undefined;
    if (legend === undefined) return;
    const { scale, range } = legend;
    const text = `${scale.title}: ${figure(range.low * scale.factor)} – ${figure(range.high * scale.factor)} ${scale.unit}`;
    this.legendBar.style.background = colorMapGradient(scale);
    setText(this.legendText, text.trim());
    this.legend.setAttribute('aria-label', text);
  }

  private get clipShare(): number {
    return Number(this.share.value) / 100;
  }

  private chooseClip(): void {
    const direction = this.clipping.value;
    this.share.hidden = direction === 'none';
    this.actions.clip(direction === 'none' ? undefined : direction, this.clipShare);
  }
}

function figure(value: number): string {
  return Math.abs(value) < 10 ? value.toFixed(1) : String(Math.round(value));
}

/** A labelled choice among named values. */
function select<T extends string>(label: string, values: readonly T[], nameOf: (value: T) => string) {
  const node = element('select');
  for (const value of values) node.append(element('option', { value }, nameOf(value)));
  return {
    select: node,
    label: element('label', { class: 'option' }, element('span', {}, label), node),
    get value(): T {
      return node.value as T;
    },
  };
}
