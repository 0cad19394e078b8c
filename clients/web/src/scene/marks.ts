import type { Camera, Scene } from 'three';
import {
  BufferAttribute,
  BufferGeometry,
  Group,
  Line,
  LineBasicMaterial,
  Sprite,
  SpriteMaterial,
} from 'three';
import { CSS2DObject, CSS2DRenderer } from 'three/examples/jsm/renderers/CSS2DRenderer.js';
import { element, setText } from '../ui/dom';
import { textTexture } from '../xr/text_plate';
import type { Point } from './picking';

/** Something drawn on the model: a line over the surface (or none), dots, and a label at one of them. */
export interface Mark {
  readonly line: readonly Point[];
  readonly dots: readonly Point[];
  readonly labelAt: Point;
  readonly text: string;
  readonly kind: 'measurement' | 'annotation' | 'pending';
  /** Shown dimmed: what it is bound to is gone. */
  readonly dimmed: boolean;
}

/** Height of a label that stands in space, in life size. */
const PLATE_HEIGHT_M = 0.006;
const LINE_COLORS = { measurement: 0xffd76a, annotation: 0x8fd3ff, pending: 0xffffff } as const;

/** The marks on the model: lines in the 3-D view, dots and labels as elements over it. */
export class Marks {
  /** In world coordinates. */
  readonly group = new Group();
  readonly overlay: HTMLElement;
  private readonly labels = new CSS2DRenderer({ element: element('div', { class: 'marks' }) });
  private drawn: DrawnMark[] = [];
  private spatial = false;

  constructor() {
    this.overlay = this.labels.domElement;
  }

  /** Whether labels stand in space, as a headset needs it, where no elements can be laid over the picture. */
  set inSpace(spatial: boolean) {
    this.spatial = spatial;
    for (const mark of this.drawn) mark.inSpace = spatial;
  }

  show(marks: readonly Mark[]): void {
    while (this.drawn.length > marks.length) this.drawn.pop()?.remove();
    while (this.drawn.length < marks.length) this.drawn.push(new DrawnMark(this.group));
    marks.forEach((mark, i) => {
      this.drawn[i]?.show(mark);
    });
    this.inSpace = this.spatial;
  }

  resize(width: number, height: number): void {
    this.labels.setSize(width, height);
  }

  render(scene: Scene, camera: Camera): void {
    this.labels.render(scene, camera);
  }

  dispose(): void {
    this.show([]);
    this.overlay.remove();
  }
}

/** One mark as drawn; the same objects are used again when it changes. */
class DrawnMark {
  private readonly material = new LineBasicMaterial({ depthTest: false, transparent: true });
  private readonly line = new Line(new BufferGeometry(), this.material);
  private readonly text = element('span', { class: 'mark-text' });
  private readonly label = new CSS2DObject(element('div', { class: 'mark-label' }, this.text));
  private readonly plate = new Sprite(new SpriteMaterial({ depthTest: false }));
  private plateText = '';
  private dots: CSS2DObject[] = [];

  constructor(private readonly group: Group) {
    this.line.renderOrder = 1;
    this.line.frustumCulled = false;
    this.label.center.set(0.5, 1.4);
    this.plate.center.set(0.5, -0.4);
    this.plate.renderOrder = 2;
    this.plate.visible = false;
    group.add(this.line, this.label, this.plate);
  }

  show({ line, dots, labelAt, text, kind, dimmed }: Mark): void {
    this.material.color.setHex(LINE_COLORS[kind]);
    this.material.opacity = dimmed ? 0.35 : 1;
    this.line.visible = line.length > 1;
    if (this.line.visible) this.replaceLine(line);
    this.placeDots(dots, kind);
    setText(this.text, text);
    this.label.visible = text !== '';
    this.label.element.className = `mark-label ${kind}${dimmed ? ' dimmed' : ''}`;
    this.label.position.set(...labelAt);
    this.plate.position.set(...labelAt);
  }

  set inSpace(spatial: boolean) {
    const text = this.text.textContent ?? '';
    this.plate.visible = spatial && text !== '';
    if (!this.plate.visible || text === this.plateText) return;
    const { texture, aspect } = textTexture(text, '#ffd76a', '#0b1014');
    this.plate.material.map?.dispose();
    this.plate.material.map = texture;
    this.plate.material.needsUpdate = true;
    this.plate.scale.set(aspect * PLATE_HEIGHT_M, PLATE_HEIGHT_M, 1);
    this.plateText = text;
  }

  remove(): void {
    this.placeDots([], 'pending');
    this.group.remove(this.line, this.label, this.plate);
    this.plate.material.map?.dispose();
    this.plate.material.dispose();
    this.line.geometry.dispose();
    this.material.dispose();
  }

  private replaceLine(line: readonly Point[]): void {
    this.line.geometry.dispose();
    this.line.geometry = new BufferGeometry();
    this.line.geometry.setAttribute('position', new BufferAttribute(new Float32Array(line.flat()), 3));
  }

  private placeDots(positions: readonly Point[], kind: Mark['kind']): void {
    for (const dot of this.dots.splice(positions.length)) this.group.remove(dot);
    while (this.dots.length < positions.length) {
      const dot = new CSS2DObject(element('div'));
      this.dots.push(dot);
      this.group.add(dot);
    }
    this.dots.forEach((dot, i) => {
      dot.element.className = `mark-dot ${kind}`;
      dot.position.set(...(positions[i] as Point));
    });
  }
}
