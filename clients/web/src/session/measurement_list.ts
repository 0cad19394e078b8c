import { lengthText, type Reading } from '../measure/measurement';
import { element, setText } from '../ui/dom';

/** What the buttons of the list do. */
export interface MeasurementListActions {
  remove(index: number): void;
  clear(): void;
}

/** The measurements in figures, with buttons that remove them. */
export class MeasurementList {
  private readonly rows = element('ol');
  private readonly clearButton = element('button', { type: 'button', class: 'quiet-button' }, 'Remove all');
  readonly root = element(
    'section',
    { class: 'card measurements', 'aria-label': 'Measurements', hidden: '' },
    element('h2', {}, 'Measurements'),
    this.rows,
    this.clearButton,
  );

  constructor(private readonly actions: MeasurementListActions) {
    this.clearButton.addEventListener('click', () => actions.clear());
  }

  show(readings: readonly Reading[]): void {
    this.root.hidden = readings.length === 0;
    while (this.rows.childElementCount > readings.length) this.rows.lastElementChild?.remove();
    while (this.rows.childElementCount < readings.length) this.rows.append(this.row());
    readings.forEach((reading, i) => {
      const value = this.rows.children[i]?.querySelector('span');
      if (value) setText(value, readingText(reading));
    });
  }

  private row(): HTMLElement {
    const index = this.rows.childElementCount;
    const remove = element(
      'button',
      { type: 'button', class: 'quiet-button', 'aria-label': `Remove measurement ${index + 1}` },
      '×',
    );
    remove.addEventListener('click', () => this.actions.remove(index));
    return element('li', { 'data-measurement': String(index) }, element('span'), remove);
  }
}

function readingText({ straight, surface, held }: Reading): string {
  const over = surface === undefined ? 'no way over the surface' : `${lengthText(surface)} over the surface`;
  return `${lengthText(straight)} straight, ${over}${held ? '' : ' (tissue gone)'}`;
}
