import { BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineSegments } from 'three';
import type { Camera } from '../generated/mis_slam/v1/calibration_pb';
import type { RigidTransform } from '../generated/mis_slam/v1/geometry_pb';

const TRACKED = 0x6cc3cd;
const NOT_TRACKED = 0xe0a84a;

/** The scope's left camera, drawn as a pyramid of lines whose base is the image. */
export class ScopeFrustum {
  /** Placed by world_from_camera, in the camera's own axes (x right, y down, z forward). */
  readonly group = new Group();
  private readonly geometry = new BufferGeometry();
  private readonly material = new LineBasicMaterial({ color: TRACKED });
  readonly lines = new LineSegments(this.geometry, this.material);

  constructor() {
    this.lines.frustumCulled = false;
    this.group.add(this.lines);
    this.group.visible = false;
  }

  /** The shape of the view, at unit depth. */
  setCamera(camera: Camera): void {
    const left = (-0.5 - camera.cxPx) / camera.fxPx;
    const right = (camera.widthPx - 0.5 - camera.cxPx) / camera.fxPx;
    const top = (-0.5 - camera.cyPx) / camera.fyPx;
    const bottom = (camera.heightPx - 0.5 - camera.cyPx) / camera.fyPx;
    const apex: Point = [0, 0, 0];
    const corners: Point[] = [
      [left, top, 1],
      [right, top, 1],
      [right, bottom, 1],
      [left, bottom, 1],
    ];
    const segments: Point[] = [];
    corners.forEach((corner, i) => {
      segments.push(apex, corner, corner, corners[(i + 1) % 4] as Point);
    });
    // A notch on the upper edge tells which way is up.
    const middle = (left + right) / 2;
    const notch: Point = [middle, top * 1.18, 1];
    segments.push([middle + left * 0.2, top, 1], notch, notch, [middle + right * 0.2, top, 1]);
    this.geometry.setAttribute('position', new BufferAttribute(new Float32Array(segments.flat()), 3));
  }

  /** Depth of the pyramid in metres. */
  set depthM(depth: number) {
    this.lines.scale.setScalar(depth);
  }

  setPose(worldFromCamera: RigidTransform): void {
    const { txM, tyM, tzM, qx, qy, qz, qw } = worldFromCamera;
    this.group.position.set(txM, tyM, tzM);
    this.group.quaternion.set(qx, qy, qz, qw).normalize();
    this.group.visible = true;
  }

  /** Without a valid pose it stays at the last one, in the colour of a warning. */
  set tracked(tracked: boolean) {
    this.material.color.setHex(tracked ? TRACKED : NOT_TRACKED);
  }

  dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
  }
}

type Point = [number, number, number];
