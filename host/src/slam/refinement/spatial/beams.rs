//! Beams of both lasers, in the base's frame, each with its own time: what the refinement looks at.

use crate::recordings::scan_geometry::{RangeScan, ScanGeometry};
use crate::slam::refinement::spatial::knots::{Knots, State};
use biplane_geometry::PortableMath;
use nalgebra::{Point3, Vector3};

/// Which laser.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Laser {
    /// The one that localizes.
    Horizontal,
    /// The one that sees the building.
    Vertical,
}

/// One beam that hit something.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BeamHit {
    /// Where, in `base_link`, meters.
    pub at_m: [f32; 3],
    /// The beam's direction in `base_link`.
    pub along: [f32; 3],
    /// The knot before its time.
    pub knot: u32,
    /// Share of the way to the next knot.
    pub share: f32,
    /// Its scan's number among those of its laser.
    pub scan: u32,
    /// Which laser.
    pub laser: Laser,
    /// Not used to find poses, but to judge them.
    pub is_held_out: bool,
}

impl BeamHit {
    /// The place in the base's frame.
    pub(crate) fn at(&self) -> [f64; 3] {
        self.at_m.map(f64::from)
    }

    /// The base's state at the beam's time.
    pub(crate) fn state(&self, knots: &Knots) -> State {
        knots.between(self.knot as usize, f64::from(self.share))
    }

    /// Where it hit, in `map`.
    pub(crate) fn placed(&self, knots: &Knots) -> [f64; 3] {
        super::knots::placed(&self.state(knots), self.at())
    }
}

/// A point as planes are sought in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub at_m: [f64; 3],
    pub laser: Laser,
    /// Piece of the way on which it was seen.
    pub piece: u32,
}

/// Nearer echoes are the robot itself, meters.
const RANGE_MIN_M: f64 = 0.1;
/// A range that differs from both neighbors by more than this and so much of itself hangs in the air: a mixed
/// pixel.
const ALONE_M: f64 = 0.06;
const ALONE_SHARE: f64 = 0.06;
/// One of so many beams is held out.
const HELD_OUT: usize = 4;

/// Which beams are taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Choice {
    /// See `SpatialParams`.
    pub beams_per_s: f64,
    /// See `SpatialParams`.
    pub range_max_m: f64,
}

/// Takes beams of a laser's scans, evenly over each scan, as many a second as are wanted; scan by scan.
pub(crate) fn beam_hits<'a>(
    laser: Laser,
    geometry: &'a ScanGeometry,
    range_scans: &'a [RangeScan],
    knots: &'a Knots,
    choice: Choice,
) -> impl Iterator<Item = Vec<BeamHit>> + 'a {
    let duration_s = knots.step_s() * knots.states.len() as f64;
    let all_per_s = (geometry.beams.len() * range_scans.len()) as f64 / duration_s.max(1.0);
    let every = (all_per_s / choice.beams_per_s).round().max(1.0) as usize;
    let origin = geometry.base_from_laser * Point3::origin();
    let directions: Vec<Vector3<f64>> = geometry
        .beams
        .iter()
        .map(|beam| {
            geometry.base_from_laser
                * Vector3::new(beam.angle_rad.portable_cos(), beam.angle_rad.portable_sin(), 0.0)
        })
        .collect();
    range_scans.iter().enumerate().map(move |(scan, range_scan)| {
        let mut hits = Vec::new();
        let mut taken = scan; // so that other beams are held out in other scans
        let count = range_scan.ranges_m.len().min(directions.len());
        for beam in (scan % every..count).step_by(every) {
            let range_m = f64::from(range_scan.ranges_m[beam]);
            if !(RANGE_MIN_M..=choice.range_max_m).contains(&range_m) || is_alone(&range_scan.ranges_m, beam)
            {
                continue;
            }
            let stamp_ns = range_scan.stamp_ns.saturating_add(geometry.beams[beam].delay_ns);
            let Some((knot, share)) = knots.place(stamp_ns) else { continue };
            taken += 1;
            hits.push(BeamHit {
                at_m: (origin.coords + directions[beam] * range_m).map(|v| v as f32).into(),
                along: directions[beam].map(|v| v as f32).into(),
                knot: knot as u32,
                share: share as f32,
                scan: scan as u32,
                laser,
                is_held_out: taken % HELD_OUT == 0,
            });
        }
        hits
    })
}

/// Whether a range is far from those of both neighbors.
fn is_alone(ranges_m: &[f32], beam: usize) -> bool {
    let range_m = f64::from(ranges_m[beam]);
    let limit_m = ALONE_M + ALONE_SHARE * range_m;
    let far = |other: Option<usize>| {
        let other_m = other.and_then(|other| ranges_m.get(other)).map_or(f64::NAN, |range| f64::from(*range));
        other_m.is_nan() || (other_m - range_m).abs() > limit_m
    };
    far(beam.checked_sub(1)) && far(beam.checked_add(1))
}
