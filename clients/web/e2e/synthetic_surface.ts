/** A patch of breathing tissue: packed surfels, cheap enough to make thousands of them at every epoch. */
import type { Surfel } from '../src/model/surfel_record';

/** Width of the patch. */
export const PATCH_M = 0.09;
const DEPTH_M = 0.085;
const POSITION_STEP_M = 2e-5;
const POSITION_ZERO = 1 << 20;
const NORMAL_ZERO = 2047;

/** The surface as `side` x `side` surfels; the id of a surfel is its place in the grid. */
export class SyntheticSurface {
  readonly side: number;

  constructor(surfels: number) {
    this.side = Math.round(Math.sqrt(surfels));
  }

  get size(): number {
    return this.side * this.side;
  }

  /** Distance from the camera at a place of the patch. */
  heightM(x: number, y: number, timeS: number): number {
    return heightM(x, y, timeS);
  }

  /** Writes the 16-byte records of `ids` at `timeS`. */
  pack(ids: readonly number[], timeS: number): Uint8Array {
    const bytes = new Uint8Array(ids.length * 16);
    const view = new DataView(bytes.buffer);
    ids.forEach((id, i) => {
      this.packOne(view, 16 * i, id, timeS);
    });
    return bytes;
  }

  private packOne(view: DataView, offset: number, id: number, timeS: number): void {
    const x = ((id % this.side) / (this.side - 1) - 0.5) * PATCH_M;
    const y = (Math.floor(id / this.side) / (this.side - 1) - 0.5) * PATCH_M * 0.8;
    const step = 1e-4;
    const z = heightM(x, y, timeS);
    const slopeX = (heightM(x + step, y, timeS) - z) / step;
    const slopeY = (heightM(x, y + step, timeS) - z) / step;
    const [red, green, blue] = tissueColor(x, y, -slopeX - slopeY);
    packSurfel(view, offset, {
      positionM: [x, y, z],
      normal: [slopeX, slopeY, -1],
      radiusM: PATCH_M / this.side,
      color: [red, green, blue],
      confidence: 200 / 255,
    });
  }
}

/** Writes the record of a surfel; its normal may have any length. */
export function packSurfel(view: DataView, offset: number, surfel: Surfel): void {
  const [red, green, blue] = surfel.color;
  const radiusCode = Math.round(16 * Math.log2(surfel.radiusM / 1e-5));
  const confidence = Math.round(surfel.confidence * 255);
  packPosition(view, offset, ...surfel.positionM);
  view.setUint32(offset + 8, (packNormal(...surfel.normal) | (radiusCode << 24)) >>> 0, true);
  view.setUint32(offset + 12, (red | (green << 8) | (blue << 16) | (confidence << 24)) >>> 0, true);
}

function heightM(x: number, y: number, timeS: number): number {
  const breath = 0.004 * Math.sin(1.6 * timeS) * Math.exp(-((x * x + y * y) / 0.0012));
  const folds = 0.0035 * Math.sin(95 * x + 30 * y) + 0.002 * Math.sin(140 * y - 60 * x);
  return DEPTH_M + folds - breath + 4 * (x * x + y * y);
}

function tissueColor(x: number, y: number, light: number): [number, number, number] {
  const vessel = Math.exp(-((Math.sin(70 * x + 3 * Math.sin(60 * y)) / 0.12) ** 2));
  const mottling = Math.sin(410 * x) * Math.sin(370 * y) + 0.5 * Math.sin(900 * x + 700 * y);
  const shade = 1 - 110 * (x * x + y * y) * 0.5 + 0.22 * light + 0.05 * mottling;
  const channel = (base: number, vesselShare: number) =>
    Math.max(0, Math.min(255, Math.round(base * shade * (1 - vesselShare * vessel))));
  return [channel(205, 0.25), channel(112, 0.5), channel(98, 0.45)];
}

function packPosition(view: DataView, offset: number, x: number, y: number, z: number): void {
  const [a, b, c] = [x, y, z].map((value) => BigInt(Math.round(value / POSITION_STEP_M) + POSITION_ZERO));
  view.setBigUint64(offset, (a ?? 0n) | ((b ?? 0n) << 21n) | ((c ?? 0n) << 42n), true);
}

function packNormal(x: number, y: number, z: number): number {
  const length = Math.abs(x) + Math.abs(y) + Math.abs(z);
  const u = x / length;
  const v = y / length;
  const folded: [number, number] = [
    (1 - Math.abs(v)) * (u < 0 ? -1 : 1),
    (1 - Math.abs(u)) * (v < 0 ? -1 : 1),
  ];
  const [first, second] = z >= 0 ? [u, v] : folded;
  const code = (value: number) => Math.round(value * NORMAL_ZERO) + NORMAL_ZERO;
  return code(first) | (code(second) << 12);
}
