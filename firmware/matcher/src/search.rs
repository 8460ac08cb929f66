//! Correlative search: tries every pose of a lattice around a guess and keeps the few that put most end points close
//! to mapped surfaces and fewest into space known to be free (after Olson 2009, on one level).
//!
//! Frame: map. Units: metres, radians. The cost is bounded by the lattice's size, which the caller limits.

use crate::local_map::LocalMap;
use crate::points::EndPoints;
use crate::pose::{Pose2, wrap_angle};
use crate::surface::Placement;

crate::named::named_parameters! { "search";
/// The search when the alignment from the prior is poor.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct SearchParams {
    /// Headings this far on either side of the prior are looked at, radians: odometry read a moment
    /// before or after the scan is off by degrees in a turn.
    pub glance_rad: f64,
    /// When the alignment from the odometry explains this share of all end points there is no glance: what fits that well
    /// is no wrong heading. Larger: a glance for more scans, more time; smaller: a turn may be missed.
    pub glance_below_share: f64,
    /// Below this share of explained end points the surroundings are searched. Larger: more searches, more time.
    pub below_score: f64,
    /// Below this share of explained end points the scan is lost. Larger: a changed place counts as lost; smaller: a wrong
    /// match counts as found.
    pub lost_below_score: f64,
    /// A scan that has less than this share of its end points where the map knows anything is on its own. Larger: more
    /// scans go on from the odometry; smaller: matches that rest on a few beams.
    pub min_informative: f64,
    /// The search looks at least this far each way, metres, and as far as three standard deviations of the prior. Larger:
    /// slower, and finds more wrong places.
    pub least_half_m: f64,
    /// The same for heading, radians.
    pub least_half_rad: f64,
    /// Lattice step, metres, rounded to whole cells of the map. Smaller: slower, by the square; larger: the right place falls between two steps.
    pub step_m: f64 [0.001, 10.0],
    /// Lattice step, radians. Smaller: slower; larger: the right heading falls between two steps.
    pub step_rad: f64 [0.0001, 3.2],
    /// Lattice steps each way at most, x and y: bounds the time.
    pub max_shifts: f64 [0.0, 1000.0],
    /// Lattice steps each way at most, heading: bounds the time.
    pub max_turns: f64 [0.0, 1000.0],
    /// Without a measured prior, places that score at least this share of the best one are aligned as well. Smaller: slower,
    /// fewer wrong places taken for right.
    pub rival_share: f64,
    /// End points used at most. More: surer and slower.
    pub beams: usize [1.0, 1e5],
    /// End points that one search looks up at most, all poses together: bounds the time whatever the window. A lattice that needs more is
    /// tried with fewer end points, evenly spread, at the least 8; one that is too large even so ends nearer to the guess in x and y.
    /// More: wide searches are surer and slower.
    pub most_looks: usize [1000.0, 1e9],
    /// Width of the likelihood about a surface, metres. About the lattice step: less, and the right place falls between
    /// two steps; more, and places look alike.
    pub blur_m: f64 [0.001, 10.0],
    /// What an end point in free space costs, in end points on a surface. Larger: moved things and people mislead more;
    /// smaller: walls beyond reach of the right place do not count against a wrong one.
    pub free_space_cost: f64,
    /// Lost scans in a row after which the map goes on from the odometry. Fewer: a passing crowd begins a second map over
    /// the first; more: a carried base waits longer.
    pub patience_scans: u32,
    /// A match that contradicts odometry and inertia alike counts from this many scans in a row on. Fewer: moving things lead
    /// the base astray; more: a base that was carried or has slipped stays wrong longer.
    pub confirm_scans: u32 [1.0, 1000.0],
}
}

impl Default for SearchParams {
    fn default() -> Self {
        Self {
            glance_rad: 0.3,
            glance_below_share: 0.9,
            below_score: 0.6,
            lost_below_score: 0.4,
            min_informative: 0.1,
            least_half_m: 0.3,
            least_half_rad: 0.3,
            step_m: 0.1,
            step_rad: 0.035,
            max_shifts: 10.0,
            max_turns: 15.0,
            rival_share: 0.8,
            beams: 60,
            most_looks: 400_000,
            blur_m: 0.1,
            free_space_cost: 0.3,
            patience_scans: 20,
            confirm_scans: 3,
        }
    }
}

/// The lattice: half widths around the guess.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Window {
    /// Half width in x and y, metres.
    pub half_m: f64,
    /// Half width in heading, radians.
    pub half_rad: f64,
}

/// A pose and how much speaks for it.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct Candidate {
    /// The pose, `map_from_base`.
    pub pose: Pose2,
    /// Mean likelihood of an end point, about -1 to 1.
    pub score: f32,
}

/// The search's memory.
#[derive(Clone, Debug)]
pub struct Search {
    params: SearchParams,
    /// Likelihood of an end point by the squared cell distance of the nearest surface.
    likelihood: [f32; 256],
    /// The lattice's step in cells.
    step_cells: i32,
    step_m: f64,
    placed: Vec<[i32; 2]>,
}

/// So many end points tell a pose at the least.
const LEAST_BEAMS: usize = 8;
/// After so many end points a pose that cannot come among the best any more is given up.
const LOOK_EVERY: usize = 12;

impl Search {
    /// Memory for scans of this many end points over cells of this size. The lattice's step becomes a whole number of cells.
    pub fn new(params: SearchParams, cell_m: f64) -> Self {
        let mut likelihood = [0.0; 256];
        for (squared, value) in likelihood.iter_mut().enumerate() {
            let distance_squared = squared as f64 * cell_m * cell_m;
            *value = (-0.5 * distance_squared / (params.blur_m * params.blur_m)).exp() as f32;
        }
        let step_cells = (params.step_m / cell_m).round().max(1.0) as i32;
        Self {
            likelihood,
            step_cells,
            step_m: f64::from(step_cells) * cell_m,
            placed: Vec::with_capacity(params.beams.max(1)),
            params,
        }
    }

    /// The best pose around a guess; its score is 0 when nothing speaks for any.
    pub fn first(&mut self, map: &LocalMap, points: &EndPoints, guess: &Pose2, window: Window) -> Candidate {
        let [first] = self.run(map, points, guess, window);
        first
    }

    /// The best poses around a guess, best first, no two neighbours on the lattice; unused places have score 0.
    pub fn run<const KEPT: usize>(
        &mut self,
        map: &LocalMap,
        points: &EndPoints,
        guess: &Pose2,
        window: Window,
    ) -> [Candidate; KEPT] {
        let mut best = [Candidate::default(); KEPT];
        let (turns, shifts, beams) = self.lattice(window);
        let stride = points.as_slice().len().div_ceil(beams).max(1);
        for turn in -turns..=turns {
            let theta_rad = wrap_angle(guess.theta_rad + f64::from(turn) * self.params.step_rad);
            let placement = Placement::new(&Pose2 { theta_rad, ..*guess });
            let points = points.as_slice().iter().step_by(stride);
            self.placed.clear();
            self.placed.extend(points.map(|point| map.cell_of(placement.place(point.at_m))));
            for y in -shifts..=shifts {
                for x in -shifts..=shifts {
                    let shift = [x * self.step_cells, y * self.step_cells];
                    let score = self.score(map, shift, best[KEPT - 1].score);
                    let (dx, dy) = (f64::from(x) * self.step_m, f64::from(y) * self.step_m);
                    let pose = Pose2::new(guess.x_m + dx, guess.y_m + dy, theta_rad);
                    self.keep(&mut best, Candidate { pose, score });
                }
            }
        }
        best
    }

    /// Steps each way in heading and in x and y, and how many end points are tried at each pose.
    fn lattice(&self, window: Window) -> (i32, i32, usize) {
        let params = &self.params;
        let turns = (window.half_rad / params.step_rad).ceil().min(params.max_turns) as i32;
        let mut shifts = (window.half_m / self.step_m).ceil().min(params.max_shifts) as i32;
        let poses = |shifts: i32| (2 * turns as usize + 1) * (2 * shifts as usize + 1).pow(2);
        while shifts > 0 && poses(shifts) * LEAST_BEAMS > params.most_looks {
            shifts -= 1;
        }
        let beams = (params.most_looks / poses(shifts)).max(LEAST_BEAMS);
        (turns, shifts, beams.min(params.beams.max(1)))
    }

    /// Mean likelihood of the end points, shifted by whole cells; something not above `least` when that is all it can come to.
    fn score(&self, map: &LocalMap, [shift_x, shift_y]: [i32; 2], least: f32) -> f32 {
        let count = self.placed.len().max(1) as f32;
        let in_free_space = -(self.params.free_space_cost as f32);
        let (mut sum, mut possible) = (0.0, count);
        for some in self.placed.chunks(LOOK_EVERY) {
            for [x, y] in some {
                let (cell, seen_through) = map.grid.look(x.wrapping_add(shift_x), y.wrapping_add(shift_y));
                sum += match cell.surface() {
                    Some(_) => self.likelihood[usize::from(cell.squared())],
                    None if seen_through => in_free_space,
                    None => 0.0,
                };
            }
            possible -= some.len() as f32;
            if sum + possible <= least * count {
                return least;
            }
        }
        sum / count
    }

    /// Inserts a candidate in order; of neighbours only the better one stays.
    fn keep(&self, best: &mut [Candidate], candidate: Candidate) {
        let last = best.len() - 1;
        if candidate.score <= best[last].score {
            return;
        }
        let mut place = last;
        for (index, other) in best.iter().enumerate() {
            if other.score > 0.0 && self.neighbours(&other.pose, &candidate.pose) {
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
    pub fn neighbours(&self, a: &Pose2, b: &Pose2) -> bool {
        let reach_m = 1.5 * self.step_m;
        (a.x_m - b.x_m).abs() < reach_m
            && (a.y_m - b.y_m).abs() < reach_m
            && wrap_angle(a.theta_rad - b.theta_rad).abs() < 1.5 * self.params.step_rad
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local_map::MapParams;
    use crate::points::PointParams;
    use crate::scan::{Beam, Scan};

    /// A room of 6 by 4 m with a cupboard in a corner, seen from a place off its middle by beams two degrees apart.
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
    fn by_definition(map: &LocalMap, points: &EndPoints, pose: &Pose2, params: &SearchParams) -> f64 {
        let placement = Placement::new(pose);
        let used: Vec<_> = points.as_slice().iter().step_by(3).collect();
        let worth = |at_m: [f32; 2]| match (map.nearest(at_m), map.seen_through(at_m)) {
            (Some(surface), _) => {
                let [x, y] = map.cell_of(at_m);
                let [dx, dy] = [x - i32::from(surface.home[0]), y - i32::from(surface.home[1])];
                (-0.5 * 0.0025 * f64::from(dx * dx + dy * dy) / params.blur_m.powi(2)).exp()
            }
            (None, true) => -params.free_space_cost,
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
        let params = SearchParams { max_shifts: 1000.0, max_turns: 1000.0, ..SearchParams::default() };
        for most_looks in [2000, 400_000] {
            let search = Search::new(SearchParams { most_looks, ..params }, 0.05);
            let (turns, shifts, beams) = search.lattice(Window { half_m: 50.0, half_rad: 3.0 });
            let poses = (2 * turns as usize + 1) * (2 * shifts as usize + 1).pow(2);
            assert!(poses * beams <= most_looks && beams >= 8, "{turns} {shifts} {beams}");
        }
    }

    #[test]
    fn what_is_given_up_early_is_never_the_best_pose_of_the_lattice() {
        let (points, params) = (room(), SearchParams::default());
        let mut map = LocalMap::new(MapParams::default());
        map.learn(&Pose2::IDENTITY, &points);
        let mut search = Search::new(params, 0.05);
        let window = Window { half_m: 0.2, half_rad: 0.2 };
        for guess in [Pose2::new(0.13, -0.08, 0.11), Pose2::new(-0.17, 0.04, -0.19), Pose2::IDENTITY] {
            let mut best = f64::NEG_INFINITY;
            for turn in -6..=6 {
                for (x, y) in (-2..=2).flat_map(|x| (-2..=2).map(move |y| (x, y))) {
                    let pose = Pose2::new(
                        guess.x_m + 0.1 * f64::from(x),
                        guess.y_m + 0.1 * f64::from(y),
                        guess.theta_rad + params.step_rad * f64::from(turn),
                    );
                    best = best.max(by_definition(&map, &points, &pose, &params));
                }
            }
            let found = search.first(&map, &points, &guess, window);
            assert!((f64::from(found.score) - best).abs() < 0.02, "{found:?} {best}");
            let again = by_definition(&map, &points, &found.pose, &params);
            assert!((f64::from(found.score) - again).abs() < 0.02, "{found:?} {again}");
            let several: [Candidate; 4] = search.run(&map, &points, &guess, window);
            assert_eq!(several[0], found);
            assert!(several.windows(2).all(|pair| pair[0].score >= pair[1].score), "{several:?}");
        }
    }
}
