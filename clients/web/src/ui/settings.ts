/** Something that the browser remembers for this person. */
export interface Setting<T> {
  value: T;
}

const PREFIX = 'mis-slam.';

/** The number of this name. Where the browser keeps nothing, it lasts as long as the page. */
export function remembered(name: string, initially: number): Setting<number> {
  const kept = rememberedText(name);
  return {
    get value() {
      const value = kept.value === '' ? Number.NaN : Number(kept.value);
      return Number.isFinite(value) ? value : initially;
    },
    set value(value: number) {
      kept.value = String(value);
    },
  };
}

/** The text of this name, at first empty. Where the browser keeps nothing, it lasts as long as the page. */
export function rememberedText(name: string): Setting<string> {
  let current = read(PREFIX + name);
  return {
    get value() {
      return current;
    },
    set value(value: string) {
      current = value;
      write(PREFIX + name, value);
    },
  };
}

function read(key: string): string {
  try {
    return window.localStorage.getItem(key) ?? '';
  } catch {
    return ''; // Storage is switched off.
  }
}

function write(key: string, value: string): void {
  try {
    window.localStorage.setItem(key, value);
  } catch {
    // Storage is switched off or full: the setting lasts as long as the page.
  }
}
