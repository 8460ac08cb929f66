// The floor map: zoomed and moved by its view box; its cells are turned in it. A click says where to stand in the 3D view, which says where its camera is.

/** Half the length of the arrow, as many pixels. */
const ARROW_PIXELS = 11;

function startMap(svg) {
  const whole = svg.viewBox.baseVal;
  const all = { x: 0, y: 0, width: whole.width, height: whole.height };
  let box = { ...all };
  const [originX, originY, cell, rows] = ['originX', 'originY', 'cell', 'rows'].map((name) => Number(svg.dataset[name]));
  const [cells, here] = ['cells', 'here'].map((id) => document.getElementById(id));

  // The arrow keeps its size on the screen, whatever the zoom.
  let eye;
  const showEye = () => {
    if (!eye) return;
    const size = ARROW_PIXELS * Math.max(box.width / (svg.clientWidth || 1), box.height / (svg.clientHeight || 1));
    here.setAttribute('transform', `translate(${eye.x} ${eye.y}) rotate(${eye.turned}) scale(${size})`);
  };
  const apply = () => {
    box.x = Math.min(Math.max(box.x, -box.width / 2), all.width - box.width / 2);
    box.y = Math.min(Math.max(box.y, -box.height / 2), all.height - box.height / 2);
    svg.setAttribute('viewBox', `${box.x} ${box.y} ${box.width} ${box.height}`);
    showEye();
  };
  const zoom = (factor, [x, y] = [box.x + box.width / 2, box.y + box.height / 2]) => {
    const width = Math.min(Math.max(box.width / factor, all.width / 60), all.width);
    const by = width / box.width;
    box = { x: x - (x - box.x) * by, y: y - (y - box.y) * by, width, height: box.height * by };
    apply();
  };
  const place = (event, within = svg) => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(within.getScreenCTM().inverse());
    return [at.x, at.y];
  };
  const showAll = () => {
    box = { ...all };
    apply();
  };

  const pointers = new Map();
  let still = true;
  svg.addEventListener('pointerdown', (event) => {
    if (event.pointerType !== 'touch') svg.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
    still = pointers.size === 1;
  });
  svg.addEventListener('pointermove', (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const [from, to] = [place(last), place(event)];
    if (Math.hypot(event.clientX - last.clientX, event.clientY - last.clientY) < 4 && still) return;
    still = false;
    const other = [...pointers.values()].find((each) => each.pointerId !== event.pointerId);
    if (other) {
      const middle = place(other);
      const apart = ([x, y]) => Math.hypot(x - middle[0], y - middle[1]) || 1;
      zoom(apart(to) / apart(from), middle);
    } else {
      box.x -= to[0] - from[0];
      box.y -= to[1] - from[1];
      apply();
    }
    pointers.set(event.pointerId, event);
  });
  const up = (event) => {
    if (pointers.delete(event.pointerId) && event.type === 'pointerup' && still) {
      const [x, y] = place(event, cells);
      const detail = [originX + x * cell, originY + (rows - y) * cell];
      document.dispatchEvent(new CustomEvent('stand', { detail }));
    }
  };
  for (const end of ['pointerup', 'pointercancel']) svg.addEventListener(end, up);
  svg.addEventListener('wheel', (event) => {
    if (document.activeElement !== svg) return;
    event.preventDefault();
    zoom(Math.exp(-Math.min(Math.max(event.deltaY, -200), 200) * 0.003), place(event));
  }, { passive: false });
  svg.addEventListener('keydown', (event) => {
    const step = box.width / 8;
    const act = {
      '+': () => zoom(1.4), '=': () => zoom(1.4), '-': () => zoom(1 / 1.4), 0: showAll,
      ArrowLeft: () => { box.x -= step; apply(); }, ArrowRight: () => { box.x += step; apply(); },
      ArrowUp: () => { box.y -= step; apply(); }, ArrowDown: () => { box.y += step; apply(); },
    }[event.key];
    if (!act || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    act();
  });
  for (const [id, act] of [['map-in', () => zoom(1.4)], ['map-out', () => zoom(1 / 1.4)], ['map-all', showAll]]) {
    document.getElementById(id).addEventListener('click', act);
  }
  new ResizeObserver(showEye).observe(svg);
  let onScreen = true;
  new IntersectionObserver(([entry]) => { onScreen = entry.isIntersecting; }).observe(svg);
  document.addEventListener('seen', ({ detail: { eye: at, yaw, still } }) => {
    if (!onScreen && !still) return;
    const [x, y] = [(at[0] - originX) / cell, rows - (at[1] - originY) / cell];
    eye = { x, y, turned: -yaw * 180 / Math.PI };
    showEye();
    if (!here.firstChild) {
      const arrow = document.createElementNS(svg.namespaceURI, 'path');
      arrow.setAttribute('d', 'M1.2 0L-0.8 0.8L-0.4 0L-0.8 -0.8Z');
      here.append(arrow);
    }
  });
}

const mapElement = document.getElementById('map');
if (mapElement) startMap(mapElement);
