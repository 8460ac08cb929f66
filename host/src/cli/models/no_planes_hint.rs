//! What to tell a person whose cloud or mesh gives no planes: nothing in these files says the unit, nor how
//! dense points should be.

use std::collections::HashSet;

/// Clouds larger or smaller than this are rarely in meters.
const LARGE_M: f64 = 1000.0;
const SMALL_M: f64 = 0.5;
/// Points that tell the size.
const SAMPLE: usize = 4096;
/// Share of points alone within delta from which on a cloud is sparse.
const SPARSE: f64 = 0.5;
/// Fewer points are no reason to doubt: a plane needs as many.
const FEW: usize = 50;

/// Why hardly any point may be on a plane; nothing when there is no reason to doubt.
pub(crate) fn of_cloud(points_m: &[[f32; 3]], on_planes: usize, delta_m: f64) -> Option<String> {
    let finite = finite(points_m);
    if finite.len() < FEW || on_planes * 10 > finite.len() {
        return None;
    }
    let found = if on_planes == 0 { "no planes" } else { "hardly any point is on a plane" };
    if let Some(why) = of_size(&finite) {
        return Some(format!("{found}: {why}"));
    }
    let cells: HashSet<[i32; 3]> =
        finite.iter().map(|p| p.map(|v| (f64::from(v) / delta_m).floor() as i32)).collect();
    (cells.len() as f64 > SPARSE * finite.len() as f64).then(|| {
        format!(
            "{found}: most points have no other within delta ({delta_m} m), so that no surface holds together"
        )
    })
}

/// Why a mesh may have become no polygon, or one of millimeters a few with rough borders.
pub(crate) fn of_mesh(points_m: &[[f32; 3]], polygons: usize) -> Option<String> {
    let finite = finite(points_m);
    let why = of_size(&finite)?;
    match polygons {
        0 => Some(format!("no polygons: {why}")),
        _ => (size_m(&finite) > LARGE_M).then_some(why),
    }
}

fn of_size(finite_m: &[[f32; 3]]) -> Option<String> {
    let size_m = size_m(finite_m);
    (!(SMALL_M..=LARGE_M).contains(&size_m)).then(|| {
        format!(
            "coordinates are taken as meters, and these spread over {size_m:.3} m; are they in another unit?"
        )
    })
}

fn finite(points_m: &[[f32; 3]]) -> Vec<[f32; 3]> {
    points_m.iter().copied().filter(|p| p.iter().all(|v| v.is_finite())).collect()
}

/// How far most points spread along the longest axis, meters: a few strays do not count.
fn size_m(points_m: &[[f32; 3]]) -> f64 {
    if points_m.is_empty() {
        return 0.0;
    }
    let step = points_m.len().div_ceil(SAMPLE).max(1);
    let spread = |axis: usize| {
        let mut values: Vec<f32> = points_m.iter().step_by(step).map(|p| p[axis]).collect();
        values.sort_unstable_by(f32::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
        f64::from(at(0.98)) - f64::from(at(0.02))
    };
    (0..3).map(spread).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::{of_cloud, of_mesh};

    /// A hundred by a hundred points, so many meters apart.
    fn grid(step_m: f32) -> Vec<[f32; 3]> {
        (0..10_000u16).map(|k| [step_m * f32::from(k % 100), step_m * f32::from(k / 100), 0.0]).collect()
    }

    #[test]
    fn millimeters_inches_and_sparse_points_are_suspected_and_a_cloud_with_planes_is_not() {
        assert!(of_cloud(&grid(50.0), 0, 0.3).unwrap().contains("spread over 4"));
        assert!(of_cloud(&grid(0.00005), 0, 0.3).unwrap().contains("another unit"));
        let mut outliers = grid(1.0);
        outliers[0] = [1e9, f32::NAN, 0.0];
        outliers[1] = [1e9, 0.0, 0.0];
        assert!(
            of_cloud(&outliers, 900, 0.3)
                .unwrap()
                .starts_with("hardly any point is on a plane: most points have no other")
        );
        assert_eq!(of_cloud(&grid(0.05), 0, 0.3), None);
        assert_eq!(of_cloud(&grid(50.0), 5_000, 0.3), None);
        assert_eq!(of_cloud(&[[0.0; 3]; 10], 0, 0.3), None);
        assert!(
            of_mesh(&grid(500.0), 0).unwrap().starts_with("no polygons: coordinates are taken as meters")
        );
        // A room of 5 m in millimeters has its walls, and nothing as fine as its door.
        assert!(of_mesh(&grid(50.0), 6).unwrap().contains("are they in another unit?"));
        assert_eq!(of_mesh(&grid(0.001), 6), None);
        assert!(of_mesh(&[], 0).is_some());
    }
}
