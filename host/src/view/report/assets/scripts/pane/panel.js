// What is known of the picked surface.

class Panel {
  constructor(contents, element) {
    Object.assign(this, { contents, element });
  }

  show(index) {
    const { element, contents } = this;
    element.hidden = index === null;
    element.replaceChildren();
    for (const row of document.querySelectorAll('.surfaces tr.picked')) row.classList.remove('picked');
    if (index === null) return;
    if (index < 0) return this.fill('Fine structure', [['', 'on no plane: kept as triangles']]);
    document.querySelector(`.surfaces tr[data-surface="${index}"]`)?.classList.add('picked');
    const beyond = index - contents.polygons.length;
    if (beyond >= contents.rounds.length) return this.showInferred(contents.inferred[beyond - contents.rounds.length]);
    if (beyond >= 0) return this.showRound(contents.rounds[beyond]);
    const polygon = contents.polygons[index];
    const plane = contents.planes[polygon.plane];
    const siblings = contents.polygons.filter((other) => other.plane === polygon.plane);
    const all = siblings.reduce((sum, other) => sum + other.area_m2, 0);
    this.fill(`surface ${index}`, [
      ['kind, by direction', plane.kind],
      ['area', `${polygon.area_m2.toFixed(2)} m²`],
      ['normal', plane.normal.map((value) => (Math.round(1000 * value) / 1000 + 0).toFixed(3)).join(', ')],
      ['RMS', `${(100 * plane.rms_m).toFixed(2)} cm`],
      ['points', plane.points.toLocaleString('en')],
      ['openings', polygon.holes],
      ['corners', polygon.corners],
      ['triangles', polygon.triangles],
      [`plane ${polygon.plane}`, `${siblings.length} surface${siblings.length > 1 ? 's' : ''}, ${all.toFixed(2)} m²`],
    ]);
  }

  showInferred({ name, area_m2, triangles }) {
    this.fill(name, [['', 'inferred: no laser saw it'], ['extent', `${area_m2.toFixed(2)} m²`], ['triangles', triangles]]);
  }

  showRound(round) {
    this.fill(round.name, [
      ['radius', `${(100 * round.radius_m).toFixed(1)} cm`],
      ['axis', round.axis.map((value) => (Math.round(1000 * value) / 1000 + 0).toFixed(3)).join(', ')],
      ['length', `${round.length_m.toFixed(2)} m`],
      ['arc', `${round.arc_deg}°`],
      ['RMS', `${(100 * round.rms_m).toFixed(2)} cm`],
      ['points', round.points.toLocaleString('en')],
      ['triangles', round.triangles],
    ]);
  }

  fill(title, rows) {
    const heading = document.createElement('h3');
    heading.textContent = title;
    const list = document.createElement('dl');
    for (const [name, value] of rows) {
      const row = document.createElement('div');
      for (const [tag, text] of [['dt', name], ['dd', value]]) {
        if (text !== '') row.appendChild(document.createElement(tag)).textContent = text;
      }
      list.append(row);
    }
    this.element.append(heading, list);
  }
}
