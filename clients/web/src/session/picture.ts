import type { Stage } from '../scene/stage';

/** Saves the 3-D view as an image file. */
export async function savePicture(stage: Stage, session: string): Promise<void> {
  const address = URL.createObjectURL(await stage.picture());
  const link = document.createElement('a');
  link.href = address;
  link.download = `${session}-${new Date().toISOString().replaceAll(':', '-').slice(0, 19)}.png`;
  link.click();
  URL.revokeObjectURL(address);
}

/** Lets the page's part fill the screen, or gives the screen back. */
export async function toggleFullScreen(part: HTMLElement): Promise<void> {
  if (document.fullscreenElement === null) await part.requestFullscreen();
  else await document.exitFullscreen();
}
