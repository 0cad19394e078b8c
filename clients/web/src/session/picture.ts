import type { Stage } from '../scene/stage';
import { saveBlob, timeForName } from '../ui/downloads';

/** Saves the 3-D view as an image file. */
export async function savePicture(stage: Stage, session: string): Promise<void> {
  saveBlob(await stage.picture(), `${session}-${timeForName()}.png`);
}

/** Lets the page's part fill the screen, or gives the screen back. */
export async function toggleFullScreen(part: HTMLElement): Promise<void> {
  if (document.fullscreenElement === null) await part.requestFullscreen();
  else await document.exitFullscreen();
}
