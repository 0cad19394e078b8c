import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import { element } from '../ui/dom';

/** What is plotted, sampled at one time; null where nothing is known. */
export interface Sample {
  readonly latencyMs: number | null;
  readonly ageMs: number | null;
  readonly bitsPerS: number;
}

const WINDOW_S = 60;
const SAMPLES_PER_S = 2;
const HEIGHT_PX = 92;

interface Curve {
  readonly title: string;
  readonly color: string;
  readonly figureOf: (sample: Sample) => number | null;
}

const CURVES: readonly Curve[] = [
  { title: 'Pose latency, ms', color: '#6cc3cd', figureOf: (sample) => sample.latencyMs },
  { title: 'Model age, ms', color: '#e3b15c', figureOf: (sample) => sample.ageMs },
  { title: 'Stream, Mbit/s', color: '#7cc79a', figureOf: (sample) => sample.bitsPerS / 1e6 },
];

/** The last minute of latency, age and bandwidth as curves. Nothing is drawn while it is folded. */
export class Plots {
  private readonly body = element('div', { class: 'plots' });
  readonly root = element(
    'details',
    { class: 'card' },
    element('summary', {}, 'Latency and bandwidth'),
    this.body,
  );
  private readonly times: number[] = [];
  private readonly values: (number | null)[][] = CURVES.map(() => []);
  private plots: uPlot[] = [];

  constructor() {
    this.root.addEventListener('toggle', () => {
      if (this.root.open) this.draw();
    });
  }

  /** Takes a sample, at most two a second are kept. */
  add(nowMs: number, sample: Sample): void {
    const timeS = nowMs / 1000;
    if (timeS - (this.times.at(-1) ?? Number.NEGATIVE_INFINITY) < 1 / SAMPLES_PER_S) return;
    this.times.push(timeS);
    CURVES.forEach(({ figureOf }, i) => {
      this.values[i]?.push(figureOf(sample));
    });
    while ((this.times[0] ?? timeS) < timeS - WINDOW_S) {
      this.times.shift();
      for (const values of this.values) values.shift();
    }
    if (this.root.open) this.draw();
  }

  dispose(): void {
    for (const plot of this.plots) plot.destroy();
    this.plots = [];
  }

  private draw(): void {
    if (this.plots.length === 0) this.plots = CURVES.map((curve) => plotOf(curve, this.body));
    const nowS = this.times.at(-1) ?? 0;
    const ages = this.times.map((timeS) => timeS - nowS);
    this.plots.forEach((plot, i) => {
      if (plot.width !== this.body.clientWidth) {
        plot.setSize({ width: this.body.clientWidth, height: HEIGHT_PX });
      }
      plot.setData([ages, this.values[i] ?? []]);
    });
  }
}

function plotOf({ title, color }: Curve, parent: HTMLElement): uPlot {
  const grid = { stroke: '#22303a', width: 1 };
  const axis = { stroke: '#8fa0ac', grid, ticks: { show: false }, font: '11px system-ui' };
  const options: uPlot.Options = {
    title,
    width: Math.max(parent.clientWidth, 100),
    height: HEIGHT_PX,
    cursor: { show: false },
    legend: { show: false },
    scales: {
      x: { time: false, range: [-WINDOW_S, 0] },
      y: { range: (_plot, _low, high) => [0, Math.max(high, 1e-3) * 1.1] },
    },
    axes: [
      { ...axis, size: 20, values: (_plot, splits) => splits.map((split) => `${split} s`) },
      { ...axis, size: 42 },
    ],
    series: [{}, { stroke: color, width: 1.5, points: { show: false } }],
  };
  return new uPlot(options, [[], []], parent);
}
