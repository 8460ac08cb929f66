//! What the reads of a telegram tell of its departure, and of how it came.

use super::*;
use crate::stamping::arrivals::Arrivals;
use crate::stamping::arrivals::Bound;
use crate::stamping::arrivals::Pace;
use crate::types::byte_time::byte_time_ns;

#[test]
fn without_a_read_of_the_telegram_there_is_no_departure() {
    let at = |arrivals: &Arrivals, offset, length| {
        arrivals.departure(&extent(offset, length, 1000)).map(|bound| bound.time_ns)
    };
    let mut arrivals = Arrivals::default();
    assert_eq!(at(&arrivals, 0, 10), None);
    arrivals.push(10, 5_000_000);
    assert_eq!(at(&arrivals, 10, 4), None);
    assert_eq!(at(&arrivals, 8, 2), Some(5_000_000 - 2 * 1000));
    assert_eq!(at(&arrivals, 8, 4), Some(5_000_000 - 2 * 1000));
}

#[test]
fn what_came_in_the_same_read_behind_a_telegram_tells_when_it_left() {
    let mut arrivals = Arrivals::default();
    // Three telegrams of 10 bytes and 4 bytes of a fourth, all in one read at 100 ms; a telegram leaves every
    // 13.32 ms at the soonest.
    arrivals.push(34, 100_000_000);
    let fourth_ns = 100_000_000 - 4 * 1000;
    for number in 0..3_i64 {
        let bound = arrivals.departure(&extent(number as u64 * 10, 10, 1000)).unwrap();
        assert_eq!(
            bound,
            Bound { time_ns: fourth_ns - (3 - number) * TURN_NS, pace: Pace::AtOnce, is_overdue: false }
        );
    }
}

/// Reads of a telegram of 360 bytes whose byte takes 20 us: (bytes so far, ms).
fn pace(reads: &[(u64, f64)]) -> Pace {
    let mut arrivals = Arrivals::default();
    for &(bytes, ms) in reads {
        arrivals.push(bytes, (ms * 1e6) as i64);
    }
    arrivals.departure(&extent(0, 360, 20_000)).unwrap().pace
}

#[test]
fn bytes_that_came_at_the_lines_pace_were_not_held_back() {
    assert_eq!(pace(&[(62, 1.3), (124, 2.6), (186, 3.8), (248, 5.0), (310, 6.5), (360, 7.3)]), Pace::Line);
    assert_eq!(pace(&[(62, 9.0), (124, 9.0), (186, 9.1), (248, 9.2), (310, 9.2), (360, 9.2)]), Pace::AtOnce);
    assert_eq!(pace(&[(360, 7.3)]), Pace::AtOnce);
    // Two reads 4 ms apart: perhaps the line, perhaps two hiccups.
    assert_eq!(pace(&[(100, 5.0), (360, 9.2)]), Pace::Spread);
    // A latency timer ran out after 100 bytes, and again 16 ms later.
    assert_eq!(pace(&[(100, 2.1), (360, 18.1)]), Pace::Line);
}

#[test]
fn the_first_bytes_of_a_device_that_sends_a_little_too_fast_decide() {
    // 38461.5 Bd instead of 38400: 732 bytes take 0.3 ms less than they should.
    let byte_ns = byte_time_ns(38_400);
    let mut arrivals = Arrivals::default();
    for bytes in (24..=732_u64).step_by(12) {
        arrivals.push(bytes, (bytes as f64 * 10e9 / 38_461.5) as i64);
    }
    let bound = arrivals.departure(&extent(0, 732, byte_ns)).unwrap();
    assert!(bound.pace == Pace::Line && bound.time_ns.abs() < 90_000, "{bound:?}");
}
