/** One packed surfel (protocol/SPEC.md), decoded. */

/** A surfel in world coordinates. */
export interface Surfel {
  readonly positionM: readonly [number, number, number];
  readonly normal: readonly [number, number, number];
  readonly radiusM: number;
  /** sRGB, 0 to 255. */
  readonly color: readonly [number, number, number];
  /** 0 to 1. */
  readonly confidence: number;
}

const POSITION_STEP_M = 2e-5;
const POSITION_ZERO = 2 ** 20;
const POSITION_MASK = 2 ** 21 - 1;
const NORMAL_ZERO = 2047;
const RADIUS_UNIT_M = 1e-5;
const RADIUS_CODES_PER_OCTAVE = 16;

/** Position of the record that starts at word `offset`, in metres. */
function positionOf(words: Uint32Array, offset: number): [number, number, number] {
  const low = word(words, offset);
  const high = word(words, offset + 1);
  const x = low & POSITION_MASK;
  const y = (low >>> 21) | ((high & 0x3ff) << 11);
  const z = (high >>> 10) & POSITION_MASK;
  return [lengthOf(x), lengthOf(y), lengthOf(z)];
}

/** The whole surfel of the record that starts at word `offset`. */
export function surfelOf(words: Uint32Array, offset: number): Surfel {
  const third = word(words, offset + 2);
  const fourth = word(words, offset + 3);
  return {
    positionM: positionOf(words, offset),
    normal: normalOf(third & 0xffffff),
    radiusM: RADIUS_UNIT_M * 2 ** ((third >>> 24) / RADIUS_CODES_PER_OCTAVE),
    color: [fourth & 0xff, (fourth >>> 8) & 0xff, (fourth >>> 16) & 0xff],
    confidence: (fourth >>> 24) / 255,
  };
}

function word(words: Uint32Array, index: number): number {
  return words[index] as number;
}

function lengthOf(code: number): number {
  return (code - POSITION_ZERO) * POSITION_STEP_M;
}

/** Octahedral map, 12 bits an axis. */
function normalOf(code: number): [number, number, number] {
  const u = axisOf(code & 0xfff);
  const v = axisOf(code >>> 12);
  const z = 1 - Math.abs(u) - Math.abs(v);
  const x = z >= 0 ? u : Math.sign(u || 1) * (1 - Math.abs(v));
  const y = z >= 0 ? v : Math.sign(v || 1) * (1 - Math.abs(u));
  const length = Math.hypot(x, y, z);
  return [x / length, y / length, z / length];
}

function axisOf(code: number): number {
  return Math.min(code - NORMAL_ZERO, NORMAL_ZERO) / NORMAL_ZERO;
}
