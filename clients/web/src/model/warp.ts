import { MOVERS, NodeIndex } from './node_index';
import { affineElement, type Nodes, translationM } from './nodes';

/** Numbers per node: A by rows, A^-T by rows, t. */
const PER_NODE = 21;

/**
 * The motion of surfels over one epoch (protocol/SPEC.md, "Warp"):
 * v' = sum w (A (v - g) + g + t), n' = sum w A^-T n, normalised. What would not be finite stays where it is.
 */
export class Warp {
  private readonly index: NodeIndex;
  private readonly motions: Float64Array;
  private readonly moves: boolean[];
  private readonly moved = new Float64Array(3);
  private readonly turned = new Float64Array(3);

  /** `transforms` of `nodes` in the places that they have before the epoch. */
  constructor(nodes: Nodes, reachM: number, transforms: Int16Array) {
    this.index = new NodeIndex(nodes, reachM);
    this.motions = new Float64Array(PER_NODE * nodes.ids.length);
    this.moves = Array.from(nodes.ids, (_, node) =>
      transforms.subarray(12 * node, 12 * node + 12).some((code) => code !== 0),
    );
    for (let node = 0; node < nodes.ids.length; node++) this.prepare(node, transforms);
  }

  private prepare(node: number, transforms: Int16Array): void {
    const a = Array.from({ length: 9 }, (_, i) => affineElement(transforms, node, Math.floor(i / 3), i % 3));
    const at = (row: number, column: number) => a[3 * (row % 3) + (column % 3)] as number;
    const cofactor = (row: number, column: number) =>
      at(row + 1, column + 1) * at(row + 2, column + 2) - at(row + 1, column + 2) * at(row + 2, column + 1);
    const determinant = at(0, 0) * cofactor(0, 0) + at(0, 1) * cofactor(0, 1) + at(0, 2) * cofactor(0, 2);
    const start = PER_NODE * node;
    for (let i = 0; i < 9; i++) {
      this.motions[start + i] = a[i] as number;
      this.motions[start + 9 + i] = cofactor(Math.floor(i / 3), i % 3) / determinant;
    }
    for (let axis = 0; axis < 3; axis++) {
      this.motions[start + 18 + axis] = translationM(transforms, node, axis);
    }
  }

  /** Moves the surfel whose position and normal begin at `at` of both arrays; false where it stays. */
  apply(positions: Float32Array, p: number, normals: Float32Array, n: number): boolean {
    const [x, y, z] = [positions[p], positions[p + 1], positions[p + 2]] as [number, number, number];
    if (!this.index.bind(x, y, z) || !this.isMoved()) return false;
    const [nx, ny, nz] = [normals[n], normals[n + 1], normals[n + 2]] as [number, number, number];
    this.moved.fill(0);
    this.turned.fill(0);
    for (let i = 0; i < MOVERS; i++) this.add(i, x, y, z, nx, ny, nz);
    const [mx, my, mz] = this.moved as unknown as [number, number, number];
    const [tx, ty, tz] = this.turned as unknown as [number, number, number];
    const length = Math.hypot(tx, ty, tz);
    if (!(length > 0) || !Number.isFinite(mx + my + mz + length)) return false;
    positions[p] = mx;
    positions[p + 1] = my;
    positions[p + 2] = mz;
    normals[n] = tx / length;
    normals[n + 1] = ty / length;
    normals[n + 2] = tz / length;
    return true;
  }

  private isMoved(): boolean {
    const { found, weights } = this.index;
    for (let i = 0; i < MOVERS; i++) {
      if ((weights[i] as number) > 0 && this.moves[found[i] as number]) return true;
    }
    return false;
  }

  /** One node's share. */
  private add(i: number, x: number, y: number, z: number, nx: number, ny: number, nz: number): void {
    const weight = this.index.weights[i] as number;
    if (weight === 0) return;
    const node = this.index.found[i] as number;
    const m = this.motions;
    const { places } = this.index;
    const dx = x - (places[3 * node] as number);
    const dy = y - (places[3 * node + 1] as number);
    const dz = z - (places[3 * node + 2] as number);
    for (let row = 0; row < 3; row++) {
      const a = PER_NODE * node + 3 * row;
      const arm = (m[a] as number) * dx + (m[a + 1] as number) * dy + (m[a + 2] as number) * dz;
      const normal = (m[a + 9] as number) * nx + (m[a + 10] as number) * ny + (m[a + 11] as number) * nz;
      const centre = (places[3 * node + row] as number) + (m[PER_NODE * node + 18 + row] as number);
      this.moved[row] = (this.moved[row] as number) + weight * (centre + arm);
      this.turned[row] = (this.turned[row] as number) + weight * normal;
    }
  }
}
