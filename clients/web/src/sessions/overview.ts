import { describePage, EMPTY_STATUS } from '../page_status';
import { whyFailed } from '../server/access';
import { fetchFinished } from '../server/finished';
import { fetchRecordings } from '../server/recordings';
import { fetchSessions, startReplay } from '../server/sessions';
import { element, setText } from '../ui/dom';
import type { Page } from '../ui/page';
import { FinishedList } from './finished_list';
import { RecordingList } from './recording_list';
import { SessionList } from './session_list';
import { Uploader } from './uploader';

const REFRESH_MS = 1500;
/** What lies on the disk changes less often, and with the open sessions. */
const REFRESHES_PER_DISK_LOOK = 4;

/** What the server has: open sessions, recordings to replay, what finished sessions left. */
export class Overview implements Page {
  readonly root = element('main', { class: 'list', 'data-page': 'sessions' });
  readonly heading = element('h1', {}, 'Sessions');
  private readonly problem = element('p', { class: 'notice', role: 'status', hidden: '' });
  private readonly sessions = new SessionList();
  private readonly recordings = new RecordingList((recording) => void this.replay(recording));
  private readonly finished = new FinishedList();
  private readonly uploader = new Uploader({
    taken: () => this.recordings.names,
    uploaded: () => void this.lookAtDisk().catch((error: unknown) => this.say(whyFailed(error))),
  });
  private readonly closing = new AbortController();
  private refreshes = 0;
  private timer = 0;

  constructor() {
    const { problem, sessions, recordings, uploader, finished } = this;
    recordings.root.append(uploader.root);
    this.root.append(problem, sessions.root, recordings.root, finished.root);
    document.title = 'MIS-SLAM · Sessions';
    describePage(() => ({
      ...EMPTY_STATUS,
      sessions: sessions.ids,
      recordings: recordings.names,
      finished: finished.runs,
    }));
    void this.refresh();
  }

  close(): void {
    this.closing.abort();
    this.uploader.abort();
    window.clearTimeout(this.timer);
  }

  private async refresh(): Promise<void> {
    try {
      const { signal } = this.closing;
      const changed = this.sessions.show(await fetchSessions(signal));
      this.root.dataset.sessions = String(this.sessions.ids.length);
      if (changed || this.refreshes % REFRESHES_PER_DISK_LOOK === 0) await this.lookAtDisk();
      this.refreshes += 1;
      this.problem.hidden = true;
    } catch (error) {
      this.say(`${whyFailed(error)} Trying again …`);
    }
    if (this.closing.signal.aborted) return;
    this.timer = window.setTimeout(() => void this.refresh(), REFRESH_MS);
  }

  private async lookAtDisk(): Promise<void> {
    const { signal } = this.closing;
    const [recordings, finished] = await Promise.all([fetchRecordings(signal), fetchFinished(signal)]);
    this.recordings.show(recordings);
    this.finished.show(finished);
  }

  private async replay(recording: string): Promise<void> {
    try {
      this.recordings.wait(true);
      window.location.hash = `#/sessions/${await startReplay(recording)}`;
    } catch (error) {
      this.say(`The replay does not start. ${whyFailed(error)}`);
    } finally {
      this.recordings.wait(false);
    }
  }

  private say(text: string): void {
    if (this.closing.signal.aborted) return;
    setText(this.problem, text);
    this.problem.hidden = false;
  }
}
