//! One scan found in another one alone: what a tracker does that has seen a single scan and has no odometry,
//! for whoever has two scans and a guess (loop closing, measuring the basin of convergence).
//!
//! The parts are the tracker's own: the method's map or field of the reference scan, the search around the
//! guess, the alignment. Frame: the base at the reference scan. Units: meters, radians. Everything is
//! allocated by [`PairMatcher::new`].

use nalgebra::{Matrix3, Vector3};

use crate::map::MapParams;
use crate::params::TrackerParams;
use crate::registration::covariance::{inverse, rows, weakest_sigma_m};
use crate::registration::gauss_newton::params::WEAK_M;
use crate::registration::gauss_newton::prior::Prior;
use crate::registration::journal::Journal;
use crate::registration::search::Window;
use crate::registration::verdict::Verdict;
use crate::scan::Scan;
use crate::scan::end_points::EndPoints;
use crate::tracker::method::Engine;
use biplane_geometry::Pose2;

/// Tiles for the surroundings of one scan: half a disk of 40 m takes 1,000 tiles of 1.6 m.
const TILES: usize = 1024;
/// Nobody knows a guess better than this, meters and radians.
const SUREST: f64 = 1e-3;

/// Where the second scan's base is held to be, seen from the reference scan's. Infinite half widths: nothing
/// is known, and the search goes as far as it ever does: one meter each way, 30 degrees to either side.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Guess {
    /// The most likely place, `reference_from_base`.
    pub reference_from_base: Pose2,
    /// It may be off by so much in x and in y, meters. The method `map` searches that far.
    pub half_m: f64,
    /// It may be off by so much in heading, radians. The method `map` searches that far.
    pub half_rad: f64,
}

/// A scan found in another.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct PairMatch {
    /// The base at the second scan, seen from the base at the reference scan.
    pub reference_from_base: Pose2,
    /// What the scans alone know of x (m), y (m) and theta (rad): the inverse of a covariance, in the
    /// reference's axes. Along a bare corridor it is about zero.
    pub information: [[f64; 3]; 3],
    /// Share of the second scan's end points that the reference explains, of those in its sight, 0 to 1.
    pub score: f64,
    /// Iterations of all alignments that were tried.
    pub iterations: u32,
    /// Whether the match is to be believed: enough of the second scan lies in the reference's sight, and
    /// enough of that is explained.
    pub found: bool,
}

impl PairMatch {
    /// Covariance of x (m), y (m) and theta (rad) in the reference's axes, by the scans alone; `None` when
    /// they leave some direction open, as along a bare corridor.
    #[must_use]
    pub fn covariance(&self) -> Option<[[f64; 3]; 3]> {
        let information = Matrix3::from_fn(|row, column| self.information[row][column]);
        if weakest_sigma_m(&information) > WEAK_M {
            return None;
        }
        inverse(&information).map(|covariance| rows(&covariance))
    }
}

/// Finds scans in a reference scan.
#[derive(Clone, Debug)]
pub struct PairMatcher {
    points: EndPoints,
    engine: Engine,
}

impl PairMatcher {
    /// A matcher without a reference: nothing is found.
    #[must_use]
    pub fn new(params: TrackerParams) -> Self {
        let tiles = params.map.tiles.min(TILES);
        let surfaces = params.map.surfaces.min(params.points.max_beams);
        let params = TrackerParams { map: MapParams { tiles, surfaces, ..params.map }, ..params };
        Self { points: EndPoints::new(params.points), engine: Engine::new(&params) }
    }

    /// Takes the scan to find others in; the one before is forgotten.
    pub fn set_reference(&mut self, scan: &Scan) {
        self.points.fill(scan);
        self.engine.forget();
        self.engine.learn(&Pose2::IDENTITY, &self.points, Verdict::NewGround);
    }

    /// Keeps from here on the iterations of each call of [`PairMatcher::find`], so many at most.
    pub fn keep_journal(&mut self, iterations: usize) {
        *self.engine.journal_mut() = Journal::with_capacity(iterations);
    }

    /// The iterations of the last call of [`PairMatcher::find`]; empty unless [`PairMatcher::keep_journal`]
    /// was called.
    #[must_use]
    pub fn journal(&self) -> &Journal {
        self.engine.journal()
    }

    /// Finds a scan in the reference. Without a usable range, or from a guess that is no number, the guess
    /// comes back as not found.
    pub fn find(&mut self, scan: &Scan, guess: &Guess) -> PairMatch {
        self.engine.journal_mut().begin();
        self.points.fill(scan);
        if self.points.are_too_few() || !guess.reference_from_base.is_finite() {
            return PairMatch {
                reference_from_base: guess.reference_from_base,
                information: [[0.0; 3]; 3],
                score: 0.0,
                iterations: 0,
                found: false,
            };
        }
        let prior = prior(guess);
        let window = Window { half_m: guess.half_m, half_rad: guess.half_rad };
        let (alignment, verdict) = self.engine.locate(&self.points, &prior, &[], window, window);
        PairMatch {
            reference_from_base: alignment.pose,
            information: rows(&alignment.information),
            score: alignment.fit.score(),
            iterations: alignment.iterations,
            found: verdict == Verdict::Found,
        }
    }
}

/// A guess as the tracker's prior: half widths count as standard deviations.
fn prior(guess: &Guess) -> Prior {
    let information = |half: f64| half.max(SUREST).powi(-2);
    let (place, heading) = (information(guess.half_m), information(guess.half_rad));
    Prior {
        measured: false,
        gives_way: true,
        mean: guess.reference_from_base,
        information: Matrix3::from_diagonal(&Vector3::new(place, place, heading)),
    }
}
