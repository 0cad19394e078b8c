import { ImageFormat, type PreviewImage } from '../generated/mis_slam/v1/image_pb';
import { element, setData, setText } from '../ui/dom';
import { age } from '../ui/wording';
import type { FeatureOverlay } from './feature_overlay';

/** Previews come a few times a second; one that is older is no longer shown as if it were live. */
const OLD_AFTER_MS = 1500;

const MIME_TYPES: Partial<Record<ImageFormat, string>> = {
  [ImageFormat.JPEG]: 'image/jpeg',
  [ImageFormat.PNG]: 'image/png',
};

/** The scope's left image. While one image is decoded only the newest of those that come is kept. */
export class Preview {
  private readonly canvas = element('canvas', { role: 'img', 'aria-label': 'Left image of the scope' });
  private readonly placeholder = element('p', {}, 'No image yet');
  private readonly oldness = element('p', { class: 'oldness', hidden: '' });
  readonly root = element('div', { class: 'preview' }, this.canvas, this.placeholder, this.oldness);
  private next: PreviewImage | undefined;
  private busy = false;
  private shown = 0;

  constructor(
    private readonly overlay: FeatureOverlay,
    private readonly onError: (error: unknown) => void,
  ) {
    this.canvas.hidden = true;
    this.root.append(overlay.canvas, overlay.toggle);
  }

  /** Images shown since the start. */
  get imagesShown(): number {
    return this.shown;
  }

  show(image: PreviewImage): void {
    this.next = image;
    if (!this.busy) void this.drain();
  }

  /** Dims an image that is no longer live and says how old it is. */
  showAge(ageMs: number | null): void {
    const old = ageMs !== null && ageMs > OLD_AFTER_MS;
    setData(this.root, 'old', String(old));
    this.oldness.hidden = !old;
    if (old) setText(this.oldness, `Image ${age(ageMs)} old`);
  }

  private async drain(): Promise<void> {
    this.busy = true;
    while (this.next !== undefined) {
      const image = this.next;
      this.next = undefined;
      await this.draw(image).catch(this.onError);
    }
    this.busy = false;
  }

  private async draw({ stampNs, left: image }: PreviewImage): Promise<void> {
    if (image === undefined) return;
    const type = MIME_TYPES[image.format];
    if (type === undefined) throw new Error(`a preview in format ${image.format} cannot be shown`);
    const bitmap = await createImageBitmap(new Blob([new Uint8Array(image.data)], { type }));
    this.canvas.width = bitmap.width;
    this.canvas.height = bitmap.height;
    this.canvas.getContext('2d')?.drawImage(bitmap, 0, 0);
    this.overlay.imageShown(stampNs, bitmap.width, bitmap.height);
    bitmap.close();
    this.canvas.hidden = false;
    this.placeholder.hidden = true;
    this.shown += 1;
  }
}
