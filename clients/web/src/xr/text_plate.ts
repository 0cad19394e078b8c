import { CanvasTexture, LinearFilter } from 'three';

const HEIGHT_PX = 96;
const FONT = '600 52px system-ui, sans-serif';

/** Text as a texture, for where no elements can be laid over the picture; `aspect` is its width over its height. */
export function textTexture(
  text: string,
  ink: string,
  ground: string,
): { texture: CanvasTexture; aspect: number } {
  const canvas = document.createElement('canvas');
  const context = canvas.getContext('2d');
  if (context === null) throw new Error('this browser draws no text on a canvas');
  context.font = FONT;
  canvas.width = Math.ceil(context.measureText(text).width) + HEIGHT_PX / 2;
  canvas.height = HEIGHT_PX;
  context.fillStyle = ground;
  context.beginPath();
  context.roundRect(0, 0, canvas.width, canvas.height, HEIGHT_PX / 4);
  context.fill();
  // Setting the size of a canvas forgets its font.
  context.font = FONT;
  context.fillStyle = ink;
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  context.fillText(text, canvas.width / 2, canvas.height / 2);
  const texture = new CanvasTexture(canvas);
  texture.minFilter = LinearFilter;
  return { texture, aspect: canvas.width / canvas.height };
}
