import {
  ColorManagement,
  Group,
  LinearSRGBColorSpace,
  Matrix4,
  Raycaster,
  type Ray as RayInWorld,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from 'three';
import type { Camera } from '../generated/mis_slam/v1/calibration_pb';
import type { RigidTransform } from '../generated/mis_slam/v1/geometry_pb';
import type { SurfelStore } from '../model/surfel_store';
import { Headset, type HeadsetEvents, type HeadsetMode } from '../xr/headset';
import { type Bounds, boundsWithScope, modelBounds, outgrows } from './bounds';
import { type ClipDirection, clipNormal, clipPlane, lineOfSight } from './clipping';
import { type Coloring, type Scale, scaleOf, type ValueRange } from './coloring';
import { type Mark, Marks } from './marks';
import { type Plane, type Point, pickSurfel } from './picking';
import { ScopeFrustum } from './scope_frustum';
import { SurfelCloud } from './surfel_cloud';
import { Trajectory } from './trajectory';
import { valueRangeOf } from './value_range';
import { ViewControl } from './view_control';

// Colours of the tissue and of the lines go to the screen as they were given, in sRGB.
ColorManagement.enabled = false;

/** Finer pixels than this cost more than they show. */
const MAX_PIXEL_RATIO = 2;
const FADE_TIME_S = 0.15;
const REFIT_INTERVAL_MS = 500;
const FRUSTUM_SHARE = 0.35;

/** World has y down and z forward (design: conventions); three.js has y up and looks along -z. */
const VIEW_FROM_WORLD = new Matrix4().makeRotationX(Math.PI);

/** What the colours shown mean. */
export interface Legend {
  readonly scale: Scale;
  readonly range: ValueRange;
}

/**
 * The 3-D view: model, scope, its way, and where the viewer looks from. It draws when something changed,
 * not at every screen refresh.
 */
export class Stage {
  readonly view: ViewControl;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly cloud: SurfelCloud;
  private readonly frustum = new ScopeFrustum();
  private readonly trajectory = new Trajectory();
  private readonly marks = new Marks();
  private readonly world = new Group();
  private readonly resizing: ResizeObserver;
  private headset: Headset | undefined;
  private lastFrameMs = performance.now();
  private lastRefitMs = Number.NEGATIVE_INFINITY;
  private fitted: Bounds | undefined;
  private dirty = true;
  private fade = 0;
  private fadeGoal = 0;
  private frames = 0;
  private coloring: Coloring = 'colour';
  private range: ValueRange = { low: 0, high: 1 };
  private epoch = 0;
  private clip: { normal: Point; share: number; plane: Plane } | undefined;

  /** Throws where the browser offers no WebGL 2. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly store: SurfelStore,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.cloud = new SurfelCloud(store);
    this.world.matrixAutoUpdate = false;
    this.world.matrix.copy(VIEW_FROM_WORLD);
    this.world.add(this.cloud.mesh, this.frustum.group, this.trajectory.line, this.marks.group);
    this.scene.add(this.world);
    this.view = new ViewControl(canvas, this.frustum.group);
    this.resizing = new ResizeObserver(() => this.resize());
    this.resizing.observe(canvas);
    this.renderer.setAnimationLoop(this.frame);
  }

  /** Images drawn since the start. */
  get framesDrawn(): number {
    return this.frames;
  }

  /** Whether the view has been put before the model, and rests. */
  get viewRests(): boolean {
    return this.fitted !== undefined && !this.view.gliding;
  }

  setPose(pose: RigidTransform | undefined, tracked: boolean): void {
    if (pose !== undefined) {
      this.frustum.setPose(pose);
      this.trajectory.add(pose.txM, pose.tyM, pose.tzM);
    }
    this.frustum.tracked = tracked;
    this.dirty = true;
  }

  setCamera(camera: Camera): void {
    this.frustum.setCamera(camera);
    this.view.setImage(camera);
    this.dirty = true;
  }

  /** Fades the model, or brings it back. */
  showStale(stale: boolean): void {
    this.fadeGoal = stale ? 1 : 0;
  }

  /** Takes a model that is too old out of sight, or brings it back. */
  hideModel(hidden: boolean): void {
    if (this.cloud.mesh.visible === !hidden) return;
    this.cloud.mesh.visible = !hidden;
    this.dirty = true;
  }

  setColoring(coloring: Coloring): void {
    this.coloring = coloring;
    this.cloud.coloring = coloring;
    this.adjustRange();
  }

  /** The epoch of the model shown, from which ages are counted. */
  setEpoch(epoch: number): void {
    this.epoch = epoch;
  }

  /** What the colours mean; undefined where they stand for themselves. */
  get legend(): Legend | undefined {
    const scale = scaleOf(this.coloring);
    return scale === undefined ? undefined : { scale, range: this.range };
  }

  /** Cuts away the first `share` (0 to 1) of the model along a direction; undefined cuts nothing. */
  setClip(cut: { direction: ClipDirection; share: number } | undefined): void {
    this.clip = undefined;
    if (cut !== undefined) {
      const normal = clipNormal(cut.direction, lineOfSight(this.view.camera.matrixWorld));
      this.clip = { normal, share: cut.share, plane: [0, 0, 0, 1] };
    }
    this.placeClipPlane();
  }

  /** Moves the clipping plane without turning it. */
  moveClip(share: number): void {
    if (this.clip === undefined) return;
    this.clip = { ...this.clip, share };
    this.placeClipPlane();
  }

  /** Shows the model in a headset until it is taken off; what hands do there is told to `events`. */
  async enterHeadset(mode: HeadsetMode, events: HeadsetEvents): Promise<Headset> {
    const { renderer, scene, world } = this;
    const centre = () => new Vector3(...(modelBounds(this.store)?.centre ?? [0, 0, 0.1]));
    const ended = () => {
      this.headset = undefined;
      this.marks.inSpace = false;
      world.matrix.copy(VIEW_FROM_WORLD);
      world.matrixWorldNeedsUpdate = true;
      this.resize();
      events.ended();
    };
    this.headset = await Headset.enter(mode, { renderer, scene, world, centre }, { ...events, ended });
    this.marks.inSpace = true;
    return this.headset;
  }

  /** The surfel that a ray in world coordinates meets first, or undefined where it meets none. */
  pickAlong({ origin, direction }: RayInWorld): number | undefined {
    const ray = { origin: origin.toArray(), direction: direction.clone().normalize().toArray() };
    const slot = pickSurfel(this.store, ray, this.clip?.plane);
    return slot === undefined ? undefined : this.store.id(slot);
  }

  /** The surfel shown at a place of the window, or undefined where there is none. */
  pick(clientX: number, clientY: number): number | undefined {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const place = new Vector2(((clientX - left) / width) * 2 - 1, 1 - ((clientY - top) / height) * 2);
    const caster = new Raycaster();
    caster.setFromCamera(place, this.view.camera);
    return this.pickAlong(caster.ray.applyMatrix4(this.world.matrixWorld.clone().invert()));
  }

  showMarks(marks: readonly Mark[]): void {
    this.marks.show(marks);
    this.dirty = true;
  }

  /** Labels and dots, to be laid over the canvas. */
  get overlay(): HTMLElement {
    return this.marks.overlay;
  }

  /** The 3-D view as a PNG image, without labels. */
  async picture(): Promise<Blob> {
    // Drawn in the same turn: the browser clears the buffer after showing it.
    this.renderer.render(this.scene, this.view.camera);
    return new Promise((resolve, reject) => {
      this.canvas.toBlob((blob) => {
        if (blob === null) reject(new Error('the view could not be encoded'));
        else resolve(blob);
      }, 'image/png');
    });
  }

  /** Another world begins: the way through the last one means nothing in it. */
  forgetTrajectory(): void {
    this.trajectory.clear();
    this.dirty = true;
  }

  showTrajectory(visible: boolean): void {
    this.trajectory.line.visible = visible;
    this.dirty = true;
  }

  /** Looks through the scope; the frustum would only be in the way then. */
  follow(on: boolean): void {
    this.view.follow(on, toView(modelBounds(this.store)?.centre ?? [0, 0, 0.1]));
    this.frustum.lines.visible = !on;
    this.dirty = true;
  }

  /** Looks from the first direction at the whole model again. */
  reset(): void {
    this.view.resetDirection();
    this.fit();
  }

  /** Brings the whole model into view, and the scope where it is near. */
  fit(): void {
    const model = modelBounds(this.store);
    if (model === undefined) return;
    this.fitted = this.withScope(model);
    this.view.fit(toView(this.fitted.centre), this.fitted.radiusM);
    this.frustum.depthM = model.radiusM * FRUSTUM_SHARE;
    this.dirty = true;
  }

  dispose(): void {
    void this.headset?.leave();
    this.renderer.setAnimationLoop(null);
    this.resizing.disconnect();
    this.view.dispose();
    this.cloud.dispose();
    this.frustum.dispose();
    this.trajectory.dispose();
    this.marks.dispose();
    this.renderer.dispose();
  }

  private readonly frame = (nowMs: number): void => {
    const seconds = Math.min(Math.max((nowMs - this.lastFrameMs) / 1000, 0), 0.1);
    this.lastFrameMs = nowMs;
    const uploaded = this.cloud.upload();
    if (this.headset !== undefined) {
      this.drawHeadset(seconds);
      return;
    }
    this.followModel(nowMs);
    const moved = this.view.update(seconds);
    const faded = this.advanceFade(seconds);
    if (!uploaded && !moved && !faded && !this.dirty) return;
    this.dirty = false;
    this.renderer.render(this.scene, this.view.camera);
    this.marks.render(this.scene, this.view.camera);
    this.frames += 1;
  };

  /** A headset wants every image, whether anything changed or not. */
  private drawHeadset(seconds: number): void {
    if (this.legend !== undefined) this.adjustRange();
    this.advanceFade(seconds);
    this.headset?.draw();
    this.frames += 1;
  }

  /** Fits what follows from the whole model to it, now and then: it grows and moves. */
  private followModel(nowMs: number): void {
    if (nowMs - this.lastRefitMs < REFIT_INTERVAL_MS) return;
    this.lastRefitMs = nowMs;
    if (!this.view.movedByHand) this.fitGrowingModel();
    if (this.legend !== undefined) this.adjustRange();
  }

  private adjustRange(): void {
    this.frustum.group.updateMatrix();
    const worldFromScope = this.frustum.group.matrix;
    const scopeFromWorld = worldFromScope.clone().invert();
    this.range = valueRangeOf(this.coloring, this.store, { epoch: this.epoch, scopeFromWorld });
    this.cloud.valueRange = this.range;
    this.cloud.epoch = this.epoch;
    this.cloud.worldFromScope = worldFromScope;
    this.dirty = true;
  }

  private placeClipPlane(): void {
    const bounds = modelBounds(this.store);
    if (this.clip !== undefined && bounds !== undefined) {
      this.clip = { ...this.clip, plane: clipPlane(this.clip.normal, this.clip.share, bounds) };
    }
    this.cloud.clipPlane = this.clip?.plane;
    this.dirty = true;
  }

  private fitGrowingModel(): void {
    const model = modelBounds(this.store);
    if (model === undefined) return;
    if (this.fitted === undefined || outgrows(this.withScope(model), this.fitted)) this.fit();
  }

  private withScope(model: Bounds): Bounds {
    const { visible, position } = this.frustum.group;
    return visible ? boundsWithScope(model, [position.x, position.y, position.z]) : model;
  }

  private advanceFade(seconds: number): boolean {
    if (this.fade === this.fadeGoal) return false;
    this.fade += (this.fadeGoal - this.fade) * (1 - Math.exp(-seconds / FADE_TIME_S));
    if (Math.abs(this.fade - this.fadeGoal) < 0.005) this.fade = this.fadeGoal;
    this.cloud.fade = this.fade;
    return true;
  }

  private resize(): void {
    if (this.headset !== undefined) return;
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, MAX_PIXEL_RATIO));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.marks.resize(clientWidth, clientHeight);
    this.view.setAspect(clientWidth / clientHeight);
    if (!this.view.movedByHand) this.fit();
    this.dirty = true;
  }
}

/** World coordinates (y down, z forward) as three.js's (y up, z backward). */
function toView([x, y, z]: readonly [number, number, number]): Vector3 {
  return new Vector3(x, -y, -z);
}
