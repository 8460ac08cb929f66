// One picture of one mesh, by WebGL2. A mesh is drawn in pieces, and those beside the picture are left out.

const PIECE = 8192;
const INK = { light: [0.2, 0.22, 0.26], dark: [0.08, 0.09, 0.11] };
const WAY = [0.13, 0.46, 0.84, 1];
const GRID = [0.5, 0.55, 0.62, 0.28];
// Lines have their full strength where a meter is so many pixels; far away less, so that small detail does not turn black.
const FULL_PIXELS = 45;
// A height above everything: no section.
const FAR_M = 1e6;
const BACKGROUND = { light: [0.965, 0.969, 0.976], dark: [0.086, 0.098, 0.118] };

class Pane {
  /** Throws when there is no WebGL2. */
  constructor(figure) {
    this.name = figure.dataset.mesh;
    this.figure = figure;
    this.canvas = figure.querySelector('canvas');
    this.status = figure.querySelector('figcaption span');
    this.gl = this.canvas.getContext('webgl2', { antialias: true, alpha: false, powerPreference: 'high-performance' });
    if (!this.gl) throw new Error('no WebGL2');
    this.surface = program(this.gl, 'surface');
    this.line = program(this.gl, 'line');
    this.canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      this.status.textContent = 'the graphics card gave up; reload the page';
      this.mesh = null;
    });
  }

  /** `mesh`: positions, corners, normals, and of a model colors and surfaces; `lattice`: origin_m and step_m. Nothing is drawn before all of it is there. */
  async load(mesh, lattice) {
    const { gl } = this;
    this.lattice = lattice;
    this.vertices = gl.createVertexArray();
    gl.bindVertexArray(this.vertices);
    attribute(gl, 0, mesh.positions, 3, gl.UNSIGNED_SHORT, false, 8);
    attribute(gl, 1, mesh.normals, 3, gl.BYTE, true, 4);
    if (mesh.colors) attribute(gl, 2, mesh.colors, 3, gl.UNSIGNED_BYTE, true, 4);
    else gl.vertexAttrib3f(2, 0.808, 0.816, 0.831);
    if (mesh.surfaces) attribute(gl, 3, mesh.surfaces, 1, gl.FLOAT, false, 4);
    else gl.vertexAttrib1f(3, 0);
    this.whole = await this.part(mesh, mesh.corners);
    this.coarse = [];
    let corners = mesh.corners;
    for (const most of COARSE) {
      corners = await coarser(mesh.positions, corners, most, lattice.step_m);
      if (corners !== mesh.corners) this.coarse.push(await this.part(mesh, corners));
    }
    this.borders = mesh.borders && this.lines(mesh.borders);
    this.way = this.floorLines(mesh.way, WAY);
    this.grid = this.floorLines(mesh.grid, GRID);
    this.mesh = mesh;
  }

  async part({ positions }, corners) {
    const parts = await pieces(positions, corners, this.lattice);
    this.gl.bindVertexArray(this.vertices);
    return { buffer: indices(this.gl, corners), pieces: parts };
  }

  lines(vertices) {
    this.gl.bindVertexArray(this.vertices);
    return { buffer: indices(this.gl, vertices), count: vertices.length };
  }

  floorLines(positions, ink) {
    const { gl } = this;
    const vertices = gl.createVertexArray();
    gl.bindVertexArray(vertices);
    attribute(gl, 0, positions, 3, gl.UNSIGNED_SHORT, false, 8);
    return { vertices, count: positions.length / 4, ink };
  }

  /** Fits the canvas to its place. */
  fit(level) {
    const ratio = Math.min(devicePixelRatio || 1, 2) * (level > 1 ? 0.5 : 1);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight].map((side) => Math.max(1, Math.round(side * ratio)));
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
  }

  draw(camera, look) {
    const { gl, canvas } = this;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...BACKGROUND[look.theme], 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.mesh) return;
    const { frame, matrix } = camera.clip(canvas.width / canvas.height);
    look.pixels_per_meter = camera.walking ? FULL_PIXELS : canvas.clientHeight / (2 * camera.half(canvas.width / canvas.height)[1] * camera.distance);
    gl.enable(gl.DEPTH_TEST);
    this.drawSurfaces(frame, matrix, look);
    if (this.borders && !look.wireframe) this.drawLines(this.borders, matrix, frame, look);
    if (look.wireframe && (look.level === 0 || this.coarse.length === 0)) this.drawLines(this.wires ||= this.lines(allEdges(this.mesh.corners)), matrix, frame, look);
    if (look.way) for (const lines of [this.grid, this.way]) this.drawFloor(lines, matrix, frame, look);
  }

  drawSurfaces(frame, matrix, look) {
    const { gl, surface } = this;
    this.use(surface, frame, matrix, look);
    for (const axis of ['right', 'up', 'forward']) gl.uniform3fv(surface.at(axis), frame[axis]);
    gl.uniform1i(surface.at('coloring'), look.coloring);
    gl.uniform1f(surface.at('picked'), look.picked + 1);
    gl.uniform1f(surface.at('inferred_from'), look.inferred ? FAR_M : look.inferred_from);
    gl.bindVertexArray(this.vertices);
    const { buffer, pieces } = this.coarse[Math.min(look.level, this.coarse.length) - 1] || this.whole;
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    for (const { first, count, box } of pieces) {
      if (mayBeSeen(matrix, box)) gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 4 * first);
    }
    gl.disable(gl.POLYGON_OFFSET_FILL);
  }

  drawLines({ buffer, count }, matrix, frame, look) {
    const { gl, line } = this;
    this.use(line, frame, matrix, look);
    gl.uniform4fv(line.at('ink'), [...INK[look.theme], clamp(0.65 * look.pixels_per_meter / FULL_PIXELS, 0.1, 0.65)]);
    gl.bindVertexArray(this.vertices);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.drawElements(gl.LINES, count, gl.UNSIGNED_INT, 0);
    gl.disable(gl.BLEND);
  }

  /** A section cuts off the way above it, too. */
  drawFloor({ vertices, count, ink }, matrix, frame, { section_m }) {
    const { gl, line } = this;
    this.use(line, frame, matrix, { cut: false, ceiling: true, section_m, ceiling_from_m: FAR_M });
    gl.uniform4fv(line.at('ink'), ink);
    gl.bindVertexArray(vertices);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.drawArrays(gl.LINES, 0, count);
    gl.disable(gl.BLEND);
  }

  use(program, frame, matrix, look) {
    const { gl, lattice } = this;
    gl.useProgram(program.program);
    gl.uniformMatrix4fv(program.at('clip_from_map'), false, matrix);
    gl.uniform3fv(program.at('origin'), lattice.origin_m);
    gl.uniform3fv(program.at('eye'), frame.eye);
    gl.uniform1f(program.at('lattice_step'), lattice.step_m);
    gl.uniform1i(program.at('cut'), look.cut);
    gl.uniform1i(program.at('ceiling'), look.ceiling);
    gl.uniform1f(program.at('section'), look.section_m);
    gl.uniform1f(program.at('ceiling_from'), look.ceiling_from_m);
  }
}

function program(gl, name) {
  const program = gl.createProgram();
  for (const [kind, end] of [[gl.VERTEX_SHADER, 'vert'], [gl.FRAGMENT_SHADER, 'frag']]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, document.getElementById(`${name}.${end}`).textContent);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  const places = {};
  return { program, at: (uniform) => places[uniform] ??= gl.getUniformLocation(program, uniform) };
}

function attribute(gl, location, data, size, type, normalized, stride) {
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(location);
  gl.vertexAttribPointer(location, size, type, normalized, stride, 0);
}

function indices(gl, data) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, data, gl.STATIC_DRAW);
  return buffer;
}

/** Runs of triangles with the boxes around them; neighbors in a mesh of scans are neighbors in space. */
async function pieces(positions, corners, { origin_m, step_m }) {
  const list = [];
  for (let first = 0; first < corners.length; first += 3 * PIECE) {
    const count = Math.min(3 * PIECE, corners.length - first);
    const low = [65535, 65535, 65535], high = [0, 0, 0];
    for (let c = first; c < first + count; c++) {
      for (let axis = 0; axis < 3; axis++) {
        const value = positions[4 * corners[c] + axis];
        if (value < low[axis]) low[axis] = value;
        if (value > high[axis]) high[axis] = value;
      }
    }
    list.push({ first, count, box: [low, high].map((p) => add(origin_m, scale(p, step_m))) });
    if (list.length % 16 === 0) await breath();
  }
  return list;
}
