import {
  BufferGeometry,
  type Group,
  Line,
  LineBasicMaterial,
  type Matrix4,
  PerspectiveCamera,
  Ray,
  type Scene,
  Vector3,
  type WebGLRenderer,
  type XRTargetRaySpace,
} from 'three';
import { Grab } from './grab';
import { firstPlacement, roomFromMarker } from './placement';
import { type HandTool, WristMenu } from './wrist_menu';

export type HeadsetMode = 'immersive-vr' | 'immersive-ar';

/** What of the 3-D view the headset shows and moves. */
export interface HeadsetScene {
  readonly renderer: WebGLRenderer;
  readonly scene: Scene;
  /** Holds the model in world coordinates; the headset places it. */
  readonly world: Group;
  /** The middle of the model, in world coordinates. */
  centre(): Vector3;
}

/** What happens in the headset. */
export interface HeadsetEvents {
  /** A hand pointed at the model along a ray, in world coordinates. */
  point(ray: Ray): void;
  /** The model was placed: room_from_world. */
  placed(roomFromWorld: Matrix4): void;
  /** Three points were touched that give a frame of the room: room_from_marker. */
  aligned(roomFromMarker: Matrix4): void;
  ended(): void;
}

const HANDS = [0, 1] as const;
const RAY_LENGTH_M = 0.4;

/** Whether this browser can show the model in a headset. */
export async function headsetSupports(mode: HeadsetMode): Promise<boolean> {
  return (await navigator.xr?.isSessionSupported(mode)) ?? false;
}

/** The model in a headset: placed in the room, moved by hands, measured and aligned. One at a time. */
export class Headset {
  private readonly camera = new PerspectiveCamera(70, 1, 0.02, 30);
  private readonly menu = new WristMenu();
  private readonly hands: readonly XRTargetRaySpace[];
  private readonly ends: (() => void)[] = [];
  private readonly grab: Grab;
  private tool: HandTool = 'move';
  private touched: Vector3[] = [];
  private roomFromWorld: Matrix4 | undefined;
  private menuHand = 0;

  private constructor(
    private readonly parts: HeadsetScene,
    private readonly events: HeadsetEvents,
  ) {
    this.hands = HANDS.map((hand) => parts.renderer.xr.getController(hand));
    this.grab = new Grab((hand) => this.handOf(hand).matrixWorld);
    for (const hand of HANDS) this.equip(hand);
    this.carryMenu(0);
    this.menu.show(this.tool);
  }

  /** Asks the browser for a session, which needs a click or key press just before. */
  static async enter(mode: HeadsetMode, parts: HeadsetScene, events: HeadsetEvents): Promise<Headset> {
    if (navigator.xr === undefined) throw new Error('this browser knows no headsets');
    const optionalFeatures = ['local-floor', 'hand-tracking'];
    const session = await navigator.xr.requestSession(mode, { optionalFeatures });
    const { xr } = parts.renderer;
    // Hands connect while the session is set.
    const headset = new Headset(parts, events);
    session.addEventListener('end', () => headset.end());
    xr.enabled = true;
    xr.setReferenceSpaceType('local-floor');
    await xr.setSession(session);
    return headset;
  }

  /** Where the model is in the room; undefined before the first image. */
  get placement(): Matrix4 | undefined {
    return this.roomFromWorld;
  }

  /** What the wearer looks at: the place nearest to the model's middle on the line of sight, in world coordinates. */
  get gaze(): Vector3 | undefined {
    if (this.roomFromWorld === undefined) return undefined;
    const sight = rayOf(this.parts.renderer.xr.getCamera().matrixWorld);
    sight.applyMatrix4(this.roomFromWorld.clone().invert());
    return sight.closestPointToPoint(this.parts.centre(), new Vector3());
  }

  /** Puts the model where another headset has it. */
  place(roomFromWorld: Matrix4): void {
    if (!this.grab.active) this.roomFromWorld = roomFromWorld.clone();
  }

  async leave(): Promise<void> {
    await this.parts.renderer.xr.getSession()?.end();
  }

  /** Draws one image. */
  draw(): void {
    const { renderer, scene, world } = this.parts;
    this.roomFromWorld ??= this.firstPlacement();
    if (this.roomFromWorld !== undefined) {
      const moved = this.grab.moved(this.roomFromWorld);
      world.matrix.copy(moved);
      world.matrixWorldNeedsUpdate = true;
    }
    renderer.render(scene, this.camera);
  }

  private firstPlacement(): Matrix4 | undefined {
    const head = this.parts.renderer.xr.getCamera().matrixWorld;
    // Before the first image the head is nowhere.
    const known = head.elements.some((value, i) => value !== (i % 5 === 0 ? 1 : 0));
    return known ? firstPlacement(this.parts.centre(), head) : undefined;
  }

  private handOf(hand: number): XRTargetRaySpace {
    const space = this.hands[hand];
    if (space === undefined) throw new Error(`there is no hand ${hand}`);
    return space;
  }

  private equip(hand: number): void {
    const space = this.handOf(hand);
    const ray = new Line(
      new BufferGeometry().setFromPoints([new Vector3(), new Vector3(0, 0, -RAY_LENGTH_M)]),
      new LineBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.5 }),
    );
    space.add(ray);
    this.parts.scene.add(space);
    const connected = ({ data }: { data: XRInputSource }) => {
      if (data.handedness === 'left') this.carryMenu(hand);
    };
    const selectStart = () => this.select(hand);
    const take = () => this.take(hand);
    const release = () => this.release(hand);
    space.addEventListener('connected', connected);
    space.addEventListener('selectstart', selectStart);
    space.addEventListener('selectend', release);
    space.addEventListener('squeezestart', take);
    space.addEventListener('squeezeend', release);
    this.ends.push(() => {
      space.removeEventListener('connected', connected);
      space.removeEventListener('selectstart', selectStart);
      space.removeEventListener('selectend', release);
      space.removeEventListener('squeezestart', take);
      space.removeEventListener('squeezeend', release);
      space.remove(ray);
      ray.geometry.dispose();
      this.parts.scene.remove(space);
    });
  }

  /** Trigger or pinch: a plate of the menu first, else what the tool does. */
  private select(hand: number): void {
    const ray = rayOf(this.handOf(hand).matrixWorld);
    const chosen = hand === this.menuHand ? undefined : this.menu.hit(ray);
    if (chosen !== undefined) this.choose(chosen);
    else if (this.tool === 'move') this.take(hand);
    else if (this.tool === 'align')
      this.touch(new Vector3().setFromMatrixPosition(this.handOf(hand).matrixWorld));
    else if (this.roomFromWorld !== undefined) {
      this.events.point(ray.applyMatrix4(this.roomFromWorld.clone().invert()));
    }
  }

  /** The menu sits on the left hand, where there is one. */
  private carryMenu(hand: number): void {
    this.menuHand = hand;
    this.handOf(hand).add(this.menu.group);
  }

  private choose(tool: HandTool): void {
    this.tool = tool;
    this.touched = [];
    this.menu.show(tool);
  }

  private take(hand: number): void {
    if (this.roomFromWorld !== undefined) this.grab.take(hand, this.roomFromWorld);
  }

  private release(hand: number): void {
    if (this.roomFromWorld === undefined || !this.grab.active) return;
    this.roomFromWorld = this.grab.moved(this.roomFromWorld).clone();
    this.grab.release(hand, this.roomFromWorld);
    if (!this.grab.active) this.events.placed(this.roomFromWorld);
  }

  private touch(point: Vector3): void {
    this.touched.push(point);
    const [origin, onX, inPlane] = this.touched;
    if (origin === undefined || onX === undefined || inPlane === undefined) return;
    this.choose('move');
    const frame = roomFromMarker(origin, onX, inPlane);
    if (frame !== undefined) this.events.aligned(frame);
  }

  private end(): void {
    for (const end of this.ends) end();
    this.menu.dispose();
    this.parts.renderer.xr.enabled = false;
    this.events.ended();
  }
}

function rayOf(roomFromHand: Matrix4): Ray {
  const origin = new Vector3().setFromMatrixPosition(roomFromHand);
  return new Ray(origin, new Vector3(0, 0, -1).transformDirection(roomFromHand));
}
