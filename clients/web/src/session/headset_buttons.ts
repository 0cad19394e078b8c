import { element } from '../ui/dom';
import { type HeadsetMode, headsetSupports } from '../xr/headset';

const MODES: Readonly<Record<HeadsetMode, { label: string; title: string }>> = {
  'immersive-vr': { label: 'VR', title: 'Show the model in a headset' },
  'immersive-ar': { label: 'AR', title: 'Show the model in the room through a headset' },
};

/** A button for each way in which this browser can show the model in a headset; none where it cannot. */
export class HeadsetButtons {
  readonly root = element('span', { class: 'headset-buttons' });

  constructor(
    private readonly enter: (mode: HeadsetMode) => void,
    onError: (error: unknown) => void,
  ) {
    this.offer().catch(onError);
  }

  private async offer(): Promise<void> {
    for (const mode of Object.keys(MODES) as HeadsetMode[]) {
      if (!(await headsetSupports(mode))) continue;
      const { label, title } = MODES[mode];
      const button = element('button', { type: 'button', title }, label);
      button.addEventListener('click', () => this.enter(mode));
      this.root.append(button);
    }
  }
}
