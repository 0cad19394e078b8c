/** One of the page's two views. */
export interface Page {
  readonly root: HTMLElement;
  /** What it shows in the bar at the top, behind the name of the program. */
  readonly heading: HTMLElement;
  /** Ends timers, connections and GPU resources. */
  close(): void;
}
