import {
  BufferAttribute,
  DynamicDrawUsage,
  GLSL3,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  ShaderMaterial,
  Vector3,
} from 'three';
import { WORDS_PER_RECORD } from '../model/packed_surfels';
import type { SurfelStore } from '../model/surfel_store';
import { fragmentShader, vertexShader } from './surfel_shader';

/** The surfel model on the GPU: a mesh of discs that is brought up to date in the parts that changed. */
export class SurfelCloud {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private records: InstancedBufferAttribute;

  constructor(private readonly store: SurfelStore) {
    this.records = packedAttribute(store.words);
    this.mesh = new Mesh(square(), surfelMaterial());
    this.mesh.geometry.setAttribute('record', this.records);
    this.mesh.geometry.instanceCount = 0;
    // The bounds of packed records are unknown to three.js.
    this.mesh.frustumCulled = false;
  }

  /** Share of the way to grey and dark, 0 to 1: how stale the model is. */
  set fade(share: number) {
    this.uniform('fade', share);
  }

  /** 0: the tissue's colours; 1: its shape only, as if of clay. */
  set relief(share: number) {
    this.uniform('relief', share);
  }

  /** Uploads what changed in the store since the last call; true where anything did. */
  upload(): boolean {
    const geometry = this.mesh.geometry;
    const changed = this.store.takeDirty();
    const resized = geometry.instanceCount !== this.store.size;
    geometry.instanceCount = this.store.size;
    if (this.records.array !== this.store.words) this.replaceBuffer();
    else this.uploadRanges(changed);
    return resized || changed.length > 0;
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }

  private uploadRanges(changed: readonly { start: number; count: number }[]): void {
    for (const { start, count } of changed) {
      this.records.addUpdateRange(start * WORDS_PER_RECORD, count * WORDS_PER_RECORD);
    }
    if (changed.length > 0) this.records.needsUpdate = true;
  }

  /** The store outgrew its array: a GPU buffer cannot grow, so all go into a new one. */
  private replaceBuffer(): void {
    const instances = this.mesh.geometry.instanceCount;
    this.mesh.geometry.dispose();
    this.records = packedAttribute(this.store.words);
    this.mesh.geometry.setAttribute('record', this.records);
    this.mesh.geometry.instanceCount = instances;
  }

  private uniform(name: string, value: number): void {
    const uniform = this.mesh.material.uniforms[name];
    if (uniform !== undefined) uniform.value = value;
  }
}

function packedAttribute(words: Uint32Array): InstancedBufferAttribute {
  const attribute = new InstancedBufferAttribute(words, WORDS_PER_RECORD);
  attribute.setUsage(DynamicDrawUsage);
  return attribute;
}

function square(): InstancedBufferGeometry {
  const geometry = new InstancedBufferGeometry();
  geometry.setAttribute('corner', new BufferAttribute(new Float32Array([-1, -1, 1, -1, 1, 1, -1, 1]), 2));
  geometry.setIndex([0, 1, 2, 0, 2, 3]);
  return geometry;
}

function surfelMaterial(): ShaderMaterial {
  return new ShaderMaterial({
    glslVersion: GLSL3,
    vertexShader,
    fragmentShader,
    uniforms: {
      lightInView: { value: new Vector3(0.25, 0.35, 0.9).normalize() },
      fade: { value: 0 },
      relief: { value: 0 },
    },
  });
}
