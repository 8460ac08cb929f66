//! The stamps of one laser's scans, smoothed: their first bytes leave whole mirror turns apart.
//!
//! A departure estimated from reads is late by chance, never early. The clock keeps a lower envelope of the departures on a
//! grid of whole scans: it falls to an earlier departure at once, and rises by a little more than the mirror may lag. A laser
//! sends every n-th scan, n being as small as its line allows: so a telegram that follows another without a byte between is
//! exactly n scans later, however late it was read. Another n is believed when it repeats itself. Units: nanoseconds.

use biplane_wire::lms::MIRROR_TURN_NS;

/// So many equal intervals in a row make another cadence believed than the line's.
const CADENCE_REPEATS: u32 = 4;

/// How a [`TurnClock`] smooths.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct TurnClockParams {
    /// By how many millionths the envelope rises faster than the nominal mirror. Larger: follows a slow mirror, strays
    /// further between two prompt reads. Smaller than the mirror's deviation: stamps fall behind until the next lift.
    pub rise_ppm: f64,
    /// A gap after which nothing is known of the phase, nanoseconds. Larger: an old phase survives a standstill.
    pub gap_ns: i64,
    /// Time over which every departure must lie above the envelope before it is lifted, nanoseconds. Smaller: reacts sooner to a
    /// change of phase, mistakes a stall of the adapter for one.
    pub window_ns: i64,
    /// The same in scans.
    pub window_scans: u32,
    /// How far above the envelope they must lie, nanoseconds. Larger: tolerates a standing error of that size.
    pub lift_ns: i64,
}

impl Default for TurnClockParams {
    fn default() -> Self {
        Self {
            rise_ppm: 150.0,
            gap_ns: 5_000_000_000,
            window_ns: 800_000_000,
            window_scans: 12,
            lift_ns: 1_000_000,
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
            _ => return self.start(departure),
        };
        let state = self.follow(state, departure, elapsed_ns);
        self.state = Some(state);
        state.envelope_ns
    }

    fn start(&mut self, departure: Departure) -> i64 {
        let state = State::starting(departure, departure.step_scans.max(1));
        self.state = Some(state);
        state.envelope_ns
    }

    fn follow(&self, mut state: State, departure: Departure, elapsed_ns: i64) -> State {
        let scan_ns = MIRROR_TURN_NS * i64::from(state.turns.max(1));
        if let Some(step) = state.other_cadence(departure, scan_ns) {
            return State::starting(departure, step);
        }
        let nominal_ns = state.scans_since(elapsed_ns, scan_ns, departure.is_next) * scan_ns;
        let rise_ns = (nominal_ns as f64 * self.params.rise_ppm * 1e-6) as i64;
        let predicted_ns = state.envelope_ns + nominal_ns + rise_ns;
        let late_ns = departure.time_ns - predicted_ns;
        if late_ns <= 0 {
            state.envelope_ns = departure.time_ns;
            state.window = Window::starting(departure.time_ns);
            return state;
        }
        state.envelope_ns = predicted_ns;
        state.window.scans += 1;
        state.window.least_late_ns = state.window.least_late_ns.min(late_ns);
        let is_long = predicted_ns - state.window.start_ns >= self.params.window_ns;
        if is_long && state.window.scans >= self.params.window_scans {
            if state.window.least_late_ns > self.params.lift_ns {
                state.envelope_ns += state.window.least_late_ns;
            }
            state.window = Window::starting(state.envelope_ns);
        }
        state
    }
}

impl State {
    fn starting(departure: Departure, step: i64) -> Self {
        let time_ns = departure.time_ns;
        Self {
            envelope_ns: time_ns,
            turns: departure.turns,
            step,
            previous_ns: time_ns,
            interval: 0,
            repeats: 0,
            window: Window::starting(time_ns),
        }
    }

    /// The cadence that the last intervals agree on, when it is another one than assumed.
    fn other_cadence(&mut self, departure: Departure, scan_ns: i64) -> Option<i64> {
        let interval_ns = departure.time_ns.saturating_sub(self.previous_ns);
        self.previous_ns = departure.time_ns;
        let interval = (interval_ns + scan_ns / 2).div_euclid(scan_ns);
        self.repeats = if departure.is_next && interval == self.interval { self.repeats + 1 } else { 1 };
        self.interval = interval;
        (self.repeats >= CADENCE_REPEATS && interval > 0 && interval != self.step).then_some(interval)
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
}
