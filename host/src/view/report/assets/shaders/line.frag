#version 300 es
precision highp float;
uniform vec4 ink;
uniform bool cut, ceiling;
uniform float section, ceiling_from;
uniform vec3 eye;
in vec3 from_eye, facing;
out vec4 pixel;

void main() {
  float height = from_eye.z + eye.z;
  if (height > section || (!ceiling && facing.z < -0.7 && height > ceiling_from)) discard;
  // Borders of walls seen edge-on stay: they are the walls of a plan.
  if (cut && dot(facing, from_eye) > 0.05 * length(from_eye)) discard;
  pixel = ink;
}
