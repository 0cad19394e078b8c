import type { View } from '../generated/mis_slam/v1/control_pb';
import { type Pose, TrackingOutcome } from '../generated/mis_slam/v1/pose_pb';
import type { SessionState } from '../generated/mis_slam/v1/session_pb';
import type { SharedChange, SharedScene } from '../generated/mis_slam/v1/shared_pb';
import { SurfelStore } from '../model/surfel_store';
import { describePage, type PartOfPage, type ReplayStatus, recordError } from '../page_status';
import { Stage } from '../scene/stage';
import type { Refused } from '../server/access';
import { changeReplay, closeSession, refusalOf, viewUrl } from '../server/sessions';
import { isStale } from '../stream/data_age';
import { outcomeName, statusName } from '../stream/names';
import { SessionFeed } from '../stream/session_feed';
import { element, pressShortcut, setData, setText } from '../ui/dom';
import type { Page } from '../ui/page';
import { age, ageTone, viewedStatusWording } from '../ui/wording';
import type { Headset, HeadsetMode } from '../xr/headset';
import { SharedPlacement } from '../xr/shared_placement';
import { Banner, messageFor } from './banner';
import { DisplayOptions } from './display_options';
import { FeatureOverlay } from './feature_overlay';
import { FilePanel } from './file_panel';
import { HeadsetButtons } from './headset_buttons';
import { MeasurementList } from './measurement_list';
import { Notes } from './notes';
import { savePicture, toggleFullScreen } from './picture';
import { Plots } from './plots';
import { Preview } from './preview';
import { StatusPanel } from './status_panel';
import { Timeline } from './timeline';
import { Toolbar } from './toolbar';
import { Tools } from './tools';
import { GazeWatch, viewMessage } from './wishes';

const REFRESH_MS = 200;
/** The server sends a surfel anew that is farther off than this: taken for the model's error until an epoch tells. */
const MODEL_ERROR_MAX_M = 2e-4;
const VIEW_HELP =
  '3-D model. Drag or arrow keys turn it, wheel or plus and minus zoom, right drag or Shift and arrows move it.';

/** One session: the model in 3-D, the scope's image, and figures with the age of what is shown. */
export class SessionPage implements Page {
  readonly root = element('main', { class: 'session-page', 'data-page': 'session' });
  readonly heading: HTMLElement;
  private readonly statusPill = element('span', { class: 'pill' });
  private readonly agePill = element('span', { class: 'pill age', title: 'Age of the model shown' });
  private readonly canvas = element('canvas', {
    tabindex: '0',
    role: 'application',
    'aria-label': VIEW_HELP,
  });
  private readonly banner = new Banner();
  private readonly panel = new StatusPanel();
  private readonly features = new FeatureOverlay(() => this.tellWishes());
  private readonly preview = new Preview(this.features, recordError);
  private readonly plots = new Plots();
  private readonly timeline: Timeline;
  private readonly files: FilePanel;
  private readonly notes: Notes;
  private readonly sharedPlacement: SharedPlacement;
  private readonly options: DisplayOptions;
  private readonly measurements: MeasurementList;
  private readonly store = new SurfelStore();
  private readonly stage: Stage | undefined;
  private readonly tools: Tools | undefined;
  private readonly toolbar: Toolbar;
  private readonly feed: SessionFeed;
  private readonly refreshing: number;
  private posesReceived = 0;
  private refused: Refused | undefined;
  private reconstruction = 0;
  private readonly gaze = new GazeWatch();
  private headset: Headset | undefined;
  private cameraKnown = false;

  constructor(private readonly session: string) {
    this.heading = element('div', {}, element('h1', {}, session), this.statusPill, this.agePill);
    this.stage = startStage(this.canvas, this.store);
    const change = (wanted: SharedChange) => this.feed.changeShared(wanted);
    this.notes = new Notes(this.store, change, () => this.showMarks());
    this.sharedPlacement = new SharedPlacement(change);
    this.tools = this.makeTools();
    this.toolbar = this.makeToolbar();
    this.options = this.makeOptions();
    this.measurements = new MeasurementList({
      remove: (index) => this.tools?.remove(index),
      clear: () => this.tools?.clear(),
    });
    this.timeline = new Timeline({
      change: (wanted) => changeReplay(session, wanted),
      end: () => closeSession(session),
    });
    this.files = new FilePanel(session);
    this.layOut();
    this.feed = new SessionFeed(viewUrl(session), this.store, this.wishes(), {
      pose: (pose) => this.takePose(pose),
      preview: (image) => this.preview.show(image),
      features: (features) => this.features.take(features),
      state: (state) => this.takeState(state),
      shared: (scene) => this.takeShared(scene),
      disconnected: () => void this.askWhyNot(),
      error: recordError,
    });
    document.title = `${session} · MIS-SLAM`;
    describePage(() => this.describe());
    document.addEventListener('keydown', this.onKey);
    this.refreshing = window.setInterval(() => this.refresh(), REFRESH_MS);
    this.refresh();
  }

  close(): void {
    window.clearInterval(this.refreshing);
    document.removeEventListener('keydown', this.onKey);
    this.feed.close();
    this.timeline.dispose();
    this.files.dispose();
    this.plots.dispose();
    this.tools?.dispose();
    this.stage?.dispose();
  }

  private makeTools(): Tools | undefined {
    if (this.stage === undefined) return undefined;
    return new Tools(this.canvas, this.stage, this.store, {
      annotate: (surfel) => this.notes.ask(surfel),
      changed: () => this.showMarks(),
    });
  }

  private makeToolbar(): Toolbar {
    const { stage } = this;
    const toolbar = new Toolbar({
      fit: () => stage?.fit(),
      reset: () => stage?.reset(),
      follow: (on) => stage?.follow(on),
      path: (visible) => stage?.showTrajectory(visible),
      tool: (tool) => this.tools?.choose(tool),
      fullScreen: () => void toggleFullScreen(this.root).catch(recordError),
      picture: () => void (stage && savePicture(stage, this.session).catch(recordError)),
    });
    if (stage !== undefined) stage.view.onRelease = () => toolbar.releaseFollow();
    return toolbar;
  }

  private readonly onKey = (event: KeyboardEvent): void => {
    if (event.ctrlKey || event.metaKey || event.altKey || takesText(event.target)) return;
    if (this.press(event.key.toLowerCase())) event.preventDefault();
  };

  /** Letters press buttons, digits choose the colouring, Escape puts the tool down. */
  private press(key: string): boolean {
    if (key === 'escape') {
      this.toolbar.releaseTools();
      return true;
    }
    return /^[1-9]$/.test(key) ? this.options.chooseColoring(Number(key) - 1) : pressShortcut(this.root, key);
  }

  private makeOptions(): DisplayOptions {
    const { stage } = this;
    return new DisplayOptions({
      coloring: (coloring) => {
        stage?.setColoring(coloring);
        this.options.showLegend(stage?.legend);
      },
      clip: (direction, share) => stage?.setClip(direction && { direction, share }),
      moveClip: (share) => stage?.moveClip(share),
      detail: () => this.tellWishes(),
    });
  }

  /** What the server is asked to send. */
  private wishes(): View {
    return viewMessage({
      features: this.features.on,
      maxSurfels: this.options.maxSurfels,
      inHeadset: this.headset !== undefined,
      gaze: this.headset?.gaze,
    });
  }

  private tellWishes(): void {
    this.feed.want(this.wishes());
  }

  private layOut(): void {
    const model = element(
      'section',
      { class: 'stage', 'aria-label': 'Model' },
      this.canvas,
      this.banner.root,
    );
    if (this.stage === undefined) {
      model.append(
        element('p', { class: 'notice' }, 'This browser offers no WebGL 2: the model cannot be drawn.'),
      );
    } else model.append(this.stage.overlay);
    this.toolbar.root.append(new HeadsetButtons((mode) => void this.wear(mode), recordError).root);
    model.append(this.toolbar.root);
    const image = element('section', { class: 'card', 'aria-label': 'Scope' }, this.preview.root);
    const { measurements, notes, options, panel, plots, files, timeline } = this;
    const cards = [measurements, notes.panel, options, files, panel, plots].map((card) => card.root);
    this.root.append(model, timeline.root, element('aside', {}, image, ...cards));
  }

  /** Shows the model in a headset. Hands that point measure; the page goes on showing the figures. */
  private async wear(mode: HeadsetMode): Promise<void> {
    const { stage } = this;
    if (stage === undefined || this.headset !== undefined) return;
    try {
      this.headset = await stage.enterHeadset(mode, {
        point: (ray) => {
          const surfel = stage.pickAlong(ray);
          if (surfel !== undefined) this.tools?.measureTo(surfel);
        },
        placed: (roomFromWorld) => this.sharedPlacement.place(roomFromWorld),
        aligned: (roomFromMarker) => this.sharedPlacement.align(roomFromMarker),
        ended: () => {
          this.headset = undefined;
          this.tellWishes();
        },
      });
      this.tellWishes();
    } catch (error) {
      recordError(error);
    }
  }

  private takeShared(scene: SharedScene): void {
    this.notes.take(scene);
    const placement = this.sharedPlacement.placementIn(scene);
    if (placement !== undefined) this.headset?.place(placement);
  }

  private showMarks(): void {
    if (this.tools === undefined) return;
    const { epoch, errorM = MODEL_ERROR_MAX_M } = this.feed.replica;
    const readings = this.tools.readings({ epoch, errorM });
    this.measurements.show(readings);
    this.stage?.showMarks([...this.tools.marks(readings), ...this.notes.marks()]);
  }

  private takePose(pose: Pose): void {
    this.posesReceived += 1;
    const tracked = pose.outcome === TrackingOutcome.TRACKED || pose.outcome === TrackingOutcome.RECOVERED;
    this.stage?.setPose(tracked ? pose.worldFromCamera : undefined, tracked);
  }

  private takeState(state: SessionState): void {
    this.refused = undefined;
    this.takeReconstruction(state.reconstruction);
    if (state.camera === undefined || this.cameraKnown) return;
    this.cameraKnown = true;
    this.stage?.setCamera(state.camera);
  }

  /** Another reconstruction has another world: what was placed in the last one is nowhere in it. */
  private takeReconstruction(reconstruction: number): void {
    const another = this.reconstruction !== 0 && this.reconstruction !== reconstruction;
    this.reconstruction = reconstruction;
    if (!another) return;
    this.tools?.clear();
    this.stage?.forgetTrajectory();
  }

  private async askWhyNot(): Promise<void> {
    this.refused = await refusalOf(this.session);
  }

  private get replay(): ReplayStatus | null {
    const replay = this.feed.lastState?.replay;
    if (replay === undefined) return null;
    const { paused, rate, ended } = replay;
    return {
      positionS: seconds(replay.positionNs),
      durationS: seconds(replay.durationNs),
      paused,
      rate,
      ended,
    };
  }

  /** Whether nothing new is to be expected, as the replay is paused or at its end. */
  private get rests(): boolean {
    const { replay } = this;
    return replay !== null && (replay.paused || replay.ended);
  }

  private describe(): PartOfPage {
    const { feed } = this;
    const now = performance.now();
    const state = statusName(feed.lastState?.status);
    const { replay, rests } = this;
    return {
      page: 'session',
      session: this.session,
      sessions: null,
      recordings: null,
      finished: null,
      connection: feed.connectionState,
      state,
      tracking: outcomeName(feed.lastPose?.outcome ?? feed.lastState?.tracking),
      surfels: this.store.size,
      serverSurfels: feed.lastState?.surfels ?? 0,
      epoch: feed.replica.epoch,
      following: feed.replica.following,
      ageMs: feed.modelAge.ageMs(now),
      stale: isStale(state, feed.modelAge.silenceMs(now), rests),
      hidden: !rests && this.options.hides(feed.modelAge.ageMs(now)),
      measuredMm: this.tools?.measuredMm ?? [],
      poses: this.posesReceived,
      previews: this.preview.imagesShown,
      replay,
      features: this.features.count,
      framesDrawn: this.stage?.framesDrawn ?? 0,
      viewRests: this.stage?.viewRests ?? false,
      resyncs: feed.resyncs,
      notes: this.notes.count,
      headset: this.headset?.placement?.elements ?? null,
    };
  }

  private refresh(): void {
    const shown = this.describe();
    this.stage?.showStale(shown.stale);
    this.stage?.hideModel(shown.hidden);
    this.stage?.setEpoch(shown.epoch);
    this.options.showLegend(this.stage?.legend);
    if (this.gaze.hasMoved(this.headset?.gaze, performance.now())) this.tellWishes();
    if (this.tools?.inUse || this.notes.inUse) this.showMarks();
    this.preview.showAge(this.rests ? null : this.feed.previewAge.ageMs(performance.now()));
    this.showFigures(shown);
    this.showTimeline(shown);
    this.banner.show(
      messageFor({
        ...shown,
        status: shown.state,
        refused: this.refused,
        statusText: this.feed.lastState?.text ?? '',
        notice: this.feed.notice,
        silenceMs: this.feed.modelAge.silenceMs(performance.now()),
      }),
    );
    const status = viewedStatusWording(shown.state, shown.connection, shown.replay);
    setText(this.statusPill, status.text);
    setData(this.statusPill, 'tone', status.tone);
    setText(this.agePill, `Age ${age(shown.ageMs)}`);
    setData(this.agePill, 'tone', this.rests ? 'quiet' : ageTone(shown.ageMs));
    for (const name of ['connection', 'state', 'tracking', 'surfels', 'epoch', 'stale', 'hidden'] as const) {
      setData(this.root, name, String(shown[name]));
    }
  }

  private showTimeline(shown: PartOfPage): void {
    const { replay, spanNs = 0n } = this.feed.lastState ?? {};
    const playing = shown.replay && replay && { ...shown.replay, recording: replay.recording };
    const live = shown.connection === 'open' && ['live', 'degraded'].includes(shown.state);
    const reachable = shown.connection === 'open' && shown.state !== 'closed';
    this.timeline.show({ replay: playing ?? undefined, spanS: seconds(spanNs), live, reachable });
    if (shown.state === 'closed' || this.refused?.status === 404) this.files.sessionEnded(performance.now());
  }

  private showFigures(shown: PartOfPage): void {
    const { feed } = this;
    const now = performance.now();
    const bitsPerS = feed.bytes.amountPerS(now) * 8;
    this.plots.add(now, { latencyMs: feed.lastPose?.latencyMs ?? null, ageMs: shown.ageMs, bitsPerS });
    this.panel.show({
      ...shown,
      status: shown.state,
      picture: feed.lastState?.picture ?? '',
      poseAgeMs: feed.poseAge.ageMs(now),
      latencyMs: feed.lastPose?.latencyMs ?? null,
      matchedFeatures: feed.lastPose?.matchedFeatures ?? null,
      videoPerS: feed.lastState?.receivedHz ?? 0,
      posesPerS: feed.poses.eventsPerS(now),
      epochsPerS: feed.epochs.eventsPerS(now),
      bitsPerS,
      drops: feed.lastState?.drops ?? [],
      viewers: feed.lastState?.viewers ?? 0,
    });
  }
}

function seconds(ns: bigint): number {
  return Number(ns) / 1e9;
}

/** Whether letters pressed here write text or choose something. */
function takesText(target: EventTarget | null): boolean {
  if (target instanceof HTMLInputElement) return target.type !== 'range';
  return target instanceof HTMLSelectElement;
}

/** The 3-D view, or nothing where the browser cannot draw it; all else still works then. */
function startStage(canvas: HTMLCanvasElement, store: SurfelStore): Stage | undefined {
  try {
    return new Stage(canvas, store);
  } catch (error) {
    recordError(error);
    return undefined;
  }
}
