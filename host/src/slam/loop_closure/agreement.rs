//! How two submaps agree at a pose: of what each saw, how much lies on the other's surfaces, and how much
//! speaks against that.
//!
//! A point speaks against it where the other one saw free space, or a surface that lies beside. Only what the
//! other one looked at counts, from the side that the point is on. On the way back along a corridor a laser
//! that looks ahead sees other faces than on the way there, and misses none of those.

use biplane_geometry::PortableMath;
use biplane_matcher::{EndPoint, Placement, Pose2};

use crate::slam::keyframes::submap::Submap;
use crate::slam::submap_alignment;

/// How two submaps agree at a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Of the points that lie where the other submap looked, the share that it explains; the smaller of both
    /// ways.
    pub share: f64,
    /// The same of the points whose surfaces face along the direction that is known least: a corridor's door
    /// jambs and ends.
    pub along: f64,
    /// How many such points there are to tell.
    pub along_points: usize,
    /// Share of all points that the other submap explains; the larger of both ways.
    pub overlap: f64,
}

impl Agreement {
    /// At a pose of `query` in `reference`; `weak` is the direction known least, in the reference's axes.
    pub(crate) fn of(reference: &Submap, query: &Submap, pose: &Pose2, weak: [f32; 2]) -> Self {
        let back = pose.inverse();
        let turned = seen_from(pose, weak);
        let one = Tally::of(reference, &query.points, pose, weak);
        let other = Tally::of(query, &reference.points, &back, turned);
        Self {
            share: one.all.share().min(other.all.share()),
            along: one.along.share().min(other.along.share()),
            along_points: one.along.judged().min(other.along.judged()),
            overlap: one.overlap().max(other.overlap()),
        }
    }
}

/// Points of one kind, counted.
#[derive(Clone, Copy, Debug, Default)]
struct Votes {
    explained: usize,
    contradicted: usize,
}

impl Votes {
    fn judged(&self) -> usize {
        self.explained + self.contradicted
    }

    fn share(&self) -> f64 {
        self.explained as f64 / self.judged().max(1) as f64
    }
}

/// What a submap says of another one's points.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    all: Votes,
    along: Votes,
    points: usize,
}

/// A point farther from every surface than this, and not in free space, lies where nobody looked, meters.
const DISPLACED_M: f32 = 0.3;

impl Tally {
    fn of(submap: &Submap, points: &[EndPoint], pose: &Pose2, weak: [f32; 2]) -> Self {
        let placement = Placement::new(pose);
        let mut tally = Self { points: points.len(), ..Self::default() };
        for point in points {
            let point = point.placed(&placement);
            let is_along = (point.normal[0] * weak[0] + point.normal[1] * weak[1]).abs() > 0.7;
            let explained = submap.surfaces.explains(&point, submap_alignment::EXPLAINED_M as f32);
            // Beside a surface, not on it: a wall that has moved.
            let contradicted = !explained
                && (submap.free.is_free(point.at_m) || submap.surfaces.explains(&point, DISPLACED_M))
                && submap.viewpoints.looked_at(&point);
            for votes in [Some(&mut tally.all), is_along.then_some(&mut tally.along)].into_iter().flatten() {
                votes.explained += usize::from(explained);
                votes.contradicted += usize::from(contradicted);
            }
        }
        tally
    }

    fn overlap(&self) -> f64 {
        self.all.explained as f64 / self.points.max(1) as f64
    }
}

/// A direction in the axes of a pose.
pub(crate) fn seen_from(pose: &Pose2, [x, y]: [f32; 2]) -> [f32; 2] {
    let (sin, cos) = pose.theta_rad.portable_sin_cos();
    let (sin, cos) = (sin as f32, cos as f32);
    [cos * x + sin * y, cos * y - sin * x]
}
