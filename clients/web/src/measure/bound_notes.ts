import type { SurfelStore } from '../model/surfel_store';
import type { Point } from '../scene/picking';
import { Anchor } from './anchor';

/** A note as the server says it. */
export interface SharedNote {
  readonly id: number;
  readonly text: string;
  readonly surfelId: number;
  readonly pointInWorld?: { readonly xM: number; readonly yM: number; readonly zM: number };
}

/** A note where it is on the tissue. */
export interface BoundNote {
  readonly text: string;
  /** The surfel that the server knows it by. */
  readonly surfelId: number;
  readonly anchor: Anchor;
}

/** The notes of a session, bound to the tissue. They go on following it while others come and go. */
export class BoundNotes {
  private byId: ReadonlyMap<number, BoundNote> = new Map();

  constructor(private readonly store: SurfelStore) {}

  get count(): number {
    return this.byId.size;
  }

  get all(): readonly BoundNote[] {
    return [...this.byId.values()];
  }

  /** These are all notes that there are. */
  take(notes: readonly SharedNote[]): void {
    this.byId = new Map(notes.map((note) => [note.id, this.bind(note)]));
  }

  /** A note that is bound already stays where it has followed the tissue to, unless it was bound elsewhere. */
  private bind({ id, text, surfelId, pointInWorld: point }: SharedNote): BoundNote {
    const held = this.byId.get(id);
    if (held?.surfelId === surfelId) return { ...held, text };
    const lastSeen: Point | undefined = point && [point.xM, point.yM, point.zM];
    return { text, surfelId, anchor: new Anchor(this.store, surfelId, lastSeen) };
  }
}
