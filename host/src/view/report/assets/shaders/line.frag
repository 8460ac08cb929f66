#version 300 es
precision highp float;
uniform vec4 ink;
uniform bool cut;
in vec3 from_eye, facing;
out vec4 pixel;

void main() {
  // Borders of walls seen edge-on stay: they are the walls of a plan.
  if (cut && dot(facing, from_eye) > 0.05 * length(from_eye)) discard;
  pixel = ink;
}
