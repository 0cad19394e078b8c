/**
 * The shortest way over the surface between two surfels: A* over a graph that joins points of the surface
 * within a reach of several point spacings, so that it hardly zigzags.
 */
import TinyQueue from 'tinyqueue';
import type { SurfelStore } from './surfel_store';

type Point = readonly [number, number, number];

export interface SurfacePath {
  readonly lengthM: number;
  readonly points: readonly Point[];
}

/** Points of the graph at most, which bounds the time (some ten milliseconds). */
const MAX_POINTS = 12_000;
const FINEST_CELL_M = 4e-4;
/** Edges reach so many cells: the graph's ways are then at most some 2 % longer than the surface's. */
const REACH_CELLS = 3;
/** Ways longer than this many times the straight distance are not looked for. */
const MAX_DETOUR = 1.8;
const DETOUR_FLOOR_M = 0.005;

/** Undefined where no way leads over the surface from one slot to the other. */
export function surfacePath(store: SurfelStore, from: number, to: number): SurfacePath | undefined {
  const start = store.position(from);
  const end = store.position(to);
  const graph = pointsBetween(store, start, end);
  const previous = shortestWays(graph);
  return previous === undefined ? undefined : pathTo(graph, previous);
}

/** One point in each cell of a grid; the first is where the way starts and the second where it ends. */
interface Graph {
  readonly points: readonly Point[];
  readonly cellM: number;
  readonly pointsOfCell: ReadonlyMap<number, readonly number[]>;
}

function pointsBetween(store: SurfelStore, start: Point, end: Point): Graph {
  const reachM = MAX_DETOUR * distance(start, end) + DETOUR_FLOOR_M;
  const inside: Point[] = [];
  for (let slot = 0; slot < store.size; slot++) {
    const point = store.position(slot);
    if (distance(point, start) + distance(point, end) <= reachM) inside.push(point);
  }
  let cellM = FINEST_CELL_M;
  let graph = thinned(start, end, inside, cellM);
  while (graph.points.length > MAX_POINTS) {
    // A surface has four times fewer cells of twice the size.
    cellM *= Math.max(1.1, Math.sqrt(graph.points.length / MAX_POINTS));
    graph = thinned(start, end, inside, cellM);
  }
  return graph;
}

function thinned(start: Point, end: Point, inside: readonly Point[], cellM: number): Graph {
  const points: Point[] = [];
  const pointsOfCell = new Map<number, number[]>();
  const add = (point: Point, always: boolean) => {
    const key = cellKey(cellOf(point, cellM));
    const held = pointsOfCell.get(key);
    if (held !== undefined && !always) return;
    pointsOfCell.set(key, [...(held ?? []), points.length]);
    points.push(point);
  };
  add(start, true);
  add(end, true);
  for (const point of inside) add(point, false);
  return { points, cellM, pointsOfCell };
}

/** A point reached on a way of this length; any way on from it to the end is at least so long in all. */
interface Candidate {
  readonly point: number;
  readonly lengthM: number;
  readonly atLeastM: number;
}

/** The point before each on its shortest way from the first, or undefined where the second is not reached. */
function shortestWays(graph: Graph): Int32Array | undefined {
  const lengths = new Float64Array(graph.points.length).fill(Number.POSITIVE_INFINITY);
  const previous = new Int32Array(graph.points.length).fill(-1);
  const queue = new TinyQueue<Candidate>([], (a, b) => a.atLeastM - b.atLeastM);
  const end = graph.points[1] as Point;
  const consider = (point: number, lengthM: number, from: number) => {
    if (lengthM >= (lengths[point] as number)) return;
    lengths[point] = lengthM;
    previous[point] = from;
    queue.push({ point, lengthM, atLeastM: lengthM + distance(graph.points[point] as Point, end) });
  };
  consider(0, 0, -1);
  for (let next = queue.pop(); next !== undefined; next = queue.pop()) {
    const { point: from, lengthM } = next;
    if (from === 1) return previous;
    if (lengthM > (lengths[from] as number)) continue;
    for (const { point, edgeM } of neighbours(graph, from)) consider(point, lengthM + edgeM, from);
  }
  return undefined;
}

function* neighbours(graph: Graph, index: number): Generator<{ point: number; edgeM: number }> {
  const at = graph.points[index] as Point;
  const [cx, cy, cz] = cellOf(at, graph.cellM);
  for (let dx = -REACH_CELLS; dx <= REACH_CELLS; dx++) {
    for (let dy = -REACH_CELLS; dy <= REACH_CELLS; dy++) {
      for (let dz = -REACH_CELLS; dz <= REACH_CELLS; dz++) {
        for (const point of graph.pointsOfCell.get(cellKey([cx + dx, cy + dy, cz + dz])) ?? []) {
          const edgeM = distance(at, graph.points[point] as Point);
          if (point !== index && edgeM <= REACH_CELLS * graph.cellM) yield { point, edgeM };
        }
      }
    }
  }
}

function pathTo(graph: Graph, previous: Int32Array): SurfacePath {
  const points: Point[] = [];
  let lengthM = 0;
  for (let point = 1; point >= 0; point = previous[point] as number) {
    const position = graph.points[point] as Point;
    const last = points.at(-1);
    if (last !== undefined) lengthM += distance(last, position);
    points.push(position);
  }
  return { lengthM, points: points.reverse() };
}

function cellOf([x, y, z]: Point, cellM: number): Point {
  return [Math.floor(x / cellM), Math.floor(y / cellM), Math.floor(z / cellM)];
}

/** Exact for cells within +-65536 of the origin: 26 m at the finest cell. */
function cellKey([x, y, z]: Point): number {
  return ((x + 65536) * 131072 + (y + 65536)) * 131072 + (z + 65536);
}

function distance(a: Point, b: Point): number {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}
