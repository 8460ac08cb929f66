//! The paper's randomized region growing as it stands there: slow and plain, the oracle of the fast search.
//!
//! Meters. Source: the paper, section 3.1 and table 1.

use super::params::ReferenceParams;
use super::random::Random;
use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};

/// Finds planes round by round until no start gives one. Returns each point's plane, or -1, and the planes.
pub(crate) fn extract(params: &ReferenceParams, points_m: &[[f64; 3]], seed: u64) -> (Vec<i32>, Vec<Fit>) {
    let mut random = Random::new(seed);
    let mut labels = vec![-1i32; points_m.len()];
    let mut planes = Vec::new();
    loop {
        let free: Vec<usize> =
            (0..points_m.len()).filter(|k| labels[*k] < 0 && is_finite(points_m[*k])).collect();
        let mut largest: Option<(Vec<usize>, Fit)> = None;
        for _ in 0..params.starts.min(free.len()) {
            let start = random.below(free.len());
            let Some(grown) = grow(params, points_m, &free, start) else { continue };
            if largest.as_ref().is_none_or(|best| grown.0.len() > best.0.len()) {
                largest = Some(grown);
            }
        }
        let Some((members, fit)) = largest.filter(|grown| grown.0.len() >= params.min_points) else {
            return (labels, planes);
        };
        for member in members {
            labels[member] = planes.len() as i32;
        }
        planes.push(fit);
    }
}

/// Table 1: from a start and its nearest neighbor, points in order of their distance to the set. Returns
/// indices into `points_m`.
fn grow(
    params: &ReferenceParams,
    points_m: &[[f64; 3]],
    free: &[usize],
    start: usize,
) -> Option<(Vec<usize>, Fit)> {
    let mut set = Set {
        sums: Scatter::default(),
        near: free.iter().map(|k| (*k, f64::INFINITY, State::Open)).collect(),
        points_m,
    };
    set.join(start);
    let (second, _) = set.nearest_open(f64::INFINITY)?;
    set.join(second);
    let mut grew = true;
    while std::mem::take(&mut grew) {
        while let Some((candidate, p)) = set.nearest_open(params.delta_m) {
            let mut with = set.sums;
            with.add(p);
            let joins = with.fit().is_some_and(|fit| {
                fit.variances_m2[0] < params.epsilon_m2 && fit.distance_m(p).abs() < params.gamma_m
            });
            if joins {
                set.join(candidate);
                grew = true;
            } else {
                set.near[candidate].2 = State::Refused;
            }
        }
        // The plane has moved since some were refused: they are asked again as long as anyone joins.
        set.near.iter_mut().filter(|n| n.2 == State::Refused).for_each(|n| n.2 = State::Open);
    }
    let members = set.near.iter().filter(|n| n.2 == State::Member).map(|n| n.0).collect();
    Some((members, set.sums.fit()?))
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    Open,
    Member,
    Refused,
}

/// The growing set: for every free point its index, its distance to the set and what became of it.
struct Set<'a> {
    sums: Scatter,
    near: Vec<(usize, f64, State)>,
    points_m: &'a [[f64; 3]],
}

impl Set<'_> {
    fn join(&mut self, which: usize) {
        let p = self.points_m[self.near[which].0];
        self.sums.add(p);
        self.near[which].2 = State::Member;
        for (other, distance_m, _) in &mut self.near {
            let q = self.points_m[*other];
            *distance_m = distance_m.min((0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt());
        }
    }

    /// The open point nearest to the set, if nearer than the limit.
    fn nearest_open(&self, limit_m: f64) -> Option<(usize, [f64; 3])> {
        let open = self.near.iter().enumerate().filter(|(_, n)| n.2 == State::Open && n.1 < limit_m);
        let (which, nearest) = open.min_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
        Some((which, self.points_m[nearest.0]))
    }
}

fn is_finite(p: [f64; 3]) -> bool {
    p.iter().all(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::extract;
    use crate::reconstruct::planes::paper::params::ReferenceParams;
    use crate::reconstruct::planes::paper::random::Random;
    use biplane_geometry::vec3::dot;

    /// Two walls of 1 m that meet at a right angle, `sigma_m` of noise across them, and a few points off
    /// both.
    fn corner(sigma_m: f64) -> (Vec<[f64; 3]>, Vec<i32>) {
        let mut random = Random::new(21);
        let mut points = Vec::new();
        let mut truth = Vec::new();
        for k in 0..600 {
            let (along, up, off) = (0.05 + random.unit(), random.unit(), sigma_m * random.normal());
            points.push(if k % 2 == 0 { [along, off, up] } else { [off, along, up] });
            truth.push(k % 2);
        }
        for k in 0..5 {
            points.push([0.8, 0.8, 0.2 * f64::from(k)]);
            truth.push(-1);
        }
        (points, truth)
    }

    #[test]
    fn the_corner_of_a_room_gives_its_two_walls() {
        let (points, truth) = corner(0.01);
        let (labels, planes) = extract(&ReferenceParams::default(), &points, 3);
        assert_eq!(planes.len(), 2);
        assert!(dot(planes[0].normal, planes[1].normal).abs() < 0.05);
        let right = |swap: bool| {
            let same = |(ours, true_label): &(&i32, &i32)| {
                **ours == if swap && **true_label >= 0 { 1 - **true_label } else { **true_label }
            };
            labels.iter().zip(&truth).filter(same).count()
        };
        assert!(right(false).max(right(true)) > 570);
    }

    #[test]
    fn the_same_seed_gives_the_same_labels_and_no_points_give_none() {
        let (points, _) = corner(0.01);
        let params = ReferenceParams { starts: 2, ..ReferenceParams::default() };
        assert_eq!(extract(&params, &points, 9), extract(&params, &points, 9));
        assert_eq!(extract(&params, &[], 9).0.len(), 0);
        assert_eq!(extract(&params, &[[f64::NAN; 3]; 90], 9).1.len(), 0);
    }
}
