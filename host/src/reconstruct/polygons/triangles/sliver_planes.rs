//! Planes that no more than two or three beams of each scan show, at a flat angle: they are none.
//!
//! Where a beam passes an edge, or a wall and a ceiling meet behind a duct, two or three points of every scan
//! lie in line, and so do those of the next scans: a strip that leans between the surfaces that are there.
//! Its direction rests on so few beams of a scan that noise along them tilts it. A real strip as narrow (a
//! reveal, a lintel) is met squarely or by more beams. Frame `map`, meters.

use crate::model::{Cloud, Plane};
use biplane_geometry::vec3::dot;

/// A plane with fewer points a scan than this, on average, is in doubt.
const MIN_POINTS_PER_SCAN: f64 = 3.0;
/// Such a plane is none when beams meet it at less than this (mean sine; 40 degrees).
const MIN_SINE: f64 = 0.64;

/// The label of points whose plane was found to be none. Like every negative label it stands for no plane;
/// what cannot be laid on a neighbor's plane is no surface
/// ([`crate::reconstruct::polygons::triangles::jump_edges`]).
pub(crate) const SLIVER: i32 = -2;

#[derive(Clone, Copy, Default)]
struct Seen {
    points: f64,
    scans: f64,
    last: Option<u32>,
    sines: f64,
}

/// The labels with [`SLIVER`] for points of such planes. A cloud that does not say from where it was seen
/// keeps all.
pub(crate) fn without(cloud: &Cloud, labels: &[i32], planes: &[Plane]) -> Vec<i32> {
    let mut seen = vec![Seen::default(); planes.len()];
    for (index, label) in labels.iter().enumerate() {
        let Some(label) = usize::try_from(*label).ok().filter(|label| *label < planes.len()) else {
            continue;
        };
        let Some(origin_m) = cloud.origin_of(index) else { continue };
        let beam: [f64; 3] = std::array::from_fn(|k| f64::from(cloud.points_m[index][k] - origin_m[k]));
        let length = dot(beam, beam).sqrt();
        let count = &mut seen[label];
        count.points += 1.0;
        count.scans += if count.last == Some(cloud.scan[index]) { 0.0 } else { 1.0 };
        count.last = Some(cloud.scan[index]);
        count.sines += if length > 0.0 { dot(beam, planes[label].normal).abs() / length } else { 1.0 };
    }
    let is_sliver = |s: &Seen| s.points < MIN_POINTS_PER_SCAN * s.scans && s.sines < MIN_SINE * s.points;
    let thin: Vec<bool> = seen.iter().map(is_sliver).collect();
    let kept = |label: &i32| match usize::try_from(*label) {
        Ok(index) if thin.get(index) == Some(&true) => SLIVER,
        _ => *label,
    };
    labels.iter().map(kept).collect()
}

#[cfg(test)]
mod tests {
    use super::without;
    use crate::model::{Cloud, Plane};

    /// Ten scans from the origin's axis, each with `beams` points on a strip that starts 1 m away and leans
    /// by `slope` (rise over run).
    fn kept(beams: u16, slope: f32) -> bool {
        let mut cloud = Cloud { beams_per_scan: 9, ..Cloud::default() };
        for scan in 0..10u16 {
            let x = 0.02 * f32::from(scan);
            cloud.origins_m.push([x, 0.0, 0.0]);
            for beam in 0..beams {
                let out = 0.05 * f32::from(beam);
                cloud.points_m.push([x, 1.0 + out, slope * out]);
                cloud.scan.push(u32::from(scan));
                cloud.beam.push(beam);
            }
        }
        let length = f64::from(slope).hypot(1.0);
        let strip = Plane {
            normal: [0.0, -f64::from(slope) / length, 1.0 / length],
            offset_m: -f64::from(slope) / length,
            points: 1,
            rms_m: 0.0,
        };
        let labels = vec![0; cloud.len()];
        let left = without(&cloud, &labels, &[strip]);
        assert_eq!(without(&Cloud { origins_m: Vec::new(), ..cloud }, &labels, &[strip]), labels);
        left == labels
    }

    #[test]
    fn a_strip_of_two_beams_a_scan_along_the_beams_is_no_plane() {
        assert!(!kept(2, 0.3));
        assert!(kept(2, 3.0), "met squarely it may be a reveal");
        assert!(kept(5, 0.3), "five beams a scan know its direction");
    }
}
