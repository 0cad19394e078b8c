/** A run of consecutive slots. */
export interface SlotRange {
  readonly start: number;
  readonly count: number;
}

const SLOTS_PER_PAGE = 256;

/**
 * Remembers which slots changed since the last upload, in pages of 256 slots (4 KiB of packed surfels):
 * scattered changes become few uploads, and a small change never uploads the whole model.
 */
export class DirtyPages {
  private readonly pages = new Set<number>();

  mark(slot: number): void {
    this.pages.add(Math.floor(slot / SLOTS_PER_PAGE));
  }

  clear(): void {
    this.pages.clear();
  }

  /** The changed runs below `slotLimit`, ascending, neighbours joined; nothing is dirty afterwards. */
  take(slotLimit: number): SlotRange[] {
    const sorted = [...this.pages].sort((a, b) => a - b);
    this.pages.clear();
    const ranges: { start: number; count: number }[] = [];
    for (const page of sorted) {
      const start = page * SLOTS_PER_PAGE;
      const count = Math.min(SLOTS_PER_PAGE, slotLimit - start);
      if (count <= 0) break;
      const last = ranges.at(-1);
      if (last !== undefined && last.start + last.count === start) last.count += count;
      else ranges.push({ start, count });
    }
    return ranges;
  }
}
