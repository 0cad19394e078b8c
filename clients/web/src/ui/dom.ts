type Child = Node | string;

/** An element with attributes (`class`, `aria-…`, `data-…`) and children. */
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Readonly<Record<string, string>> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

/** Sets the text where it differs, so that readers of the screen are not told the same again. */
export function setText(node: Element, text: string): void {
  if (node.textContent !== text) node.textContent = text;
}

/** Presses the button whose letter this is; false where none below `root` can be pressed so. */
export function pressShortcut(root: HTMLElement, key: string): boolean {
  const target = root.querySelector<HTMLButtonElement>(
    `button[aria-keyshortcuts="${CSS.escape(key)}"]:not([hidden], :disabled)`,
  );
  target?.click();
  return target !== null;
}

/** Sets a data attribute where it differs. */
export function setData(node: HTMLElement, name: string, value: string): void {
  if (node.dataset[name] !== value) node.dataset[name] = value;
}
