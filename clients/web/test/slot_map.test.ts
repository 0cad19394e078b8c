import assert from 'node:assert/strict';
import { test } from 'node:test';
import { DirtyPages } from '../src/model/dirty_pages';
import { SlotMap } from '../src/model/slot_map';

test('slots are filled from the start and a known id keeps its slot', () => {
  const slots = new SlotMap();
  assert.deepEqual([slots.insert(70), slots.insert(5), slots.insert(70)], [0, 1, 0]);
  assert.equal(slots.size, 2);
});

test('the last surfel moves into the slot of a removed one', () => {
  const slots = new SlotMap();
  for (const id of [10, 20, 30]) slots.insert(id);
  assert.deepEqual(slots.remove(10), { slot: 0, movedFrom: 2 });
  assert.equal(slots.slot(30), 0);
  assert.equal(slots.id(0), 30);
  assert.equal(slots.slot(10), undefined);
});

test('removing the last or an unknown surfel moves nothing', () => {
  const slots = new SlotMap();
  slots.insert(1);
  assert.deepEqual(slots.remove(1), { slot: 0, movedFrom: 0 });
  assert.equal(slots.remove(1), undefined);
  assert.equal(slots.size, 0);
});

test('after any sequence of changes the slots in use are exactly the first ones', () => {
  const slots = new SlotMap();
  const held = new Set<number>();
  let state = 1;
  for (let step = 0; step < 20_000; step++) {
    state = (Math.imul(state, 1103515245) + 12345) >>> 0;
    const id = (state >>> 8) % 3000;
    if ((state >>> 30) % 3 === 0) {
      slots.remove(id);
      held.delete(id);
    } else {
      slots.insert(id);
      held.add(id);
    }
  }
  assert.equal(slots.size, held.size);
  const ids = Array.from({ length: slots.size }, (_, slot) => slots.id(slot));
  assert.deepEqual(new Set(ids), held);
  for (const [slot, id] of ids.entries()) assert.equal(slots.slot(id), slot);
});

test('changed slots are uploaded in joined pages, and once', () => {
  const dirty = new DirtyPages();
  for (const slot of [1000, 3, 300, 5]) dirty.mark(slot);
  assert.deepEqual(dirty.take(10_000), [
    { start: 0, count: 512 },
    { start: 768, count: 256 },
  ]);
  assert.deepEqual(dirty.take(10_000), []);
});

test('slots that are no longer in use are not uploaded', () => {
  const dirty = new DirtyPages();
  dirty.mark(10);
  dirty.mark(600);
  assert.deepEqual(dirty.take(20), [{ start: 0, count: 20 }]);
});
