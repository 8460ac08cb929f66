// What lies under a place of a picture: the nearest triangle of the model along a ray.

/** `surface`: its number, -1 for fine structure on no plane, null for nothing; `point`: where it was met. Only what `look` shows. */
function pick({ positions, corners, surfaces, normals }, { origin_m, step_m }, camera, [x, y], aspect, look) {
  const { eye, right, up, forward } = camera.frame();
  const half = camera.half(aspect);
  const direction = add(forward, add(scale(right, x * half[0]), scale(up, y * half[1])));
  const from = scale(sub(eye, origin_m), 1 / step_m);
  let [nearest, found] = [Infinity, null];
  const at = (corner) => [positions[4 * corner], positions[4 * corner + 1], positions[4 * corner + 2]];
  for (let t = 0; t < corners.length; t += 3) {
    const corner = corners[t];
    const facing = normals[4 * corner] * direction[0] + normals[4 * corner + 1] * direction[1] + normals[4 * corner + 2] * direction[2];
    if (look.cut && facing >= 0) continue;
    const distance = along(from, direction, at(corner), at(corners[t + 1]), at(corners[t + 2]));
    if (distance <= 0 || distance >= nearest) continue;
    if (!look.inferred && surfaces[corner] > look.inferred_from) continue;
    const height_m = origin_m[2] + step_m * (from[2] + distance * direction[2]);
    const isCeiling = normals[4 * corner + 2] < -0.7 * 127 && height_m > look.ceiling_from_m;
    if (height_m > look.section_m || (!look.ceiling && isCeiling)) continue;
    [nearest, found] = [distance, surfaces[corner] - 1];
  }
  return { surface: found, point: found === null ? null : add(eye, scale(direction, nearest * step_m)) };
}

/** How far along a ray it meets a triangle, in lengths of its direction; -1 when it does not (Möller and Trumbore 1997). */
function along(from, direction, a, b, c) {
  const [u, v] = [sub(b, a), sub(c, a)];
  const p = cross(direction, v);
  const det = dot(u, p);
  if (det === 0) return -1;
  const s = sub(from, a);
  const beside = dot(s, p) / det;
  if (beside < 0 || beside > 1) return -1;
  const q = cross(s, u);
  const above = dot(direction, q) / det;
  return above < 0 || beside + above > 1 ? -1 : dot(v, q) / det;
}
