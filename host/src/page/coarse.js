// A coarser index of a large mesh, over the same vertices: all vertices of a cell become its first one. Slow computers draw this one while
// the view moves, and the whole mesh when it stands.

const ENOUGH = 150000;

/** Corners of at most about ENOUGH triangles, or null when the mesh has no more than that. */
async function coarser({ positions, corners }, step_m) {
  if (corners.length / 3 <= ENOUGH) return null;
  for (let cell = 0.06 / step_m; ; cell *= 1.5) {
    const coarse = await clustered(positions, corners, cell);
    if (coarse.length / 3 <= ENOUGH) return coarse;
  }
}

async function clustered(positions, corners, cell) {
  const firsts = new Map();
  const side = Math.ceil(65536 / cell);
  const first = new Uint32Array(positions.length / 4);
  for (let v = 0; v < first.length; v++) {
    const [x, y, z] = [0, 1, 2].map((axis) => Math.floor(positions[4 * v + axis] / cell));
    const key = (x * side + y) * side + z;
    const known = firsts.get(key);
    if (known === undefined) firsts.set(key, v);
    first[v] = known ?? v;
    if (v % SLICE === 0) await breath();
  }
  const kept = new Uint32Array(corners.length);
  let count = 0;
  for (let t = 0; t < corners.length; t += 3) {
    const a = first[corners[t]], b = first[corners[t + 1]], c = first[corners[t + 2]];
    if (a !== b && b !== c && c !== a) {
      kept[count++] = a;
      kept[count++] = b;
      kept[count++] = c;
    }
    if (t % (3 * SLICE) === 0) await breath();
  }
  return kept.slice(0, count);
}
