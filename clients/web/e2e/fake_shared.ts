import { create } from '@bufbuild/protobuf';
import {
  type SharedChange,
  type SharedScene,
  SharedSceneSchema,
} from '../src/generated/mis_slam/v1/shared_pb';

/** The server's side of what viewers share, without its checks. */
export class FakeShared {
  readonly scene: SharedScene = create(SharedSceneSchema);
  private lastId = 0;

  apply({ change }: SharedChange): void {
    const { scene } = this;
    switch (change.case) {
      case 'annotate':
        this.lastId += 1;
        scene.annotations.push({ ...change.value, id: this.lastId });
        break;
      case 'eraseAnnotation':
        scene.annotations = scene.annotations.filter(({ id }) => id !== change.value);
        break;
      case 'place':
        scene.placement = change.value;
        break;
      case 'anchor':
        scene.anchors = scene.anchors.filter(({ headset }) => headset !== change.value.headset);
        scene.anchors.push(change.value);
        break;
      case undefined:
        break;
    }
  }
}
