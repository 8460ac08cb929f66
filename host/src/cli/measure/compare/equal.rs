//! The raw mesh simplified by quadric errors until it equals the model in triangles, in bytes or in error.
//! The paper compares at equal surfaces, where a polygon counts as much as a triangle.

use super::figures::{Equal, Figures, Simplified};
use crate::model::Mesh;
use crate::reconstruct::simplify::fewer;

/// Rounds in which the number of triangles is corrected by the bytes that it gave; three come within 1 %.
const ROUNDS: usize = 3;
/// Numbers of triangles that are tried for an error are this factor apart.
const STEP: usize = 3;

/// Simplifies the raw mesh and measures it.
pub(super) fn simplified(
    raw: &Mesh,
    model: &Figures,
    equal: Equal,
    measure: impl Fn(&Mesh) -> Figures,
) -> Simplified {
    let at = |triangles: usize| measure(&fewer::to_count(raw, triangles));
    let (is_reached, figures) = match equal {
        Equal::Triangles => (true, at(model.triangles)),
        Equal::Bytes => (true, at_bytes(raw, model, at)),
        Equal::Rms => at_rms(raw, model, at),
    };
    Simplified { equal, is_reached, figures }
}

fn at_bytes(raw: &Mesh, model: &Figures, at: impl Fn(usize) -> Figures) -> Figures {
    let mut found = at(model.triangles);
    for _ in 0..ROUNDS {
        let share = model.bytes as f64 / found.bytes.max(1) as f64;
        let triangles = (found.triangles as f64 * share).round() as usize;
        found = at(triangles.clamp(1, raw.triangles.len().max(1)));
    }
    found
}

/// The fewest triangles whose error is no larger than the model's, to a factor; otherwise the least error.
fn at_rms(raw: &Mesh, model: &Figures, at: impl Fn(usize) -> Figures) -> (bool, Figures) {
    let mut best = at(model.surfaces);
    let mut triangles = model.surfaces.max(1);
    while best.to_truth.rms_m > model.to_truth.rms_m && triangles < raw.triangles.len() {
        triangles = triangles.saturating_mul(STEP).min(raw.triangles.len());
        let next = at(triangles);
        if next.to_truth.rms_m < best.to_truth.rms_m {
            best = next;
        }
    }
    (best.to_truth.rms_m <= model.to_truth.rms_m, best)
}

#[cfg(test)]
mod tests {
    use super::simplified;
    use crate::cli::measure::compare::figures::{Equal, Figures};
    use crate::metrics::surface_distance::Distances;
    use crate::model::Mesh;

    /// A rough sheet of 3,200 triangles.
    fn sheet() -> Mesh {
        let at = |k: u32| [0.1 * (k % 41) as f32, 0.1 * (k / 41) as f32, 0.01 * ((k * 7919) % 5) as f32];
        let square = |k: u32| {
            let a = k / 40 * 41 + k % 40;
            [[a, a + 1, a + 42], [a, a + 42, a + 41]]
        };
        Mesh { vertices_m: (0..41 * 41).map(at).collect(), triangles: (0..1600).flat_map(square).collect() }
    }

    /// As if a file had 20 bytes for each triangle, and the error were one over their number.
    fn figures(triangles: usize) -> Figures {
        let to_truth = Distances { rms_m: 1.0 / triangles as f64, ..Distances::default() };
        Figures {
            triangles,
            surfaces: triangles,
            polygons: None,
            bytes: 20 * triangles as u64,
            to_truth,
            from_truth: Distances::default(),
            symmetric_mean_m: 0.0,
            rays: None,
        }
    }

    #[test]
    fn a_simplification_equals_the_model_in_what_is_asked_for() {
        let raw = sheet();
        let model = Figures { surfaces: 50, bytes: 6000, ..figures(200) };
        let of = |equal| simplified(&raw, &model, equal, |mesh| figures(mesh.triangles.len()));
        assert!(of(Equal::Triangles).figures.triangles.abs_diff(200) <= 2);
        assert!(of(Equal::Bytes).figures.bytes.abs_diff(6000) <= 60);
        let found = of(Equal::Rms);
        assert!(found.is_reached && found.figures.to_truth.rms_m <= model.to_truth.rms_m);
        assert!(found.figures.triangles < 3 * 200, "{}", found.figures.triangles);
    }

    #[test]
    fn an_error_that_no_number_of_triangles_has_is_reported_as_not_reached() {
        let raw = sheet();
        let model = Figures { to_truth: Distances { rms_m: 1e-9, ..Distances::default() }, ..figures(200) };
        let found = simplified(&raw, &model, Equal::Rms, |mesh| figures(mesh.triangles.len()));
        assert!(!found.is_reached);
        assert_eq!(found.figures.triangles, 3200);
    }
}
