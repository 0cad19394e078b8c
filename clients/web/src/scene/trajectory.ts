import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Line, LineBasicMaterial } from 'three';

const CAPACITY = 8192;
const SPACING_M = 2e-4;

/** The way of the scope: a line that grows, with fewer points in its older part once it is full. */
export class Trajectory {
  private readonly positions = new BufferAttribute(new Float32Array(CAPACITY * 3), 3);
  private readonly geometry = new BufferGeometry();
  private readonly material = new LineBasicMaterial({ color: 0xd9b38c, transparent: true, opacity: 0.75 });
  readonly line = new Line(this.geometry, this.material);
  private count = 0;

  constructor() {
    this.positions.setUsage(DynamicDrawUsage);
    this.geometry.setAttribute('position', this.positions);
    this.geometry.setDrawRange(0, 0);
    this.line.frustumCulled = false;
  }

  /** Appends a position in world; one closer than 0.2 mm to the last is left out. */
  add(x: number, y: number, z: number): void {
    if (this.count > 0 && this.distanceFromLast(x, y, z) < SPACING_M) return;
    if (this.count === CAPACITY) this.thinOut();
    this.positions.setXYZ(this.count, x, y, z);
    this.positions.addUpdateRange(this.count * 3, 3);
    this.positions.needsUpdate = true;
    this.count += 1;
    this.geometry.setDrawRange(0, this.count);
  }

  clear(): void {
    this.count = 0;
    this.geometry.setDrawRange(0, 0);
  }

  dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
  }

  private distanceFromLast(x: number, y: number, z: number): number {
    const last = this.count - 1;
    const { positions } = this;
    return Math.hypot(x - positions.getX(last), y - positions.getY(last), z - positions.getZ(last));
  }

  /** Keeps every second point. */
  private thinOut(): void {
    const kept = CAPACITY / 2;
    for (let i = 0; i < kept; i++) this.positions.copyAt(i, this.positions, 2 * i);
    this.count = kept;
    this.positions.clearUpdateRanges();
    this.positions.addUpdateRange(0, kept * 3);
  }
}
