/** Draws surfels as oriented discs: one instance of a square for each. */

/** Corners of the square are (+-1, +-1); the disc is its inscribed circle. */
export const vertexShader = /* glsl */ `
  uniform vec3 lightInView;
  uniform int coloring;
  uniform mat4 scopeFromWorld;
  uniform vec2 valueRange;
  uniform uint epoch;
  uniform sampler2D colorMap;
  in vec2 corner;
  // centre and radius, metres
  in vec4 place;
  in vec3 facing;
  // red, green, blue, confidence, from the low byte up
  in uint appearance;
  in vec3 origin;
  in uint version;
  out vec2 onDisc;
  out vec3 inWorld;
  flat out vec3 albedo;
  flat out float lambert;

  // Discs as large as the spacing of a square grid leave holes at its corners; sqrt(2) closes them.
  const float OVERLAP = 1.4142;
  const vec3 CLAY = vec3(0.80, 0.78, 0.75);

  vec3 mapped(float value) {
    float share = (value - valueRange.x) / max(valueRange.y - valueRange.x, 1e-9);
    return texture(colorMap, vec2(clamp(share, 0.0, 1.0) * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
  }

  // The order is that of COLORINGS in coloring.ts.
  vec3 paint(vec3 centre, vec3 normalInView) {
    if (coloring == 1) return CLAY;
    if (coloring == 2) return 0.5 + 0.5 * normalInView;
    if (coloring == 3) return mapped(float(appearance >> 24) / 255.0);
    if (coloring == 4) return mapped((scopeFromWorld * vec4(centre, 1.0)).z);
    if (coloring == 5) return mapped(float(epoch - version));
    if (coloring == 6) return mapped(distance(centre, origin));
    return vec3((uvec3(appearance) >> uvec3(0u, 8u, 16u)) & 0xFFu) / 255.0;
  }

  void main() {
    vec3 centre = place.xyz;
    vec3 normal = facing;
    float radius = place.w;
    // A tangent that exists for every normal: of the axis that is least parallel to it.
    vec3 away = abs(normal.z) < 0.7 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0);
    vec3 tangent = normalize(cross(away, normal));
    vec3 bitangent = cross(normal, tangent);
    inWorld = centre + OVERLAP * radius * (corner.x * tangent + corner.y * bitangent);

    vec3 normalInView = normalize(mat3(modelViewMatrix) * normal);
    vec3 toEye = -normalize((modelViewMatrix * vec4(centre, 1.0)).xyz);
    // Discs have no inside: both faces are lit alike.
    if (dot(normalInView, toEye) < 0.0) normalInView = -normalInView;
    lambert = max(dot(normalInView, lightInView), 0.0);
    albedo = paint(centre, normalInView);
    onDisc = corner;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(inWorld, 1.0);
  }
`;

export const fragmentShader = /* glsl */ `
  uniform int coloring;
  uniform float fade;
  // What lies on the negative side of this plane (unit normal and offset, world) is cut away.
  uniform vec4 clipPlane;
  in vec2 onDisc;
  in vec3 inWorld;
  flat in vec3 albedo;
  flat in float lambert;
  out vec4 color;

  const vec3 BACKGROUND = vec3(0.055, 0.078, 0.098);

  void main() {
    if (dot(onDisc, onDisc) > 1.0 || dot(vec4(inWorld, 1.0), clipPlane) < 0.0) discard;
    // Clay is all shading. The texture already holds the light of the scope, and a colour map must stay
    // readable: these are shaded only a little.
    float shading = coloring == 1 ? 0.16 + 0.84 * lambert * lambert : 0.82 + 0.18 * lambert;
    vec3 lit = albedo * shading;
    vec3 grey = vec3(dot(lit, vec3(0.30, 0.59, 0.11)));
    color = vec4(mix(lit, mix(grey, BACKGROUND, 0.55), fade), 1.0);
  }
`;
