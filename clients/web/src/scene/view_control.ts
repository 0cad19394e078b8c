import { MathUtils, type Object3D, PerspectiveCamera, Quaternion, Vector3 } from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import type { Camera } from '../generated/mis_slam/v1/calibration_pb';

const ORBIT_FOV_DEG = 40;
/** Time in which the view covers 63 % of the way to where it goes. */
const GLIDE_TIME_S = 0.12;
const KEY_TURN_RAD = 0.07;
const KEY_PAN_PX = 24;
const KEY_ZOOM = 0.9;
/** Below 1: organs seldom fill their sphere to its edge. */
const FIT_MARGIN = 0.88;
const GESTURES = ['pointerdown', 'wheel'] as const;
/** From the scope's side, a little from above and from the right, so that the frustum is seen too. */
const FIRST_DIRECTION = new Vector3(0.5, 0.36, 1).normalize();

/**
 * Where the viewer looks from: an orbit that people steer, or the scope's own view (follow).
 * Coordinates are three.js's (y up), in metres.
 */
export class ViewControl {
  readonly camera = new PerspectiveCamera(ORBIT_FOV_DEG, 1, 0.001, 10);
  /** Asked to end following because somebody takes hold of the view. */
  onRelease: () => void = () => {};
  private readonly orbit: OrbitControls;
  private following = false;
  private touched = false;
  private imageAspect = 4 / 3;
  private imageFovDeg = ORBIT_FOV_DEG;
  private modelRadiusM = 0.05;
  private goal: { position: Vector3; target: Vector3 } | undefined;

  /** `scope` is placed by world_from_camera, in the axes of a camera with y down. */
  constructor(
    private readonly element: HTMLElement,
    private readonly scope: Object3D,
  ) {
    this.camera.position.copy(FIRST_DIRECTION).multiplyScalar(0.2);
    this.orbit = new OrbitControls(this.camera, element);
    this.orbit.enableDamping = true;
    this.orbit.dampingFactor = 0.12;
    this.orbit.addEventListener('start', () => this.takeHold());
    // Before the orbit's own listeners, so that the same gesture that ends following turns the view.
    for (const gesture of GESTURES) element.addEventListener(gesture, this.endFollowing, { capture: true });
    element.addEventListener('keydown', this.onKey);
  }

  /** Whether somebody has moved the view since the last fit. */
  get movedByHand(): boolean {
    return this.touched;
  }

  /** Whether the view is on its way to where a fit put it. */
  get gliding(): boolean {
    return this.goal !== undefined;
  }

  /** Glides to where a sphere fills the view, keeping the direction. */
  fit(centre: Vector3, radiusM: number): void {
    const halfVertical = MathUtils.degToRad(ORBIT_FOV_DEG) / 2;
    const halfHorizontal = Math.atan(Math.tan(halfVertical) * this.camera.aspect);
    const distance = (radiusM * FIT_MARGIN) / Math.sin(Math.min(halfVertical, halfHorizontal));
    const { position, target } = this.goal ?? { position: this.camera.position, target: this.orbit.target };
    const direction = position.clone().sub(target).normalize();
    this.goal = { position: centre.clone().addScaledVector(direction, distance), target: centre.clone() };
    this.modelRadiusM = radiusM;
    this.touched = false;
  }

  /** The next fit looks from the first direction again. */
  resetDirection(): void {
    this.goal = {
      position: this.orbit.target.clone().add(FIRST_DIRECTION),
      target: this.orbit.target.clone(),
    };
  }

  /** Looks through the scope, or goes back to the orbit at `pivot`. */
  follow(on: boolean, pivot: Vector3): void {
    if (on === this.following) return;
    this.following = on;
    this.orbit.enabled = !on;
    this.goal = undefined;
    if (on) return;
    const forward = this.camera.getWorldDirection(new Vector3());
    const depth = Math.max(pivot.clone().sub(this.camera.position).dot(forward), 0.01);
    this.orbit.target.copy(this.camera.position).addScaledVector(forward, depth);
  }

  /** The scope's field of view, which the followed view shows whole. */
  setImage(camera: Camera): void {
    this.imageAspect = camera.widthPx / camera.heightPx;
    this.imageFovDeg = MathUtils.radToDeg(2 * Math.atan(camera.heightPx / 2 / camera.fyPx));
  }

  setAspect(aspect: number): void {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
  }

  /** Moves on by `seconds`; true where the view changed. */
  update(seconds: number): boolean {
    const before = this.camera.matrixWorld.clone();
    const fovBefore = this.camera.fov;
    const share = 1 - Math.exp(-seconds / GLIDE_TIME_S);
    if (this.following) this.glideToScope(share);
    else this.glideToGoal(share);
    this.setLens(share);
    this.camera.updateMatrixWorld();
    return fovBefore !== this.camera.fov || !before.equals(this.camera.matrixWorld);
  }

  dispose(): void {
    this.element.removeEventListener('keydown', this.onKey);
    for (const gesture of GESTURES)
      this.element.removeEventListener(gesture, this.endFollowing, { capture: true });
    this.orbit.dispose();
  }

  private glideToScope(share: number): void {
    this.scope.updateWorldMatrix(true, false);
    const position = new Vector3();
    const rotation = new Quaternion();
    this.scope.matrixWorld.decompose(position, rotation, new Vector3());
    // three.js looks along -z with y up, the scope along +z with y down: half a turn about x.
    rotation.multiply(new Quaternion(1, 0, 0, 0));
    this.camera.position.lerp(position, share);
    this.camera.quaternion.slerp(rotation, share);
  }

  private glideToGoal(share: number): void {
    if (this.goal !== undefined) {
      this.camera.position.lerp(this.goal.position, share);
      this.orbit.target.lerp(this.goal.target, share);
      const rest = this.camera.position.distanceTo(this.goal.position);
      if (rest < 1e-3 * this.goal.position.distanceTo(this.goal.target)) this.goal = undefined;
    }
    this.orbit.update();
  }

  /** Field of view and clipping planes: the near one at a two hundredth of the distance looked at. */
  private setLens(share: number): void {
    const fitted = this.camera.aspect < this.imageAspect ? this.imageAspect / this.camera.aspect : 1;
    const half = Math.tan(MathUtils.degToRad(this.imageFovDeg) / 2) * fitted;
    const wanted = this.following ? MathUtils.radToDeg(2 * Math.atan(half)) : ORBIT_FOV_DEG;
    const fov =
      Math.abs(wanted - this.camera.fov) < 0.01 ? wanted : MathUtils.lerp(this.camera.fov, wanted, share);
    const distance = this.following ? this.modelRadiusM : this.camera.position.distanceTo(this.orbit.target);
    const near = Math.max(distance / 200, 1e-4);
    if (fov === this.camera.fov && near === this.camera.near) return;
    this.camera.fov = fov;
    this.camera.near = near;
    this.camera.far = 100 * Math.max(distance, this.modelRadiusM);
    this.camera.updateProjectionMatrix();
  }

  private takeHold(): void {
    this.touched = true;
    this.goal = undefined;
  }

  private readonly endFollowing = (): void => {
    if (this.following) this.onRelease();
  };

  private readonly onKey = (event: KeyboardEvent): void => {
    const action = this.keyActions()[event.shiftKey ? `Shift+${event.key}` : event.key];
    if (action === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.endFollowing();
    this.takeHold();
    action();
  };

  private keyActions(): Record<string, () => void> {
    const { orbit } = this;
    return {
      ArrowLeft: () => orbit.rotateLeft(KEY_TURN_RAD),
      ArrowRight: () => orbit.rotateLeft(-KEY_TURN_RAD),
      ArrowUp: () => orbit.rotateUp(KEY_TURN_RAD),
      ArrowDown: () => orbit.rotateUp(-KEY_TURN_RAD),
      'Shift+ArrowLeft': () => orbit.pan(KEY_PAN_PX, 0),
      'Shift+ArrowRight': () => orbit.pan(-KEY_PAN_PX, 0),
      'Shift+ArrowUp': () => orbit.pan(0, KEY_PAN_PX),
      'Shift+ArrowDown': () => orbit.pan(0, -KEY_PAN_PX),
      '+': () => orbit.dollyIn(KEY_ZOOM),
      'Shift++': () => orbit.dollyIn(KEY_ZOOM),
      '=': () => orbit.dollyIn(KEY_ZOOM),
      '-': () => orbit.dollyOut(KEY_ZOOM),
    };
  }
}
