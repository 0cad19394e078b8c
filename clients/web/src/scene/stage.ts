import { ColorManagement, Group, LinearSRGBColorSpace, Scene, Vector3, WebGLRenderer } from 'three';
import type { Camera } from '../generated/mis_slam/v1/calibration_pb';
import type { RigidTransform } from '../generated/mis_slam/v1/geometry_pb';
import type { SurfelStore } from '../model/surfel_store';
import { type Bounds, boundsWithScope, modelBounds, outgrows } from './bounds';
import { ScopeFrustum } from './scope_frustum';
import { SurfelCloud } from './surfel_cloud';
import { Trajectory } from './trajectory';
import { ViewControl } from './view_control';

// Colours of the tissue and of the lines go to the screen as they were given, in sRGB.
ColorManagement.enabled = false;

/** Finer pixels than this cost more than they show. */
const MAX_PIXEL_RATIO = 2;
const FADE_TIME_S = 0.15;
const REFIT_INTERVAL_MS = 500;
const FRUSTUM_SHARE = 0.35;

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
  private readonly resizing: ResizeObserver;
  private animation = 0;
  private lastFrameMs = performance.now();
  private lastRefitMs = Number.NEGATIVE_INFINITY;
  private fitted: Bounds | undefined;
  private dirty = true;
  private fade = 0;
  private fadeGoal = 0;
  private frames = 0;

  /** Throws where the browser offers no WebGL 2. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly store: SurfelStore,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.cloud = new SurfelCloud(store);
    // World has y down and z forward (design: conventions); three.js has y up and looks along -z.
    const world = new Group();
    world.rotation.x = Math.PI;
    world.add(this.cloud.mesh, this.frustum.group, this.trajectory.line);
    this.scene.add(world);
    this.view = new ViewControl(canvas, this.frustum.group);
    this.resizing = new ResizeObserver(() => this.resize());
    this.resizing.observe(canvas);
    this.animation = requestAnimationFrame(this.frame);
  }

  /** Images drawn since the start. */
  get framesDrawn(): number {
    return this.frames;
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

  /** Shows the shape without the tissue's colours. */
  showShape(on: boolean): void {
    this.cloud.relief = on ? 1 : 0;
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
    cancelAnimationFrame(this.animation);
    this.resizing.disconnect();
    this.view.dispose();
    this.cloud.dispose();
    this.frustum.dispose();
    this.trajectory.dispose();
    this.renderer.dispose();
  }

  private readonly frame = (nowMs: number): void => {
    this.animation = requestAnimationFrame(this.frame);
    const seconds = Math.min(Math.max((nowMs - this.lastFrameMs) / 1000, 0), 0.1);
    this.lastFrameMs = nowMs;
    const uploaded = this.cloud.upload();
    if (!this.view.movedByHand) this.fitGrowingModel(nowMs);
    const moved = this.view.update(seconds);
    const faded = this.advanceFade(seconds);
    if (!uploaded && !moved && !faded && !this.dirty) return;
    this.dirty = false;
    this.renderer.render(this.scene, this.view.camera);
    this.frames += 1;
  };

  private fitGrowingModel(nowMs: number): void {
    if (nowMs - this.lastRefitMs < REFIT_INTERVAL_MS) return;
    this.lastRefitMs = nowMs;
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
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, MAX_PIXEL_RATIO));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.view.setAspect(clientWidth / clientHeight);
    if (!this.view.movedByHand) this.fit();
    this.dirty = true;
  }
}

/** World coordinates (y down, z forward) as three.js's (y up, z backward). */
function toView([x, y, z]: readonly [number, number, number]): Vector3 {
  return new Vector3(x, -y, -z);
}
