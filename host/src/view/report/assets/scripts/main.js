// Starts the 3D view: the model first, because it is small and can be looked at while the raw mesh is still on its way.

/** Places, as positions of a mesh are. */
function onLattice(places, { origin_m, step_m }) {
  const positions = new Uint16Array(4 * places.length);
  places.forEach((place, index) => {
    place.forEach((value, axis) => {
      positions[4 * index + axis] = clamp(Math.round((value - origin_m[axis]) / step_m), 0, 65535);
    });
  });
  return positions;
}

/** A grid on the floor, of meters or, of a large building, of five: many recordings have no floor to stand on. */
function gridLines({ bounds_m: [low, high] }, height_m) {
  const side = Math.max(high[0] - low[0], high[1] - low[1]) > 60 ? 5 : 1;
  const lines = [];
  for (const axis of [0, 1]) {
    for (let at = Math.ceil(low[axis] / side) * side; at <= high[axis]; at += side) {
      for (const end of [low, high]) lines.push(axis === 0 ? [at, end[1], height_m] : [end[0], at, height_m]);
    }
  }
  return lines;
}

/** The robot's way a little over its floor, each piece with both ends: drives are not joined. */
function wayLines({ way_m }) {
  const over = ([x, y, z]) => [x, y, z + 0.03];
  return way_m.flatMap((drive) => drive.slice(1).flatMap((at, index) => [over(drive[index]), over(at)]));
}

/** Colors, plane normals and numbers of a model's surfaces, for each of its vertices. */
function dress(mesh, normals, { polygons, planes, rounds, inferred }) {
  const count = mesh.positions.length / 4;
  mesh.colors = new Uint8Array(4 * count).fill(152);
  mesh.surfaces = new Float32Array(count);
  mesh.normals = normals;
  let first = 0;
  // Round things keep the normals of their vertices: these turn with the surface.
  const color = (number, triangles, rgb, normal) => {
    for (let c = first; c < first + 3 * triangles; c++) {
      const vertex = mesh.corners[c];
      mesh.surfaces[vertex] = number;
      for (let axis = 0; axis < 3; axis++) {
        mesh.colors[4 * vertex + axis] = rgb[axis];
        if (normal) normals[4 * vertex + axis] = Math.round(127 * normal[axis]);
      }
    }
    first += 3 * triangles;
  };
  polygons.forEach(({ plane, triangles }, index) => color(index + 1, triangles, planes[plane].color, planes[plane].normal));
  mesh.borders = borders(mesh.corners, first / 3);
  rounds.forEach((round, index) => color(polygons.length + index + 1, round.triangles, round.color, null));
  inferred.forEach((surface, index) => color(polygons.length + rounds.length + index + 1, surface.triangles, surface.color, surface.normal));
}

/** What a view should hold: the way, and corners of the model with their normals, some thousand at most. */
function placesToSee({ positions, normals, surfaces }, { origin_m, step_m, way_m, bounds_m: [low, high] }) {
  const places = way_m.flat().map((at) => ({ at, normal: [0, 0, 1] }));
  const every = Math.ceil(surfaces.length / 6000);
  for (let v = 0; v < surfaces.length; v += every) {
    const [steps, normal] = [positions, normals].map((from) => [from[4 * v], from[4 * v + 1], from[4 * v + 2]]);
    const at = add(origin_m, scale(steps, step_m));
    // Of what lies on no plane single triangles may be anywhere.
    if (surfaces[v] > 0 || at.every((value, axis) => value >= low[axis] && value <= high[axis])) places.push({ at, normal });
  }
  return places;
}

async function loadMesh(viewer, note) {
  const pane = viewer.panes.find((each) => each.name === note.name);
  const say = (part) => { pane.status.textContent = `loading ${Math.round(100 * part)} %`; };
  const mesh = await unpack(note, await bytesOf(note.name), say);
  const { contents, camera: { floor_m } } = viewer;
  mesh.way = onLattice(wayLines(contents), contents);
  mesh.grid = onLattice(gridLines(contents, floor_m), contents);
  mesh.normals = await facing(mesh);
  if (note.name === 'model') {
    dress(mesh, mesh.normals, viewer.contents);
    viewer.model = mesh;
    viewer.camera.places = placesToSee(mesh, contents);
    viewer.resized();
  }
  await pane.load(mesh, viewer.contents);
  pane.status.textContent = sizeOf(note, viewer.contents);
  viewer.changed();
}

function sizeOf({ name, triangles }, { polygons, rounds, inferred, raw_triangles }) {
  const grouped = (number) => number.toLocaleString('en');
  const count = (number, noun) => `${grouped(number)} ${noun}${number === 1 ? '' : 's'}`;
  if (name === 'model') {
    const known = [...polygons, ...rounds, ...inferred].reduce((sum, surface) => sum + surface.triangles, 0);
    const round = rounds.length > 0 ? ` + ${count(rounds.length, 'round thing')}` : '';
    return `${count(polygons.length, 'polygon')}${round} + ${count(triangles - known, 'triangle')}${inferred.length > 0 ? `; ${grouped(inferred.length)} inferred` : ''}`;
  }
  return name === 'raw' && triangles < raw_triangles ? `${grouped(triangles)} of ${count(raw_triangles, 'triangle')}` : count(triangles, 'triangle');
}

async function start(section) {
  const contents = JSON.parse(document.getElementById('contents').textContent);
  let viewer;
  try {
    viewer = new Viewer(section, contents);
  } catch {
    document.documentElement.classList.remove('scripted');
    document.getElementById('no-webgl').hidden = false;
    section.dataset.state = 'pictures';
    return;
  }
  // The simplification is unpacked when somebody wants to see it.
  const [later, now] = [true, false].map((isSimple) => contents.meshes.filter(({ name }) => (name === 'simple') === isSimple));
  document.addEventListener('shown', async ({ detail }) => {
    for (const note of later.splice(0, detail.includes('simple') ? later.length : 0)) await loadMesh(viewer, note);
  });
  for (const note of now) await loadMesh(viewer, note);
  section.dataset.state = 'ready';
}

start(document.getElementById('view'));
