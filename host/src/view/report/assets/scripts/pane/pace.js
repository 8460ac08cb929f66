// How much is drawn while the view moves: all of it, or less when the computer is slow. What stands still is always drawn whole.

const SLOW_MS = 45;
const QUICK_MS = 20;

class Pace {
  constructor() {
    // 0: everything; 1: the coarser mesh; 2: the coarsest, at half the resolution.
    this.level = 0;
    this.quick = 0;
    this.until = 0;
  }

  /** Something moves without a finger or key held, as the wheel does. */
  nudge(now) {
    this.until = now + 250;
  }

  /** The level of this frame, which waited so long for the ones before. */
  of(moving, now, waited_ms) {
    if (!moving && now > this.until) return 0;
    this.learn(waited_ms);
    return this.level;
  }

  learn(waited_ms) {
    this.quick = waited_ms < QUICK_MS ? this.quick + 1 : 0;
    if (waited_ms > SLOW_MS) this.level = Math.min(this.level + (waited_ms > 3 * SLOW_MS ? 2 : 1), 2);
    if (this.quick > 60) [this.level, this.quick] = [Math.max(this.level - 1, 0), 0];
  }
}
