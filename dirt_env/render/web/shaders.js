// Programs of the graphics card.

const LIGHTING = `
const vec3 SUN = vec3(${SUN.map((v) => v.toFixed(5)).join(", ")});
vec3 lit(vec3 albedo, vec3 normal, float sun, float open) {
  vec3 sky = mix(vec3(0.20, 0.18, 0.16), vec3(0.27, 0.30, 0.36), 0.5 + 0.5 * normal.z) * open;
  return albedo * (sky + vec3(1.12, 1.03, 0.88) * max(dot(normal, SUN), 0.0) * sun);
}
vec3 linear(vec3 c) { return pow(c, vec3(2.2)); }
vec4 developed(vec3 c) {
  c = c / (1.0 + 0.18 * max(c.r, max(c.g, c.b)));
  return vec4(pow(clamp(c, 0.0, 1.0), vec3(1.0 / 2.2)), 1.0);
}`;

// How dark the machine makes the ground at a point.
const SHADOW = `
uniform vec2 u_half, u_blade;
uniform vec4 u_pose;
uniform float u_edge;
float box(vec2 p, vec2 half_size, float soft) {
  vec2 q = abs(p) - half_size;
  return smoothstep(soft, -soft, length(max(q, 0.0)) + min(max(q.x, q.y), 0.0));
}
float shade(vec2 at) {
  float c = u_pose.z, s = u_pose.w, dark = 0.0;
  for (int k = 0; k < 3; k++) {
    float high = k == 0 ? 0.4 : k == 1 ? 1.4 : 0.5 + max(u_edge, 0.0);
    vec2 d = at + SUN.xy / SUN.z * high - u_pose.xy;
    vec2 p = vec2(d.x * c + d.y * s, d.y * c - d.x * s);
    if (k == 0) dark = max(dark, box(p, u_half, 0.15));
    if (k == 1) dark = max(dark, box(p - vec2(-0.1 * u_half.x, 0.0), u_half * vec2(0.75, 0.45), 0.3));
    if (k == 2) dark = max(dark, box(p - vec2(u_blade.x, 0.0), vec2(0.2, u_blade.y), 0.15 + 0.2 * max(u_edge, 0.0)));
  }
  return dark;
}`;

const GROUND_VERTEX = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D u_height;
uniform mat4 u_view;
uniform float u_tall, u_cell, u_base;
uniform ivec2 u_cells;
uniform int u_fine;
uniform bool u_wall;
in vec3 a_at;
out vec3 v_at;
float cellHeight(ivec2 at) { return texelFetch(u_height, clamp(at, ivec2(0), u_cells - 1), 0).r; }
vec4 weights(float t) {
  float t2 = t * t, t3 = t2 * t;
  return vec4(-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1.0, -1.5 * t3 + 2.0 * t2 + 0.5 * t, 0.5 * t3 - 0.5 * t2);
}
float heightAt(vec2 at) {
  vec2 p = at - 0.5, base = floor(p);
  vec4 wx = weights(p.x - base.x), wy = weights(p.y - base.y);
  float sum = 0.0;
  for (int r = 0; r < 4; r++) for (int c = 0; c < 4; c++)
    sum += wx[c] * wy[r] * cellHeight(ivec2(base) + ivec2(c - 1, r - 1));
  return sum;
}
void main() {
  vec2 at;
  float down = 0.0;
  if (u_wall) { at = a_at.xy; down = a_at.z; }
  else {
    int wide = u_cells.x * u_fine + 1;
    at = vec2(float(gl_VertexID % wide), float(gl_VertexID / wide)) / float(u_fine);
  }
  float z = mix(heightAt(at), u_base, down);
  v_at = vec3(at * u_cell, z);
  gl_Position = u_view * vec4(v_at.xy, z * u_tall, 1.0);
}`;

const GROUND_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D u_shape, u_regions;
uniform vec2 u_site;
uniform float u_tall, u_interval;
uniform vec3 u_high;
uniform bool u_wall;
in vec3 v_at;
out vec4 color;
${LIGHTING}
float hash(vec2 p) { return fract(sin(dot(p, vec2(127.1, 311.7))) * 43758.5453); }
float noise(vec2 p) {
  vec2 i = floor(p), f = fract(p);
  f = f * f * (3.0 - 2.0 * f);
  return mix(mix(hash(i), hash(i + vec2(1, 0)), f.x), mix(hash(i + vec2(0, 1)), hash(i + vec2(1, 1)), f.x), f.y);
}
${SHADOW}
vec3 outlined(vec3 albedo, float inside, vec3 tint, float fill) {
  float slope = max(fwidth(inside), 1e-4);
  float away = abs(inside - 0.5) / slope;
  float near = step(0.02, inside) * step(inside, 0.98);
  albedo = mix(albedo, tint, fill * smoothstep(0.3, 0.7, inside));
  albedo = mix(albedo, vec3(0.0), 0.35 * near * smoothstep(3.4, 2.0, away));
  return mix(albedo, tint, near * smoothstep(2.2, 1.2, away));
}
void main() {
  float grain = 0.55 * noise(v_at.xy * 1.3) + 0.3 * noise(v_at.xy * 5.0) + 0.3 * noise(v_at.xy * 17.0);
  if (u_wall) {
    vec3 n = normalize(cross(dFdx(v_at), dFdy(v_at)));
    float layer = noise(vec2(v_at.z * 5.0 + 0.6 * noise(v_at.xy * 0.3), 3.0));
    vec3 earth = linear(mix(vec3(0.52, 0.42, 0.32), vec3(0.63, 0.53, 0.41), layer) * (0.9 + 0.12 * grain));
    color = developed(lit(earth, abs(n.x) > abs(n.y) ? vec3(sign(n.x), 0, 0) : vec3(0, sign(n.y), 0), 0.9, 1.5));
    return;
  }
  vec4 shape = texture(u_shape, v_at.xy / u_site);
  vec4 region = texture(u_regions, v_at.xy / u_site);
  vec2 slope = shape.xy * (1.0 + 0.7 / (1.0 + 4.0 * dot(shape.xy, shape.xy))) * u_tall;
  vec3 normal = normalize(vec3(-slope, 1.0));
  float share = shape.w / (abs(shape.w) + 0.06);
  float rise = clamp((v_at.z - u_high.x) / max(u_high.y - u_high.x, 1.0), 0.0, 1.0);
  vec3 albedo = linear(vec3(0.70, 0.65, 0.55) * (0.88 + 0.2 * rise) * (0.92 + 0.14 * grain));
  vec3 below = mix(linear(vec3(0.38, 0.32, 0.27)), linear(vec3(0.25, 0.40, 0.62)), region.z);
  albedo = mix(albedo, below, max(-share, 0.0));
  albedo = mix(albedo, linear(vec3(0.56, 0.37, 0.22) * (0.84 + 0.28 * grain)), max(share, 0.0));
  float level = v_at.z / u_interval - 0.5, step_px = fwidth(level);
  float line = smoothstep(1.3, 0.3, abs(level - round(level)) / max(step_px, 1e-6));
  albedo *= 1.0 - 0.28 * line * clamp(length(shape.xy) * 4.0, 0.0, 1.0) * smoothstep(0.35, 0.12, step_px);
  float hatch = smoothstep(0.42, 0.5, abs(fract((v_at.x + v_at.y) * 0.8) - 0.5));
  float counter = smoothstep(0.42, 0.5, abs(fract((v_at.x - v_at.y) * 0.8) - 0.5));
  float bare = 1.0 - 0.65 * max(share, 0.0);
  albedo = outlined(albedo, region.z, linear(vec3(0.80, 0.47, 0.65)), 0.06 + 0.2 * counter * bare);
  albedo = outlined(albedo, region.x, linear(vec3(1.0, 0.78, 0.22)), 0.06 + 0.2 * hatch * bare);
  albedo = outlined(albedo, region.y, linear(vec3(0.12, 0.46, 0.86)), 0.26 * bare);
  float sun = (1.0 - 0.85 * shade(v_at.xy)) * (1.0 - 0.8 * (1.0 - region.w));
  color = developed(lit(albedo, normal, sun, shape.z * (1.0 - 0.4 * shade(v_at.xy - SUN.xy * 0.3))));
}`;

// Six faces of a box for each of the cells; the face's own coordinates go from 0 to 1.
const CELL_VERTEX = `#version 300 es
precision highp float;
uniform mat4 u_view;
uniform float u_tall, u_cell;
in vec4 a_place;
in vec3 a_paint;
out vec3 v_at, v_paint;
out vec2 v_own;
flat out vec3 v_normal;
const vec2 CORNERS[6] = vec2[6](vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 0), vec2(1, 1), vec2(0, 1));
void main() {
  int axis = gl_VertexID / 12, side = (gl_VertexID / 6) % 2;
  v_own = CORNERS[gl_VertexID % 6];
  vec3 corner = axis == 0 ? vec3(side, v_own) : axis == 1 ? vec3(v_own.x, side, v_own.y) : vec3(v_own, side);
  v_normal = vec3(axis == 0, axis == 1, axis == 2) * (side == 0 ? -1.0 : 1.0);
  v_at = vec3((a_place.xy + corner.xy) * u_cell, mix(a_place.z, a_place.w, corner.z));
  v_paint = a_paint;
  gl_Position = u_view * vec4(v_at.xy, v_at.z * u_tall, 1.0);
}`;

const CELL_FRAGMENT = `#version 300 es
precision highp float;
in vec3 v_at, v_paint;
in vec2 v_own;
flat in vec3 v_normal;
out vec4 color;
${LIGHTING}
${SHADOW}
void main() {
  vec2 width = max(fwidth(v_own), 1e-6), inside = min(v_own, 1.0 - v_own) / width;
  float line = smoothstep(1.1, 0.2, min(inside.x, inside.y)) * smoothstep(0.3, 0.05, max(width.x, width.y));
  float dark = v_normal.z > 0.5 ? shade(v_at.xy) : 0.0;
  color = developed(lit(linear(v_paint * (1.0 - 0.45 * line)), v_normal, 1.0 - 0.85 * dark, 1.0 - 0.4 * dark));
}`;

const MODEL_VERTEX = `#version 300 es
precision highp float;
uniform mat4 u_view, u_model;
in vec3 a_point, a_normal;
in vec4 a_paint;
out vec3 v_own, v_normal;
out vec4 v_paint;
void main() {
  v_own = a_point;
  v_normal = mat3(u_model) * a_normal;
  v_paint = a_paint;
  gl_Position = u_view * u_model * vec4(a_point, 1.0);
}`;

const MODEL_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 u_paint;
uniform float u_driven;
in vec3 v_own, v_normal;
in vec4 v_paint;
out vec4 color;
${LIGHTING}
void main() {
  vec3 paint = v_paint.r < 0.0 ? u_paint : v_paint.rgb;
  if (abs(v_paint.a - 1.0) < 0.5) paint *= 0.7 + 0.9 * smoothstep(0.1, 0.2, abs(fract((v_own.x + u_driven) / 0.28) - 0.5));
  if (v_paint.a > 1.5) paint *= 0.86 + 0.2 * smoothstep(0.3, 0.34, abs(fract((v_own.x + v_own.y) * 0.9) - 0.5));
  vec3 normal = normalize(v_normal);
  color = developed(lit(linear(paint), normal, 1.0, 0.75 + 0.25 * clamp(v_own.z, 0.0, 1.0)));
}`;
