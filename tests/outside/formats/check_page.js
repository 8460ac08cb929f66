// Looks at a report.html in headless Chromium, as its reader sees it.
//   node check_page.js REPORT.html [SCREENSHOTS_FOLDER] [--most-bytes N] [--most-paint-ms N]
// Opens the file from disk and fails on any console error, any request, an empty picture, or anything that
// does not answer to mouse, touch, keys. With playwright-core on NODE_PATH, and Chromium.
const fs = require('fs');
const os = require('os');
const path = require('path');
const { chromium } = require('playwright-core');

const ARGUMENTS = [
  '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
  '--disable-background-networking', '--disable-component-update',
  '--disable-sync', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
];
const isOption = (word) => (word || '').startsWith('--');
const words = process.argv.slice(2).filter((word, i, all) => !isOption(word) && !isOption(all[i - 1]));
const limit = (name, otherwise) => {
  const at = process.argv.indexOf(`--${name}`);
  return at < 0 ? otherwise : Number(process.argv[at + 1]);
};
const [report, shots] = words;
const problems = [];
let passed = 0;
const check = (good, what) => {
  if (good) passed += 1;
  else problems.push(what);
};

/** A browser with a user's folder of its own, with the report open in it. */
async function open(options) {
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), 'biplane-page-'));
  const browser = { executablePath: '/usr/bin/chromium', headless: true, args: ARGUMENTS };
  const context = await chromium.launchPersistentContext(profile, { ...browser, ...options });
  const page = context.pages()[0] || await context.newPage();
  const url = `file://${path.resolve(report)}`;
  page.on('console', (message) => check(message.type() !== 'error', `console: ${message.text()}`));
  page.on('pageerror', (error) => problems.push(`page error: ${error.stack}`));
  const isOwn = (asked) => asked === url || asked.startsWith('data:');
  page.on('request', (request) => check(isOwn(request.url()), `request: ${request.url()}`));
  await page.goto(url);
  const close = async () => {
    await context.close();
    fs.rmSync(profile, { recursive: true, force: true });
  };
  return { page, close };
}

const shoot = (page, name) => (shots ? page.screenshot({ path: path.join(shots, name) }) : null);
const frame = (page) => page.evaluate(() => new Promise((done) => {
  requestAnimationFrame(() => requestAnimationFrame(done));
}));

// Quadric errors leave little of a corridor.
const LEAST_SHARE = { raw: 0.02, simple: 0.002, model: 0.02 };

/** Share of the pixels of each visible canvas that differ from its corner. */
async function pictures(page) {
  await frame(page);
  const found = {};
  for (const canvas of await page.locator('.pane canvas:visible').all()) {
    const name = await canvas.evaluate((element) => element.closest('.pane').dataset.mesh);
    const png = (await canvas.screenshot()).toString('base64');
    found[name] = await page.evaluate(async (base64) => {
      const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
      const flat = new OffscreenCanvas(image.width, image.height).getContext('2d');
      flat.drawImage(image, 0, 0);
      const pixels = flat.getImageData(0, 0, image.width, image.height).data;
      const last = pixels.length - 4;
      let other = 0;
      let sum = 0;
      for (let i = 0; i < pixels.length; i += 4) {
        const [red, green, blue] = [0, 1, 2].map((k) => Math.abs(pixels[i + k] - pixels[last + k]));
        other += red + green + blue > 24;
        sum = (sum * 31 + pixels[i] + 7 * pixels[i + 1] + 13 * pixels[i + 2]) % 1000000007;
      }
      return { share: other / (pixels.length / 4), sum };
    }, png);
  }
  return found;
}

async function loads(page) {
  await page.waitForSelector('#view[data-state]', { timeout: 120000, state: 'attached' });
  check(await page.locator('#view').getAttribute('data-state') === 'ready', 'the 3D view did not start');
  const first = 'first-contentful-paint';
  const paint = await page.evaluate((name) => performance.getEntriesByName(name)[0].startTime, first);
  const most = limit('most-paint-ms', 2000);
  check(paint < most, `first paint after ${paint} ms, ${most} allowed`);
  const bytes = fs.statSync(report).size;
  check(bytes < limit('most-bytes', 20e6), `${bytes} bytes`);
  const ready = await page.evaluate(() => performance.now());
  const times = `first paint ${paint.toFixed(0)} ms, everything after ${ready.toFixed(0)} ms`;
  console.log(`${report}: ${(bytes / 1e6).toFixed(2)} MB, ${times}`);
}

function checkFilled(panes, where) {
  for (const [name, { share }] of Object.entries(panes)) {
    check(share > LEAST_SHARE[name], `${name}${where} is empty: ${share}`);
  }
}

/** All meshes side by side; the simplification is unpacked only now. */
async function showsAll(page) {
  await page.click('[data-show="all"]');
  await page.waitForFunction(() => ![...document.querySelectorAll('.pane figcaption span')]
    .some((span) => span.textContent.startsWith('loading')), null, { timeout: 120000 });
}

async function beginsWithTheModel(page) {
  const first = await pictures(page);
  check(Object.keys(first).join() === 'model', `the first view: ${Object.keys(first)}`);
  checkFilled(first, ', the first view,');
  const [own, whole] = await page.locator('.pane[data-mesh="model"]')
    .evaluate((pane) => [pane.clientWidth, document.querySelector('main').clientWidth]);
  check(own > 0.8 * whole, `the model is ${own} of ${whole} pixels wide`);
}

/** Share of the pixels along the edge of the model's picture that show something. */
async function atTheEdge(page) {
  const png = await page.locator('.pane[data-mesh="model"] canvas').screenshot();
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
    const flat = new OffscreenCanvas(image.width, image.height).getContext('2d');
    flat.drawImage(image, 0, 0);
    let [other, count] = [0, 0];
    const [width, height] = [image.width, image.height];
    const { data } = flat.getImageData(0, 0, width, height);
    for (let y = 3; y < height - 3; y++) {
      for (let x = 3; x < width - 3; x++) {
        if (x > 5 && x < width - 6 && y > 5 && y < height - 6) continue;
        const [here, corner] = [4 * (y * width + x), 4 * (3 * width + 3)];
        other += [0, 1, 2].some((k) => Math.abs(data[here + k] - data[corner + k]) > 12);
        count += 1;
      }
    }
    return other / count;
  }, png.toString('base64'));
}

async function presetsHoldAll(page) {
  await page.click('[data-show="model"]');
  await page.click('#way');
  for (const preset of ['top', 'outside']) {
    await page.click(`[data-preset="${preset}"]`);
    await frame(page);
    const share = await atTheEdge(page);
    check(share < 0.01, `${preset} cuts the model off: ${share} of the edge`);
  }
  await page.click('#way');
}

async function compares(page) {
  await page.click('[data-show="compare"]');
  const canvas = page.locator('.pane[data-mesh="model"] canvas');
  const clip = () => page.locator('.pane[data-mesh="model"]')
    .evaluate((pane) => getComputedStyle(pane).clipPath);
  const raw = page.locator('.pane[data-mesh="raw"] canvas');
  check(await canvas.isVisible() && await raw.isVisible(), 'compare shows one mesh');
  check(await clip() === 'inset(0px 0px 0px 50%)', `the boundary begins at ${await clip()}`);
  await page.locator('#split').fill('20');
  check(await clip() === 'inset(0px 0px 0px 20%)', 'the slider between raw mesh and model does nothing');
  await shoot(page, 'compare.png');
  await page.locator('#split').fill('50');
  await page.click('[data-show="model"]');
}

async function cutsAndCeiling(page) {
  await page.click('[data-preset="inside"]');
  const whole = (await pictures(page)).model.sum;
  await page.click('#ceiling');
  check((await pictures(page)).model.sum !== whole, 'the ceiling stays');
  await page.click('#ceiling');
  await page.click('[data-preset="outside"]');
  const uncut = (await pictures(page)).model.sum;
  const slider = page.locator('#section');
  const [low, high] = await slider.evaluate((input) => [Number(input.min), Number(input.max)]);
  await slider.fill((Math.round(20 * (low + 0.4 * (high - low))) / 20).toFixed(2));
  check((await pictures(page)).model.sum !== uncut, 'the section cuts nothing');
  check(/^-?[\d.]+ m$/.test(await page.locator('#section-at').innerText()), 'the section has no height');
  await shoot(page, 'section.png');
  await slider.fill(String(high));
  check((await pictures(page)).model.sum === uncut, 'without a section something is missing');
}

/** Clicks until so many places of the model were hit. */
async function hitPlaces(page, wanted) {
  const box = await page.locator('.pane[data-mesh="model"] canvas').boundingBox();
  for (let place = 0; place < 150; place++) {
    const [across, down] = [0.1 + 0.055 * (place % 15), 0.2 + 0.06 * Math.floor(place / 15)];
    await page.mouse.click(box.x + box.width * across, box.y + box.height * down);
    await frame(page);
    if (await page.locator('#marks circle').count() >= wanted) return;
  }
}

async function measures(page) {
  await page.click('[data-show="model"]');
  await page.click('[data-preset="outside"]');
  await page.click('#measure');
  await hitPlaces(page, 2);
  const measured = page.locator('#measured');
  check(/^distance [\d.]+ m/.test(await measured.innerText()), `distance: ${await measured.innerText()}`);
  await hitPlaces(page, 4);
  check(/area [\d.]+ m²/.test(await measured.innerText()), `area: ${await measured.innerText()}`);
  await shoot(page, 'measured.png');
  await page.click('#measure');
  await frame(page);
  check(await measured.isHidden() && await page.locator('#marks circle').count() === 0, 'the measure stays');
}

/** In full screen all buttons are there, and the same one leads out. */
async function fillsTheScreen(page) {
  const whole = () => page.evaluate(() => {
    const [root, panes] = [document.fullscreenElement, document.querySelector('#panes')];
    const inside = ['#full', '#section'].every((id) => root?.contains(document.querySelector(id)));
    return { inside, share: panes.clientHeight / innerHeight };
  });
  await page.click('#full');
  await page.waitForFunction(() => document.fullscreenElement !== null);
  await frame(page);
  const { inside, share } = await whole();
  check(inside && share > 0.7, `full screen: buttons ${inside}, ${share} of its height is the view`);
  check(/^Leave/.test(await page.locator('#full').innerText()), 'nothing says how to leave full screen');
  await shoot(page, 'full-screen.png');
  await page.click('#full');
  await page.waitForFunction(() => document.fullscreenElement === null);
}

/** However small the screen is: a plan is as wide as its names need. */
async function wallNamesStandApart(page) {
  const size = page.viewportSize();
  for (const width of [size.width, 400]) {
    await page.setViewportSize({ width, height: size.height });
    const touching = await page.evaluate(() => [...document.querySelectorAll('.plan')].flatMap((plan) => {
      const names = [...plan.querySelectorAll('.wall')];
      const boxes = names.map((name) => name.getBoundingClientRect());
      const touch = (one, other) => one.left < other.right && other.left < one.right
        && one.top < other.bottom && other.top < one.bottom;
      const pairs = boxes.flatMap((box, number) => boxes.slice(0, number).map((other, before) => [
        touch(box, other), `${names[number].textContent} and ${names[before].textContent}`,
      ]));
      return pairs.filter(([is]) => is).map(([, both]) => both);
    }));
    check(touching.length === 0, `names of walls touch at ${width} pixels: ${touching}`);
  }
  await page.setViewportSize(size);
}

/** Of several storeys one can be looked at; walls have their names on the plan when that is wanted. */
async function namesStoreysAndWalls(page) {
  const storey = page.locator('#storey');
  if (await storey.isVisible()) {
    const all = (await pictures(page)).model.sum;
    await storey.selectOption('0');
    check((await pictures(page)).model.sum !== all, 'the lowest storey alone looks like all');
    await shoot(page, 'storey.png');
    await page.click('[data-preset="inside"]');
    const below = (await pictures(page)).model.sum;
    await storey.selectOption('1');
    check((await pictures(page)).model.sum !== below, 'one walks on one storey only');
    await shoot(page, 'storey-inside.png');
    await storey.selectOption('');
    await page.click('[data-preset="outside"]');
  }
  const name = page.locator('.plan .wall').first();
  if (await name.count() === 0) return;
  check(await name.isHidden(), 'names of walls are there without being asked for');
  await page.check('#wall-names');
  check(await name.isVisible(), 'names of walls stay away');
  await wallNamesStandApart(page);
  if (shots) await page.locator('#rooms').screenshot({ path: path.join(shots, 'walls.png') });
  await page.uncheck('#wall-names');
}

async function offersThemes(page) {
  const paper = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const light = await paper();
  await page.click('#dark');
  check(await paper() !== light, 'Dark does nothing');
  await shoot(page, 'dark.png');
  await page.click('#dark');
  check(await paper() === light, 'Dark cannot be left');
}

async function offersFiles(page) {
  const folder = path.dirname(path.resolve(report));
  const found = page.locator('#downloads a');
  const links = await found.evaluateAll((all) => all.map((link) => link.getAttribute('href')));
  const isBuild = fs.existsSync(path.join(folder, 'model.json'));
  check(links.length > 0 || !isBuild, 'no links to the files');
  for (const link of links) check(fs.existsSync(path.join(folder, link)) || !isBuild, `${link} is not there`);
}

/** Nothing is wider than its place, at widths of a screen and of a phone. */
async function fitsAt(width) {
  const { page, close } = await open({ viewport: { width, height: 850 } });
  await page.waitForSelector('#view[data-state="ready"]', { timeout: 120000 });
  const wide = await page.evaluate(() => [document.documentElement, ...document.querySelectorAll('.scroll')]
    .filter((element) => element.scrollWidth > element.clientWidth + 1)
    .map((element) => `${element.tagName} ${element.scrollWidth} > ${element.clientWidth}`));
  check(wide.length === 0, `at ${width} pixels: ${wide}`);
  await presetsHoldAll(page);
  await frame(page);
  if (shots) await page.screenshot({ path: path.join(shots, `whole-${width}.png`), fullPage: true });
  await close();
}

async function switchesViews(page) {
  await showsAll(page);
  const all = await pictures(page);
  check(Object.keys(all).length === 3, `panes: ${Object.keys(all)}`);
  checkFilled(all, '');
  let last = all.model.sum;
  for (const preset of ['inside', 'top', 'outside']) {
    await page.click(`[data-preset="${preset}"]`);
    const now = await pictures(page);
    checkFilled(now, ` from ${preset}`);
    check(now.model.sum !== last, `${preset} shows nothing else`);
    last = now.model.sum;
    await shoot(page, `${preset}.png`);
  }
  for (const name of ['raw', 'simple', 'model']) {
    await page.click(`[data-show="${name}"]`);
    const now = await pictures(page);
    const isAlone = Object.keys(now).join() === name && now[name].share > LEAST_SHARE[name];
    check(isAlone, `only ${name}: ${JSON.stringify(now)}`);
  }
  for (const [change, what] of [['#wireframe', 'wireframe'], ['#cut', 'look into rooms']]) {
    const before = (await pictures(page)).model.sum;
    await page.click(change);
    check((await pictures(page)).model.sum !== before, `${what} changes nothing`);
    await page.click(change);
  }
  const colors = new Set();
  for (const value of ['2', '1', '0']) {
    await page.selectOption('#coloring', value);
    colors.add((await pictures(page)).model.sum);
  }
  check(colors.size === 3, 'colors change nothing');
}

async function picks(page) {
  await page.click('[data-preset="outside"]');
  const canvas = page.locator('.pane[data-mesh="model"] canvas');
  const box = await canvas.boundingBox();
  // All over the picture until a surface is hit.
  for (let place = 0; place < 120; place++) {
    const across = 0.1 + 0.07 * (place % 12);
    const down = 0.5 + 0.04 * Math.ceil(place / 24) * (place % 24 < 12 ? 1 : -1);
    await page.mouse.click(box.x + box.width * across, box.y + box.height * down);
    if (/area/.test(await page.locator('#picked').textContent())) break;
  }
  const text = await page.locator('#picked').innerText();
  const told = [/area\s+[\d.]+ m²/, /RMS\s+[\d.]+ cm/, /openings\s+\d+/, /normal/];
  check(told.every((pattern) => pattern.test(text)), `picked: ${text}`);
  await shoot(page, 'picked.png');
  await canvas.focus();
  await page.keyboard.press('Escape');
  check(await page.locator('#picked').isHidden(), 'Escape does not put the surface down');
  await page.keyboard.press('n');
  const largest = await page.locator('#planes tbody tr').first().locator('td').nth(1).innerText();
  const picked = await page.locator('#picked').innerText();
  check(picked.includes(`${largest} m²`), `N does not pick the largest surface, ${largest} m²`);
  const name = await page.locator('#planes tbody tr button').first().textContent();
  const heading = await page.locator('#picked h3').textContent();
  check(name === heading && /plane \d+/.test(picked), `${name} is picked as ${heading}: ${picked}`);
  await page.keyboard.press('Escape');
  await page.locator('#planes tbody tr button').first().click();
  check(await page.locator('#picked').isVisible(), 'a name in the list picks nothing');
  await page.keyboard.press('Escape');
  check(await page.locator('#picked').isHidden(), 'Escape does nothing once a name was clicked');
  await picksRound(page);
}

/** Of a model with round things: one of them by its row. */
async function picksRound(page) {
  const row = page.locator('#rounds tbody tr').first();
  if (await row.count() === 0) return;
  const before = (await pictures(page)).model.sum;
  await row.locator('button').click();
  const text = await page.locator('#picked').innerText();
  const axis = /axis\s+-?[\d.]+, -?[\d.]+, -?[\d.]+/;
  const told = [/radius\s+[\d.]+ cm/, axis, /length\s+[\d.]+ m/, /arc\s+\d+°/];
  check(told.every((pattern) => pattern.test(text)), `picked round thing: ${text}`);
  const name = await row.locator('button').textContent();
  const heading = await page.locator('#picked h3').textContent();
  check(name === heading, `${name} is picked as ${heading}`);
  check((await pictures(page)).model.sum !== before, 'a round thing that is picked is not shown');
  await page.keyboard.press('Escape');
}

/** What a picture's pixels sum to once it stands still: a slow machine draws what moved again, whole. */
async function atRest(sum) {
  for (let last = await sum(), tries = 0; tries < 40; tries++) {
    await new Promise((done) => { setTimeout(done, 400); });
    const now = await sum();
    if (now === last) return now;
    last = now;
  }
  throw new Error('the picture never stands still');
}

async function answersToMouseAndKeys(page) {
  const canvas = page.locator('.pane[data-mesh="model"] canvas');
  const sum = () => atRest(async () => (await pictures(page)).model.sum);
  const box = await canvas.boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const before = await sum();
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 80, y + 10, { steps: 4 });
  await page.mouse.up();
  const turned = await sum();
  check(turned !== before, 'dragging does not orbit');
  await canvas.focus();
  await page.mouse.wheel(0, -300);
  check(await sum() !== turned, 'the wheel does not zoom');
  await page.keyboard.press('i');
  const stood = await sum();
  await page.keyboard.press('w');
  const stepped = await sum();
  check(stepped !== stood, 'a tap on W does not walk');
  await page.keyboard.down('w');
  await page.waitForTimeout(600);
  await page.keyboard.up('w');
  check(await sum() !== stepped, 'W does not walk');
  await page.keyboard.press('r');
  await frame(page);
  check(await page.locator('[data-preset="outside"][aria-pressed="true"]').count() === 1, 'R does not reset');
  if (await page.locator('#map').count()) await mapAnswers(page);
}

async function mapAnswers(page) {
  await page.locator('#map').scrollIntoViewIfNeeded();
  const whole = await page.locator('#map').getAttribute('viewBox');
  await page.click('#map-in');
  check(await page.locator('#map').getAttribute('viewBox') !== whole, 'the map does not zoom');
  await page.click('#map-all');
  check(await page.locator('#map').getAttribute('viewBox') === whole, 'the map does not come back');
  const arrow = await page.locator('#here').getAttribute('transform');
  await page.locator('#map').click();
  await frame(page);
  const moved = await page.locator('#here').getAttribute('transform');
  check(moved !== arrow, 'a click on the map does not move the camera');
  // Wherever the cells are turned to, one stands where one clicked.
  const [sheet, here] = [await page.locator('#map').boundingBox(), await page.locator('#here').boundingBox()];
  const apart = ['x', 'y'].map((axis, side) => {
    const middle = (box) => box[axis] + [box.width, box.height][side] / 2;
    return middle(sheet) - middle(here);
  });
  const isThere = Math.hypot(...apart) < 0.04 * sheet.width;
  check(isThere, `a click on the map moves the camera ${apart} pixels away from there`);
  const view = await page.locator('#panes').boundingBox();
  const isSeen = view.y >= -1 && view.y + view.height <= page.viewportSize().height + 1;
  check(isSeen, `a click on the map leaves the 3D view out of sight, at ${view.y} pixels`);
}

/** Frames while the view turns, by held keys: the middle of the times between them, milliseconds. */
async function frameTime(page) {
  await page.click('[data-show="raw"]');
  await page.click('[data-preset="outside"]');
  await page.locator('.pane[data-mesh="raw"] canvas').focus();
  await page.keyboard.down('ArrowLeft');
  const times = await page.evaluate(() => new Promise((done) => {
    const between = [];
    let last = performance.now();
    const start = last;
    const next = (now) => {
      between.push(now - last);
      last = now;
      if (now - start < 3000) requestAnimationFrame(next);
      else done(between);
    };
    requestAnimationFrame(next);
  }));
  await page.keyboard.up('ArrowLeft');
  times.sort((a, b) => a - b);
  const caption = await page.locator('.pane[data-mesh="raw"] figcaption').innerText();
  const middle = times[times.length >> 1].toFixed(0);
  const frames = `${times.length} frames in 3 s (software rendering)`;
  console.log(`${caption}: ${middle} ms a frame while turning, ${frames}`);
}

async function onAPhone() {
  const viewport = { width: 390, height: 800 };
  const phone = { viewport, hasTouch: true, isMobile: true, deviceScaleFactor: 2, colorScheme: 'dark' };
  const { page, close } = await open(phone);
  await page.waitForSelector('#view[data-state="ready"]', { timeout: 120000 });
  const fits = await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);
  check(fits, 'a phone would scroll sideways');
  const canvas = page.locator('.pane canvas:visible').first();
  await canvas.scrollIntoViewIfNeeded();
  const box = await canvas.boundingBox();
  const client = await page.context().newCDPSession(page);
  const touch = (type, ...places) => {
    const touchPoints = places.map(([left, top], id) => ({ x: left, y: top, id }));
    return client.send('Input.dispatchTouchEvent', { type, touchPoints });
  };
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const sum = () => atRest(async () => Object.values(await pictures(page))[0].sum);
  const before = await sum();
  await touch('touchStart', [x, y]);
  for (let step = 1; step < 6; step++) await touch('touchMove', [x + 15 * step, y]);
  await touch('touchEnd');
  const turned = await sum();
  check(turned !== before, 'one finger does not orbit');
  await touch('touchStart', [x - 30, y], [x + 30, y]);
  for (let step = 1; step < 6; step++) {
    await touch('touchMove', [x - 30 - 10 * step, y], [x + 30 + 10 * step, y]);
  }
  await touch('touchEnd');
  check(await sum() !== turned, 'two fingers do not zoom');
  await shoot(page, 'phone.png');
  await close();
}

const showsPictures = (page) => page.locator('#pictures img').first().isVisible();

async function onPaper(page) {
  await page.click('[data-show="all"]');
  await page.click('[data-preset="outside"]');
  const before = (await pictures(page)).model.sum;
  await page.emulateMedia({ media: 'print' });
  await frame(page);
  check(await showsPictures(page) && await page.locator('#panes').isHidden(), 'no pictures on paper');
  await page.emulateMedia({ media: 'screen' });
  await page.waitForTimeout(500);
  check((await pictures(page)).model.sum === before, 'printing changes the view');
}

/** A slow computer draws again and again while it is still loading: pauses of the page's are long here, with
 * a frame asked for in them: in the first dozen, then in every eighth, because a large model has hundreds. */
async function whileItLoads() {
  const { page, close } = await open({ viewport: { width: 1200, height: 800 } });
  await page.addInitScript(() => {
    const later = window.setTimeout.bind(window);
    window.drawn = 0;
    let pauses = 0;
    window.setTimeout = (act, ms) => {
      pauses += ms ? 0 : 1;
      if (ms || (pauses > 12 && pauses % 8)) return later(act, ms);
      document.querySelector('#wireframe').dispatchEvent(new Event('change'));
      return requestAnimationFrame(() => requestAnimationFrame(() => { window.drawn += 1; act(); }));
    };
  });
  await page.reload();
  await page.waitForSelector('#view[data-state="ready"]', { timeout: 120000 });
  check(await page.evaluate(() => window.drawn) > 5, 'nothing was drawn while the page loaded');
  checkFilled(await pictures(page), ', loaded slowly,');
  await close();
}

async function withoutWebGL() {
  const { page, close } = await open({ viewport: { width: 1200, height: 800 } });
  await page.addInitScript(() => { HTMLCanvasElement.prototype.getContext = () => null; });
  await page.reload();
  await page.waitForSelector('#view[data-state="pictures"]');
  const isTold = await page.locator('#no-webgl').isVisible();
  check(isTold && await showsPictures(page), 'no pictures without WebGL2');
  check(await page.locator('#panes').isHidden(), 'empty panes without WebGL2');
  await close();
}

(async () => {
  if (shots) fs.mkdirSync(shots, { recursive: true });
  const { page, close } = await open({ viewport: { width: 1400, height: 900 } });
  await loads(page);
  await shoot(page, 'all.png');
  await beginsWithTheModel(page);
  await switchesViews(page);
  await compares(page);
  await cutsAndCeiling(page);
  await measures(page);
  await fillsTheScreen(page);
  await namesStoreysAndWalls(page);
  await offersThemes(page);
  await offersFiles(page);
  await picks(page);
  await answersToMouseAndKeys(page);
  await frameTime(page);
  await onPaper(page);
  await close();
  await fitsAt(1300);
  await fitsAt(400);
  await onAPhone();
  await whileItLoads();
  await withoutWebGL();
  problems.forEach((problem) => console.error(`FAILED: ${problem}`));
  console.log(`${passed} checks passed, ${problems.length} failed`);
  process.exit(problems.length > 0 ? 1 : 0);
})().catch((error) => {
  console.error(error);
  process.exit(1);
});
