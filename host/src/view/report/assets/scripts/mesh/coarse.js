// Coarser indices of a large mesh, over the same vertices: all vertices of a cell become its first one. Slow computers draw these while the
// view moves, and the whole mesh when it stands.

/** Triangles of the two coarser ones, at most. */
const COARSE = [150000, 40000];

/** Corners of a mesh of at most so many triangles, from one that may have more. */
async function coarser(positions, corners, most, step_m) {
  for (let cell = 0.06 / step_m; corners.length / 3 > most; cell *= 1.5) corners = await clustered(positions, corners, cell);
  return corners;
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
