import { create } from '@bufbuild/protobuf';
import { type SharedChange, SharedChangeSchema, type SharedScene } from '../generated/mis_slam/v1/shared_pb';
import { Anchor } from '../measure/anchor';
import { BoundNotes } from '../measure/bound_notes';
import type { SurfelStore } from '../model/surfel_store';
import type { Mark } from '../scene/marks';
import { AnnotationPanel } from './annotation_panel';

/** The notes of a session: what the server says, bound to the tissue, and what is asked of it. */
export class Notes {
  readonly panel: AnnotationPanel;
  private readonly bound: BoundNotes;
  private chosen: Anchor | undefined;

  /** `send` hands a change to the server; `changed` is told when other marks have to be drawn. */
  constructor(
    private readonly store: SurfelStore,
    private readonly send: (change: SharedChange) => void,
    private readonly changed: () => void,
  ) {
    this.bound = new BoundNotes(store);
    this.panel = new AnnotationPanel({
      write: (text, author) => this.write(text, author),
      cancel: () => this.choose(undefined),
      erase: (id) => send(create(SharedChangeSchema, { change: { case: 'eraseAnnotation', value: id } })),
    });
  }

  /** Whether any mark has to be kept up with the model. */
  get inUse(): boolean {
    return this.bound.count > 0 || this.chosen !== undefined;
  }

  /** Notes in the session. */
  get count(): number {
    return this.bound.count;
  }

  /** A place was chosen: the form asks what to write there. */
  ask(surfel: number): void {
    this.choose(new Anchor(this.store, surfel));
    this.panel.ask(true);
  }

  take({ annotations }: SharedScene): void {
    this.bound.take(annotations);
    this.panel.show(annotations);
    this.changed();
  }

  marks(): Mark[] {
    const marks = this.bound.all.map(({ text, anchor }): Mark => {
      const dimmed = anchor.follow() === undefined;
      return {
        line: [],
        dots: [anchor.position],
        labelAt: anchor.position,
        text,
        kind: 'annotation',
        dimmed,
      };
    });
    if (this.chosen === undefined) return marks;
    this.chosen.follow();
    const { position } = this.chosen;
    marks.push({ line: [], dots: [position], labelAt: position, text: '', kind: 'pending', dimmed: false });
    return marks;
  }

  private write(text: string, author: string): void {
    if (this.chosen === undefined) return;
    const [xM, yM, zM] = this.chosen.position;
    const value = { surfelId: this.chosen.surfelId, pointInWorld: { xM, yM, zM }, text, author };
    this.send(create(SharedChangeSchema, { change: { case: 'annotate', value } }));
    this.choose(undefined);
  }

  private choose(place: Anchor | undefined): void {
    this.chosen = place;
    this.changed();
  }
}
