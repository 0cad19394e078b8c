/** A number that the browser remembers for this person, with what it is at first. */
export interface Setting {
  value: number;
}

const PREFIX = 'mis-slam.';

/** The setting of this name. Where the browser keeps nothing, it lasts as long as the page. */
export function remembered(name: string, initially: number): Setting {
  let current = read(PREFIX + name) ?? initially;
  return {
    get value() {
      return current;
    },
    set value(value: number) {
      current = value;
      write(PREFIX + name, value);
    },
  };
}

function read(key: string): number | undefined {
  try {
    const kept = window.localStorage.getItem(key);
    const value = kept === null ? Number.NaN : Number(kept);
    return Number.isFinite(value) ? value : undefined;
  } catch {
    return undefined; // Storage is switched off.
  }
}

function write(key: string, value: number): void {
  try {
    window.localStorage.setItem(key, String(value));
  } catch {
    // Storage is switched off or full: the setting lasts as long as the page.
  }
}
