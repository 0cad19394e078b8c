/** Deformation nodes and their motion in whole numbers (protocol/SPEC.md): all who follow hold the same bits. */
import { nodeDigest } from './digest';
import { expectCount, unpackIds } from './numbers';
import { ProtocolError } from './protocol_error';

/** Step of node positions and translations, metres. */
export const NODE_STEP_M = 4e-6;
/** Step of the elements of A - I. */
const AFFINE_STEP = 1 / 4096;
const COMPONENTS = 12;
const POSITION_BYTES = 12;
const MAX_NODES = 65536;

/** Nodes by increasing id; three position codes each. */
export interface Nodes {
  readonly ids: Uint32Array;
  readonly codes: Int32Array;
}

/** No nodes: nothing deforms. */
export const NO_NODES: Nodes = { ids: new Uint32Array(0), codes: new Int32Array(0) };

/** Nodes as they are sent; absent ones are none. */
export function unpackNodes(packed: { ids: Uint8Array; positions: Uint8Array } | undefined): Nodes {
  if (packed === undefined) return NO_NODES;
  const ids = unpackIds('node ids', packed.ids);
  if (ids.length > MAX_NODES) throw tooManyNodes(ids.length);
  if (packed.positions.length % POSITION_BYTES !== 0) {
    throw new ProtocolError(`node positions has ${packed.positions.length} bytes, no multiple of 12`);
  }
  expectCount('node positions', packed.positions.length / POSITION_BYTES, ids.length);
  // A copy, because the bytes may begin anywhere.
  return { ids, codes: new Int32Array(packed.positions.slice().buffer) };
}

function tooManyNodes(got: number): ProtocolError {
  return new ProtocolError(`nodes has ${got} elements; the limit is ${MAX_NODES}`);
}

/** The transforms of `nodes` nodes, twelve codes each: t, then A - I by rows. Empty: nothing deforms. */
export function unpackTransforms(planes: Uint8Array, nodes: number): Int16Array {
  if (planes.length === 0) return new Int16Array(0);
  if (planes.length % (2 * COMPONENTS) !== 0) {
    throw new ProtocolError(`node_transforms has ${planes.length} bytes, no multiple of 24`);
  }
  expectCount('node_transforms', planes.length / (2 * COMPONENTS), nodes);
  const codes = new Int16Array(COMPONENTS * nodes);
  for (let component = 0; component < COMPONENTS; component++) {
    for (let node = 0; node < nodes; node++) {
      const low = planes[2 * component * nodes + node] as number;
      const high = planes[(2 * component + 1) * nodes + node] as number;
      const folded = low | (high << 8);
      codes[COMPONENTS * node + component] = (folded >>> 1) ^ -(folded & 1);
    }
  }
  return codes;
}

/** Metres of the translation component `axis`, or an element of A, from the codes of node `node`. */
export function translationM(codes: Int16Array, node: number, axis: number): number {
  return (codes[COMPONENTS * node + axis] as number) * NODE_STEP_M;
}

/** Element of A. */
export function affineElement(codes: Int16Array, node: number, row: number, column: number): number {
  const code = codes[COMPONENTS * node + 3 + 3 * row + column] as number;
  return (row === column ? 1 : 0) + code * AFFINE_STEP;
}

/** The nodes after an epoch: all move, then some go and others come. */
export function nodesAfter(held: Nodes, transforms: Int16Array, removed: Uint32Array, added: Nodes): Nodes {
  const codeOf = new Map<number, [number, number, number]>();
  held.ids.forEach((id, node) => {
    const code = (axis: number) =>
      ((held.codes[3 * node + axis] as number) + (transforms[COMPONENTS * node + axis] ?? 0)) | 0;
    codeOf.set(id, [code(0), code(1), code(2)]);
  });
  for (const id of removed) {
    if (!codeOf.delete(id)) throw new ProtocolError(`removed node ${id} is not held`);
  }
  added.ids.forEach((id, node) => {
    if (codeOf.has(id)) throw new ProtocolError(`added node ${id} is held already`);
    const code = (axis: number) => added.codes[3 * node + axis] as number;
    codeOf.set(id, [code(0), code(1), code(2)]);
  });
  if (codeOf.size > MAX_NODES) throw tooManyNodes(codeOf.size);
  const ids = Uint32Array.from(codeOf.keys()).sort();
  const codes = new Int32Array(3 * ids.length);
  ids.forEach((id, node) => {
    codes.set(codeOf.get(id) ?? [], 3 * node);
  });
  return { ids, codes };
}

/** The nodes' part of a model's digest. */
export function nodesDigest({ ids, codes }: Nodes): number {
  let sum = 0;
  ids.forEach((id, node) => {
    const code = (axis: number) => codes[3 * node + axis] as number;
    sum = (sum + nodeDigest(id, code(0), code(1), code(2))) >>> 0;
  });
  return sum;
}
