/**
 * Places surfels, known by their stable 32-bit ids, into the slots of a GPU buffer.
 *
 * Slots `0..size` are always all in use: the last surfel moves into the slot of a removed one. So the
 * number of slots drawn is the number of surfels, and no list of free slots has to be kept or skipped.
 */
export class SlotMap {
  private readonly slotOfId = new Map<number, number>();
  private idOfSlot = new Uint32Array(1024);

  get size(): number {
    return this.slotOfId.size;
  }

  /** The slot of `id`, or undefined where the id is unknown. */
  slot(id: number): number | undefined {
    return this.slotOfId.get(id);
  }

  /** The id in `slot`; `slot` must be below `size`. */
  id(slot: number): number {
    return this.idOfSlot[slot] as number;
  }

  /** The slot of `id`, newly taken at the end where the id is unknown. */
  insert(id: number): number {
    const known = this.slotOfId.get(id);
    if (known !== undefined) return known;
    const slot = this.slotOfId.size;
    this.reserve(slot + 1);
    this.idOfSlot[slot] = id;
    this.slotOfId.set(id, slot);
    return slot;
  }

  /**
   * Frees the slot of `id`. The surfel of slot `movedFrom` (the last) must then be copied into `slot`;
   * the two are equal where the last was removed. Undefined where the id is unknown.
   */
  remove(id: number): { slot: number; movedFrom: number } | undefined {
    const slot = this.slotOfId.get(id);
    if (slot === undefined) return undefined;
    this.slotOfId.delete(id);
    const movedFrom = this.slotOfId.size;
    if (movedFrom !== slot) {
      const movedId = this.idOfSlot[movedFrom] as number;
      this.idOfSlot[slot] = movedId;
      this.slotOfId.set(movedId, slot);
    }
    return { slot, movedFrom };
  }

  clear(): void {
    this.slotOfId.clear();
  }

  private reserve(slots: number): void {
    if (slots <= this.idOfSlot.length) return;
    const grown = new Uint32Array(this.idOfSlot.length * 2);
    grown.set(this.idOfSlot);
    this.idOfSlot = grown;
  }
}
