import { element } from '../ui/dom';
import type { Tool } from './tools';

/** What the buttons do. */
export interface ToolbarActions {
  fit(): void;
  reset(): void;
  follow(on: boolean): void;
  path(visible: boolean): void;
  tool(tool: Tool): void;
  fullScreen(): void;
  picture(): void;
}

/** The buttons on the 3-D view, also reached by their letters. */
export class Toolbar {
  readonly root: HTMLElement;
  private readonly followButton: HTMLButtonElement;
  private readonly toolButtons: Readonly<Record<Exclude<Tool, 'look'>, HTMLButtonElement>>;

  constructor(actions: ToolbarActions) {
    this.followButton = toggle('Follow scope', 'Look through the scope (C)', 'c', false, actions.follow);
    const chooser = (tool: Exclude<Tool, 'look'>) => (on: boolean) => {
      if (on) this.releaseTools(tool);
      actions.tool(on ? tool : 'look');
    };
    this.toolButtons = {
      measure: toggle(
        'Measure',
        'Measure between two places on the tissue (M)',
        'm',
        false,
        chooser('measure'),
      ),
      annotate: toggle(
        'Annotate',
        'Write a note at a place on the tissue (N)',
        'n',
        false,
        chooser('annotate'),
      ),
    };
    this.root = element(
      'div',
      { class: 'toolbar', role: 'toolbar', 'aria-label': 'View' },
      button('Fit', 'Bring the whole model into view (F)', 'f', actions.fit),
      button('Reset', 'Look from where the view began (R)', 'r', actions.reset),
      this.followButton,
      toggle('Path', 'Show the way of the scope (P)', 'p', true, actions.path),
      this.toolButtons.measure,
      this.toolButtons.annotate,
      button('Full screen', 'Fill the screen, or leave it (G)', 'g', actions.fullScreen),
      button('Picture', 'Save the view as an image (I)', 'i', actions.picture),
    );
  }

  /** Ends following, if on. */
  releaseFollow(): void {
    release(this.followButton);
  }

  /** Puts down the tool in hand, if any. */
  releaseTools(but?: Tool): void {
    for (const [tool, node] of Object.entries(this.toolButtons)) if (tool !== but) release(node);
  }
}

function release(node: HTMLButtonElement): void {
  if (node.getAttribute('aria-pressed') === 'true') node.click();
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
