/**
 * Draws packed surfels (protocol/SPEC.md) as oriented discs: one instance of a square for each 16-byte
 * record, which the vertex shader decodes. Nothing is unpacked on the CPU.
 */

/** Corners of the square are (+-1, +-1); the disc is its inscribed circle. */
export const vertexShader = /* glsl */ `
  uniform vec3 lightInView;
  in vec2 corner;
  in uvec4 record;
  out vec2 onDisc;
  flat out vec3 albedo;
  flat out float lambert;

  // Discs as large as the spacing of a square grid leave holes at its corners; sqrt(2) closes them.
  const float OVERLAP = 1.4142;

  vec3 unpackPosition(uvec2 word) {
    uvec3 code = uvec3(
      word.x & 0x1FFFFFu,
      (word.x >> 21) | ((word.y & 0x3FFu) << 11),
      (word.y >> 10) & 0x1FFFFFu);
    return vec3(ivec3(code) - 1048576) * 2e-5;
  }

  vec3 unpackNormal(uint word) {
    vec2 axes = min(vec2(ivec2(word & 0xFFFu, (word >> 12) & 0xFFFu) - 2047) / 2047.0, 1.0);
    vec3 normal = vec3(axes, 1.0 - abs(axes.x) - abs(axes.y));
    vec2 folded = (1.0 - abs(axes.yx)) * vec2(axes.x < 0.0 ? -1.0 : 1.0, axes.y < 0.0 ? -1.0 : 1.0);
    if (normal.z < 0.0) normal.xy = folded;
    return normalize(normal);
  }

  void main() {
    vec3 centre = unpackPosition(record.xy);
    vec3 normal = unpackNormal(record.z);
    float radius = 1e-5 * exp2(float(record.z >> 24) / 16.0);
    // A tangent that exists for every normal: of the axis that is least parallel to it.
    vec3 away = abs(normal.z) < 0.7 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0);
    vec3 tangent = normalize(cross(away, normal));
    vec3 bitangent = cross(normal, tangent);
    vec3 point = centre + OVERLAP * radius * (corner.x * tangent + corner.y * bitangent);

    vec3 normalInView = normalize(mat3(modelViewMatrix) * normal);
    vec3 toEye = -normalize((modelViewMatrix * vec4(centre, 1.0)).xyz);
    // Discs have no inside: both faces are lit alike.
    if (dot(normalInView, toEye) < 0.0) normalInView = -normalInView;
    lambert = max(dot(normalInView, lightInView), 0.0);
    albedo = vec3((uvec3(record.w) >> uvec3(0u, 8u, 16u)) & 0xFFu) / 255.0;
    onDisc = corner;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(point, 1.0);
  }
`;

export const fragmentShader = /* glsl */ `
  uniform float relief;
  uniform float fade;
  in vec2 onDisc;
  flat in vec3 albedo;
  flat in float lambert;
  out vec4 color;

  const vec3 BACKGROUND = vec3(0.055, 0.078, 0.098);
  const vec3 CLAY = vec3(0.80, 0.78, 0.75);

  void main() {
    if (dot(onDisc, onDisc) > 1.0) discard;
    // The texture already holds the light of the scope: it is shaded only a little.
    vec3 textured = albedo * (0.82 + 0.18 * lambert);
    vec3 shape = CLAY * (0.16 + 0.84 * lambert * lambert);
    vec3 lit = mix(textured, shape, relief);
    vec3 grey = vec3(dot(lit, vec3(0.30, 0.59, 0.11)));
    color = vec4(mix(lit, mix(grey, BACKGROUND, 0.55), fade), 1.0);
  }
`;
