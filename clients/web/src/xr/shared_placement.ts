/** Between the headset's own room and the marker frame that all headsets of a room share. */
import { create } from '@bufbuild/protobuf';
import { Matrix4, Quaternion, Vector3 } from 'three';
import type { RigidTransform } from '../generated/mis_slam/v1/geometry_pb';
import { type SharedChange, SharedChangeSchema, type SharedScene } from '../generated/mis_slam/v1/shared_pb';
import { rememberedText } from '../ui/settings';

/** This headset's name, made once and kept by the browser. */
function ownName(): string {
  const kept = rememberedText('headset');
  if (kept.value === '') kept.value = `headset-${Math.random().toString(36).slice(2, 10)}`;
  return kept.value;
}

/** Keeps this headset's placement of the model and the shared one the same, once the marker was touched. */
export class SharedPlacement {
  private readonly name = ownName();
  private roomFromMarker: Matrix4 | undefined;

  constructor(private readonly send: (change: SharedChange) => void) {}

  /** The marker was touched. */
  align(roomFromMarker: Matrix4): void {
    this.roomFromMarker = roomFromMarker.clone();
    const value = { headset: this.name, roomFromMarker: rigidOf(roomFromMarker).transform };
    this.send(create(SharedChangeSchema, { change: { case: 'anchor', value } }));
  }

  /** The model was placed here. Without a marker that stays this headset's own business. */
  place(roomFromWorld: Matrix4): void {
    if (this.roomFromMarker === undefined) return;
    const { transform, scale } = rigidOf(this.roomFromMarker.clone().invert().multiply(roomFromWorld));
    const value = { markerFromWorld: transform, scale };
    this.send(create(SharedChangeSchema, { change: { case: 'place', value } }));
  }

  /** Where the shared scene has the model in this headset's room: room_from_world; undefined where it says nothing. */
  placementIn({ anchors, placement }: SharedScene): Matrix4 | undefined {
    const own = anchors.find(({ headset }) => headset === this.name)?.roomFromMarker;
    if (own !== undefined) this.roomFromMarker = matrixOf(own, 1);
    const markerFromWorld = placement?.markerFromWorld;
    if (this.roomFromMarker === undefined || placement === undefined || markerFromWorld === undefined) {
      return undefined;
    }
    return this.roomFromMarker.clone().multiply(matrixOf(markerFromWorld, placement.scale));
  }
}

function rigidOf(matrix: Matrix4) {
  const position = new Vector3();
  const rotation = new Quaternion();
  const scale = new Vector3();
  matrix.decompose(position, rotation, scale);
  const transform = {
    txM: position.x,
    tyM: position.y,
    tzM: position.z,
    qx: rotation.x,
    qy: rotation.y,
    qz: rotation.z,
    qw: rotation.w,
  };
  return { transform, scale: scale.x };
}

function matrixOf({ txM, tyM, tzM, qx, qy, qz, qw }: RigidTransform, scale: number): Matrix4 {
  return new Matrix4().compose(
    new Vector3(txM, tyM, tzM),
    new Quaternion(qx, qy, qz, qw).normalize(),
    new Vector3(scale, scale, scale),
  );
}
