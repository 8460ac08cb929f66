// Opens tileset.json in headless Chromium with three.js and its 3DTilesRenderer, as a web viewer would.
//   node check_tileset.js MODEL_FOLDER
// The folder holds model.glb too. Seen from near all squares of the model itself must be there, with as many
// triangles as model.glb has; from far the coarsest level alone. Each piece must lie in its box, each box in
// the one above, and Khronos' validator must find no error in a piece. With gltf-validator, playwright-core,
// three and 3d-tiles-renderer on NODE_PATH, and Chromium.
const fs = require('fs');
const http = require('http');
const path = require('path');
const validator = require('gltf-validator');
const { chromium } = require('playwright-core');

const ARGUMENTS = [
  '--headless', '--no-sandbox', '--disable-gpu', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync', '--use-gl=angle', '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
];
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.json': 'application/json' };
// Further than a level may be from the eye to be drawn with an error of 16 pixels, in sizes of the model.
const FAR = 30;
const [folder] = process.argv.slice(2);
const problems = [];
let passed = 0;
const check = (good, what) => {
  if (good) passed += 1;
  else problems.push(what);
};
const places = (process.env.NODE_PATH || '').split(':');
const modules = places.find((place) => fs.existsSync(path.join(place, 'three')));

/** A viewer of a few lines: what a page of somebody else's would do. */
const PAGE = `<!doctype html><title>tiles</title><style>body{margin:0}</style>
<script type="importmap">{"imports": {
  "three": "/modules/three/build/three.module.js",
  "three/addons/": "/modules/three/examples/jsm/",
  "3d-tiles-renderer": "/modules/3d-tiles-renderer/build/index.three.js"}}</script>
<script type="module">
import * as THREE from 'three';
import { TilesRenderer } from '3d-tiles-renderer';
const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
renderer.setSize(1300, 900);
document.body.append(renderer.domElement);
const scene = new THREE.Scene();
scene.background = new THREE.Color('white');
scene.add(new THREE.AmbientLight('white', 3));
const camera = new THREE.PerspectiveCamera(60, 1300 / 900, 0.1, 1e5);
camera.up.set(0, 0, 1);
const tiles = new TilesRenderer('/model/tileset.json');
tiles.setCamera(camera);
tiles.setResolutionFromRenderer(camera, renderer);
scene.add(tiles.group);
window.failed = [];
tiles.addEventListener('load-error', (event) => window.failed.push(String(event.url) + ' ' + event.error));
const triangles = (mesh) => (mesh.geometry.index ?? mesh.geometry.attributes.position).count / 3;
const shown = () => [...tiles.visibleTiles].map((tile) => {
  const found = { uri: tile.content.uri, triangles: 0, low: [9e9, 9e9, 9e9], high: [-9e9, -9e9, -9e9] };
  tile.engineData.scene.traverse((node) => {
    if (!node.isMesh) return;
    found.triangles += triangles(node);
    const toMap = tiles.group.matrixWorld.clone().invert();
    const box = new THREE.Box3().setFromObject(node, true).applyMatrix4(toMap);
    found.low = box.min.toArray().map((x, k) => Math.min(x, found.low[k]));
    found.high = box.max.toArray().map((x, k) => Math.max(x, found.high[k]));
  });
  return found;
});
/** Looks at the middle from so many sizes of the model away, until nothing more is loaded. */
window.look = async (sizes) => {
  const sphere = new THREE.Sphere();
  for (let quiet = 0, turn = 0; quiet < 5 && turn < 600; turn += 1) {
    if (tiles.getBoundingSphere(sphere)) {
      const away = new THREE.Vector3(0.5, -0.6, 0.6).normalize().multiplyScalar(2 * sphere.radius * sizes);
      camera.position.copy(sphere.center).add(away);
      camera.lookAt(sphere.center);
      camera.updateMatrixWorld();
    }
    tiles.update();
    renderer.render(scene, camera);
    const { downloading, parsing, queued = 0 } = tiles.stats;
    const waiting = sphere.radius <= 0 || downloading + parsing + queued > 0 || tiles.visibleTiles.size === 0;
    quiet = waiting ? 0 : quiet + 1;
    await new Promise((done) => { setTimeout(done, 50); });
  }
  const pixels = new Uint8Array(4 * 1300 * 900);
  const gl = renderer.getContext();
  gl.readPixels(0, 0, 1300, 900, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let drawn = 0;
  for (let i = 0; i < pixels.length; i += 4) drawn += pixels[i] + pixels[i + 1] + pixels[i + 2] < 750;
  return { tiles: shown(), drawn };
};
window.triangles_of = async (url) => {
  const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
  let sum = 0;
  const { scene: model } = await new GLTFLoader().loadAsync(url);
  model.traverse((node) => { sum += node.isMesh ? triangles(node) : 0; });
  return sum;
};
window.errorTarget = tiles.errorTarget;
</script>`;

function serve() {
  const roots = { model: folder, modules };
  const server = http.createServer((request, response) => {
    const [, root, ...rest] = decodeURIComponent(request.url.split('?')[0]).split('/');
    const send = (type, body) => response.writeHead(200, { 'content-type': type }).end(body);
    if (root === '') return send(TYPES['.html'], PAGE);
    // A browser asks for a picture of the site.
    if (root === 'favicon.ico') return response.writeHead(204).end();
    const file = path.join(roots[root] || '', ...rest);
    if (!roots[root] || !fs.existsSync(file)) return response.writeHead(404).end();
    return send(TYPES[path.extname(file)] || 'application/octet-stream', fs.readFileSync(file));
  });
  return new Promise((done) => { server.listen(0, '127.0.0.1', () => done(server)); });
}

/** All tiles, each with its parent. */
function all(tile, parent = null) {
  return [{ tile, parent }, ...(tile.children || []).flatMap((child) => all(child, tile))];
}

/** Smallest and largest coordinates of a box whose half axes lie along x, y and z. */
function bounds({ boundingVolume: { box } }) {
  const sides = [box[3], box[7], box[11]];
  return { low: sides.map((side, k) => box[k] - side), high: sides.map((side, k) => box[k] + side) };
}

const inside = (inner, outer) => [0, 1, 2]
  .every((k) => inner.low[k] >= outer.low[k] - 2e-3 && inner.high[k] <= outer.high[k] + 2e-3);

async function checkPieces(tileset) {
  const tiles = all(tileset.root);
  for (const { tile, parent } of tiles) {
    const { uri } = tile.content;
    const { issues } = await validator.validateBytes(new Uint8Array(fs.readFileSync(path.join(folder, uri))));
    check(issues.numErrors === 0, `${uri}: ${JSON.stringify(issues.messages.slice(0, 3))}`);
    if (!parent) continue;
    check(inside(bounds(tile), bounds(parent)), `${uri} reaches out of ${parent.content.uri}`);
    check(tile.geometricError <= parent.geometricError, `${uri}: a larger error than the level above`);
  }
  return tiles;
}

function checkShown(view, tiles, where) {
  check(view.drawn > 0, `nothing is drawn from ${where}`);
  for (const seen of view.tiles) {
    const { tile } = tiles.find((other) => other.tile.content.uri === seen.uri);
    const both = JSON.stringify([seen, bounds(tile)]);
    check(inside(seen, bounds(tile)), `${seen.uri} reaches out of its box: ${both}`);
  }
}

async function checkViews(page, tiles) {
  const leaves = tiles.filter(({ tile }) => !tile.children).map(({ tile }) => tile.content.uri).sort();
  const near = await page.evaluate(() => window.look(0.8));
  checkShown(near, tiles, 'near');
  const names = near.tiles.map(({ uri }) => uri).sort();
  check(names.join() === leaves.join(), `from near: ${names} instead of ${leaves}`);
  const whole = await page.evaluate(() => window.triangles_of('/model/model.glb'));
  const sum = near.tiles.reduce((so_far, { triangles }) => so_far + triangles, 0);
  check(sum === whole, `${sum} triangles in the squares, ${whole} in model.glb`);
  const far = await page.evaluate((sizes) => window.look(sizes), FAR);
  checkShown(far, tiles, 'far');
  const root = tiles[0].tile.content.uri;
  check(far.tiles.map(({ uri }) => uri).join() === root, `from far: ${far.tiles.map(({ uri }) => uri)}`);
  check(near.drawn > 20 * far.drawn, `${near.drawn} pixels from near, ${far.drawn} from far`);
  const squares = `${folder}: ${leaves.length} squares`;
  console.log(`${squares}, ${sum} triangles from near, ${far.tiles[0].triangles} from far`);
}

async function main() {
  const tileset = JSON.parse(fs.readFileSync(path.join(folder, 'tileset.json'), 'utf8'));
  const tiles = await checkPieces(tileset);
  const server = await serve();
  const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: ARGUMENTS });
  const page = await browser.newPage({ viewport: { width: 1300, height: 900 } });
  const own = `http://127.0.0.1:${server.address().port}/`;
  page.on('console', (message) => check(message.type() !== 'error', `console: ${message.text()}`));
  page.on('pageerror', (error) => problems.push(`page error: ${error.stack}`));
  page.on('request', (request) => {
    const isOwn = request.url().startsWith(own) || request.url().startsWith(`blob:${own}`);
    check(isOwn, `request: ${request.url()}`);
  });
  await page.goto(own);
  await page.waitForFunction(() => window.errorTarget, null, { timeout: 60000 });
  await checkViews(page, tiles);
  (await page.evaluate(() => window.failed)).forEach((failure) => problems.push(failure));
  await browser.close();
  server.close();
  problems.forEach((problem) => console.error(problem));
  console.log(`${passed} checks passed, ${problems.length} failed`);
  process.exitCode = problems.length ? 1 : 0;
}

main();
