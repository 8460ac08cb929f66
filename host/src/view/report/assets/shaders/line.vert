#version 300 es
// An end of a line on a surface.
uniform mat4 clip_from_map;
uniform vec3 origin, eye;
uniform float lattice_step;
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
out vec3 from_eye, facing;

void main() {
  vec3 at = origin + lattice_step * position;
  from_eye = at - eye;
  facing = normal;
  gl_Position = clip_from_map * vec4(at, 1.0);
}
