// Which way a noisy mesh faces: normals at its vertices, averaged a few times with their neighbors. Light comes from the triangles' own
// normals, which the shader computes; these tell front from back, and a single triangle of noise must not.

const ROUNDS = 4;

async function facing({ positions, corners }) {
  const count = positions.length / 4;
  let sums = new Float32Array(3 * count);
  for (let t = 0; t < corners.length; t += 3) {
    const a = 4 * corners[t], b = 4 * corners[t + 1], c = 4 * corners[t + 2];
    const ux = positions[b] - positions[a], uy = positions[b + 1] - positions[a + 1], uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a], vy = positions[c + 1] - positions[a + 1], vz = positions[c + 2] - positions[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    for (let k = 0; k < 3; k++) {
      const to = 3 * corners[t + k];
      sums[to] += x;
      sums[to + 1] += y;
      sums[to + 2] += z;
    }
    if (t % (3 * SLICE) === 0) await breath();
  }
  for (let round = 0; round < ROUNDS; round++) sums = await averaged(sums, corners);
  return bytesOfNormals(sums);
}

async function averaged(sums, corners) {
  const next = new Float32Array(sums.length);
  for (let t = 0; t < corners.length; t += 3) {
    const a = 3 * corners[t], b = 3 * corners[t + 1], c = 3 * corners[t + 2];
    for (let axis = 0; axis < 3; axis++) {
      const mean = (sums[a + axis] + sums[b + axis] + sums[c + axis]) / 9;
      next[a + axis] += mean;
      next[b + axis] += mean;
      next[c + axis] += mean;
    }
    if (t % (3 * SLICE) === 0) await breath();
  }
  return next;
}

/** Four signed bytes a vertex. */
function bytesOfNormals(normals) {
  const bytes = new Int8Array(normals.length / 3 * 4);
  for (let v = 0; v < normals.length / 3; v++) {
    const length = Math.hypot(normals[3 * v], normals[3 * v + 1], normals[3 * v + 2]) || 1;
    for (let axis = 0; axis < 3; axis++) bytes[4 * v + axis] = Math.round(127 * normals[3 * v + axis] / length);
  }
  return bytes;
}
