//! Correlative search: tries every pose of a lattice around a guess and keeps the few that put most end
//! points close to mapped surfaces and fewest into space known to be free (after Olson 2009, on one level).
//!
//! Frame: map. Units: meters, radians. The cost is bounded by the lattice's size, which the caller limits.

use crate::lanes::{InLanes, widest};
use crate::map::LocalMap;
use crate::map::grid::{floor_in_lanes, whole};
use crate::parameter_group::parameter_group;
use crate::placement::Placement;
use crate::registration::search::shift_sums::ShiftSums;
use crate::registration::search::{Candidate, Window};
use crate::scan::end_points::EndPoints;
use biplane_geometry::{Pose2, wrap_angle};

parameter_group! { "search";
/// The search when the alignment from the prior is poor.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct SearchParams {
    /// The search looks at least this far each way, meters, and as far as three standard deviations of the
    /// prior. Larger: slower, and finds more wrong places.
    pub min_half_m: f64,
    /// The same for heading, radians.
    pub min_half_rad: f64,
    /// End points that one search looks up at most, all poses together: bounds the time whatever the window.
    /// A lattice that needs more is tried with fewer end points, evenly spread, at the least 8; one that is
    /// too large even so ends nearer to the guess in x and y. More: wide searches are surer and slower.
    pub max_looks: usize [1000.0, 1e9],
    /// Lost scans in a row after which the map goes on from the odometry. Fewer: a passing crowd begins a
    /// second map over the first; more: a carried base waits longer.
    pub patience_scans: u32,
}
}

impl Default for SearchParams {
    fn default() -> Self {
        Self { min_half_m: 0.3, min_half_rad: 0.3, max_looks: 400_000, patience_scans: 20 }
    }
}

/// Lattice step, meters, rounded to whole cells of the map. Smaller: slower, by the square; larger: the right
/// place falls between two steps. Starts found 96.2 % halved, 96.1 % doubled.
const STEP_M: f64 = 0.1;
/// Lattice step, radians. Smaller: slower; larger: the right heading falls between two steps. Starts found
/// 93.3 % halved, 95.2 % doubled.
const STEP_RAD: f64 = 0.035;
/// Lattice steps each way at most, x and y: one meter, which bounds the time. Starts found 95.5 % halved,
/// 95.5 % doubled.
const MAX_SHIFTS: f64 = 10.0;
/// Lattice steps each way at most, heading: 30 degrees, which bounds the time. Starts found 92.7 % halved,
/// 95.5 % doubled.
const MAX_TURNS: f64 = 15.0;
/// End points used at most: one in three of a scan of 181 beams. More: surer and slower. Starts found 96.2 %
/// halved, 96.2 % doubled.
const BEAMS: usize = 60;

/// The search's memory.
#[derive(Clone, Debug)]
pub(crate) struct Search {
    params: SearchParams,
    step_m: f64,
    placed: Vec<[i32; 2]>,
    /// The end points that are tried, meters.
    tried_m: [[f32; BEAMS]; 2],
    /// What the end points find at each shift of a heading.
    sums: ShiftSums,
}

/// So many end points tell a pose at the least.
const MIN_BEAMS: usize = 8;
/// The end points are looked up in so many parts; after each, a heading that can no longer hold a pose to be
/// kept is given up.
const PARTS: usize = 4;

impl Search {
    /// Memory for scans of this many end points over cells of this size. The lattice's step becomes a whole
    /// number of cells.
    pub(crate) fn new(params: SearchParams, cell_m: f64) -> Self {
        let step_cells = (STEP_M / cell_m).round().max(1.0) as i32;
        Self {
            step_m: f64::from(step_cells) * cell_m,
            placed: Vec::with_capacity(BEAMS),
            tried_m: [[0.0; BEAMS]; 2],
            sums: ShiftSums::new(MAX_SHIFTS as usize, step_cells, cell_m),
            params,
        }
    }

    /// The best pose around a guess; its score is 0 when nothing speaks for any.
    pub(crate) fn first(
        &mut self,
        map: &LocalMap,
        points: &EndPoints,
        guess: &Pose2,
        window: Window,
    ) -> Candidate {
        let [first] = self.run(map, points, guess, window);
        first
    }

    /// The best poses around a guess, best first, no two neighbors on the lattice; unused places have score
    /// 0.
    pub(crate) fn run<const KEPT: usize>(
        &mut self,
        map: &LocalMap,
        points: &EndPoints,
        guess: &Pose2,
        window: Window,
    ) -> [Candidate; KEPT] {
        widest(Try { search: self, map, points, guess, window })
    }

    #[inline(always)]
    fn try_all<const KEPT: usize>(
        &mut self,
        map: &LocalMap,
        points: &EndPoints,
        guess: &Pose2,
        window: Window,
    ) -> [Candidate; KEPT] {
        let mut best = [Candidate::default(); KEPT];
        let (turns, shifts, beams) = self.lattice(window);
        let count = self.choose(points, beams);
        for turn in -turns..=turns {
            let theta_rad = wrap_angle(guess.theta_rad + f64::from(turn) * STEP_RAD);
            let turned = Pose2 { theta_rad, ..*guess };
            self.place(&Placement::new(&turned), map.cells_per_m(), count);
            if self.sum_up(map, shifts, best[KEPT - 1].score) {
                self.keep_best(&mut best, &turned, shifts);
            }
        }
        best
    }

    /// Keeps the best of the shifts of a heading that were summed up.
    #[inline(always)]
    fn keep_best(&self, best: &mut [Candidate], guess: &Pose2, shifts: i32) {
        let count = self.placed.len().max(1) as f32;
        let mut sums = self.sums.as_slice().iter();
        for y in -shifts..=shifts {
            for (x, sum) in (-shifts..=shifts).zip(&mut sums) {
                let (dx, dy) = (f64::from(x) * self.step_m, f64::from(y) * self.step_m);
                let pose = Pose2 { x_m: guess.x_m + dx, y_m: guess.y_m + dy, ..*guess };
                self.keep(best, Candidate { pose, score: sum / count });
            }
        }
    }

    /// The cells in which the end points that are tried lie.
    #[inline(always)]
    fn place(&mut self, placement: &Placement, cells_per_m: f32, count: usize) {
        let ([x, y], mut cells) = (&self.tried_m, [[0; 2]; BEAMS]);
        for i in 0..BEAMS {
            cells[i] =
                placement.place([x[i], y[i]]).map(|meters| whole(floor_in_lanes(meters * cells_per_m)));
        }
        self.placed.clear();
        self.placed.extend_from_slice(&cells[..count]);
    }

    /// Steps each way in heading and in x and y, and how many end points are tried at each pose.
    fn lattice(&self, window: Window) -> (i32, i32, usize) {
        let turns = (window.half_rad / STEP_RAD).ceil().min(MAX_TURNS) as i32;
        let mut shifts = (window.half_m / self.step_m).ceil().min(MAX_SHIFTS) as i32;
        let poses = |shifts: i32| (2 * turns as usize + 1) * (2 * shifts as usize + 1).pow(2);
        while shifts > 0 && poses(shifts) * MIN_BEAMS > self.params.max_looks {
            shifts -= 1;
        }
        let beams = (self.params.max_looks / poses(shifts)).max(MIN_BEAMS);
        (turns, shifts, beams.min(BEAMS))
    }

    /// Chooses so many end points, evenly spread.
    #[inline(always)]
    fn choose(&mut self, points: &EndPoints, beams: usize) -> usize {
        let stride = points.as_slice().len().div_ceil(beams).max(1);
        let mut count = 0;
        for (point, place) in points.as_slice().iter().step_by(stride).zip(0..BEAMS) {
            [self.tried_m[0][place], self.tried_m[1][place]] = point.at_m;
            count = place + 1;
        }
        count
    }

    /// Sums up the likelihoods of the end points at all shifts, row by row. `false` when none of the means
    /// can be above `minimum` any more.
    #[inline(always)]
    fn sum_up(&mut self, map: &LocalMap, shifts: i32, minimum: f32) -> bool {
        self.sums.clear(shifts);
        let count = self.placed.len().max(1);
        let mut possible = count as f32;
        for part in self.placed.chunks(count.div_ceil(PARTS)) {
            part.iter().for_each(|cell| self.sums.add(map, *cell));
            possible -= part.len() as f32;
            if self.sums.best() + possible <= minimum * count as f32 {
                return false;
            }
        }
        true
    }

    /// Inserts a candidate in order; of neighbors only the better one stays.
    fn keep(&self, best: &mut [Candidate], candidate: Candidate) {
        let last = best.len() - 1;
        if candidate.score <= best[last].score {
            return;
        }
        let mut place = last;
        for (index, other) in best.iter().enumerate() {
            if other.score > 0.0 && self.neighbors(&other.pose, &candidate.pose) {
                if other.score >= candidate.score {
                    return;
                }
                place = index;
                break;
            }
        }
        best[place] = candidate;
        best.sort_by(|a, b| b.score.total_cmp(&a.score));
    }

    /// Whether two poses are next to each other on the lattice, or closer.
    pub(crate) fn neighbors(&self, a: &Pose2, b: &Pose2) -> bool {
        let reach_m = 1.5 * self.step_m;
        (a.x_m - b.x_m).abs() < reach_m
            && (a.y_m - b.y_m).abs() < reach_m
            && wrap_angle(a.theta_rad - b.theta_rad).abs() < 1.5 * STEP_RAD
    }
}

/// All poses of a lattice, to be tried.
struct Try<'a, const KEPT: usize> {
    search: &'a mut Search,
    map: &'a LocalMap,
    points: &'a EndPoints,
    guess: &'a Pose2,
    window: Window,
}

impl<const KEPT: usize> InLanes for Try<'_, KEPT> {
    type Output = [Candidate; KEPT];

    #[inline(always)]
    fn work(self) -> Self::Output {
        self.search.try_all(self.map, self.points, self.guess, self.window)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::MapParams;
    use crate::registration::search::shift_sums::{BLUR_M, FREE_SPACE_COST};
    use crate::scan::end_points::PointParams;
    use crate::scan::{Beam, Scan};

    /// A room of 6 by 4 m with a cupboard in a corner, seen from a place off its middle by beams two degrees
    /// apart.
    fn room() -> EndPoints {
        let beams: Vec<Beam> = (0..180)
            .map(|i| {
                let angle_rad = (2.0 * f64::from(i)).to_radians();
                let (sin, cos) = angle_rad.sin_cos();
                let to_x = if cos > 0.0 { 3.5 / cos } else { -2.5 / cos };
                let to_y = if sin > 0.0 { 2.2 / sin } else { -1.8 / sin };
                let range_m = to_x.min(to_y) - if (20..30).contains(&i) { 0.7 } else { 0.0 };
                Beam { direction_in_base: [cos as f32, sin as f32], range_m: range_m as f32, delay_s: 0.0 }
            })
            .collect();
        let mut points = EndPoints::new(PointParams::default());
        points.fill(&Scan { stamp_ns: 0, laser_in_base_m: [0.0; 2], beams: &beams, twist_in_base: [0.0; 3] });
        points
    }

    /// The score of a pose, from the definition: each end point by the nearest surface, or by free space.
    fn by_definition(map: &LocalMap, points: &EndPoints, pose: &Pose2) -> f64 {
        let placement = Placement::new(pose);
        let used: Vec<_> = points.as_slice().iter().step_by(3).collect();
        let worth = |at_m: [f32; 2]| match (map.nearest(at_m), map.seen_through(at_m)) {
            (Some(surfel), _) => {
                let [x, y] = map.cell_of(at_m);
                let [dx, dy] = [x - i32::from(surfel.home[0]), y - i32::from(surfel.home[1])];
                (-0.5 * 0.0025 * f64::from(dx * dx + dy * dy) / BLUR_M.powi(2)).exp()
            }
            (None, true) => -f64::from(FREE_SPACE_COST),
            (None, false) => 0.0,
        };
        used.iter().map(|point| worth(placement.place(point.at_m))).sum::<f64>() / used.len() as f64
    }

    #[test]
    fn a_search_looks_up_no_more_than_its_budget_and_a_small_one_is_not_thinned() {
        let search = Search::new(SearchParams::default(), 0.05);
        assert_eq!(search.lattice(Window { half_m: 0.2, half_rad: 0.3 }), (9, 2, 60));
        // The widest: 31 headings by 21 by 21 places, 29 end points each.
        assert_eq!(search.lattice(Window { half_m: 9.0, half_rad: 3.0 }), (15, 10, 29));
        for max_looks in [2000, 40_000, 400_000] {
            let search = Search::new(SearchParams { max_looks, ..SearchParams::default() }, 0.05);
            let (turns, shifts, beams) = search.lattice(Window { half_m: 50.0, half_rad: 3.0 });
            let poses = (2 * turns as usize + 1) * (2 * shifts as usize + 1).pow(2);
            assert!(poses * beams <= max_looks && beams >= 8, "{turns} {shifts} {beams}");
        }
    }

    #[test]
    fn what_is_given_up_early_is_never_the_best_pose_of_the_lattice() {
        let points = room();
        let mut map = LocalMap::new(MapParams::default());
        map.learn(&Pose2::IDENTITY, &points);
        let mut search = Search::new(SearchParams::default(), 0.05);
        let window = Window { half_m: 0.2, half_rad: 0.2 };
        for guess in [Pose2::new(0.13, -0.08, 0.11), Pose2::new(-0.17, 0.04, -0.19), Pose2::IDENTITY] {
            let mut best = f64::NEG_INFINITY;
            for turn in -6..=6 {
                for (x, y) in (-2..=2).flat_map(|x| (-2..=2).map(move |y| (x, y))) {
                    let pose = Pose2::new(
                        guess.x_m + 0.1 * f64::from(x),
                        guess.y_m + 0.1 * f64::from(y),
                        guess.theta_rad + STEP_RAD * f64::from(turn),
                    );
                    best = best.max(by_definition(&map, &points, &pose));
                }
            }
            let found = search.first(&map, &points, &guess, window);
            assert!((f64::from(found.score) - best).abs() < 0.02, "{found:?} {best}");
            let again = by_definition(&map, &points, &found.pose);
            assert!((f64::from(found.score) - again).abs() < 0.02, "{found:?} {again}");
            let several: [Candidate; 4] = search.run(&map, &points, &guess, window);
            assert_eq!(several[0], found);
            assert!(several.windows(2).all(|pair| pair[0].score >= pair[1].score), "{several:?}");
        }
    }
}
