// Starts the 3D view: the model first, because it is small and can be looked at while the raw mesh is still on its way.

/** Positions on the floor along the robot's way, as a mesh's are. */
function wayOnLattice({ way_m, origin_m, step_m }) {
  const positions = new Uint16Array(4 * way_m.length);
  way_m.forEach(([x, y], index) => {
    [x, y, 0.03].forEach((value, axis) => {
      positions[4 * index + axis] = clamp(Math.round((value - origin_m[axis]) / step_m), 0, 65535);
    });
  });
  return positions;
}

/** Colours, plane normals and numbers of a model's surfaces, for each of its vertices. */
function dress(mesh, normals, { polygons, planes }) {
  const count = mesh.positions.length / 4;
  mesh.colors = new Uint8Array(4 * count).fill(152);
  mesh.surfaces = new Float32Array(count);
  mesh.normals = normals;
  let first = 0;
  polygons.forEach(({ plane, triangles }, index) => {
    const { color, normal } = planes[plane];
    for (let c = first; c < first + 3 * triangles; c++) {
      const vertex = mesh.corners[c];
      mesh.surfaces[vertex] = index + 1;
      for (let axis = 0; axis < 3; axis++) {
        mesh.colors[4 * vertex + axis] = color[axis];
        normals[4 * vertex + axis] = Math.round(127 * normal[axis]);
      }
    }
    first += 3 * triangles;
  });
  mesh.borders = borders(mesh.corners, first / 3);
}

async function loadMesh(viewer, note) {
  const pane = viewer.panes.find((each) => each.name === note.name);
  const say = (part) => { pane.status.textContent = `loading ${Math.round(100 * part)} %`; };
  const mesh = await unpack(note, await bytesOf(note.name), say);
  mesh.way = wayOnLattice(viewer.contents);
  mesh.normals = await facing(mesh);
  if (note.name === 'model') {
    dress(mesh, mesh.normals, viewer.contents);
    viewer.model = mesh;
  }
  await pane.load(mesh, viewer.contents);
  pane.status.textContent = sizeOf(note, viewer.contents);
  viewer.changed();
}

function sizeOf({ name, triangles }, { polygons, raw_triangles }) {
  const count = (number) => number.toLocaleString('en');
  if (name === 'model') {
    const flat = polygons.reduce((sum, polygon) => sum + polygon.triangles, 0);
    return `${count(polygons.length)} polygons + ${count(triangles - flat)} triangles`;
  }
  return name === 'raw' && triangles < raw_triangles
    ? `${count(triangles)} of ${count(raw_triangles)} triangles` : `${count(triangles)} triangles`;
}

async function start(section) {
  const contents = JSON.parse(document.getElementById('contents').textContent);
  let viewer;
  try {
    viewer = new Viewer(section, contents);
  } catch (error) {
    document.documentElement.classList.remove('scripted');
    document.getElementById('no-webgl').hidden = false;
    section.dataset.state = 'pictures';
    return;
  }
  for (const note of contents.meshes) await loadMesh(viewer, note);
  section.dataset.state = 'ready';
}

start(document.getElementById('view'));
