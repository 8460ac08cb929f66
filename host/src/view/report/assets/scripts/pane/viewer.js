// The panes with their one camera, and everything that the toolbar changes. Draws only when something changed.

// Surfaces that face down are a ceiling from this height above the floor.
const CEILING_FROM_M = 1.6;

// A storey is cut off so far under the floor of the next one.
const UNDER_FLOOR_M = 0.1;
// Drives that begin so far above each other are on two storeys.
const STOREY_M = 2;

/** Heights of the floors on which was driven, from below; of a model without a way its lowest place. */
function floorsOf({ way_m, bounds_m }) {
  const heights_m = way_m.map(([[, , height_m]]) => height_m).sort((a, b) => a - b);
  const floors_m = heights_m.filter((height_m, at) => at === 0 || height_m - heights_m[at - 1] > STOREY_M);
  return floors_m.length > 0 ? floors_m : [bounds_m[0][2]];
}

/** Where one walks first on a floor: as in the picture from inside, on others in the middle of the way there. */
function startOn({ way_m, inside }, floor_m) {
  const drive = way_m.find(([[, , height_m]]) => Math.abs(height_m - floor_m) < STOREY_M);
  if (!drive || drive === way_m[0] || drive.length < 2) return inside;
  const at = Math.floor((drive.length - 1) / 2);
  return [drive[at], sub(drive[at + 1], drive[at])];
}

class Viewer {
  constructor(section, contents) {
    this.section = section;
    this.contents = contents;
    this.panes = [...section.querySelectorAll('.pane')].map((figure) => new Pane(figure));
    const floors_m = floorsOf(contents);
    const [floor_m] = floors_m;
    this.camera = new Camera({ bounds_m: contents.bounds_m, inside: contents.inside, turned: contents.turned_rad, floor_m });
    this.look = { coloring: 0, wireframe: false, cut: true, way: true, picked: -1, ceiling: true, section_m: FAR_M, ceiling_from_m: floor_m + CEILING_FROM_M, inferred: true, inferred_from: contents.polygons.length + contents.rounds.length };
    this.hideAbsent();
    this.startTheme(matchMedia('(prefers-color-scheme: dark)'));
    this.startSection(section.querySelector('#section'));
    this.startStoreys(section.querySelector('#storey'), floors_m);
    this.panel = new Panel(contents, section.querySelector('#picked'));
    this.pace = new Pace();
    this.measure = new Measure(section.querySelector('#panes'));
    this.controls = new Controls(this, section.querySelector('#panes'));
    this.listen();
    new ResizeObserver(() => this.resized()).observe(section.querySelector('#panes'));
    // Long buildings are shown one below the other.
    section.querySelector('#panes').classList.toggle('rows', this.camera.shape() < 0.42);
    this.set('coloring', 0);
    this.show('model');
    this.preset('outside');
  }

  /** What the model has not is neither in the legend nor among the boxes. */
  hideAbsent() {
    const { section, contents } = this;
    const has = { inferred: contents.inferred.length > 0, path: contents.way_m.length > 0 };
    for (const kind of ['floor', 'ceiling', 'wall']) has[`${kind}s`] = contents.planes.some((plane) => plane.kind === kind);
    for (const [kind, isThere] of Object.entries(has)) section.querySelectorAll(`.legend .${kind}`).forEach((mark) => { mark.parentElement.hidden = !isThere; });
    section.querySelector('#inferred').parentElement.hidden = !has.inferred;
    section.querySelector('#way-too').hidden = !has.path;
  }

  /** The system's theme, until the reader chooses one. */
  startTheme(system) {
    const root = document.documentElement;
    const button = this.section.querySelector('#dark');
    const apply = () => {
      this.look.theme = root.dataset.theme || (system.matches ? 'dark' : 'light');
      button.setAttribute('aria-pressed', this.look.theme === 'dark');
      this.changed();
    };
    system.addEventListener('change', apply);
    button.addEventListener('click', () => {
      root.dataset.theme = this.look.theme === 'dark' ? 'light' : 'dark';
      apply();
    });
    apply();
  }

  /** The height above which nothing is drawn; at its end nothing is cut. */
  startSection(slider) {
    const [low, high] = this.contents.bounds_m.map((corner) => corner[2]);
    slider.min = (Math.ceil(20 * low) / 20 + 0.1).toFixed(2);
    slider.max = (Math.ceil(20 * high) / 20 + 0.1).toFixed(2);
    slider.value = slider.max;
    slider.addEventListener('input', () => {
      const isOff = Number(slider.value) >= Number(slider.max) - 0.01;
      this.section.querySelector('#section-at').textContent = isOff ? 'no cut' : `${(Number(slider.value) - this.camera.floor_m).toFixed(2)} m`;
      this.set('section_m', isOff ? FAR_M : Number(slider.value));
    });
  }

  /** Of several storeys one can be chosen: what lies over it is cut off, and one walks on its floor. */
  startStoreys(select, floors_m) {
    select.parentElement.hidden = floors_m.length < 2;
    floors_m.forEach((floor_m, place) => select.add(new Option(`S${place + 1}: floor at ${floor_m.toFixed(2)} m`, place)));
    select.addEventListener('change', () => {
      const place = select.value === '' ? 0 : Number(select.value);
      const walks = this.camera.walking;
      this.camera.floor_m = floors_m[place];
      this.camera.start = startOn(this.contents, floors_m[place]);
      this.look.ceiling_from_m = floors_m[place] + CEILING_FROM_M;
      const slider = this.section.querySelector('#section');
      const above_m = select.value === '' ? undefined : floors_m[place + 1];
      slider.value = above_m === undefined ? slider.max : above_m - UNDER_FLOOR_M;
      slider.dispatchEvent(new Event('input'));
      if (walks) this.preset('inside');
    });
  }

  listen() {
    const { section } = this;
    const on = (selector, event, act) => section.querySelectorAll(selector).forEach((element) => element.addEventListener(event, () => act(element)));
    on('[data-show]', 'click', (button) => this.show(button.dataset.show));
    on('[data-preset]', 'click', (button) => this.preset(button.dataset.preset));
    on('#wireframe, #cut, #way, #inferred', 'change', (box) => this.set(box.id, box.checked));
    on('#coloring', 'change', (select) => this.set('coloring', Number(select.value)));
    on('#ceiling', 'click', () => this.press('ceiling'));
    on('#measure', 'click', () => this.startMeasuring());
    const panes = section.querySelector('#panes');
    on('#split', 'input', (slider) => panes.style.setProperty('--split', `${slider.value}%`));
    on('#full', 'click', () => (document.fullscreenElement ? document.exitFullscreen() : section.requestFullscreen()));
    document.addEventListener('fullscreenchange', () => {
      section.querySelector('#full').textContent = document.fullscreenElement ? 'Leave full screen' : 'Full screen';
    });
    on('[data-key]', 'pointerdown', (button) => {
      this.controls.hold(`Key${button.dataset.key.toUpperCase()}`);
      this.changed();
    });
    for (const end of ['pointerup', 'pointerleave', 'pointercancel']) on('[data-key]', end, () => this.controls.releaseAll());
    document.querySelectorAll('.surfaces tr[data-surface]').forEach((row) => row.addEventListener('click', () => {
      this.pick(Number(row.dataset.surface));
      section.scrollIntoView({ block: 'nearest' });
    }));
    // The name that was clicked in a list keeps the focus, and answers to the keys of picking.
    document.querySelectorAll('.surfaces').forEach((list) => list.addEventListener('keydown', (event) => {
      if (/^(n|p|escape)$/i.test(event.key)) this.controls.act(event);
    }));
    document.addEventListener('stand', ({ detail }) => {
      this.camera.stand(detail);
      this.changed();
      panes.scrollIntoView({ block: 'nearest' });
    });
  }

  set(name, value) {
    this.look[name] = value;
    if (name === 'coloring') this.section.dataset.coloring = value;
    this.changed();
  }

  /** A button that stays pressed. */
  press(name) {
    this.set(name, !this.look[name]);
    this.section.querySelector(`#${name}`).setAttribute('aria-pressed', this.look[name]);
  }

  startMeasuring() {
    this.measure.toggle();
    this.section.querySelector('#measure').setAttribute('aria-pressed', this.measure.active);
    this.pick(null);
  }

  toggle(name) {
    const box = this.section.querySelector(`#${name}`);
    box.checked = !box.checked;
    this.set(name, box.checked);
  }

  nextColoring() {
    const select = this.section.querySelector('#coloring');
    select.value = (Number(select.value) + 1) % 3;
    this.set('coloring', Number(select.value));
  }

  /** One pane, all of them, or `compare`: the model over the raw mesh. */
  show(which) {
    if (!['all', 'compare'].includes(which) && !this.panes.some((pane) => pane.name === which)) return;
    const isShown = { all: () => true, compare: ({ name }) => name === 'raw' || name === 'model' }[which] || (({ name }) => name === which);
    const focused = this.panes.some((pane) => pane.canvas === document.activeElement);
    this.shown = which;
    for (const pane of this.panes) pane.figure.hidden = !isShown(pane);
    document.dispatchEvent(new CustomEvent('shown', { detail: this.panes.filter(isShown).map(({ name }) => name) }));
    for (const button of this.section.querySelectorAll('[data-show]')) button.setAttribute('aria-pressed', button.dataset.show === which);
    const first = this.panes.find((pane) => !pane.figure.hidden);
    if (focused) first.canvas.focus();
    this.section.querySelector('#panes').dataset.shown = which;
    this.resized();
  }

  resized() {
    const { camera } = this;
    const pane = this.panes.find((each) => !each.figure.hidden);
    const { clientWidth, clientHeight } = pane.canvas;
    // On paper there are pictures instead.
    if (clientWidth * clientHeight === 0) return;
    camera.aspect = clientWidth / clientHeight;
    // Who has not moved yet sees all of it in the new shape too.
    if (camera.preset === 'outside' || camera.preset === 'top') camera[camera.preset]();
    this.changed();
  }

  preset(name) {
    this.camera[name]();
    this.changed();
  }

  reset() {
    this.pick(null);
    this.preset('outside');
  }

  pickAt(place, aspect) {
    if (!this.model) return;
    const { surface, point } = pick(this.model, this.contents, this.camera, place, aspect, { ...this.look, cut: this.cuts() });
    if (!this.measure.active) return this.pick(surface);
    if (point) this.measure.add(point);
    else this.measure.miss();
    this.changed();
  }

  /** Puts down what is picked and measured. */
  clear() {
    this.measure.clear();
    this.pick(null);
  }

  pick(index) {
    this.look.picked = index ?? -1;
    this.panel.show(index);
    this.changed();
  }

  /** The next surface by area. */
  pickNext(step) {
    const { polygons } = this.contents;
    this.byArea ||= polygons.map((_, index) => index).sort((a, b) => polygons[b].area_m2 - polygons[a].area_m2);
    const { byArea } = this;
    const at = byArea.indexOf(this.look.picked);
    if (byArea.length > 0) this.pick(byArea[(at + (at < 0 && step < 0 ? 0 : step) + byArea.length) % byArea.length]);
  }

  /** Little of what others simplify faces up: from above it is drawn from both sides, without its ceiling. */
  bothSides(look) {
    return { ...look, cut: false, ceiling: false };
  }

  /** Whether surfaces that turn their back are left out: never for someone who walks. */
  cuts() {
    return this.look.cut && !this.camera.walking;
  }

  changed() {
    if (this.asked) return;
    this.asked = true;
    const asked_at = performance.now();
    requestAnimationFrame((now) => this.frame(now, performance.now() - asked_at));
  }

  /** `waited_ms` since it was asked for: a frame waits for the ones before. */
  frame(now, waited_ms) {
    this.asked = false;
    const seconds = Math.min((now - (this.last ?? now)) / 1000, 0.1);
    const moving = this.controls.step(seconds);
    this.last = moving ? now : null;
    const level = this.pace.of(moving || this.controls.pointers.size > 0, now, waited_ms);
    const look = { ...this.look, cut: this.cuts(), level };
    for (const pane of this.panes) {
      if (pane.figure.hidden) continue;
      pane.fit(level);
      pane.draw(this.camera, pane.name === 'simple' && this.camera.preset === 'top' ? this.bothSides(look) : look);
    }
    const { camera } = this;
    const measured = this.panes.find(({ name, figure }) => name === 'model' && !figure.hidden) || this.panes.find(({ figure }) => !figure.hidden);
    this.measure.draw(camera, measured.canvas);
    for (const id of ['pad', 'walk-hint']) this.section.querySelector(`#${id}`).hidden = !camera.walking;
    for (const button of this.section.querySelectorAll('[data-preset]')) button.setAttribute('aria-pressed', button.dataset.preset === camera.preset);
    document.dispatchEvent(new CustomEvent('seen', { detail: { eye: camera.frame().eye, yaw: camera.yaw, still: !moving } }));
    if (moving) this.changed();
    else if (level > 0 && this.controls.pointers.size === 0) setTimeout(() => this.changed(), 260);
  }
}
