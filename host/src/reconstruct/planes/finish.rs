//! The last step of the search: planes in their final order, with normals towards the sensor. Frame `map`,
//! meters.

use crate::model::{Cloud, Plane};
use crate::reconstruct::planes::fit::scatter::Fit;
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::planes::labels::refine::{POINTS_PER_PIECE, scatters};
use crate::reconstruct::planes::params::PlaneParams;
use rayon::prelude::*;

/// Drops labels with too few points, turns normals towards the sensor, orders planes by size.
pub(super) fn finish(
    params: &PlaneParams,
    cloud: &Cloud,
    mut labels: Vec<i32>,
    before: &[Option<Fit>],
    sigma_m: f64,
) -> Planes {
    let count = before.len();
    let sums = scatters(&cloud.points_m, &labels, count);
    let fits: Vec<Option<Fit>> = sums
        .iter()
        .zip(before)
        .map(|(s, b)| s.fit_again(b.as_ref()).filter(|f| f.count >= params.min_points as f64))
        .collect();
    let geometry = of_one_scan(cloud, &labels, count);
    let mut kept: Vec<(usize, Fit)> = fits
        .iter()
        .enumerate()
        .filter_map(|(l, f)| Some((l, (*f)?)))
        .filter(|(l, _)| !geometry[*l])
        .collect();
    kept.sort_by(|a, b| b.1.count.total_cmp(&a.1.count));
    let mut new_label = vec![-1; count];
    let mut planes = Vec::new();
    for (old, fit) in kept {
        new_label[old] = planes.len() as i32;
        planes.push(Plane {
            normal: fit.normal,
            offset_m: fit.offset_m,
            points: fit.count as usize,
            rms_m: fit.variances_m2[0].sqrt(),
        });
    }
    let rename = |label: &mut i32| *label = usize::try_from(*label).map_or(-1, |old| new_label[old]);
    labels.par_iter_mut().with_min_len(POINTS_PER_PIECE).for_each(rename);
    let mut found = Planes { planes, labels, sigma_m, ..Planes::default() };
    found.face(|index| Some(cloud.origin_of(index)?.map(f64::from)));
    found
}

/// Which labels have all their points from one scan: the plane of a fan of beams, not of a surface. None in
/// clouds without scans.
fn of_one_scan(cloud: &Cloud, labels: &[i32], count: usize) -> Vec<bool> {
    let mut first = vec![None; count];
    let mut one = vec![!cloud.scan.is_empty(); count];
    for (label, scan) in labels.iter().zip(&cloud.scan) {
        let Ok(label) = usize::try_from(*label) else { continue };
        one[label] &= *first[label].get_or_insert(scan) == scan;
    }
    one
}
