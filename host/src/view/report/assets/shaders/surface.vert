#version 300 es
// A corner of a surface. Positions are whole steps of the lattice.
uniform mat4 clip_from_map;
uniform vec3 origin, eye;
uniform float lattice_step;
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 color;
layout(location = 3) in float surface;
out vec3 from_eye, facing, own_color;
flat out float surface_number;

void main() {
  vec3 at = origin + lattice_step * position;
  from_eye = at - eye;
  facing = normal;
  own_color = color;
  surface_number = surface;
  gl_Position = clip_from_map * vec4(at, 1.0);
}
