//! The stamps of one laser's scans, smoothed: their first bytes leave whole mirror turns apart.
//!
//! A departure estimated from reads is late by chance, never early. The clock keeps a lower envelope of the departures on a
//! grid of whole scans: it falls to an earlier departure at once, and rises by a little more than the mirror may lag. A laser
//! sends every n-th scan, n being as small as its line allows: so a telegram that follows another without a byte between is
//! exactly n scans later, however late it was read. Another n is believed when it repeats itself.
//!
//! Not every stream keeps to such a grid: recordings of others that were encoded as telegrams do not. So the grid is trusted only while the
//! departures bear it out, and a stamp moves far from its departure only when it is trusted. Units: nanoseconds.

use biplane_wire::lms::MIRROR_TURN_NS;

/// How a [`TurnClock`] smooths.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct TurnClockParams {
    /// By how many millionths the envelope rises faster than the nominal mirror. Larger: follows a slow mirror, strays
    /// further between two prompt reads. Smaller than the mirror's deviation: stamps fall behind until the next lift.
    pub rise_ppm: f64,
    /// A gap after which nothing is known of the phase, nanoseconds. Larger: an old phase survives a standstill.
    pub gap_ns: i64,
    /// So near to the grid lies a departure that was read promptly, nanoseconds. Larger: a grid is trusted that is none.
    pub prompt_ns: i64,
    /// So many prompt departures in a row make the grid trusted.
    pub prompt_scans: u32,
    /// So late may a read be for an adapter with a latency timer, nanoseconds.
    pub timer_ns: i64,
    /// So many departures in a row that are at most that late make the grid trusted as well.
    pub timer_scans: u32,
    /// So late may a read be at all, nanoseconds; later, and the grid is given up. Larger: longer stalls are bridged, a laser that was
    /// stopped for a moment is stamped too early for longer.
    pub stall_ns: i64,
    /// Time over which every departure must lie above the envelope before it is lifted, nanoseconds. Smaller: reacts sooner to a
    /// change of phase, mistakes a stall of the adapter for one.
    pub window_ns: i64,
    /// The same in scans.
    pub window_scans: u32,
    /// How far above the envelope they must lie, nanoseconds. Larger: tolerates a standing error of that size.
    pub lift_ns: i64,
    /// So many equal intervals in a row make another cadence believed than the line's.
    pub cadence_scans: u32,
}

impl Default for TurnClockParams {
    fn default() -> Self {
        Self {
            rise_ppm: 150.0,
            gap_ns: 5_000_000_000,
            prompt_ns: 2_000_000,
            prompt_scans: 6,
            timer_ns: 18_000_000,
            timer_scans: 24,
            stall_ns: 300_000_000,
            window_ns: 800_000_000,
            window_scans: 12,
            lift_ns: 1_000_000,
            cadence_scans: 6,
        }
    }
}

/// One scan's telegram.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Departure {
    /// When its first byte left the device, as its reads allow, nanoseconds.
    pub time_ns: i64,
    /// Mirror turns of the scan: 1, 2 or 4.
    pub turns: u8,
    /// Whether it follows the telegram before without a byte between.
    pub is_next: bool,
    /// Scans from one telegram to the next when the line is the only limit.
    pub step_scans: i64,
}

/// Follows the departures of one laser's scans.
#[derive(Clone, Debug)]
pub struct TurnClock {
    params: TurnClockParams,
    state: Option<State>,
}

#[derive(Copy, Clone, Debug)]
struct State {
    envelope_ns: i64,
    turns: u8,
    /// Scans from one telegram to the next.
    step: i64,
    /// The departure before as its reads gave it, the interval to it in scans, and how often that one came in a row.
    previous_ns: i64,
    interval: i64,
    repeats: u32,
    /// Departures in a row that were prompt, and that were as late as a timer makes them.
    prompt: u32,
    timely: u32,
    is_trusted: bool,
    window: Window,
}

/// The departures since the envelope was last touched or lifted.
#[derive(Copy, Clone, Debug)]
struct Window {
    start_ns: i64,
    scans: u32,
    least_late_ns: i64,
}

impl Window {
    fn starting(start_ns: i64) -> Self {
        Self { start_ns, scans: 0, least_late_ns: i64::MAX }
    }
}

impl TurnClock {
    /// A clock that has seen nothing.
    #[must_use]
    pub fn new(params: TurnClockParams) -> Self {
        Self { params, state: None }
    }

    /// Forgets the phase: the device was started anew.
    pub fn reset(&mut self) {
        self.state = None;
    }

    /// The smoothed departure of a scan; never later than the estimate.
    pub fn smooth(&mut self, departure: Departure) -> i64 {
        let elapsed_ns = self.state.and_then(|state| departure.time_ns.checked_sub(state.envelope_ns));
        let (state, elapsed_ns) = match (self.state, elapsed_ns) {
            (Some(state), Some(elapsed_ns))
                if (0..=self.params.gap_ns).contains(&elapsed_ns) && state.turns == departure.turns =>
            {
                (state, elapsed_ns)
            }
            _ => return self.start(departure, departure.step_scans.max(1)),
        };
        self.follow(state, departure, elapsed_ns)
    }

    fn start(&mut self, departure: Departure, step: i64) -> i64 {
        let time_ns = departure.time_ns;
        self.state = Some(State {
            envelope_ns: time_ns,
            turns: departure.turns,
            step,
            previous_ns: time_ns,
            interval: 0,
            repeats: 0,
            prompt: 0,
            timely: 0,
            is_trusted: false,
            window: Window::starting(time_ns),
        });
        time_ns
    }

    fn follow(&mut self, mut state: State, departure: Departure, elapsed_ns: i64) -> i64 {
        let scan_ns = MIRROR_TURN_NS * i64::from(state.turns.max(1));
        if let Some(step) = state.other_cadence(departure, scan_ns, &self.params) {
            return self.start(departure, step);
        }
        let nominal_ns = state.scans_since(elapsed_ns, scan_ns, departure.is_next) * scan_ns;
        let rise_ns = (nominal_ns as f64 * self.params.rise_ppm * 1e-6) as i64;
        let predicted_ns = state.envelope_ns + nominal_ns + rise_ns;
        let late_ns = departure.time_ns - predicted_ns;
        state.judge(late_ns, &self.params);
        let limit_ns = if state.is_trusted { self.params.stall_ns } else { self.params.timer_ns };
        if !(-self.params.timer_ns..=limit_ns).contains(&late_ns) {
            return self.lose_grid(state, departure);
        }
        if late_ns <= 0 {
            state.envelope_ns = departure.time_ns;
            state.window = Window::starting(departure.time_ns);
        } else {
            state.envelope_ns = predicted_ns;
            state.lift(late_ns, &self.params);
        }
        self.state = Some(state);
        let is_near = late_ns <= self.params.prompt_ns;
        if state.is_trusted || is_near { state.envelope_ns } else { departure.time_ns }
    }

    /// No grid fits: from this departure on a new one is sought. What was learnt of the cadence stays.
    fn lose_grid(&mut self, state: State, departure: Departure) -> i64 {
        let (interval, repeats) = (state.interval, state.repeats);
        let time_ns = self.start(departure, state.step);
        if let Some(state) = &mut self.state {
            (state.interval, state.repeats) = (interval, repeats);
        }
        time_ns
    }
}

impl State {
    /// The cadence that the last intervals agree on, when it is another one than assumed.
    fn other_cadence(&mut self, departure: Departure, scan_ns: i64, params: &TurnClockParams) -> Option<i64> {
        let interval_ns = departure.time_ns.saturating_sub(self.previous_ns);
        self.previous_ns = departure.time_ns;
        let interval = (interval_ns + scan_ns / 2).div_euclid(scan_ns);
        let is_whole = (interval_ns - interval * scan_ns).abs() <= params.prompt_ns;
        let is_same = departure.is_next && is_whole && interval == self.interval;
        self.repeats = if is_same { self.repeats + 1 } else { 1 };
        self.interval = interval;
        (self.repeats >= params.cadence_scans && interval > 0 && interval != self.step).then_some(interval)
    }

    /// Scans since the telegram before: one step of the cadence, or whole steps when telegrams were lost between. Reads come
    /// late, so a departure may then lie three quarters of a step above the envelope and one quarter below.
    fn scans_since(&self, elapsed_ns: i64, scan_ns: i64, is_next: bool) -> i64 {
        if is_next {
            return self.step;
        }
        let step_ns = self.step * scan_ns;
        ((elapsed_ns + step_ns / 4) / step_ns).max(1) * self.step
    }

    fn judge(&mut self, late_ns: i64, params: &TurnClockParams) {
        self.prompt = if late_ns.abs() <= params.prompt_ns { self.prompt + 1 } else { 0 };
        self.timely = if late_ns.abs() <= params.timer_ns { self.timely + 1 } else { 0 };
        self.is_trusted |= self.prompt >= params.prompt_scans || self.timely >= params.timer_scans;
        // Nothing leaves earlier than a grid that is one.
        if late_ns < -params.prompt_ns {
            self.distrust();
        }
    }

    fn distrust(&mut self) {
        (self.prompt, self.timely, self.is_trusted) = (0, 0, false);
    }

    /// When nothing has touched the envelope for a while, the phase is another one.
    fn lift(&mut self, late_ns: i64, params: &TurnClockParams) {
        self.window.scans += 1;
        self.window.least_late_ns = self.window.least_late_ns.min(late_ns);
        let is_long = self.envelope_ns - self.window.start_ns >= params.window_ns;
        if is_long && self.window.scans >= params.window_scans {
            if self.window.least_late_ns > params.lift_ns {
                self.envelope_ns += self.window.least_late_ns;
                self.distrust();
            }
            self.window = Window::starting(self.envelope_ns);
        }
    }
}
