// Mouse, touch and keys on the panes, as calls of the viewer.

const CLICK_PIXELS = 5;
const WALK_M_S = 1.4;
const TURN_RAD_S = 1.2;
// What a key does that is let go before a picture came that could show it held.
const TAP_S = 0.1;

class Controls {
  constructor(viewer, container) {
    this.viewer = viewer;
    this.pointers = new Map();
    this.held = new Set();
    // Those of the held keys that have done nothing yet.
    this.fresh = new Set();
    for (const pane of viewer.panes) this.listen(pane.canvas);
    container.addEventListener('keydown', (event) => this.keyDown(event));
    container.addEventListener('keyup', (event) => this.release(event.code));
    container.addEventListener('focusout', () => this.releaseAll());
    addEventListener('blur', () => this.releaseAll());
  }

  listen(canvas) {
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (event) => this.up(event));
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
  }

  down(event) {
    const { target, pointerId, clientX: x, clientY: y } = event;
    target.setPointerCapture(pointerId);
    if (this.pointers.size === 0) this.press = { x, y, still: true, button: event.button };
    else this.press.still = false;
    this.pointers.set(pointerId, { x, y });
  }

  move(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const { camera } = this.viewer;
    const [x, y] = [event.clientX - last.x, event.clientY - last.y];
    const height = event.target.clientHeight;
    if (Math.hypot(event.clientX - this.press.x, event.clientY - this.press.y) > CLICK_PIXELS) this.press.still = false;
    if (this.pointers.size > 1) this.pinch(event, [x, y], height);
    else if (this.press.still) return;
    else if (this.press.button === 2 || this.press.button === 1 || event.shiftKey) camera.pan(x, y, height);
    else if (camera.walking) camera.turn(-x * 2.4 / height, y * 1.6 / height);
    else camera.turn(x * 4 / height, -y * 3 / height);
    Object.assign(last, { x: event.clientX, y: event.clientY });
    this.viewer.changed();
  }

  /** Each of two fingers moves by half; the distance between them zooms. */
  pinch(event, [x, y], height) {
    const { camera } = this.viewer;
    const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
    const last = this.pointers.get(event.pointerId);
    const apart = (place) => Math.hypot(place.x - other.x, place.y - other.y) || 1;
    camera.zoom(apart({ x: event.clientX, y: event.clientY }) / apart(last));
    camera.pan(x / 2, y / 2, height);
  }

  up(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    this.viewer.changed();
    if (event.type === 'pointerup' && this.pointers.size === 0 && this.press.still && this.press.button === 0) {
      const box = event.target.getBoundingClientRect();
      const place = [2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height];
      this.viewer.pickAt(place, box.width / box.height);
    }
  }

  /** A page that scrolls must not stop at the view: the wheel zooms when the view has the focus. */
  wheel(event) {
    if (document.activeElement !== event.target && !document.fullscreenElement) return;
    event.preventDefault();
    const pixels = event.deltaY * (event.deltaMode === 1 ? 30 : 1);
    this.viewer.pace.nudge(performance.now());
    this.viewer.camera.zoom(Math.exp(-clamp(pixels, -200, 200) * 0.002));
    this.viewer.changed();
  }

  keyDown(event) {
    if (event.target.tagName === 'CANVAS') this.act(event);
  }

  act(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { viewer } = this;
    const act = {
      o: () => viewer.preset('outside'), i: () => viewer.preset('inside'), t: () => viewer.preset('top'), r: () => viewer.reset(),
      n: () => viewer.pickNext(1), p: () => viewer.pickNext(-1), escape: () => viewer.clear(),
      c: () => viewer.nextColoring(), x: () => viewer.toggle('wireframe'), l: () => viewer.press('ceiling'), m: () => viewer.startMeasuring(),
      '+': () => viewer.camera.zoom(1.15), '=': () => viewer.camera.zoom(1.15), '-': () => viewer.camera.zoom(1 / 1.15),
      1: () => viewer.show('all'), 2: () => viewer.show('raw'), 3: () => viewer.show('simple'), 4: () => viewer.show('model'), 5: () => viewer.show('compare'),
    }[event.key.toLowerCase()];
    if (act) act();
    else if (/^(Key[WASDQE]|Arrow.*)$/.test(event.code)) this.hold(event.code);
    else if (!event.key.startsWith('Shift')) return;
    this.fast = event.shiftKey;
    event.preventDefault();
    viewer.changed();
  }

  hold(code) {
    if (/^Key[WASD]/.test(code) && !this.viewer.camera.walking) this.viewer.preset('inside');
    if (!this.held.has(code)) this.fresh.add(code);
    this.held.add(code);
  }

  /** A tap moves too, however slowly pictures come. */
  release(code) {
    if (!this.held.has(code)) return;
    if (this.fresh.has(code)) this.step(TAP_S);
    this.held.delete(code);
    this.viewer.changed();
  }

  releaseAll() {
    for (const code of [...this.held]) this.release(code);
  }

  /** What held keys do in so many seconds; true while any is held. */
  step(seconds) {
    if (this.held.size === 0) return false;
    if (seconds > 0) this.fresh.clear();
    const { camera } = this.viewer;
    const sign = (plus, minus) => this.held.has(plus) - this.held.has(minus);
    const meters = WALK_M_S * seconds * (this.fast ? 3 : 1);
    const turn = TURN_RAD_S * seconds;
    if (camera.walking) {
      const ahead = clamp(sign('KeyW', 'KeyS') + sign('ArrowUp', 'ArrowDown'), -1, 1);
      camera.walk(ahead * meters, sign('KeyD', 'KeyA') * meters);
      camera.turn((sign('KeyE', 'KeyQ') + sign('ArrowRight', 'ArrowLeft')) * turn, 0);
    } else {
      camera.turn((sign('KeyE', 'KeyQ') + sign('ArrowRight', 'ArrowLeft')) * turn, sign('ArrowUp', 'ArrowDown') * -turn);
    }
    return true;
  }
}
