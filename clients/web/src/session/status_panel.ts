import { Reason } from '../generated/mis_slam/v1/control_pb';
import { element, setData, setText } from '../ui/dom';
import {
  age,
  ageTone,
  bitRate,
  count,
  perSecond,
  type ReplayStanding,
  type Tone,
  trackingWording,
  viewedStatusWording,
} from '../ui/wording';

/** What the panel shows. */
export interface Figures {
  readonly connection: string;
  readonly status: string;
  readonly replay: ReplayStanding | null;
  readonly tracking: string;
  /** Fitness of the newest picture: `good`, `black`, `frozen`, `blurred`; empty before the first. */
  readonly picture: string;
  readonly surfels: number;
  readonly serverSurfels: number;
  /** Whether the model is complete; else a snapshot is on its way. */
  readonly following: boolean;
  readonly epoch: number;
  readonly ageMs: number | null;
  readonly poseAgeMs: number | null;
  readonly latencyMs: number | null;
  readonly matchedFeatures: number | null;
  readonly videoPerS: number;
  readonly posesPerS: number;
  readonly epochsPerS: number;
  readonly bitsPerS: number;
  readonly viewers: number;
  /** Pairs refused or dropped since the session opened, by reason. */
  readonly drops: readonly { readonly reason: Reason; readonly count: bigint }[];
}

const ROWS = {
  status: 'Session',
  tracking: 'Tracking',
  picture: 'Picture',
  surfels: 'Surfels',
  epoch: 'Model epoch',
  modelAge: 'Model age',
  poseAge: 'Pose age',
  latency: 'Pose latency',
  features: 'Features matched',
  video: 'Video in',
  poses: 'Poses',
  epochs: 'Model updates',
  bits: 'Stream',
  viewers: 'Viewers',
  drops: 'Dropped',
} as const;

type Row = keyof typeof ROWS;

/** A table of figures about the session. */
export class StatusPanel {
  private readonly values = new Map<Row, HTMLElement>();
  readonly root: HTMLElement;

  constructor() {
    const list = element('dl');
    for (const row of Object.keys(ROWS) as Row[]) {
      const value = element('dd', { 'data-row': row });
      this.values.set(row, value);
      list.append(element('div', {}, element('dt', {}, ROWS[row]), value));
    }
    this.root = element('section', { class: 'card figures', 'aria-label': 'Status' }, list);
  }

  show(figures: Figures): void {
    const status = viewedStatusWording(figures.status, figures.connection, figures.replay);
    const tracking = trackingWording(figures.tracking);
    const trackingNow = figures.connection === 'open' && figures.status !== 'source_lost';
    const partly = figures.following ? '' : ` of ${count(figures.serverSurfels)}`;
    this.set('status', status.text, status.tone);
    this.set('tracking', trackingNow ? tracking.text : '–', tracking.tone);
    this.set('picture', pictureText(figures.picture), figures.picture === 'good' ? undefined : 'warning');
    this.set('surfels', count(figures.surfels) + partly);
    this.set('epoch', count(figures.epoch));
    this.set('modelAge', age(figures.ageMs), ageTone(figures.ageMs));
    this.set('poseAge', age(figures.poseAgeMs));
    this.set('latency', figures.latencyMs === null ? '–' : `${Math.round(figures.latencyMs)} ms`);
    this.set('features', figures.matchedFeatures === null ? '–' : count(figures.matchedFeatures));
    this.set('video', perSecond(figures.videoPerS));
    this.set('poses', perSecond(figures.posesPerS));
    this.set('epochs', perSecond(figures.epochsPerS));
    this.set('bits', bitRate(figures.bitsPerS));
    this.set('viewers', count(figures.viewers));
    this.set('drops', dropsText(figures.drops));
  }

  private set(row: Row, text: string, tone?: Tone): void {
    const value = this.values.get(row);
    if (value === undefined) return;
    setText(value, text);
    setData(value, 'tone', tone ?? '');
  }
}

function pictureText(picture: string): string {
  return picture === '' ? '–' : picture.charAt(0).toUpperCase() + picture.slice(1);
}

/** `12 superseded, 1 unpaired`. */
function dropsText(drops: Figures['drops']): string {
  const parts = drops.map((drop) => {
    const reason = Reason[drop.reason] ?? 'unknown';
    return `${count(Number(drop.count))} ${reason.toLowerCase().replaceAll('_', ' ')}`;
  });
  return parts.length === 0 ? 'None' : parts.join(', ');
}
