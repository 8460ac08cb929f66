//! The scans of a recording that a list of pairs means.
//!
//! A list's stamps are good to a few milliseconds, and in recordings with bursts several scans lie as close
//! to a stamp as that. Then the scan that is meant is the one which lies best on the other at the pair's true
//! pose (no matching is done for that).

use biplane_matcher::{Beam, Scan};

use crate::engine::localize::tracker_inputs::KeptScans;
use crate::replay::basin::overlay::{end_points, gap_m};
use crate::replay::basin::pairs::Pair;

/// A scan this close to a stamp may be the one that is meant, nanoseconds.
const TOLERANCE_NS: i64 = 6_000_000;

/// A scan with the memory of its beams.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct OwnScan {
    stamp_ns: i64,
    laser_in_base_m: [f64; 2],
    beams: Vec<Beam>,
}

impl OwnScan {
    /// The scan as the matcher takes it. Its beams count as simultaneous: nothing is known of the base's
    /// motion.
    pub(crate) fn scan(&self) -> Scan<'_> {
        Scan {
            stamp_ns: self.stamp_ns,
            laser_in_base_m: self.laser_in_base_m,
            beams: &self.beams,
            twist_in_base: [0.0; 3],
        }
    }
}

/// The two scans of a pair, and whether there was a choice; the stamp that no scan bears when there is none.
pub(crate) fn scans_of(kept: &KeptScans, pair: &Pair) -> Result<([OwnScan; 2], bool), i64> {
    let [firsts, seconds] = pair.stamps_ns.map(|stamp_ns| near(kept, stamp_ns));
    let gap = |a: &OwnScan, b: &OwnScan| {
        gap_m(&end_points(&a.scan()), &end_points(&b.scan()), &pair.first_from_second)
    };
    let ambiguous = firsts.len() * seconds.len() > 1;
    let both = firsts.iter().flat_map(|first| seconds.iter().map(move |second| (first, second)));
    let best = both.min_by(|a, b| gap(a.0, a.1).total_cmp(&gap(b.0, b.1)));
    best.map(|(first, second)| ([first.clone(), second.clone()], ambiguous))
        .ok_or(pair.stamps_ns[usize::from(!firsts.is_empty())])
}

fn near(kept: &KeptScans, stamp_ns: i64) -> Vec<OwnScan> {
    let is_near = |other_ns: i64| other_ns.abs_diff(stamp_ns) <= TOLERANCE_NS.unsigned_abs();
    let indices = kept.stamps_ns().enumerate().filter(|(_, other_ns)| is_near(*other_ns));
    indices.filter_map(|(index, _)| own(kept, index)).collect()
}

fn own(kept: &KeptScans, index: usize) -> Option<OwnScan> {
    let mut beams = Vec::new();
    let (scan, _) = kept.get(index, &mut beams)?;
    let (stamp_ns, laser_in_base_m) = (scan.stamp_ns, scan.laser_in_base_m);
    Some(OwnScan { stamp_ns, laser_in_base_m, beams })
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_matcher::Pose2;

    /// A scan of a wall ahead at this distance and one to the left, meters.
    fn push(kept: &mut KeptScans, ms: i64, ahead_m: f32) {
        let beam = |direction_in_base, range_m| Beam { direction_in_base, range_m, delay_s: 0.0 };
        let beams = [beam([1.0, 0.0], ahead_m), beam([0.0, 1.0], 2.0)];
        let stamp_ns = ms * 1_000_000;
        kept.push(
            &Scan { stamp_ns, laser_in_base_m: [0.0; 2], beams: &beams, twist_in_base: [1.0; 3] },
            None,
        );
    }

    fn pair(first_ms: i64, second_ms: i64) -> Pair {
        let stamps_ns = [first_ms, second_ms].map(|ms| ms * 1_000_000);
        Pair { stamps_ns, first_from_second: Pose2::new(0.5, 0.0, 0.0) }
    }

    #[test]
    fn of_scans_with_one_stamp_the_one_is_taken_that_lies_best_on_the_other() {
        let mut kept = KeptScans::default();
        push(&mut kept, 1000, 3.0);
        for (ms, ahead_m) in [(2002, 2.6), (2001, 2.5), (2000, 2.4)] {
            push(&mut kept, ms, ahead_m);
        }
        let ([first, second], ambiguous) = scans_of(&kept, &pair(1001, 2000)).unwrap();
        assert!(ambiguous);
        assert_eq!([first.scan().beams[0].range_m, second.scan().beams[0].range_m], [3.0, 2.5]);
        assert_eq!(second.scan().twist_in_base, [0.0; 3]);
    }

    #[test]
    fn a_stamp_that_no_scan_bears_comes_back() {
        let mut kept = KeptScans::default();
        push(&mut kept, 1000, 3.0);
        assert_eq!(scans_of(&kept, &pair(1000, 1007)), Err(1_007_000_000));
        assert_eq!(scans_of(&kept, &pair(990, 1000)), Err(990_000_000));
        assert!(!scans_of(&kept, &pair(1000, 1006)).unwrap().1);
    }
}
