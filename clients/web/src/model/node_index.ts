import { NODE_STEP_M, type Nodes } from './nodes';

/** Nodes that move a point. */
export const MOVERS = 4;

const NEAREST = MOVERS + 1;
/** Slack of d_max, so that the sum of the weights is never 0. */
const OUTER_FACTOR = 1.001;
const OUTER_SLACK_M = 1e-6;
/** Cells along each axis, on both sides of the origin. */
const CELLS = 65536;

/**
 * Finds which nodes move a point and by how much (protocol/SPEC.md, "Warp"): the four nearest within reach, with
 * weights that vanish where a node comes or goes. The result of `bind` lies in `found` and `weights`.
 */
export class NodeIndex {
  /** Nodes of the last point bound, nearest first. */
  readonly found = new Int32Array(MOVERS);
  /** Their weights: they sum to 1, or all are 0. */
  readonly weights = new Float64Array(MOVERS);
  /** Positions of all nodes, metres. */
  readonly places: Float32Array;
  private readonly around = new Map<number, number[]>();
  private readonly squares = new Float64Array(NEAREST);
  private readonly nearest = new Int32Array(NEAREST);
  private lastKey = Number.NaN;
  private lastCandidates: readonly number[] = [];

  constructor(
    nodes: Nodes,
    private readonly reachM: number,
  ) {
    this.places = Float32Array.from(nodes.codes, (code) => code * NODE_STEP_M);
    if (!(reachM > 0)) return;
    for (let node = 0; node < nodes.ids.length; node++) this.enter(node);
  }

  private enter(node: number): void {
    const [x, y, z] = [0, 1, 2].map((axis) => this.cell(this.places[3 * node + axis] as number)) as [
      number,
      number,
      number,
    ];
    for (let i = 0; i < 27; i++) {
      const key = keyOf(x + (i % 3) - 1, y + (Math.floor(i / 3) % 3) - 1, z + Math.floor(i / 9) - 1);
      const list = this.around.get(key);
      if (list === undefined) this.around.set(key, [node]);
      else list.push(node);
    }
  }

  /** Finds the nodes of a point; false where none reaches it. */
  bind(x: number, y: number, z: number): boolean {
    const key = keyOf(this.cell(x), this.cell(y), this.cell(z));
    if (key !== this.lastKey) {
      this.lastKey = key;
      this.lastCandidates = this.around.get(key) ?? [];
    }
    this.squares.fill(this.reachM * this.reachM);
    this.nearest.fill(-1);
    for (const node of this.lastCandidates) {
      const dx = (this.places[3 * node] as number) - x;
      const dy = (this.places[3 * node + 1] as number) - y;
      const dz = (this.places[3 * node + 2] as number) - z;
      this.keep(node, dx * dx + dy * dy + dz * dz);
    }
    return this.weigh();
  }

  /** Candidates come by increasing id, so the lower id keeps its place at equal distance. */
  private keep(node: number, square: number): void {
    let place = NEAREST;
    while (place > 0 && square < (this.squares[place - 1] as number)) place -= 1;
    if (place === NEAREST) return;
    this.squares.copyWithin(place + 1, place, NEAREST - 1);
    this.nearest.copyWithin(place + 1, place, NEAREST - 1);
    this.squares[place] = square;
    this.nearest[place] = node;
  }

  private weigh(): boolean {
    const outerM = OUTER_FACTOR * Math.sqrt(this.squares[MOVERS] as number) + OUTER_SLACK_M;
    let sum = 0;
    for (let i = 0; i < MOVERS; i++) {
      const node = this.nearest[i] as number;
      const weight = node < 0 ? 0 : 1 - Math.sqrt(this.squares[i] as number) / outerM;
      this.found[i] = Math.max(node, 0);
      this.weights[i] = weight;
      sum += weight;
    }
    if (!(sum > 0)) return false;
    for (let i = 0; i < MOVERS; i++) this.weights[i] = (this.weights[i] as number) / sum;
    return true;
  }

  private cell(valueM: number): number {
    return Math.floor(valueM / this.reachM);
  }
}

/** A whole number for each cell; NaN, which equals nothing, for what is no place. */
function keyOf(x: number, y: number, z: number): number {
  const span = 2 * CELLS;
  return ((x + CELLS) * span + (y + CELLS)) * span + (z + CELLS);
}
