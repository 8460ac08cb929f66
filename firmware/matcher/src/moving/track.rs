//! A thing that stands free and is followed from scan to scan, and what it is known to be.
//!
//! Frames: map and base. Units: meters.

use biplane_geometry::vec2::{distance, minus, norm};

use crate::moving::segments::Segment;
use crate::placement::Placement;
use crate::scan::end_points::Mobility;

/// A thing is static when it has kept its place while the place that it would have had if it went along with
/// the base moved away from it so far, meters.
const APART_M: f32 = 0.7;
/// What is farther from where it was first seen than this and its own size has moved, meters.
const MOVED_M: f32 = 0.3;
/// What is closer to where it was first seen than this and its own size has kept its place, meters.
const KEPT_M: f32 = 0.12;
/// What the newest step counts for how far a thing goes from scan to scan.
const STEP_RATE: f32 = 0.3;
/// As fast as something else is what differs by no more than this share of the way.
const AS_FAST: f32 = 0.3;
/// So often a thing is seen before it is static.
const SEEN: u32 = 3;

/// So many places are expected of a thing.
pub(crate) const PLACES: usize = 3;

/// A thing that is followed.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Track {
    /// What it is known to be.
    pub mobility: Mobility,
    /// Where it was first seen: in the map, and in the base.
    first_m: [f32; 2],
    first_in_base_m: [f32; 2],
    /// Where it was last seen: in the map, and in the base.
    at_m: [f32; 2],
    in_base_m: [f32; 2],
    /// How far it goes in the map from scan to scan, meters.
    step_m: [f32; 2],
    /// So many scans have usually come in the time since it was seen.
    scans: f32,
    /// Half its length, the longest seen.
    pub half_m: f32,
    seen: u32,
    /// So many scans in a row have not shown it.
    pub missed: u32,
}

impl Track {
    /// A thing that is seen for the first time.
    pub(crate) fn new(segment: &Segment, placement: &Placement) -> Self {
        let at_m = placement.place(segment.at_m);
        Self {
            mobility: Mobility::Unknown,
            first_m: at_m,
            first_in_base_m: segment.at_m,
            at_m,
            in_base_m: segment.at_m,
            step_m: [0.0; 2],
            scans: 0.0,
            half_m: segment.half_m,
            seen: 1,
            missed: 0,
        }
    }

    /// So many scans usually come in the time that has passed.
    pub(crate) fn wait(&mut self, scans: f32) {
        self.scans += scans;
    }

    /// Where it is expected, whether it stands, goes along with the base, or goes on as before.
    pub(crate) fn places_m(&self, placement: &Placement) -> [[f32; 2]; PLACES] {
        [self.at_m, placement.place(self.in_base_m), self.ahead_m()]
    }

    /// Where it is by now when it goes on as before.
    pub(crate) fn ahead_m(&self) -> [f32; 2] {
        [0, 1].map(|axis| self.at_m[axis] + self.scans * self.step_m[axis])
    }

    /// Whether it was seen often enough to be told from a glimpse.
    pub(crate) fn is_known(&self) -> bool {
        self.seen >= SEEN
    }

    /// Takes note of where it is seen.
    pub(crate) fn see(&mut self, segment: &Segment, placement: &Placement) {
        let at_m = placement.place(segment.at_m);
        let scans = std::mem::take(&mut self.scans).max(1.0);
        self.step_m = [0, 1].map(|axis| {
            let step_m = (at_m[axis] - self.at_m[axis]) / scans;
            self.step_m[axis] + STEP_RATE * (step_m - self.step_m[axis])
        });
        self.at_m = at_m;
        self.in_base_m = segment.at_m;
        self.half_m = self.half_m.max(segment.half_m);
        self.seen += 1;
        self.missed = 0;
        let along_m = minus(placement.place(self.first_in_base_m), self.first_m);
        let (moved_m, apart_m) = (distance(self.at_m, self.first_m), norm(along_m));
        // What the base comes by twice as fast as it should stands, and the odometry's sign is wrong.
        let twice_m = [0, 1].map(|axis| self.first_m[axis] + 2.0 * along_m[axis]);
        let is_passed_twice_as_fast = distance(self.at_m, twice_m) < AS_FAST * apart_m;
        if moved_m > MOVED_M + self.half_m {
            if !is_passed_twice_as_fast {
                self.mobility = Mobility::Dynamic;
            }
        } else if self.mobility == Mobility::Unknown
            && self.is_known()
            && apart_m > APART_M + self.half_m
            && moved_m < KEPT_M + self.half_m
        {
            self.mobility = Mobility::Static;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_geometry::Pose2;

    #[test]
    fn what_walks_is_expected_farther_on_the_more_scans_were_dropped() {
        let seen_at =
            |x_m: f32| Segment { first: 0, last: 3, at_m: [x_m, 0.0], half_m: 0.1, is_hidden: [false; 2] };
        let placement = Placement::new(&Pose2::IDENTITY);
        let mut track = Track::new(&seen_at(0.0), &placement);
        for scan in 1..=20 {
            track.wait(1.0);
            track.see(&seen_at(0.2 * scan as f32), &placement);
        }
        track.wait(3.0);
        assert!(distance(track.ahead_m(), [4.6, 0.0]) < 0.01, "{:?}", track.ahead_m());
        let off_m = |at_m| {
            track.places_m(&placement).map(|place_m| distance(place_m, at_m)).into_iter().fold(9.0, f32::min)
        };
        assert!(off_m([4.6, 0.0]) < 0.01 && off_m([4.3, 0.0]) > 0.25);
    }
}
