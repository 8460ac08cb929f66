//! Recorded arrival times back onto a mirror's turns.
//!
//! A laser's scans leave on the boundaries between its mirror's turns; a capture has the times at which they
//! were read, late by what the adapter added (0.3 ms on average, up to 8 ms now and then). The earliest
//! arrivals show where the boundaries are; every other one belongs to the boundary before it. Times that
//! follow no mirror, such as those of an imported log, stay as they are. Order is kept.

/// When recorded scans leave.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Slots {
    /// Time of each scan relative to the origin given, strictly rising.
    pub starts_ns: Vec<i64>,
    /// Where the boundaries between turns are, when the scans follow a mirror.
    pub phase_ns: Option<i64>,
}

/// Arrivals that are looked at to find the boundaries: enough to meet an undelayed one, few enough that the
/// mirror's drift against ours does not matter.
const FOR_PHASE: usize = 200;

/// An arrival this little before a boundary counts as on it: reading times are rounded to bytes.
const TOLERANCE_NS: i64 = 300_000;

/// Scans follow a mirror when most of them come no later than this behind their boundary.
const USUAL_LATENESS_NS: i64 = 2_000_000;

/// Puts times (relative to an origin) onto boundaries `turn_ns` apart, if they follow a mirror.
#[must_use]
pub fn onto_turns(times_ns: &[i64], turn_ns: i64) -> Slots {
    let phase_ns = phase(times_ns, turn_ns).filter(|phase_ns| follow_mirror(times_ns, *phase_ns, turn_ns));
    let mut starts_ns: Vec<i64> = Vec::with_capacity(times_ns.len());
    for &time_ns in times_ns {
        let (start_ns, step_ns) = match phase_ns {
            Some(phase_ns) => (time_ns - lateness(time_ns, phase_ns, turn_ns) + TOLERANCE_NS, turn_ns),
            None => (time_ns, 1),
        };
        let earliest_ns = starts_ns.last().map_or(start_ns, |last_ns| last_ns + step_ns);
        starts_ns.push(start_ns.max(earliest_ns));
    }
    Slots { starts_ns, phase_ns }
}

/// How far behind its boundary (less the tolerance) a time lies: 0 up to a turn.
fn lateness(time_ns: i64, phase_ns: i64, turn_ns: i64) -> i64 {
    (time_ns - phase_ns + TOLERANCE_NS).rem_euclid(turn_ns)
}

/// The earliest of the residuals, the boundary being where all others lie as little behind it as possible.
fn phase(times_ns: &[i64], turn_ns: i64) -> Option<i64> {
    let first = &times_ns[..times_ns.len().min(FOR_PHASE)];
    let late = |phase_ns: i64| first.iter().map(|&time_ns| lateness(time_ns, phase_ns, turn_ns)).sum::<i64>();
    let near_ns =
        first.iter().map(|time_ns| time_ns.rem_euclid(turn_ns)).min_by_key(|phase_ns| late(*phase_ns))?;
    let earliest_ns = first.iter().map(|&time_ns| lateness(time_ns, near_ns, turn_ns)).min()?;
    Some((near_ns + earliest_ns - TOLERANCE_NS).rem_euclid(turn_ns))
}

fn follow_mirror(times_ns: &[i64], phase_ns: i64, turn_ns: i64) -> bool {
    let first = &times_ns[..times_ns.len().min(FOR_PHASE)];
    let late =
        first.iter().filter(|&&time_ns| lateness(time_ns, phase_ns, turn_ns) > USUAL_LATENESS_NS).count();
    late * 4 <= first.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    const TURN_NS: i64 = 13_320_000;

    #[test]
    fn late_reads_find_back_to_their_turns() {
        let mut rng = Rng::new(3, 0, 0);
        let mut times_ns = Vec::new();
        for scan in 0..400 {
            let hiccup_ms = if rng.unit() < 0.01 { rng.between(0.0, 8.0) } else { 0.0 };
            let late_ms = rng.exponential(0.3) + hiccup_ms;
            times_ns.push(2_000_000 + scan * 8 * TURN_NS + (late_ms * 1e6) as i64);
        }
        let slots = onto_turns(&times_ns, TURN_NS);
        assert!(slots.phase_ns.is_some());
        for (scan, start_ns) in (0..).zip(&slots.starts_ns) {
            let error_ns = start_ns - (2_000_000 + scan * 8 * TURN_NS);
            assert!(error_ns.abs() < 100_000, "scan {scan}: {error_ns} ns");
        }
    }

    #[test]
    fn scans_of_a_faster_mirror_keep_their_order_a_turn_apart() {
        let times_ns: Vec<i64> = (0..10_000).map(|scan| scan * (TURN_NS - 2_000)).collect();
        let slots = onto_turns(&times_ns, TURN_NS);
        assert!(slots.starts_ns.windows(2).all(|pair| pair[1] >= pair[0] + TURN_NS));
    }

    #[test]
    fn times_that_follow_no_mirror_stay_as_they_are() {
        let mut rng = Rng::new(4, 0, 0);
        let times_ns: Vec<i64> =
            (0..300).map(|scan| scan * 200_000_000 + (rng.unit() * 5e7) as i64).collect();
        assert_eq!(onto_turns(&times_ns, TURN_NS), Slots { starts_ns: times_ns, phase_ns: None });
    }
}
