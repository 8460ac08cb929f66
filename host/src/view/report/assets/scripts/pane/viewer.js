// The panes with their one camera, and everything that the toolbar changes. Draws only when something changed.

class Viewer {
  constructor(section, contents) {
    this.section = section;
    this.contents = contents;
    this.panes = [...section.querySelectorAll('.pane')].map((figure) => new Pane(figure));
    const floor_m = contents.way_m.length > 0 ? 0 : contents.bounds_m[0][2];
    this.camera = new Camera({ bounds_m: contents.bounds_m, inside: contents.inside, floor_m });
    const dark = matchMedia('(prefers-color-scheme: dark)');
    this.look = { coloring: 0, wireframe: false, cut: true, way: true, picked: -1, theme: dark.matches ? 'dark' : 'light' };
    dark.addEventListener('change', () => {
      this.look.theme = dark.matches ? 'dark' : 'light';
      this.changed();
    });
    this.panel = new Panel(contents, section.querySelector('#picked'));
    this.pace = new Pace();
    this.controls = new Controls(this, section.querySelector('#panes'));
    this.listen();
    new ResizeObserver(() => this.resized()).observe(section.querySelector('#panes'));
    // Long buildings are shown one below the other.
    section.querySelector('#panes').classList.toggle('rows', this.camera.shape() < 0.42);
    this.show(innerWidth < 720 ? 'model' : 'all');
    this.preset('outside');
  }

  listen() {
    const { section } = this;
    const on = (selector, event, act) => section.querySelectorAll(selector).forEach((element) => element.addEventListener(event, () => act(element)));
    on('[data-show]', 'click', (button) => this.show(button.dataset.show));
    on('[data-preset]', 'click', (button) => this.preset(button.dataset.preset));
    on('#wireframe, #cut, #way', 'change', (box) => this.set(box.id, box.checked));
    on('#coloring', 'change', (select) => this.set('coloring', Number(select.value)));
    const panes = section.querySelector('#panes');
    on('#full', 'click', () => (document.fullscreenElement ? document.exitFullscreen() : panes.requestFullscreen()));
    on('[data-key]', 'pointerdown', (button) => {
      this.controls.hold(`Key${button.dataset.key.toUpperCase()}`);
      this.changed();
    });
    for (const end of ['pointerup', 'pointerleave', 'pointercancel']) on('[data-key]', end, () => this.controls.releaseAll());
    document.querySelectorAll('#planes tr[data-polygon]').forEach((row) => row.addEventListener('click', () => {
      this.pick(Number(row.dataset.polygon));
      section.scrollIntoView({ block: 'nearest' });
    }));
    document.addEventListener('stand', ({ detail }) => {
      this.camera.stand(detail);
      this.changed();
    });
  }

  set(name, value) {
    this.look[name] = value;
    this.changed();
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

  /** One pane or all of them. */
  show(which) {
    if (which !== 'all' && !this.panes.some((pane) => pane.name === which)) return;
    const focused = this.panes.some((pane) => pane.canvas === document.activeElement);
    this.shown = which;
    for (const pane of this.panes) pane.figure.hidden = which !== 'all' && pane.name !== which;
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
    this.pick(pick(this.model, this.contents, this.camera, place, aspect, this.cuts()));
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
      pane.draw(this.camera, look);
    }
    const { camera } = this;
    this.section.querySelector('#pad').hidden = !camera.walking;
    for (const button of this.section.querySelectorAll('[data-preset]')) button.setAttribute('aria-pressed', button.dataset.preset === camera.preset);
    document.dispatchEvent(new CustomEvent('seen', { detail: { eye: camera.frame().eye, yaw: camera.yaw, still: !moving } }));
    if (moving) this.changed();
    else if (level > 0 && this.controls.pointers.size === 0) setTimeout(() => this.changed(), 260);
  }
}
