import assert from 'node:assert/strict';
import { test } from 'node:test';
import { packSurfel } from '../e2e/synthetic_surface';
import { Anchor } from '../src/measure/anchor';
import { BoundNotes, type SharedNote } from '../src/measure/bound_notes';
import { lengthText, Measurement } from '../src/measure/measurement';
import { WORDS_PER_RECORD } from '../src/model/packed_surfels';
import { surfacePath } from '../src/model/surface_path';
import { SurfelStore } from '../src/model/surfel_store';
import { type Point, pickSurfel } from '../src/scene/picking';

const RADIUS_M = 5e-4;

function record(positionM: Point, normal: Point = [0, 0, -1]): Uint32Array {
  const view = new DataView(new ArrayBuffer(4 * WORDS_PER_RECORD));
  packSurfel(view, 0, { positionM, normal, radiusM: RADIUS_M, color: [200, 100, 90], confidence: 1 });
  return new Uint32Array(view.buffer);
}

/** The ids are the indices of the points. */
function storeOf(points: readonly Point[]): SurfelStore {
  const store = new SurfelStore();
  points.forEach((point, id) => {
    store.put(id, 1, record(point), 0);
  });
  return store;
}

/** A half tube of radius 10 mm about the y axis, in steps of 0.5 mm. */
function halfTube(): Point[] {
  const points: Point[] = [];
  for (let i = 0; i <= 62; i++) {
    for (let j = 0; j <= 40; j++) {
      const angle = (i / 62) * Math.PI;
      points.push([0.01 * Math.cos(angle), 0.0005 * j, 0.05 + 0.01 * Math.sin(angle)]);
    }
  }
  return points;
}

test('the way over half a tube is its arc, not its diameter', () => {
  const points = halfTube();
  const from = 20;
  const to = points.length - 21;
  const reading = new Measurement(storeOf(points), from, to).read(1, 2e-4);
  const arcM = Math.PI * 0.01;
  assert.ok(Math.abs(reading.straight.valueM - 0.02) < 5e-5, lengthText(reading.straight));
  const surface = reading.surface ?? assert.fail('no way');
  assert.ok(
    Math.abs(surface.valueM - arcM) < Math.min(surface.uncertaintyM, 0.03 * arcM),
    lengthText(surface),
  );
});

test('no way leads across a gap', () => {
  const sheets = [0, 0.02].flatMap((x) =>
    Array.from({ length: 400 }, (_, i): Point => [x + 5e-4 * (i % 20), 5e-4 * Math.floor(i / 20), 0.1]),
  );
  assert.equal(surfacePath(storeOf(sheets), 0, 799), undefined);
});

test('a slanted way over a plane is no more than three percent too long', () => {
  const plane = Array.from(
    { length: 10_000 },
    // Not on the borders of the cells, where rounding would decide.
    (_, i): Point => [1e-4 + 4e-4 * (i % 100), 1e-4 + 4e-4 * Math.floor(i / 100), 0.1],
  );
  const way = surfacePath(storeOf(plane), 0, 30 + 100 * 77) ?? assert.fail('no way');
  const straightM = 4e-4 * Math.hypot(30, 77);
  assert.ok(
    way.lengthM >= 0.999 * straightM && way.lengthM < 1.03 * straightM,
    `${way.lengthM} ${straightM}`,
  );
});

test('a measurement follows the tissue that it is bound to', () => {
  const store = storeOf([
    [0, 0, 0.1],
    [0.01, 0, 0.1],
  ]);
  const measurement = new Measurement(store, 0, 1);
  assert.ok(Math.abs(measurement.read(1, 0).straight.valueM - 0.01) < 3e-5);
  store.put(1, 2, record([0.013, 0, 0.1]), 0);
  assert.ok(Math.abs(measurement.read(2, 0).straight.valueM - 0.013) < 3e-5);
});

test('an anchor whose surfel is gone goes to the nearest one, or says that there is none', () => {
  const store = storeOf([
    [0, 0, 0.1],
    [0.001, 0, 0.1],
    [0.03, 0, 0.1],
  ]);
  const anchor = new Anchor(store, 0);
  store.remove(0);
  assert.notEqual(anchor.follow(), undefined);
  assert.equal(anchor.surfelId, 1);
  store.remove(1);
  assert.equal(anchor.follow(), undefined);
  assert.deepEqual(
    anchor.position.map((value) => Math.round(value * 1e3)),
    [1, 0, 100],
  );
});

test('the foremost disc that is not cut away is picked', () => {
  const store = storeOf([
    [0, 0, 0.1],
    [0, 0, 0.12],
    [0.002, 0, 0.05],
  ]);
  const ray = { origin: [0, 0, 0], direction: [0, 0, 1] } as const;
  assert.equal(pickSurfel(store, ray), 0);
  assert.equal(pickSurfel(store, ray, [0, 0, 1, -0.11]), 1);
  assert.equal(pickSurfel(store, { origin: [0.01, 0, 0], direction: [0, 0, 1] }), undefined);
});

test('lengths are written with the digits that their uncertainty allows', () => {
  assert.equal(lengthText({ valueM: 0.023456, uncertaintyM: 0.0003 }), '23.46 ± 0.30 mm');
  assert.equal(lengthText({ valueM: 0.0404, uncertaintyM: 0.0012 }), '40.4 ± 1.2 mm');
});

test('a note stays where it has followed the tissue to while others come and go', () => {
  const store = storeOf([
    [0, 0, 0.05],
    [0.0015, 0, 0.05],
    [0.003, 0, 0.05],
  ]);
  const notes = new BoundNotes(store);
  const at = (id: number, surfelId: number): SharedNote => ({
    id,
    text: `note ${id}`,
    surfelId,
    pointInWorld: { xM: 0, yM: 0, zM: 0.05 },
  });
  notes.take([at(1, 0)]);
  // The surfel goes, and then the one that took its place: each is followed to the next one within 2 mm.
  for (const gone of [0, 1]) {
    store.remove(gone);
    notes.all[0]?.anchor.follow();
  }
  notes.take([at(1, 0), at(2, 2)]);
  const [first, second] = notes.all;
  assert.deepEqual([first?.anchor.surfelId, second?.anchor.surfelId], [2, 2]);
  notes.take([at(1, 1)]);
  assert.deepEqual([notes.count, notes.all[0]?.anchor.surfelId], [1, 1]);
});
