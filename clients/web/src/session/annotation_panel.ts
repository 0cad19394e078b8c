import { element, setText } from '../ui/dom';
import { rememberedText } from '../ui/settings';

/** A note as it is listed. */
export interface Note {
  readonly id: number;
  readonly text: string;
  readonly author: string;
}

/** What the panel asks for. */
export interface AnnotationActions {
  /** Writes the note at the place that was chosen. */
  write(text: string, author: string): void;
  cancel(): void;
  erase(id: number): void;
}

/** As in protocol/SPEC.md, Limits. */
export const TEXT_MAX_CHARS = 200;
export const AUTHOR_MAX_CHARS = 40;

/** The notes on the tissue, shared by all viewers, and the form that writes one. */
export class AnnotationPanel {
  private readonly text = element('input', {
    type: 'text',
    required: '',
    maxlength: String(TEXT_MAX_CHARS),
    'aria-label': 'Note',
    placeholder: 'Note',
  });
  private readonly author = element('input', {
    type: 'text',
    maxlength: String(AUTHOR_MAX_CHARS),
    'aria-label': 'Your name',
    placeholder: 'Your name',
  });
  private readonly cancelButton = element('button', { type: 'button', class: 'quiet-button' }, 'Cancel');
  private readonly form = element(
    'form',
    { class: 'note-form', hidden: '', 'aria-label': 'New note' },
    this.text,
    this.author,
    element('button', { type: 'submit', class: 'quiet-button' }, 'Write'),
    this.cancelButton,
  );
  private readonly rows = element('ul');
  readonly root = element(
    'section',
    { class: 'card annotations', 'aria-label': 'Notes', hidden: '' },
    element('h2', {}, 'Notes'),
    this.form,
    this.rows,
  );
  private readonly rememberedAuthor = rememberedText('author');
  private notes: readonly Note[] = [];

  constructor(private readonly actions: AnnotationActions) {
    this.author.value = this.rememberedAuthor.value;
    this.form.addEventListener('submit', (event) => {
      event.preventDefault();
      this.rememberedAuthor.value = this.author.value;
      actions.write(this.text.value, this.author.value);
      this.ask(false);
    });
    this.cancelButton.addEventListener('click', () => {
      this.ask(false);
      actions.cancel();
    });
  }

  /** Shows the form for a note, or takes it away. */
  ask(asking: boolean): void {
    this.form.hidden = !asking;
    this.text.value = '';
    if (asking) this.text.focus();
    this.hideIfEmpty();
  }

  show(notes: readonly Note[]): void {
    this.notes = notes;
    this.rows.replaceChildren(...notes.map((note) => this.row(note)));
    this.hideIfEmpty();
  }

  private hideIfEmpty(): void {
    this.root.hidden = this.notes.length === 0 && this.form.hidden;
    if (!this.form.hidden) this.root.scrollIntoView({ block: 'nearest' });
  }

  private row({ id, text, author }: Note): HTMLElement {
    const erase = element(
      'button',
      { type: 'button', class: 'quiet-button', 'aria-label': `Erase note: ${text}` },
      '×',
    );
    erase.addEventListener('click', () => this.actions.erase(id));
    const body = element('span');
    setText(body, author === '' ? text : `${text} (${author})`);
    return element('li', { 'data-note': String(id) }, body, erase);
  }
}
