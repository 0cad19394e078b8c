import { create } from '@bufbuild/protobuf';
import { PackedNodesSchema } from '../src/generated/mis_slam/v1/model_pb';
import { NODE_STEP_M, type Nodes, nodesAfter, nodesDigest } from '../src/model/nodes';
import { packIds, packTransforms } from './fake_pack';
import { PATCH_M, type SyntheticSurface } from './synthetic_surface';

/** Nodes along each side of the patch. */
const SIDE = 16;
const SPACING_M = PATCH_M / (SIDE - 1);
const AFFINE_STEPS = 4096;
const NOTHING = { ids: new Uint32Array(0), codes: new Int32Array(0) };

/** Deformation nodes on a synthetic surface that rise and sink with it. */
export class FakeNodes {
  readonly reachM = 2 * SPACING_M;
  private nodes: Nodes;

  constructor(private readonly surface: SyntheticSurface) {
    const ids = Uint32Array.from({ length: SIDE * SIDE }, (_, id) => id);
    const codes = new Int32Array(3 * ids.length);
    ids.forEach((id) => {
      const [x, y] = placeOf(id);
      codes.set(
        [x, y, this.surface.heightM(x, y, 0)].map((value) => Math.round(value / NODE_STEP_M)),
        3 * id,
      );
    });
    this.nodes = { ids, codes };
  }

  get digest(): number {
    return nodesDigest(this.nodes);
  }

  get packed() {
    const { ids, codes } = this.nodes;
    return create(PackedNodesSchema, {
      ids: packIds([...ids]),
      positions: new Uint8Array(codes.slice().buffer),
    });
  }

  /** Moves the nodes from one time to another, and says by what. */
  move(fromS: number, toS: number): Uint8Array {
    const codes = [...this.nodes.ids].flatMap((id) => this.transform(id, fromS, toS));
    this.nodes = nodesAfter(this.nodes, Int16Array.from(codes), new Uint32Array(0), NOTHING);
    return packTransforms(codes);
  }

  /** A rise, and the change of slope around it. */
  private transform(id: number, fromS: number, toS: number): number[] {
    const [x, y] = placeOf(id);
    const risen = (dx: number, dy: number) =>
      this.surface.heightM(x + dx, y + dy, toS) - this.surface.heightM(x + dx, y + dy, fromS);
    const z = (this.nodes.codes[3 * id + 2] as number) * NODE_STEP_M;
    const rise = Math.round((this.surface.heightM(x, y, toS) - z) / NODE_STEP_M);
    const slope = (dx: number, dy: number) =>
      Math.round(((risen(dx, dy) - risen(0, 0)) / SPACING_M) * AFFINE_STEPS);
    return [0, 0, rise, 0, 0, 0, 0, 0, 0, slope(SPACING_M, 0), slope(0, SPACING_M), 0];
  }
}

function placeOf(id: number): [number, number] {
  const along = (place: number) => (place / (SIDE - 1) - 0.5) * PATCH_M;
  return [along(id % SIDE), 0.8 * along(Math.floor(id / SIDE))];
}
