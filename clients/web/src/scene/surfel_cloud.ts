import {
  BufferAttribute,
  type DataTexture,
  DynamicDrawUsage,
  GLSL3,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Matrix4,
  Mesh,
  ShaderMaterial,
  Vector2,
  Vector3,
  Vector4,
} from 'three';
import type { SlotRange } from '../model/dirty_pages';
import { NORMAL_SIZE, PLACE_SIZE, type SurfelStore } from '../model/surfel_store';
import { COLORINGS, type Coloring, colorMapTexture, scaleOf, type ValueRange } from './coloring';
import { fragmentShader, vertexShader } from './surfel_shader';

/** Cuts nothing away. */
const NO_CLIPPING = [0, 0, 0, 1] as const;

/** The surfel model on the GPU: a mesh of discs that is brought up to date in the parts that changed. */
export class SurfelCloud {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private readonly material = surfelMaterial();
  private readonly maps = new Map<Coloring, DataTexture>();
  private attributes: Attributes;

  constructor(private readonly store: SurfelStore) {
    this.attributes = attributesOf(store);
    this.mesh = new Mesh(square(), this.material);
    this.setAttributes();
    this.mesh.geometry.instanceCount = 0;
    // three.js would take the bounds of one square.
    this.mesh.frustumCulled = false;
  }

  /** Share of the way to grey and dark, 0 to 1: how stale the model is. */
  set fade(share: number) {
    this.uniforms.fade.value = share;
  }

  set coloring(coloring: Coloring) {
    this.uniforms.coloring.value = COLORINGS.indexOf(coloring);
    const scale = scaleOf(coloring);
    if (scale === undefined) return;
    const map = this.maps.get(coloring) ?? colorMapTexture(scale);
    this.maps.set(coloring, map);
    this.uniforms.colorMap.value = map;
  }

  /** The values that the colour map begins and ends with. */
  set valueRange({ low, high }: ValueRange) {
    this.uniforms.valueRange.value.set(low, high);
  }

  /** The epoch of the model, from which ages are counted. */
  set epoch(epoch: number) {
    this.uniforms.epoch.value = epoch;
  }

  /** Where the scope is: world_from_camera. */
  set worldFromScope(matrix: Matrix4) {
    this.uniforms.scopeFromWorld.value.copy(matrix).invert();
  }

  /** Unit normal and offset, world; what has a negative distance is cut away. Undefined cuts nothing. */
  set clipPlane(plane: readonly [number, number, number, number] | undefined) {
    this.uniforms.clipPlane.value.set(...(plane ?? NO_CLIPPING));
  }

  /** Uploads what changed in the store since the last call; true where anything did. */
  upload(): boolean {
    const geometry = this.mesh.geometry;
    const changed = this.store.takeDirty();
    const newcomers = this.store.takeNewcomers();
    const resized = geometry.instanceCount !== this.store.size;
    geometry.instanceCount = this.store.size;
    if (this.attributes.place.array !== this.store.places) this.replaceBuffers();
    else {
      uploadRanges(this.attributes.place, changed);
      uploadRanges(this.attributes.facing, changed);
      uploadRanges(this.attributes.appearance, changed);
      uploadRanges(this.attributes.version, changed);
      uploadRanges(this.attributes.origin, newcomers);
    }
    return resized || changed.length > 0;
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.material.dispose();
    for (const map of this.maps.values()) map.dispose();
  }

  private get uniforms(): Uniforms {
    return this.material.uniforms as unknown as Uniforms;
  }

  /** The store outgrew its arrays: GPU buffers cannot grow, so all go into new ones. */
  private replaceBuffers(): void {
    const instances = this.mesh.geometry.instanceCount;
    this.mesh.geometry.dispose();
    this.attributes = attributesOf(this.store);
    this.setAttributes();
    this.mesh.geometry.instanceCount = instances;
  }

  private setAttributes(): void {
    for (const [name, attribute] of Object.entries(this.attributes)) {
      this.mesh.geometry.setAttribute(name, attribute);
    }
  }
}

/** Instanced attributes by their names in the shader. */
interface Attributes {
  readonly place: InstancedBufferAttribute;
  readonly facing: InstancedBufferAttribute;
  readonly appearance: InstancedBufferAttribute;
  readonly version: InstancedBufferAttribute;
  readonly origin: InstancedBufferAttribute;
}

type Uniforms = ReturnType<typeof initialUniforms>;

function attributesOf(store: SurfelStore): Attributes {
  return {
    place: dynamic(new InstancedBufferAttribute(store.places, PLACE_SIZE)),
    facing: dynamic(new InstancedBufferAttribute(store.normals, NORMAL_SIZE)),
    appearance: dynamic(new InstancedBufferAttribute(store.colors, 1)),
    version: dynamic(new InstancedBufferAttribute(store.versionWords, 1)),
    origin: dynamic(new InstancedBufferAttribute(store.originsM, 3)),
  };
}

function dynamic(attribute: InstancedBufferAttribute): InstancedBufferAttribute {
  attribute.setUsage(DynamicDrawUsage);
  return attribute;
}

function uploadRanges(attribute: InstancedBufferAttribute, changed: readonly SlotRange[]): void {
  for (const { start, count } of changed) {
    attribute.addUpdateRange(start * attribute.itemSize, count * attribute.itemSize);
  }
  if (changed.length > 0) attribute.needsUpdate = true;
}

function square(): InstancedBufferGeometry {
  const geometry = new InstancedBufferGeometry();
  geometry.setAttribute('corner', new BufferAttribute(new Float32Array([-1, -1, 1, -1, 1, 1, -1, 1]), 2));
  geometry.setIndex([0, 1, 2, 0, 2, 3]);
  return geometry;
}

function initialUniforms() {
  return {
    lightInView: { value: new Vector3(0.25, 0.35, 0.9).normalize() },
    fade: { value: 0 },
    coloring: { value: 0 },
    colorMap: { value: null as DataTexture | null },
    valueRange: { value: new Vector2(0, 1) },
    epoch: { value: 0 },
    scopeFromWorld: { value: new Matrix4() },
    clipPlane: { value: new Vector4(...NO_CLIPPING) },
  };
}

function surfelMaterial(): ShaderMaterial {
  return new ShaderMaterial({
    glslVersion: GLSL3,
    vertexShader,
    fragmentShader,
    uniforms: initialUniforms(),
  });
}
