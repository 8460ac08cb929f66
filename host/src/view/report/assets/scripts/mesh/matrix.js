// Vectors of three and matrices of 4 x 4, columns first, as WebGL wants them.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, by) => [a[0] * by, a[1] * by, a[2] * by];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => scale(a, 1 / (Math.hypot(...a) || 1));
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** Clip space from `map`, seen from an eye with its axes; `half` is half the picture's width and height at a distance of one. */
function clipFromMap({ eye, right, up, forward }, half, near, far) {
  const depth = [(far + near) / (far - near), (-2 * far * near) / (far - near)];
  const rows = [scale(right, 1 / half[0]), scale(up, 1 / half[1]), scale(forward, depth[0]), forward];
  const last = rows.map((row, i) => -dot(row, eye) + (i === 2 ? depth[1] : 0));
  const matrix = new Float32Array(16);
  rows.forEach((row, i) => {
    for (let j = 0; j < 3; j++) matrix[4 * j + i] = row[j];
    matrix[12 + i] = last[i];
  });
  return matrix;
}

/** Whether a box may be seen through a matrix. */
function mayBeSeen(matrix, [low, high]) {
  const outside = [0, 0, 0, 0, 0];
  for (let corner = 0; corner < 8; corner++) {
    const p = [0, 1, 2].map((axis) => (corner >> axis & 1 ? high : low)[axis]);
    const [x, y, , w] = [0, 1, 2, 3].map((i) => matrix[i] * p[0] + matrix[4 + i] * p[1] + matrix[8 + i] * p[2] + matrix[12 + i]);
    outside[0] += x < -w;
    outside[1] += x > w;
    outside[2] += y < -w;
    outside[3] += y > w;
    outside[4] += w < 0;
  }
  return outside.every((count) => count < 8);
}
