//! The stamps of one laser's scans, smoothed: their first bytes leave whole mirror turns apart.
//!
//! A departure estimated from reads is late by chance, never early. The clock keeps a lower envelope of the departures on a
//! grid of whole scans: it falls to an earlier departure at once, and rises by a little more than the mirror may lag. Once the
//! laser's cadence (scans from one telegram to the next) has repeated itself, a telegram that follows another without a byte
//! between is exactly one step later, however late it was read. Units: nanoseconds.

use biplane_wire::lms::MIRROR_TURN_NS;

/// Equal steps that make a cadence.
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
    /// Scans from one telegram to the next, as last seen, and how often in a row.
    step: i64,
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
        let (envelope_ns, turns) = (departure.time_ns, departure.turns);
        let window = Window::starting(envelope_ns);
        self.state = Some(State { envelope_ns, turns, step: 0, repeats: 0, window });
        envelope_ns
    }

    fn follow(&self, mut state: State, departure: Departure, elapsed_ns: i64) -> State {
        let scan_ns = MIRROR_TURN_NS * i64::from(state.turns.max(1));
        let scans = state.scans_since(elapsed_ns, scan_ns, departure.is_next);
        let nominal_ns = scans * scan_ns;
        let rise_ns = (nominal_ns as f64 * self.params.rise_ppm * 1e-6) as i64;
        let predicted_ns = state.envelope_ns + nominal_ns + rise_ns;
        let late_ns = departure.time_ns - predicted_ns;
        state.learn(scans);
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
                state.repeats = 0;
            }
            state.window = Window::starting(state.envelope_ns);
        }
        state
    }
}

impl State {
    fn has_cadence(&self) -> bool {
        self.repeats >= CADENCE_REPEATS
    }

    /// Scans since the telegram before: whole steps of the cadence when there is one. Reads come late, so a departure may lie
    /// three quarters of a step above the envelope and one quarter below.
    fn scans_since(&self, elapsed_ns: i64, scan_ns: i64, is_next: bool) -> i64 {
        let step = if self.has_cadence() { self.step } else { 1 };
        if self.has_cadence() && is_next {
            return step;
        }
        let step_ns = step * scan_ns;
        ((elapsed_ns + step_ns / 4) / step_ns).max(1) * step
    }

    /// Steps over lost telegrams are multiples of the cadence and do not speak against it.
    fn learn(&mut self, scans: i64) {
        if self.step == scans {
            self.repeats += 1;
        } else if !self.has_cadence() || scans % self.step != 0 {
            self.step = scans;
            self.repeats = 1;
        }
    }
}
