import { Group, Mesh, MeshBasicMaterial, PlaneGeometry, type Ray, Raycaster } from 'three';
import { textTexture } from './text_plate';

/** What the hands do in the headset. */
export const HAND_TOOLS = ['move', 'measure', 'align'] as const;
export type HandTool = (typeof HAND_TOOLS)[number];

const NAMES: Readonly<Record<HandTool, string>> = { move: 'Move', measure: 'Measure', align: 'Align' };
const PLATE_HEIGHT_M = 0.022;
const PLATE_GAP_M = 0.006;
const CHOSEN = 0xffffff;
const RESTING = 0x7c8b96;

/** The tools as plates over one hand, chosen by the ray of the other. */
export class WristMenu {
  readonly group = new Group();
  private readonly plates: readonly { tool: HandTool; mesh: Mesh<PlaneGeometry, MeshBasicMaterial> }[];
  private readonly caster = new Raycaster();

  constructor() {
    this.plates = HAND_TOOLS.map((tool, row) => {
      const { texture, aspect } = textTexture(NAMES[tool], '#dbe4ea', '#18232c');
      const material = new MeshBasicMaterial({ map: texture, transparent: true });
      const mesh = new Mesh(new PlaneGeometry(aspect * PLATE_HEIGHT_M, PLATE_HEIGHT_M), material);
      mesh.position.y = 0.05 + row * (PLATE_HEIGHT_M + PLATE_GAP_M);
      this.group.add(mesh);
      return { tool, mesh };
    });
    // Tilted towards the eyes of somebody who looks down at the hand.
    this.group.rotation.x = -0.6;
  }

  show(chosen: HandTool): void {
    for (const { tool, mesh } of this.plates) mesh.material.color.setHex(tool === chosen ? CHOSEN : RESTING);
  }

  /** The tool whose plate the ray (in the room) meets. */
  hit(ray: Ray): HandTool | undefined {
    this.caster.ray.copy(ray);
    const [first] = this.caster.intersectObjects(this.plates.map(({ mesh }) => mesh));
    return this.plates.find(({ mesh }) => mesh === first?.object)?.tool;
  }

  dispose(): void {
    this.group.removeFromParent();
    for (const { mesh } of this.plates) {
      mesh.geometry.dispose();
      mesh.material.map?.dispose();
      mesh.material.dispose();
    }
  }
}
