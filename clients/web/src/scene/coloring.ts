import { interpolateTurbo, interpolateViridis } from 'd3-scale-chromatic';
import { DataTexture, LinearFilter, RGBAFormat } from 'three';

/** How surfels are coloured; the order is that of the shader's `coloring`. */
export const COLORINGS = ['colour', 'shape', 'normal', 'confidence', 'depth', 'age', 'deformation'] as const;
export type Coloring = (typeof COLORINGS)[number];

/** The range of values that a colouring by a figure spreads over its colour map. */
export interface ValueRange {
  readonly low: number;
  readonly high: number;
}

/** A colouring by a figure: what the legend says, and in which unit of the shader's values it says it. */
export interface Scale {
  readonly title: string;
  readonly unit: string;
  /** Legend units per shader unit, for example millimetres per metre. */
  readonly factor: number;
  readonly colorOf: (share: number) => string;
}

const SCALES: Partial<Record<Coloring, Scale>> = {
  confidence: { title: 'Confidence', unit: '%', factor: 100, colorOf: interpolateViridis },
  depth: { title: 'Distance from the scope', unit: 'mm', factor: 1000, colorOf: interpolateTurbo },
  age: { title: 'Updates since it last changed', unit: '', factor: 1, colorOf: interpolateViridis },
  deformation: { title: 'Moved since first seen', unit: 'mm', factor: 1000, colorOf: interpolateViridis },
};

/** The scale of a colouring, or undefined where colours stand for themselves. */
export function scaleOf(coloring: Coloring): Scale | undefined {
  return SCALES[coloring];
}

const MAP_STEPS = 256;

/** A scale's colours as a texture of one row. */
export function colorMapTexture(scale: Scale): DataTexture {
  const bytes = new Uint8Array(MAP_STEPS * 4);
  for (let step = 0; step < MAP_STEPS; step++) {
    bytes.set([...rgbOf(scale.colorOf(step / (MAP_STEPS - 1))), 255], step * 4);
  }
  const texture = new DataTexture(bytes, MAP_STEPS, 1, RGBAFormat);
  texture.magFilter = LinearFilter;
  texture.minFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

/** A scale's colours as a CSS gradient from left to right. */
export function colorMapGradient(scale: Scale): string {
  const stops = Array.from({ length: 9 }, (_, i) => scale.colorOf(i / 8));
  return `linear-gradient(to right, ${stops.join(', ')})`;
}

/** Colours come as `rgb(1, 2, 3)` or `#010203`. */
function rgbOf(color: string): [number, number, number] {
  if (color.startsWith('#')) {
    const code = Number.parseInt(color.slice(1), 16);
    return [code >> 16, (code >> 8) & 0xff, code & 0xff];
  }
  const [red = 0, green = 0, blue = 0] = (color.match(/\d+/g) ?? []).map(Number);
  return [red, green, blue];
}
