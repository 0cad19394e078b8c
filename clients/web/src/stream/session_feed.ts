import type { Refusal, View } from '../generated/mis_slam/v1/control_pb';
import type { FromServer } from '../generated/mis_slam/v1/envelope_pb';
import type { ImageFeatures, PreviewImage } from '../generated/mis_slam/v1/image_pb';
import type { Pose } from '../generated/mis_slam/v1/pose_pb';
import type { SessionState } from '../generated/mis_slam/v1/session_pb';
import type { SharedChange, SharedScene } from '../generated/mis_slam/v1/shared_pb';
import { type Applied, Replica } from '../model/replica';
import type { SurfelStore } from '../model/surfel_store';
import { Connection, type ConnectionState } from './connection';
import { DataAge } from './data_age';
import { decodeFromServer, encodeResync, encodeSharedChange, encodeView } from './messages';
import { RateMeter } from './rate_meter';

/** A snapshot that does not come is asked for again, and a bad one is not asked for at once, after this time. */
const RESYNC_INTERVAL_MS = 3000;
const RESYNC_CHECK_MS = 1000;

/** What a feed hands on as it comes; what is only shown now and then is read from its fields. */
export interface FeedEvents {
  pose(pose: Pose): void;
  preview(image: PreviewImage): void;
  features(features: ImageFeatures): void;
  state(state: SessionState): void;
  /** What viewers share changed, or is told for the first time. */
  shared(scene: SharedScene): void;
  /** The connection broke or could not be made. */
  disconnected(): void;
  error(error: unknown): void;
}

/** Everything that the server says about one session: applied to the model, counted and dated. */
export class SessionFeed {
  readonly replica: Replica;
  readonly modelAge = new DataAge();
  readonly poseAge = new DataAge();
  readonly previewAge = new DataAge();
  readonly bytes = new RateMeter();
  readonly epochs = new RateMeter();
  readonly poses = new RateMeter();
  connectionState: ConnectionState = 'connecting';
  lastState: SessionState | undefined;
  lastPose: Pose | undefined;
  /** What the server said when it refused or left; empty while all is well. */
  notice = '';
  /** How often the model had to be asked for again. */
  resyncs = 0;
  private readonly connection: Connection;
  private readonly resyncCheck: number;
  private lastResyncMs = Number.NEGATIVE_INFINITY;
  private lastSeededMs = Number.NEGATIVE_INFINITY;

  constructor(
    url: string,
    store: SurfelStore,
    private view: View,
    private readonly events: FeedEvents,
  ) {
    this.replica = new Replica(store);
    this.connection = new Connection(url, {
      message: (bytes) => this.take(bytes),
      changed: (state) => this.connectionChanged(state),
    });
    this.resyncCheck = window.setInterval(() => this.resyncIfStuck(), RESYNC_CHECK_MS);
  }

  /** Asks the server to change what viewers share. */
  changeShared(change: SharedChange): void {
    this.connection.send(encodeSharedChange(change));
  }

  /** Says what this viewer wants, now and after each greeting. */
  want(view: View): void {
    this.view = view;
    this.connection.send(encodeView(view));
  }

  close(): void {
    window.clearInterval(this.resyncCheck);
    this.connection.close();
  }

  private connectionChanged(state: ConnectionState): void {
    this.connectionState = state;
    if (state === 'waiting') this.events.disconnected();
    if (state !== 'open') return;
    // The server begins with a snapshot of its own accord.
    this.replica.forget();
    this.lastResyncMs = performance.now();
  }

  private take(bytes: Uint8Array): void {
    this.bytes.add(performance.now(), bytes.length);
    let body: FromServer['body'];
    try {
      body = decodeFromServer(bytes);
    } catch (error) {
      // Had it been an epoch, then the next one will not fit and a snapshot is asked for.
      this.events.error(error);
      return;
    }
    this.dispatch(body);
  }

  private dispatch(body: FromServer['body']): void {
    switch (body.case) {
      case 'hello':
        this.notice = '';
        this.connection.send(encodeView(this.view));
        break;
      case 'refusal':
        this.refused(body.value);
        break;
      case 'farewell':
        this.notice = body.value.text;
        break;
      case 'pose':
        this.takePose(body.value);
        break;
      case 'epoch':
        this.changeModel(() => this.replica.applyEpoch(body.value));
        break;
      case 'snapshot':
        this.changeModel(() => this.replica.applyChunk(body.value));
        break;
      case 'state':
        this.takeState(body.value);
        break;
      case 'preview':
        this.previewAge.heard(performance.now());
        this.events.preview(body.value);
        break;
      case 'features':
        this.events.features(body.value);
        break;
      case 'shared':
        this.events.shared(body.value);
        break;
      case undefined:
        break;
    }
  }

  private refused(refusal: Refusal): void {
    this.notice = refusal.text;
    this.events.error(new Error(`the server refused: ${refusal.text}`));
  }

  private takePose(pose: Pose): void {
    const now = performance.now();
    this.lastPose = pose;
    this.poses.add(now);
    this.poseAge.heard(now, pose.latencyMs);
    this.events.pose(pose);
  }

  private takeState(state: SessionState): void {
    const now = performance.now();
    this.lastState = state;
    if (state.modelAgeMs !== undefined) this.modelAge.serverSays(now, state.modelAgeMs);
    this.events.state(state);
  }

  private changeModel(apply: () => Applied): void {
    const now = performance.now();
    try {
      const applied = apply();
      if (applied === 'seeding') this.lastSeededMs = now;
      if (applied !== 'current') return;
      this.epochs.add(now);
      this.modelAge.heard(now);
    } catch (error) {
      this.events.error(error);
      this.resyncIfStuck();
    }
  }

  private resyncIfStuck(): void {
    const now = performance.now();
    const lastProgressMs = Math.max(this.lastResyncMs, this.lastSeededMs);
    if (this.replica.following || this.connectionState !== 'open') return;
    if (now - lastProgressMs < RESYNC_INTERVAL_MS) return;
    this.lastResyncMs = now;
    this.resyncs += 1;
    this.connection.send(encodeResync(this.replica.epoch));
  }
}
