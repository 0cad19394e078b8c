/** One of the page's views. */
export interface Page {
  readonly root: HTMLElement;
  /** What it shows in the bar at the top, behind the name of the program. */
  readonly heading: HTMLElement;
  /** Called once it is on the screen. */
  shown?(): void;
  /** Ends timers, connections and GPU resources. */
  close(): void;
}
