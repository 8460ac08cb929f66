//! The times that an inertial unit states: ten-thousandths of a second, 32 bits, beside a count of messages.
//!
//! The time comes round after five days (in a unit that counts within the second, after each). One message in
//! 256 that are damaged passes the checksum: a time that does not follow the one before is believed only when
//! the next one follows it.

/// A unit's tick, microseconds.
const TICK_US: u64 = 100;
/// Until the time comes round, microseconds.
const ROUND_US: u64 = TICK_US << 32;
/// Ticks of a second.
const SECOND_TICKS: u32 = 10_000;
/// The unit's time and the host's pass alike, but for what is held back on the way, microseconds.
const HELD_BACK_US: u64 = 2_000_000;
/// The intervals of messages that follow one another differ by no more than this part, and a tick.
const SAME_INTERVAL: f64 = 0.1;
/// Messages counted on by at most this many follow one another.
const FOLLOWING: u16 = 3000;

/// What a message states.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct StatedTime {
    /// Ten-thousandths of a second.
    pub ticks: u32,
    /// Count of messages.
    pub counter: u16,
    /// When it came, nanoseconds of the host.
    pub now_ns: i64,
}

/// When a sample was taken.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct SampleTime {
    /// Microseconds of the unit's clock, which does not come round; less than before when it began anew.
    pub time_us: u64,
    /// The count of its message.
    pub counter: u16,
    /// From sample to sample, microseconds; 0 before it is known.
    pub interval_us: f64,
    /// Messages between the last one and this that did not arrive.
    pub missing: u16,
}

/// What a message's time is worth.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) enum Acceptance {
    /// It follows what came before.
    Accepted(SampleTime),
    /// It does not: the next one decides.
    Undecided,
    /// It does, and with it the one before, which was not believed yet.
    BothAccepted([SampleTime; 2]),
}

/// The clock.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct SampleClock {
    last: Option<StatedTime>,
    /// A time that does not follow the last.
    doubted: Option<StatedTime>,
    /// The unit has been told to measure: whatever it states first is believed.
    is_anew: bool,
    time_us: u64,
    interval_us: f64,
    rejected: u64,
}

impl SampleClock {
    /// The unit is told to measure.
    pub(crate) fn expect_anew(&mut self) {
        self.is_anew = true;
    }

    /// Times that were not believed, nor confirmed by the next.
    pub(crate) fn rejected(&self) -> u64 {
        self.rejected
    }

    /// What the time of a message is worth.
    pub(crate) fn take(&mut self, stated: StatedTime) -> Acceptance {
        let doubted = self.doubted.take();
        let is_first = std::mem::take(&mut self.is_anew) || self.last.is_none();
        let Some(last) = self.last.filter(|_| !is_first) else {
            self.rejected += u64::from(doubted.is_some());
            return Acceptance::Accepted(self.begin(stated));
        };
        if let Some(passed_us) = passed_us(last, stated, Some(self.interval_us)) {
            self.rejected += u64::from(doubted.is_some());
            return Acceptance::Accepted(self.go_on(last, stated, passed_us));
        }
        let follows = doubted.and_then(|before| Some((before, passed_us(before, stated, None)?)));
        if let Some((before, passed_us)) = follows {
            let first = self.begin(before);
            return Acceptance::BothAccepted([first, self.go_on(before, stated, passed_us)]);
        }
        self.rejected += u64::from(doubted.is_some());
        self.doubted = Some(stated);
        Acceptance::Undecided
    }

    /// The first message, or the first behind a pause, a reset or a change of the rate.
    fn begin(&mut self, stated: StatedTime) -> SampleTime {
        match self.last.and_then(|last| since_pause_us(last, stated)) {
            Some(pause_us) => self.time_us += pause_us,
            None => self.time_us = u64::from(stated.ticks) * TICK_US,
        }
        self.last = Some(stated);
        self.interval_us = 0.0;
        self.time(stated, 0)
    }

    fn go_on(&mut self, before: StatedTime, now: StatedTime, passed_us: u64) -> SampleTime {
        let counted = now.counter.wrapping_sub(before.counter);
        self.last = Some(now);
        self.time_us += passed_us;
        if counted == 1 {
            self.interval_us = passed_us as f64;
        }
        self.time(now, counted.saturating_sub(1))
    }

    fn time(&self, stated: StatedTime, missing: u16) -> SampleTime {
        let SampleClock { time_us, interval_us, .. } = *self;
        SampleTime { time_us, counter: stated.counter, interval_us, missing }
    }
}

/// How much of the unit's time has passed between two messages that follow each other; `None` when they do
/// not. Where no interval is known yet, the host's time judges.
fn passed_us(last: StatedTime, now: StatedTime, interval_us: Option<f64>) -> Option<u64> {
    let counted = now.counter.wrapping_sub(last.counter);
    if !(1..=FOLLOWING).contains(&counted) {
        return None;
    }
    let elapsed_us = now.now_ns.saturating_sub(last.now_ns).max(0) as u64 / 1000;
    passed_ticks(last.ticks, now.ticks).into_iter().flatten().map(|ticks| u64::from(ticks) * TICK_US).find(
        |&passed_us| match interval_us.filter(|interval_us| *interval_us > 0.0) {
            Some(interval_us) => {
                let expected_us = f64::from(counted) * interval_us;
                let allowed_us = TICK_US as f64 + SAME_INTERVAL * expected_us;
                (passed_us as f64 - expected_us).abs() <= allowed_us
            }
            None => passed_us > 0 && passed_us.abs_diff(elapsed_us) <= HELD_BACK_US,
        },
    )
}

/// What has passed since the last message before a pause, as the unit's clock says: if the host's agrees, it
/// did not begin anew. It may have come round meanwhile.
fn since_pause_us(last: StatedTime, now: StatedTime) -> Option<u64> {
    let elapsed_us = now.now_ns.saturating_sub(last.now_ns).max(0) as u64 / 1000;
    let passed_us = u64::from(now.ticks.wrapping_sub(last.ticks)) * TICK_US;
    let rounds = (elapsed_us + ROUND_US / 2).saturating_sub(passed_us) / ROUND_US;
    let passed_us = passed_us + rounds * ROUND_US;
    (passed_us.abs_diff(elapsed_us) <= HELD_BACK_US).then_some(passed_us)
}

/// Ticks between two times: of a clock of 32 bits, and of one that counts within the second.
fn passed_ticks(last: u32, now: u32) -> [Option<u32>; 2] {
    let is_within = last < SECOND_TICKS && now < last;
    [Some(now.wrapping_sub(last)), is_within.then(|| now + SECOND_TICKS - last)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn stated(ticks: u32, counter: u16, ms: i64) -> StatedTime {
        StatedTime { ticks, counter, now_ns: ms * MS }
    }

    /// The time of a message that is believed at once.
    fn accepted(clock: &mut SampleClock, stated: StatedTime) -> SampleTime {
        match clock.take(stated) {
            Acceptance::Accepted(time) => time,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_time_that_comes_round_goes_on() {
        let mut clock = SampleClock::default();
        let first = accepted(&mut clock, stated(u32::MAX - 149, 65_534, 0)).time_us;
        for n in 1..6_u32 {
            let counter = 65_534_u16.wrapping_add(n as u16);
            let at = stated((n * 100).wrapping_sub(150), counter, 10 * i64::from(n));
            let time = accepted(&mut clock, at);
            assert_eq!(time.time_us - first, u64::from(n) * 10_000);
            assert_eq!((time.missing, time.interval_us), (0, 10_000.0));
        }
        let mut within = SampleClock::default();
        let at = |n: u32| stated((9_900 + n * 100) % SECOND_TICKS, n as u16, 10 * i64::from(n));
        let times: Vec<u64> = (0..250).map(|n| accepted(&mut within, at(n)).time_us).collect();
        assert_eq!(times[249] - times[0], 2_490_000);
    }

    #[test]
    fn messages_that_are_missing_are_counted() {
        let mut clock = SampleClock::default();
        for n in 0..3 {
            clock.take(stated(1000 + 100 * n, n as u16, 10 * i64::from(n)));
        }
        let time = accepted(&mut clock, stated(2000, 10, 100));
        assert_eq!((time.missing, time.time_us, clock.rejected()), (7, 200_000, 0));
    }

    #[test]
    fn one_wild_time_is_left_out_and_a_unit_that_was_reset_is_believed_with_its_second_message() {
        let mut clock = SampleClock::default();
        for n in 0..5 {
            clock.take(stated(700_000 + 100 * n, 40 + n as u16, 10 * i64::from(n)));
        }
        assert_eq!(clock.take(stated(700_500 ^ 0x10_0000, 45, 50)), Acceptance::Undecided);
        let next = accepted(&mut clock, stated(700_600, 46, 60));
        assert_eq!((next.time_us, next.missing, clock.rejected()), (70_060_000, 1, 1));
        assert_eq!(clock.take(stated(3_000, 0, 900)), Acceptance::Undecided);
        let Acceptance::BothAccepted(anew) = clock.take(stated(3_100, 1, 910)) else {
            panic!("two that agree")
        };
        assert_eq!(anew.map(|time| (time.time_us, time.missing)), [(300_000, 0), (310_000, 0)]);
        // Set to another rate: 400 a second, the time goes on.
        assert_eq!(clock.take(stated(4_000, 2, 1000)), Acceptance::Undecided);
        let Acceptance::BothAccepted(faster) = clock.take(stated(4_025, 3, 1003)) else {
            panic!("two that agree")
        };
        assert_eq!(faster.map(|time| (time.time_us, time.interval_us)), [(400_000, 0.0), (402_500, 2_500.0)]);
        // Told to measure: the first is believed, five days later as well.
        clock.expect_anew();
        let round_ms = ROUND_US as i64 / 1000;
        let later = accepted(&mut clock, stated(4_125, 900, 1013 + round_ms));
        assert_eq!((later.time_us - 402_500 - ROUND_US, clock.rejected()), (10_000, 1));
        clock.expect_anew();
        let reset = accepted(&mut clock, stated(77, 0, 2013 + round_ms));
        assert_eq!(reset.time_us, 7_700);
        assert_eq!(clock.rejected(), 1);
    }
}
