// Distances and areas between places that were clicked on the model. Meters, frame map.

class Measure {
  constructor(panes) {
    this.panes = panes;
    this.marks = panes.querySelector('#marks');
    this.words = panes.querySelector('#measured');
    this.points = [];
    this.active = false;
  }

  toggle() {
    this.active = !this.active;
    this.panes.classList.toggle('measuring', this.active);
    this.clear();
  }

  clear() {
    this.points = [];
    this.say();
  }

  add(point) {
    this.points.push(point);
    this.say();
  }

  /** A click beside the model. */
  miss() {
    this.say('Nothing is there. ');
  }

  say(before = '') {
    const { words, points } = this;
    words.hidden = !this.active;
    words.textContent = before + (points.length < 2 ? 'Click two places on the model for their distance, three or more for an area.' : this.figures());
  }

  figures() {
    const { points } = this;
    const [from, to] = points.slice(-2);
    const [x, y, up] = sub(to, from);
    const steps = points.slice(1).map((point, index) => Math.hypot(...sub(point, points[index])));
    const last = `distance ${steps.at(-1).toFixed(2)} m (level ${Math.hypot(x, y).toFixed(2)}, up ${up.toFixed(2)})`;
    if (points.length === 2) return last;
    const length = steps.reduce((sum, step) => sum + step, 0);
    return `${last}; length ${length.toFixed(2)} m; area ${area(points).toFixed(2)} m²`;
  }

  /** The marks over the picture of a canvas, as its camera sees them. */
  draw(camera, canvas) {
    const { marks, points } = this;
    const [own, frame] = [canvas.getBoundingClientRect(), this.panes.getBoundingClientRect()];
    const { matrix } = camera.clip(own.width / own.height);
    const seen = points.map((point) => onScreen(matrix, point)).filter((place) => place).map(([x, y]) => [
      own.left - frame.left + own.width * (0.5 + x / 2), own.top - frame.top + own.height * (0.5 - y / 2),
    ]);
    const shape = (name, values) => {
      const element = document.createElementNS(marks.namespaceURI, name);
      for (const [key, value] of Object.entries(values)) element.setAttribute(key, value);
      return element;
    };
    const line = shape('polyline', { points: seen.map((place) => place.join(',')).join(' ') });
    marks.replaceChildren(line, ...seen.map(([cx, cy]) => shape('circle', { cx, cy, r: 5 })));
  }
}

/** Of the polygon through these points: the length of its vector area (Newell). */
function area(points) {
  const middle = scale(points.reduce(add), 1 / points.length);
  const sum = points.reduce((total, point, index) => {
    const next = points[(index + 1) % points.length];
    return add(total, cross(sub(point, middle), sub(next, middle)));
  }, [0, 0, 0]);
  return Math.hypot(...sum) / 2;
}

/** Where a point lies in a picture, from -1 to 1; null behind the camera. */
function onScreen(matrix, [x, y, z]) {
  const row = (i) => matrix[i] * x + matrix[4 + i] * y + matrix[8 + i] * z + matrix[12 + i];
  const depth = row(3);
  return depth > 0 ? [row(0) / depth, row(1) / depth] : null;
}
