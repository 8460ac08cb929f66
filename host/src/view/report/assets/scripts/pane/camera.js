// One camera for all panes. It turns round a point (outside, top) or stands where a person would (walk). Frame map, meters, radians.

const EYE_M = 1.7;
const STEEPEST = 1.55;

class Camera {
  /** `bounds`: least and greatest corner of most of the building; `inside`: an eye and a direction; `floor_m`: height of the floor; `turned`: by what the plan is turned. */
  constructor({ bounds_m, inside, turned, floor_m }) {
    Object.assign(this, { bounds: bounds_m, start: inside, turned, floor_m, aspect: 1 });
    this.outside();
  }

  outside() {
    const size = sub(this.bounds[1], this.bounds[0]);
    const flat = size[0] >= size[1] ? [0.5, 1] : [-1, 0.5];
    this.orbit(Math.atan2(flat[1], flat[0]), -0.61, 0.55);
    this.preset = 'outside';
  }

  top() {
    const size = sub(this.bounds[1], this.bounds[0]);
    this.orbit((size[0] >= size[1] === this.aspect >= 1 ? Math.PI / 2 : 0) - this.turned, -STEEPEST, 0.3);
    this.preset = 'top';
  }

  orbit(yaw, pitch, lens) {
    Object.assign(this, { walking: false, yaw, pitch, lens });
    this.fit();
  }

  inside() {
    const [eye, ahead] = this.start;
    this.stand([eye[0], eye[1]], Math.atan2(ahead[1], ahead[0]));
    this.preset = 'inside';
  }

  /** A person on the floor. */
  stand([x, y], yaw = this.yaw) {
    Object.assign(this, { walking: true, yaw, pitch: 0, lens: 1.5, preset: '' });
    this.eye = [x, y, this.floor_m + EYE_M];
  }

  forward() {
    const level = Math.cos(this.pitch);
    return [level * Math.cos(this.yaw), level * Math.sin(this.yaw), Math.sin(this.pitch)];
  }

  /** The eye and its axes. */
  frame() {
    const forward = this.forward();
    const right = [Math.sin(this.yaw), -Math.cos(this.yaw), 0];
    const eye = this.walking ? this.eye : sub(this.target, scale(forward, this.distance));
    return { eye, right, up: cross(right, forward), forward };
  }

  /** Half the width and height of a picture at a distance of one; wide and tall panes show the same middle. */
  half(aspect = this.aspect) {
    const size = this.lens / 2;
    return aspect >= 1 ? [size * Math.min(aspect, 1.3), size * Math.min(aspect, 1.3) / aspect] : [size, size / aspect];
  }

  /** Height over width of the building as it looks now. */
  shape() {
    const { right, up } = this.frame();
    const size = sub(this.bounds[1], this.bounds[0]);
    const across = (axis) => size.reduce((sum, side, i) => sum + Math.abs(side * axis[i]), 0);
    return across(up) / across(right);
  }

  /** The points that a picture should hold: the way and all flat surfaces that do not turn their back, or the corners of the bounds. */
  pointsToSee(forward) {
    const seen = (this.places || []).filter(({ normal }) => this.pitch <= -STEEPEST || dot(normal, forward) < 0.05);
    if (seen.length > 2) return seen.map(({ at }) => at);
    return [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => [0, 1, 2].map((axis) => this.bounds[corner >> axis & 1][axis]));
  }

  /** As near as shows all points. Each bounds the eye on both sides; the tightest of each side fix its place. */
  fit() {
    const middle = scale(add(...this.bounds), 0.5);
    Object.assign(this, { target: middle, distance: 1 });
    const { right, up, forward } = this.frame();
    const points = this.pointsToSee(forward).map((p) => sub(p, middle));
    const half = this.half().map((side) => side * 0.94);
    const along = (axis, reach) => {
      const [plus, minus] = [1, -1].map((sign) => Math.max(...points.map((p) => sign * dot(p, axis) - reach * dot(p, forward))));
      return [(plus - minus) / 2, (plus + minus) / (2 * reach)];
    };
    const [[across, wide], [above, high]] = [along(right, half[0]), along(up, half[1])];
    this.distance = Math.max(wide, high, 0.5);
    this.target = add(middle, add(scale(right, across), scale(up, above)));
  }

  /** Radians: round the target, or the head. */
  turn(right, up) {
    this.yaw -= right;
    this.pitch = clamp(this.pitch + up, -STEEPEST, this.walking ? STEEPEST : 0.3);
    this.preset = '';
  }

  /** Pixels of a pane with this height: what is under the finger goes along. */
  pan(x, y, height) {
    this.preset = '';
    const { right, up } = this.frame();
    if (this.walking) return this.walk(y * 0.02, -x * 0.02);
    const meters = 2 * this.half()[1] * this.distance / height;
    this.target = add(this.target, add(scale(right, -x * meters), scale(up, y * meters)));
  }

  /** Nearer by a factor; a person steps ahead. */
  zoom(factor) {
    this.preset = '';
    if (this.walking) this.walk(Math.log(factor) * 2, 0);
    else this.distance = clamp(this.distance / factor, 0.2, 5000);
  }

  /** Meters ahead and to the right, on the floor. */
  walk(ahead, right) {
    const [cos, sin] = [Math.cos(this.yaw), Math.sin(this.yaw)];
    this.eye = [this.eye[0] + cos * ahead + sin * right, this.eye[1] + sin * ahead - cos * right, this.eye[2]];
    this.preset = '';
  }

  clip(aspect) {
    const frame = this.frame();
    const reach = Math.hypot(...sub(this.bounds[1], this.bounds[0])) * 2 + 100;
    const near = this.walking ? 0.05 : Math.max(0.05, this.distance * 0.02);
    return { frame, matrix: clipFromMap(frame, this.half(aspect), near, (this.walking ? 0 : this.distance) + reach) };
  }
}
