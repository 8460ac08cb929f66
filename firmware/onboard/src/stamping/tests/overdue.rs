//! Telegrams that lay in the kernel's buffer while the process stood still.

use super::*;
use crate::stamping::arrivals::Pace;
use crate::stamping::departure::Departure;
use crate::stamping::departure::HostState;

#[test]
fn telegrams_that_lay_unread_for_a_minute_are_stamped_when_their_cycles_came() {
    for index in [false, true] {
        let mut clock = turn_clock();
        let true_ns = |scan: i64| 5_000_000_000 + scan * 8 * 13_320_000;
        for scan in 0..200 {
            let index = index.then_some((scan * 8) as u8);
            clock.smooth(&Departure { min_cycles: 8, index, ..departure(true_ns(scan)) });
        }
        for scan in 200..211 {
            let index = index.then_some((scan * 8) as u8);
            let overdue = Departure {
                min_cycles: 8,
                index,
                pace: Pace::AtOnce,
                host: HostState::Overdue,
                ..departure(true_ns(211) + 60_000_000_000)
            };
            let off_ns = clock.smooth(&overdue) - true_ns(scan);
            assert!(off_ns.abs() < 100_000, "scan {scan}: {off_ns} ns");
        }
        // What comes behind them, and is listened to, tells its own time.
        let next_ns = true_ns(211) + 60_123_000_000;
        let resumed = Departure { host: HostState::Resumed, is_next: false, ..departure(next_ns) };
        assert_eq!(clock.smooth(&resumed), next_ns);
    }
}
