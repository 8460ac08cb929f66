// Lines along edges, as pairs of vertices.

/** All edges of a mesh: the wireframe. */
function allEdges(corners) {
  const lines = new Uint32Array(2 * corners.length);
  for (let t = 0; t < corners.length; t += 3) {
    const [a, b, c] = [corners[t], corners[t + 1], corners[t + 2]];
    lines.set([a, b, b, c, c, a], 2 * t);
  }
  return lines;
}

/** The borders of polygons: edges that only one triangle of a polygon has. Polygons share no vertices. */
function borders(corners, triangles) {
  const uses = new Map();
  const span = 2 ** 26;
  for (let c = 0; c < 3 * triangles; c++) {
    const a = corners[c], b = corners[c % 3 === 2 ? c - 2 : c + 1];
    const edge = Math.min(a, b) * span + Math.max(a, b);
    uses.set(edge, (uses.get(edge) || 0) + 1);
  }
  const lines = [];
  for (const [edge, count] of uses) if (count === 1) lines.push(Math.floor(edge / span), edge % span);
  return new Uint32Array(lines);
}
