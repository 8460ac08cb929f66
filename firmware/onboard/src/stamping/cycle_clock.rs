//! The stamps of a device that works in cycles: a laser whose scans end with a turn of its mirror, a base
//! that reports every tenth of a second.
//!
//! Two things must be known of a departure: how many cycles lie between it and the one before, and when the
//! cycles are. The second is an [`Envelope`]. The first is a count, and a wrong one costs whole cycles, so it
//! is taken from the best witness there is:
//!
//! 1. the device's own index, when it sends one (modulo 256 cycles; the departure tells the rest);
//! 2. a departure whose telegram came at the line's pace: it is right to a fraction of a cycle, so the count
//!    is what fits it;
//! 3. otherwise the bytes may have been held back for long, and the telegram is taken to be as many cycles
//!    after the one before as the line allows, or as it has been for a while. The next of the kinds above
//!    sets the count right.
//!
//! Not every stream keeps to such cycles: recordings of others that were encoded as telegrams do not. So the
//! line is followed only while the departures bear it out. A laser whose mirror turns at another rate sends
//! at even distances that are no whole number of cycles: then one distance is a cycle, because how many turns
//! it holds is not known, and that is told. All is causal. Units: nanoseconds.

use crate::stamping::arrivals::Pace;
use crate::stamping::cycle_params::CycleClockParams;
use crate::stamping::departure::Departure;
use crate::stamping::departure::HostState;
use crate::stamping::envelope::Envelope;
use crate::stamping::mean_interval::MeanInterval;
use crate::stamping::regularity::{ExpectedInterval, LatenessRun, PhaseConfidence, Verdict};

/// The device's index counts modulo this.
const INDEX_CYCLES: i64 = 256;
/// An index that was contradicted so often in a row is none of cycles.
const MAX_CONTRADICTIONS: u8 = 8;
/// A mean distance that is off a whole number of cycles by a larger share is none of these cycles: more than
/// an envelope follows, and than chance makes of it.
const ODD_SHARE: f64 = 0.001;

/// Follows the departures of one device's telegrams.
#[derive(Clone, Debug)]
pub(crate) struct CycleClock {
    params: CycleClockParams,
    nominal_ns: i64,
    cycle_ns: i64,
    state: Option<State>,
    /// Of a device whose cycle may be another one.
    interval: Option<MeanInterval>,
    odd: Option<OddInterval>,
}

/// The distance at which telegrams come, where it is no whole number of nominal cycles.
#[derive(Copy, Clone, Debug)]
struct OddInterval {
    mean_ns: i64,
    /// What it was taken to be.
    min_cycles: i64,
}

impl OddInterval {
    /// A telegram in cycles of that distance. An index counts others.
    fn departure(self, departure: &Departure) -> Departure {
        let min_cycles = (departure.min_cycles / self.min_cycles).max(1);
        Departure { unit: 1, min_cycles, index: None, ..*departure }
    }
}

#[derive(Clone, Debug)]
struct State {
    envelope: Envelope,
    /// Cycles since the envelope began, of the telegram before.
    cycle: i64,
    index: Option<u8>,
    /// Times in a row that the index and the clock contradicted each other.
    index_contradictions: u8,
    /// Whether the line rests on paced departures, and when the last of them was, nanoseconds.
    is_paced: bool,
    paced_ns: i64,
    expected_interval: ExpectedInterval,
    confidence: PhaseConfidence,
    late: LatenessRun,
}

impl Departure {
    fn is_paced(&self) -> bool {
        self.pace == Pace::Line
    }
}

impl CycleClock {
    /// A clock that has seen nothing of a device whose cycle nominally lasts so long.
    #[must_use]
    pub(crate) fn new(params: CycleClockParams, cycle_ns: i64) -> Self {
        let nominal_ns = cycle_ns.max(1);
        let cycle_ns = nominal_ns;
        Self { params, nominal_ns, cycle_ns, state: None, interval: None, odd: None }
    }

    /// The same of a device whose cycle may last longer or shorter than nominally: it is measured.
    #[must_use]
    pub(crate) fn measured(self) -> Self {
        Self { interval: Some(MeanInterval::default()), ..self }
    }

    /// At which distance telegrams come, if that is no whole number of nominal cycles, nanoseconds.
    #[must_use]
    pub(crate) fn odd_interval_ns(&self) -> Option<i64> {
        self.odd.map(|odd| odd.mean_ns)
    }

    /// Forgets everything, the phase and the index above all: it may be another device, or one that was
    /// switched off.
    pub(crate) fn reset(&mut self) {
        (self.state, self.cycle_ns, self.odd) = (None, self.nominal_ns, None);
        self.interval = self.interval.map(|_| MeanInterval::default());
    }

    /// Takes the mean distance of telegrams for the cycle, where it is none of whole cycles.
    fn measure(&mut self, departure: &Departure) {
        let Some(interval) = &mut self.interval else { return };
        interval.note(departure);
        let Some(mean_ns) = interval.mean_ns().filter(|_| departure.is_paced()) else { return };
        let unit = if self.odd.is_some() { 1 } else { departure.unit.max(1) };
        let unit_ns = (self.cycle_ns * unit) as f64;
        let whole_ns = (mean_ns / unit_ns).round().max(1.0) * unit_ns;
        if (mean_ns - whole_ns).abs() > ODD_SHARE * whole_ns {
            let mean_ns = (mean_ns.round() as i64).max(1);
            self.odd = Some(OddInterval { mean_ns, min_cycles: departure.min_cycles.max(1) });
            (self.cycle_ns, self.state) = (mean_ns, None);
        }
    }

    /// The smoothed departure of a telegram; never later than its reads allow.
    pub(crate) fn smooth(&mut self, departure: &Departure) -> i64 {
        self.measure(departure);
        let departure = &self.odd.map_or(*departure, |odd| odd.departure(departure));
        let Some(mut state) = self.state.take() else { return self.start(departure) };
        if departure.host == HostState::Overdue && state.confidence.verdict(&self.params) != Verdict::Broken {
            return self.follow(state, departure);
        }
        let elapsed_ns = departure.time_ns.saturating_sub(state.envelope.at_ns(state.cycle));
        if elapsed_ns > self.params.pause_ns {
            return self.start(departure);
        }
        let uncertain_ns = state.envelope.uncertain_ns(elapsed_ns / self.cycle_ns);
        let is_better = departure.is_paced() && !state.is_paced;
        if is_better || uncertain_ns > self.params.forget_ns {
            return self.restart(state, departure, PhaseConfidence::default());
        }
        let expected = state.expected_interval.expected(departure);
        let Some(cycles) = self.count(&mut state, departure, elapsed_ns) else {
            let confidence = state.confidence.with(false);
            return self.restart(state, departure, confidence);
        };
        state.cycle = state.cycle.saturating_add(cycles);
        state.index = departure.index;
        state.expected_interval.note(departure, self.cycle_ns, &self.params);
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
            index_contradictions: 0,
            is_paced: departure.is_paced(),
            paced_ns: departure.time_ns,
            expected_interval: ExpectedInterval::default(),
            confidence: PhaseConfidence::default(),
            late: LatenessRun::default(),
        });
        departure.time_ns
    }

    /// A telegram that nobody listened to: it left when its cycle came.
    fn follow(&mut self, mut state: State, departure: &Departure) -> i64 {
        let by_index =
            departure.index.zip(state.index).map(|(now, before)| i64::from(now.wrapping_sub(before)));
        let cycles = by_index
            .filter(|cycles| *cycles > 0)
            .unwrap_or_else(|| state.expected_interval.expected(departure));
        state.cycle = state.cycle.saturating_add(cycles);
        state.index = departure.index;
        let line_ns = state.envelope.at_ns(state.cycle).min(departure.time_ns);
        state.expected_interval.miss(line_ns);
        self.state = Some(state);
        line_ns
    }

    /// No cycle fits: from this departure on others are sought. What was learned of the rate stays.
    fn restart(&mut self, mut old: State, departure: &Departure, confidence: PhaseConfidence) -> i64 {
        old.envelope.restart(departure.time_ns);
        self.start(departure);
        if let Some(state) = &mut self.state {
            (state.envelope, state.confidence) = (old.envelope, confidence);
        }
        departure.time_ns
    }

    /// Cycles since the telegram before; `None` when nothing fits.
    fn count(&self, state: &mut State, departure: &Departure, elapsed_ns: i64) -> Option<i64> {
        if let Some(cycles) = self.count_by_index(state, departure, elapsed_ns) {
            return Some(cycles);
        }
        let expected = state.expected_interval.expected(departure);
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

    /// The index tells the cycles but for multiples of 256, which the departure tells. An index that the
    /// clock contradicts is doubted.
    fn count_by_index(&self, state: &mut State, departure: &Departure, elapsed_ns: i64) -> Option<i64> {
        let (now, before) = (departure.index?, state.index?);
        if state.index_contradictions >= MAX_CONTRADICTIONS {
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
            state.index_contradictions += 1;
            return None;
        }
        state.index_contradictions = 0;
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
        let bearing_ns = (self.nominal_ns as f64 * share) as i64;
        if departure.is_paced() || is_blind {
            state.confidence = state.confidence.with((-self.params.early_ns..=bearing_ns).contains(&late_ns));
            if late_ns < -self.params.near_ns {
                state.envelope.restart(departure.time_ns);
                (state.cycle, state.late) = (0, LatenessRun::default());
            } else {
                state.envelope.add(state.cycle, departure.time_ns);
                self.raise(state, departure.time_ns, late_ns);
            }
        }
        let line_ns = state.envelope.at_ns(state.cycle).min(departure.time_ns);
        let is_near = departure.time_ns - line_ns <= self.params.near_ns;
        let is_followed = match state.confidence.verdict(&self.params) {
            Verdict::Kept => true,
            Verdict::Unknown => is_near || !departure.is_paced(),
            Verdict::Broken => false,
        };
        if is_followed { line_ns } else { departure.time_ns }
    }

    /// When departures have all been late for a while, cycles were missed in the count, or the phase is
    /// another one.
    fn raise(&self, state: &mut State, time_ns: i64, late_ns: i64) {
        let Some(min_ns) = state.late.note(time_ns, late_ns, &self.params) else { return };
        let missed = min_ns.saturating_add(self.params.early_ns) / self.cycle_ns;
        state.cycle += missed;
        if min_ns - missed * self.cycle_ns > self.params.lateness.late_ns {
            state.envelope.restart(time_ns - (late_ns - min_ns));
            state.cycle = 0;
        }
    }
}
