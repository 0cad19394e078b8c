import { isMcap, recordingName, type Upload, upload, whyNotUploaded } from '../server/recordings';
import { element, setText } from '../ui/dom';
import { bytes } from '../ui/wording';

export interface UploaderEvents {
  /** Names that recordings have already. */
  taken(): readonly string[];
  /** A recording has been uploaded. */
  uploaded(): void;
}

/** Where a recording is dropped or chosen, and how far its upload is. One at a time. */
export class Uploader {
  private readonly chooser = element('input', { type: 'file', accept: '.mcap', id: 'recording-file' });
  private readonly invitation = element(
    'label',
    { class: 'invitation', for: 'recording-file' },
    element('strong', {}, 'Upload a recording'),
    element('span', {}, 'Drop an MCAP file here, or choose one.'),
    this.chooser,
  );
  private readonly bar = element('progress', { 'aria-label': 'Upload', max: '1', value: '0' });
  private readonly cancelButton = element('button', { type: 'button', class: 'quiet-button' }, 'Cancel');
  private readonly running = element('div', { class: 'running', hidden: '' }, this.bar, this.cancelButton);
  private readonly message = element('p', { class: 'message', role: 'status' });
  readonly root = element('div', { class: 'uploader' }, this.invitation, this.running, this.message);
  private current: Upload | undefined;

  constructor(private readonly events: UploaderEvents) {
    this.chooser.addEventListener('change', () => this.take(this.chooser.files));
    this.cancelButton.addEventListener('click', () => this.abort());
    this.root.addEventListener('dragover', (event) => {
      event.preventDefault();
      this.root.dataset.dragged = 'true';
    });
    this.root.addEventListener('dragleave', () => {
      delete this.root.dataset.dragged;
    });
    this.root.addEventListener('drop', (event) => {
      event.preventDefault();
      delete this.root.dataset.dragged;
      this.take(event.dataTransfer?.files ?? null);
    });
  }

  /** Gives up an upload under way. */
  abort(): void {
    this.current?.abort();
  }

  private take(files: FileList | null): void {
    const file = files?.[0];
    if (file === undefined || this.current !== undefined) return;
    if (files !== null && files.length > 1) this.say('One recording at a time, please.');
    else void this.send(file);
  }

  private async send(file: File): Promise<void> {
    try {
      if (!(await isMcap(file))) {
        this.say(`${file.name} is no MCAP recording.`);
        return;
      }
      const name = recordingName(file.name, this.events.taken());
      this.current = upload(name, file, (sent) => this.showProgress(name, sent, file.size));
      this.showProgress(name, 0, file.size);
      await this.current.done;
      this.say(`${name} is on the server.`, 'good');
      this.events.uploaded();
    } catch (error) {
      this.say(whyNotUploaded(error));
    } finally {
      this.current = undefined;
      this.running.hidden = true;
      this.invitation.hidden = false;
      // The same file can be chosen again.
      this.chooser.value = '';
    }
  }

  private showProgress(name: string, sent: number, total: number): void {
    this.running.hidden = false;
    this.invitation.hidden = true;
    this.bar.value = total === 0 ? 1 : sent / total;
    const checking = sent >= total;
    this.say(checking ? `${name} is being checked …` : `${name}: ${bytes(sent)} of ${bytes(total)}`, 'quiet');
  }

  private say(text: string, tone: 'good' | 'bad' | 'quiet' = 'bad'): void {
    this.message.dataset.tone = tone;
    setText(this.message, text);
  }
}
