//! The stamps of a device that works in cycles: a laser whose scans end with a turn of its mirror, a base that reports every tenth
//! of a second.
//!
//! Two things must be known of a departure: how many cycles lie between it and the one before, and when the cycles are. The second
//! is an [`Envelope`]. The first is a count, and a wrong one costs whole cycles, so it is taken from the best witness there is:
//!
//! 1. the device's own index, when it sends one (modulo 256 cycles; the departure tells the rest);
//! 2. a departure whose telegram came at the line's pace: it is right to a fraction of a cycle, so the count is what fits it;
//! 3. otherwise the bytes may have been held back for long, and the telegram is taken to be as many cycles
//!    after the one before as the line allows, or as it has been for a while. The next of the kinds above sets the count right.
//!
//! Not every stream keeps to such cycles: recordings of others that were encoded as telegrams do not. So the line is followed only
//! while the departures bear it out. All is causal. Units: nanoseconds.

use super::arrivals::Pace;
use super::conduct::{Habit, LateRun, Trust, Verdict};
use super::envelope::{Envelope, EnvelopeParams};

/// The device's index counts modulo this.
const INDEX_CYCLES: i64 = 256;
/// An index that was contradicted so often in a row is none of cycles.
const MOST_DOUBTS: u8 = 8;

/// How a [`CycleClock`] follows.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct CycleClockParams {
    /// The line of the cycles.
    pub envelope: EnvelopeParams,
    /// So much before its cycle may a departure seem to be, nanoseconds: what the line is uncertain by. Larger: late ones
    /// are taken for early ones of the next cycle.
    pub early_ns: i64,
    /// So late is a departure still near its cycle, nanoseconds. Larger: cycles are seen where there are none.
    pub near_ns: i64,
    /// A departure up to this share of a cycle late bears the cycles out (an adapter with a latency timer is often so late).
    /// Larger: cycles are seen where there are none.
    pub bearing_share: f64,
    /// The same for one that comes as many cycles after the one before as was expected, which is a sign of its own.
    pub regular_share: f64,
    /// So many departures must have been judged before cycles are trusted.
    pub trust_after: u32,
    /// So many of the last sixteen may then be far from their cycle.
    pub trust_strays: u32,
    /// When for so long all departures may have been held back, such are believed: better ones do not come. Nanoseconds.
    pub blind_after_ns: i64,
    /// A departure later than this is not one held back, nanoseconds: the device has paused.
    pub longest_hold_ns: i64,
    /// An adapter's timer makes bytes no later than this, nanoseconds.
    pub longest_timer_ns: i64,
    /// When so many departures in a row that were equally late ...
    pub alike_scans: u32,
    /// When so many departures in a row ...
    pub raise_scans: u32,
    /// ... over so long a time, nanoseconds ...
    pub raise_after_ns: i64,
    /// ... were all later than this, nanoseconds, the phase is another one.
    pub raise_ns: i64,
    /// So many equal distances in a row are a habit.
    pub habit: u32,
    /// After a pause so long, nanoseconds, everything is forgotten: the device may have been switched off and on, or be another one.
    /// Longer than a departure is held back, shorter than a laser takes to start.
    pub pause_ns: i64,
    /// The phase is forgotten when the line has become more uncertain than this, nanoseconds.
    pub forget_ns: i64,
}

impl Default for CycleClockParams {
    fn default() -> Self {
        Self {
            envelope: EnvelopeParams::default(),
            early_ns: 1_000_000,
            near_ns: 2_000_000,
            bearing_share: 0.25,
            regular_share: 0.6,
            trust_after: 8,
            trust_strays: 3,
            blind_after_ns: 5_000_000_000,
            longest_hold_ns: 2_000_000_000,
            longest_timer_ns: 20_000_000,
            alike_scans: 3,
            raise_scans: 8,
            raise_after_ns: 800_000_000,
            raise_ns: 1_000_000,
            habit: 4,
            pause_ns: 2_500_000_000,
            forget_ns: 1_000_000,
        }
    }
}

/// One telegram.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct Departure {
    /// When its first byte left the device, as its reads allow, nanoseconds.
    pub time_ns: i64,
    /// How its bytes came, and so what that time is worth.
    pub pace: Pace,
    /// Cycles of one scan: distances are multiples of it.
    pub unit: i64,
    /// Cycles since the telegram before when only the line kept them apart.
    pub least_cycles: i64,
    /// Whether it follows the telegram before without a byte between.
    pub is_next: bool,
    /// The device's own count of cycles, modulo 256.
    pub index: Option<u8>,
    /// What is known of the host at that time.
    pub host: HostState,
}

/// Whether the host read in time.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum HostState {
    /// It did.
    #[default]
    Listening,
    /// Nobody listened while the telegram came: its reads say nothing, its place in the stream everything.
    Overdue,
    /// It listens again, behind bytes that filled the kernel's buffer: others may be lost, and the place in the stream says nothing.
    Resumed,
}

/// Follows the departures of one device's telegrams.
#[derive(Clone, Debug)]
pub struct CycleClock {
    params: CycleClockParams,
    cycle_ns: i64,
    state: Option<State>,
}

#[derive(Clone, Debug)]
struct State {
    envelope: Envelope,
    /// Cycles since the envelope began, of the telegram before.
    cycle: i64,
    index: Option<u8>,
    /// Times in a row that the index and the clock contradicted each other.
    index_doubts: u8,
    /// Whether the line rests on paced departures, and when the last of them was, nanoseconds.
    is_paced: bool,
    paced_ns: i64,
    habit: Habit,
    trust: Trust,
    late: LateRun,
}

impl Departure {
    fn is_paced(&self) -> bool {
        self.pace == Pace::Line
    }
}

impl CycleClock {
    /// A clock that has seen nothing of a device whose cycle nominally lasts so long.
    #[must_use]
    pub fn new(params: CycleClockParams, cycle_ns: i64) -> Self {
        Self { params, cycle_ns: cycle_ns.max(1), state: None }
    }

    /// Forgets everything, the phase and the index above all: it may be another device, or one that was switched off.
    pub fn reset(&mut self) {
        self.state = None;
    }

    /// The smoothed departure of a telegram; never later than its reads allow.
    pub fn smooth(&mut self, departure: &Departure) -> i64 {
        let Some(mut state) = self.state.take() else { return self.start(departure) };
        if departure.host == HostState::Overdue && state.trust.verdict(&self.params) != Verdict::Broken {
            return self.follow(state, departure);
        }
        let elapsed_ns = departure.time_ns.saturating_sub(state.envelope.at_ns(state.cycle));
        if elapsed_ns > self.params.pause_ns {
            return self.start(departure);
        }
        let uncertain_ns = state.envelope.uncertain_ns(elapsed_ns / self.cycle_ns);
        let is_better = departure.is_paced() && !state.is_paced;
        if is_better || uncertain_ns > self.params.forget_ns {
            return self.restart(state, departure, Trust::default());
        }
        let expected = state.habit.expected(departure);
        let Some(cycles) = self.count(&mut state, departure, elapsed_ns) else {
            let trust = state.trust.with(false);
            return self.restart(state, departure, trust);
        };
        state.cycle = state.cycle.saturating_add(cycles);
        state.index = departure.index;
        state.habit.note(departure, self.cycle_ns, &self.params);
        let is_regular = cycles == expected;
        let smooth_ns = self.place(&mut state, departure, is_regular);
        self.state = Some(state);
        smooth_ns
    }

    fn start(&mut self, departure: &Departure) -> i64 {
        self.state = Some(State {
            envelope: Envelope::new(self.params.envelope, self.cycle_ns, departure.time_ns),
            cycle: 0,
            index: departure.index,
            index_doubts: 0,
            is_paced: departure.is_paced(),
            paced_ns: departure.time_ns,
            habit: Habit::default(),
            trust: Trust::default(),
            late: LateRun::default(),
        });
        departure.time_ns
    }

    /// A telegram that nobody listened to: it left when its cycle came.
    fn follow(&mut self, mut state: State, departure: &Departure) -> i64 {
        let by_index =
            departure.index.zip(state.index).map(|(now, before)| i64::from(now.wrapping_sub(before)));
        let cycles = by_index.filter(|cycles| *cycles > 0).unwrap_or_else(|| state.habit.expected(departure));
        state.cycle = state.cycle.saturating_add(cycles);
        state.index = departure.index;
        let line_ns = state.envelope.at_ns(state.cycle).min(departure.time_ns);
        state.habit.miss(line_ns);
        self.state = Some(state);
        line_ns
    }

    /// No cycle fits: from this departure on others are sought. What was learnt of the rate stays.
    fn restart(&mut self, mut old: State, departure: &Departure, trust: Trust) -> i64 {
        old.envelope.restart(departure.time_ns);
        self.start(departure);
        if let Some(state) = &mut self.state {
            (state.envelope, state.trust) = (old.envelope, trust);
        }
        departure.time_ns
    }

    /// Cycles since the telegram before; `None` when nothing fits.
    fn count(&self, state: &mut State, departure: &Departure, elapsed_ns: i64) -> Option<i64> {
        if let Some(cycles) = self.count_by_index(state, departure, elapsed_ns) {
            return Some(cycles);
        }
        let expected = state.habit.expected(departure);
        let late_ns = |cycles: i64| {
            departure.time_ns.saturating_sub(state.envelope.at_ns(state.cycle.saturating_add(cycles)))
        };
        let expected_late_ns = late_ns(expected);
        let is_near = |late_ns: i64| (-self.params.early_ns..=self.params.near_ns).contains(&late_ns);
        if is_near(expected_late_ns) {
            return Some(expected);
        }
        let fitting = |unit: i64| {
            let unit_ns = state.envelope.period_ns() * unit as f64;
            let units = (elapsed_ns.saturating_add(self.params.early_ns) as f64 / unit_ns).floor();
            (units as i64).saturating_mul(unit)
        };
        let (whole, any) = (fitting(departure.unit.max(1)), fitting(1));
        let is_skip = departure.pace == Pace::Spread
            && expected_late_ns > self.params.longest_timer_ns
            && is_near(late_ns(whole));
        let is_held = !departure.is_paced()
            && departure.host != HostState::Resumed
            && !is_skip
            && (0..=self.params.longest_hold_ns).contains(&expected_late_ns);
        let is_early = expected_late_ns < 0 && expected_late_ns >= -self.cycle_ns / 2;
        if is_held || (is_early && !is_near(late_ns(any))) {
            return Some(expected);
        }
        let best = if is_near(late_ns(whole)) || !is_near(late_ns(any)) { whole } else { any };
        (best >= 1).then_some(best)
    }

    /// The index tells the cycles but for multiples of 256, which the departure tells. An index that the clock contradicts is doubted.
    fn count_by_index(&self, state: &mut State, departure: &Departure, elapsed_ns: i64) -> Option<i64> {
        let (now, before) = (departure.index?, state.index?);
        if state.index_doubts >= MOST_DOUBTS {
            return None;
        }
        let apart = i64::from(now.wrapping_sub(before));
        let over_ns = elapsed_ns.saturating_add(self.cycle_ns).saturating_sub(apart * self.cycle_ns);
        let cycles = apart + INDEX_CYCLES * (over_ns / (INDEX_CYCLES * self.cycle_ns)).max(0);
        let late_ns =
            departure.time_ns.saturating_sub(state.envelope.at_ns(state.cycle.saturating_add(cycles)));
        let latest_ns = if departure.is_paced() { self.cycle_ns } else { self.params.longest_hold_ns };
        let is_possible = (1 - self.cycle_ns / 2..latest_ns).contains(&late_ns);
        if cycles < 1 || !is_possible {
            state.index_doubts += 1;
            return None;
        }
        state.index_doubts = 0;
        Some(cycles)
    }

    /// Holds the departure against the line of its cycle, and takes what it says of that line.
    fn place(&self, state: &mut State, departure: &Departure, is_regular: bool) -> i64 {
        let late_ns = departure.time_ns.saturating_sub(state.envelope.at_ns(state.cycle));
        if departure.is_paced() {
            state.paced_ns = departure.time_ns;
        }
        let unpaced_ns = departure.time_ns.saturating_sub(state.paced_ns);
        let is_blind = !state.is_paced || unpaced_ns > self.params.blind_after_ns;
        let share = if is_regular { self.params.regular_share } else { self.params.bearing_share };
        let bearing_ns = (self.cycle_ns as f64 * share) as i64;
        if departure.is_paced() || is_blind {
            state.trust = state.trust.with((-self.params.early_ns..=bearing_ns).contains(&late_ns));
            if late_ns < -self.params.near_ns {
                state.envelope.restart(departure.time_ns);
                (state.cycle, state.late) = (0, LateRun::default());
            } else {
                state.envelope.add(state.cycle, departure.time_ns);
                self.raise(state, departure.time_ns, late_ns);
            }
        }
        let line_ns = state.envelope.at_ns(state.cycle).min(departure.time_ns);
        let is_near = departure.time_ns - line_ns <= self.params.near_ns;
        let is_followed = match state.trust.verdict(&self.params) {
            Verdict::Kept => true,
            Verdict::Unknown => is_near || !departure.is_paced(),
            Verdict::Broken => false,
        };
        if is_followed { line_ns } else { departure.time_ns }
    }

    /// When departures have all been late for a while, cycles were missed in the count, or the phase is another one.
    fn raise(&self, state: &mut State, time_ns: i64, late_ns: i64) {
        let Some(least_ns) = state.late.note(time_ns, late_ns, &self.params) else { return };
        let missed = least_ns.saturating_add(self.params.early_ns) / self.cycle_ns;
        state.cycle += missed;
        if least_ns - missed * self.cycle_ns > self.params.raise_ns {
            state.envelope.restart(time_ns - (late_ns - least_ns));
            state.cycle = 0;
        }
    }
}
