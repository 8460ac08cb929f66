#version 300 es
// Light as in the pictures: a lamp above left of the camera, the sky, and some from the camera itself.
precision highp float;
uniform vec3 right, up, forward;
uniform int coloring;
uniform float picked;
uniform bool cut, ceiling;
uniform float section, ceiling_from, inferred_from;
uniform vec3 eye;
in vec3 from_eye, facing, own_color;
flat in float surface_number;
out vec4 pixel;

void main() {
  float height = from_eye.z + eye.z;
  if (height > section || (!ceiling && facing.z < -0.7 && height > ceiling_from)) discard;
  if (surface_number > inferred_from) discard;
  bool chosen = picked > 0.0 && surface_number == picked;
  if (cut && !chosen && dot(facing, from_eye) >= 0.0) discard;
  // A flat surface has its plane's normal, anything else that of its own triangle.
  vec3 normal = surface_number > 0.0 ? normalize(facing) : normalize(cross(dFdx(from_eye), dFdy(from_eye)));
  if (dot(normal, from_eye) > 0.0) normal = -normal;
  vec3 color = coloring == 0 ? own_color : coloring == 1 ? vec3(0.80, 0.81, 0.83) : 0.68 + 0.26 * normalize(facing);
  if (chosen) color = vec3(1.0, 0.62, 0.18);
  vec3 lamp = normalize(1.1 * up - 0.7 * right - 0.6 * forward);
  float light = 0.74 + 0.22 * max(dot(normal, lamp), 0.0) + 0.05 * (0.5 + 0.5 * normal.z) + 0.17 * max(dot(normal, -forward), 0.0);
  if (chosen) light = mix(light, 1.0, 0.7);
  pixel = vec4(min(color * light, 1.0), 1.0);
}
