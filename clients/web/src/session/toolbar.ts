import { element } from '../ui/dom';

/** What the buttons do. */
export interface ToolbarActions {
  fit(): void;
  follow(on: boolean): void;
  path(visible: boolean): void;
  shape(on: boolean): void;
}

/** The buttons on the 3-D view, also reached by their letters. */
export class Toolbar {
  readonly root: HTMLElement;
  private readonly followButton: HTMLButtonElement;

  constructor(actions: ToolbarActions) {
    this.followButton = toggle('Follow scope', 'Look through the scope (C)', 'c', false, actions.follow);
    this.root = element(
      'div',
      { class: 'toolbar', role: 'toolbar', 'aria-label': 'View' },
      button('Fit', 'Bring the whole model into view (F)', 'f', actions.fit),
      this.followButton,
      toggle('Path', 'Show the way of the scope (P)', 'p', true, actions.path),
      toggle('Shape', 'Show the shape without colours (S)', 's', false, actions.shape),
    );
  }

  /** Ends following, if on. */
  releaseFollow(): void {
    if (this.followButton.getAttribute('aria-pressed') === 'true') this.followButton.click();
  }

  /** Presses the button whose letter this is; false where there is none. */
  press(key: string): boolean {
    const target = this.root.querySelector<HTMLButtonElement>(
      `button[aria-keyshortcuts="${CSS.escape(key)}"]`,
    );
    target?.click();
    return target !== null;
  }
}

function button(label: string, title: string, key: string, action: () => void): HTMLButtonElement {
  const node = element('button', { type: 'button', title, 'aria-keyshortcuts': key }, label);
  node.addEventListener('click', action);
  return node;
}

function toggle(
  label: string,
  title: string,
  key: string,
  initially: boolean,
  action: (on: boolean) => void,
): HTMLButtonElement {
  const node = button(label, title, key, () => {
    const on = node.getAttribute('aria-pressed') !== 'true';
    node.setAttribute('aria-pressed', String(on));
    action(on);
  });
  node.setAttribute('aria-pressed', String(initially));
  return node;
}
