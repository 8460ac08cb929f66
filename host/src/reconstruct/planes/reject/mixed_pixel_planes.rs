//! Curtains of mixed pixels: planes that are none.
//!
//! A beam that meets an edge reports a range between the edge and what lies behind it. As the robot drives
//! along a straight edge these points line up in a narrow strip of a plane. What gives it away: a scan has
//! one or two of its points, and the beams run almost within the plane. Frame `map`, meters.

use crate::model::Cloud;
use crate::reconstruct::planes::fit::scatter::Fit;
use crate::reconstruct::planes::labels::refine::POINTS_PER_PIECE;
use biplane_geometry::vec3::dot;
use rayon::prelude::*;
use std::ops::Range;

/// A plane may be a mixed-pixel plane when at most this share of its points has both neighboring beams on the
/// same plane.
const MAX_INNER_SHARE: f64 = 0.2;
/// Largest mean sine of the angle between beams and a mixed-pixel plane (15 degrees).
const MAX_SINE: f64 = 0.26;

/// Which labels are mixed-pixel planes. Clouds that are not organized have none that could be told.
pub(crate) fn find(cloud: &Cloud, labels: &[i32], fits: &[Option<Fit>]) -> Vec<bool> {
    if cloud.origins_m.is_empty() {
        return vec![false; fits.len()];
    }
    let pieces: Vec<usize> = (0..labels.len()).step_by(POINTS_PER_PIECE).collect();
    let parts: Vec<Vec<Seen>> = pieces
        .into_par_iter()
        .map(|first| seen_in(cloud, labels, fits, first..(first + POINTS_PER_PIECE).min(labels.len())))
        .collect();
    let mut seen = vec![Seen::default(); fits.len()];
    for part in &parts {
        seen.iter_mut().zip(part).for_each(|(seen, part)| seen.merge(part));
    }
    let mixed_pixel_plane =
        |s: &Seen| s.points > 0.0 && s.inner <= MAX_INNER_SHARE * s.points && s.sines < MAX_SINE * s.points;
    seen.iter().map(mixed_pixel_plane).collect()
}

/// How a run of points sees the planes that they are on.
fn seen_in(cloud: &Cloud, labels: &[i32], fits: &[Option<Fit>], run: Range<usize>) -> Vec<Seen> {
    let mut seen = vec![Seen::default(); fits.len()];
    for index in run {
        let Some(label) = usize::try_from(labels[index]).ok().filter(|label| *label < fits.len()) else {
            continue;
        };
        let (Some(fit), Some(origin)) = (&fits[label], cloud.origin_of(index)) else { continue };
        let beam: [f64; 3] = std::array::from_fn(|k| f64::from(cloud.points_m[index][k] - origin[k]));
        let length = dot(beam, beam).sqrt();
        let beside = [index.wrapping_sub(1), index + 1];
        let inner =
            beside.into_iter().all(|k| labels.get(k) == Some(&labels[index]) && next_beam(cloud, index, k));
        seen[label].merge(&Seen {
            points: 1.0,
            inner: if inner { 1.0 } else { 0.0 },
            sines: if length > 0.0 { dot(beam, fit.normal).abs() / length } else { 1.0 },
        });
    }
    seen
}

#[derive(Clone, Copy, Default)]
struct Seen {
    points: f64,
    inner: f64,
    sines: f64,
}

impl Seen {
    fn merge(&mut self, other: &Self) {
        self.points += other.points;
        self.inner += other.inner;
        self.sines += other.sines;
    }
}

/// Whether two points are from neighboring beams of one scan.
pub(crate) fn next_beam(cloud: &Cloud, a: usize, b: usize) -> bool {
    let at = |index: usize| Some((*cloud.scan.get(index)?, *cloud.beam.get(index)?));
    match (at(a), at(b)) {
        (Some(a), Some(b)) => a.0 == b.0 && a.1.abs_diff(b.1) == 1,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::find;
    use crate::model::Cloud;
    use crate::reconstruct::planes::labels::refine::{refit, scatters};

    /// Scans whose beams rise along y = z: of five beams those in `on` lie in the plane x-(y = z), the others
    /// elsewhere.
    fn scans(on: std::ops::Range<u16>) -> (Cloud, Vec<i32>) {
        let mut cloud = Cloud { beams_per_scan: 5, ..Cloud::default() };
        let mut labels = Vec::new();
        for scan in 0..40u16 {
            let x = 0.05 * f32::from(scan);
            cloud.origins_m.push([x, 0.1, 0.0]);
            for beam in 0..5u16 {
                let up = 1.0 + 0.1 * f32::from(beam) + 0.03 * f32::from(scan % 3);
                cloud.points_m.push([x, up, up]);
                cloud.scan.push(u32::from(scan));
                cloud.beam.push(beam);
                labels.push(if on.contains(&beam) { 0 } else { -1 });
            }
        }
        (cloud, labels)
    }

    #[test]
    fn a_grazed_strip_of_one_or_two_beams_is_a_curtain_and_a_grazed_wall_is_none() {
        for (on, mixed_pixel_plane) in [(2..3, true), (1..3, true), (0..5, false)] {
            let (cloud, labels) = scans(on);
            assert_eq!(
                find(&cloud, &labels, &refit(&scatters(&cloud.points_m, &labels, 1), &[None])),
                [mixed_pixel_plane]
            );
        }
    }

    #[test]
    fn a_narrow_strip_that_is_seen_from_the_front_is_none() {
        let (mut cloud, labels) = scans(2..3);
        cloud.origins_m.iter_mut().for_each(|origin| origin[1] = 3.0);
        assert_eq!(find(&cloud, &labels, &refit(&scatters(&cloud.points_m, &labels, 1), &[None])), [false]);
    }
}
