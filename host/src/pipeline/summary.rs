//! `summary.json`: the figures of a build, for people and scripts.
//!
//! The names of the top-level counts stay as they are, because scripts read them. Measured times and memory
//! are the only figures that differ between two runs over the same input.

#[cfg(feature = "cli")]
use biplane_cli::counted;
use serde::Serialize;

use crate::model::inferred::{InferredKind, InferredSurface};
use crate::model::{Model, Plane};
use crate::pipeline::Counts;
use crate::pipeline::params::BuildParams;
use crate::reconstruct::planes::labeled::SigmaSource;
use crate::slam::refinement::spatial::observability::Observed;

/// Time and memory of one stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct StageFigures {
    /// The stage.
    pub stage: String,
    /// Things made: points, triangles, planes, polygons, triangles, cells, files.
    pub count: usize,
    /// Seconds on the clock.
    pub wall_s: f64,
    /// Seconds of processor time, over all threads.
    pub cpu_s: f64,
    /// The process's largest resident memory by the stage's end, bytes.
    pub peak_memory_bytes: Option<u64>,
}

/// How well planes fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct PlaneErrors {
    /// Points on planes.
    pub points: usize,
    /// Root mean square distance of these to their planes, meters.
    pub rms_m: f64,
    /// Of the worst plane, meters.
    pub worst_plane_rms_m: f64,
    /// Range noise, meters.
    pub sigma_m: f64,
    /// Where it comes from.
    pub sigma_source: SigmaSource,
}

impl PlaneErrors {
    /// Of all planes of a model.
    pub(crate) fn of(model: &Model, sigma_m: f64, sigma_source: SigmaSource) -> Self {
        let points: usize = model.planes.iter().map(|plane| plane.points).sum();
        let squares = |plane: &Plane| plane.points as f64 * plane.rms_m * plane.rms_m;
        let sum: f64 = model.planes.iter().map(squares).sum();
        Self {
            points,
            rms_m: (sum / points.max(1) as f64).sqrt(),
            worst_plane_rms_m: model.planes.iter().map(|plane| plane.rms_m).fold(0.0, f64::max),
            sigma_m,
            sigma_source,
        }
    }
}

/// What of a recording was used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct ScanFigures {
    /// Horizontal scans.
    pub horizontal: usize,
    /// Of these, without a pose.
    pub horizontal_unposed: usize,
    /// Vertical scans.
    pub vertical: usize,
    /// Of these, left out because the robot had not moved.
    pub vertical_still: usize,
    /// Of these, without a pose.
    pub vertical_unposed: usize,
    /// Of these, left out because their fan is another than the first one's.
    pub vertical_odd: usize,
    /// Poses that no motion explains, left out.
    pub wild_poses: usize,
}

/// Where the poses of a model are from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum PosesFrom {
    /// The recording, as it stands: it was asked for so, or no loop was found.
    Recorded,
    /// The recording, which is one that was optimized before.
    OptimizedBefore,
    /// This program, which closed the recording's loops. They may be refined in all six directions, too.
    Optimized,
    /// This program, which closed no loop, and refined the recorded poses in all six directions.
    Refined,
    /// A file.
    Given,
}

/// The counts of a model and of what it was made of.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ModelFigures {
    /// Points of the drive.
    pub raw_points: usize,
    /// Of these, seen again on surfaces that were covered, and fused with the planes.
    pub revisited_points: usize,
    /// Triangles of the raw mesh.
    pub raw_triangles: usize,
    /// Planes.
    pub planes: usize,
    /// Polygons.
    pub polygons: usize,
    /// Polygons that `--max-triangles` left out; absent when none were.
    #[serde(skip_serializing_if = "is_zero")]
    pub polygons_left_out: usize,
    /// Holes of all polygons.
    pub holes: usize,
    /// Triangles on no plane.
    pub leftover_triangles: usize,
    /// 100 (1 - (polygons + leftover_triangles) / raw_triangles).
    pub reduction_percent: f64,
    /// Triangles of the model with its polygons cut into triangles.
    pub model_triangles: usize,
    /// What nobody measured; in none of the counts above but the last.
    pub inferred: InferredFigures,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands it over so")]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Surfaces that nobody measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct InferredFigures {
    /// How many.
    pub surfaces: usize,
    /// Of floors, square meters.
    pub floor_m2: f64,
    /// Of the bases of walls, square meters.
    pub wall_base_m2: f64,
    /// Of walls around openings, square meters.
    pub opening_surround_m2: f64,
}

impl InferredFigures {
    fn of(model: &Model) -> Self {
        let area_m2 = |kind: InferredKind| {
            let of_kind = model.inferred.iter().filter(|surface| surface.kind == kind);
            let area_m2: f64 = of_kind.map(InferredSurface::area_m2).sum();
            // No areas add up to a negative zero.
            (area_m2 * 1e4).round() / 1e4 + 0.0
        };
        Self {
            surfaces: model.inferred.len(),
            floor_m2: area_m2(InferredKind::Floor),
            wall_base_m2: area_m2(InferredKind::WallBase),
            opening_surround_m2: area_m2(InferredKind::OpeningSurround),
        }
    }
}

/// What a model was made of.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct SourceFigures {
    /// The recordings that are in the model.
    pub recordings: Vec<String>,
    /// Recordings that saw no place that those saw, and are in nothing that is written.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub recordings_left_out: Vec<String>,
    /// The mesh, when the model was made of one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// What was taken off the mesh's coordinates while working, meters; all files are in its own coordinates
    /// again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift_m: Option<[f64; 3]>,
    /// The foreign trajectory, if one was given.
    pub poses: Option<String>,
    /// Where the poses are from, when there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poses_from: Option<PosesFrom>,
    /// Loops that were closed. Zero: none was found, or those found drew a worse map. Absent: none was
    /// searched for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loops: Option<usize>,
    /// Which directions of the poses the drive tells beside those on the floor; others are those of a flat
    /// floor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub observed: Option<Observed>,
}

/// Time and memory of everything.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct CostFigures {
    /// Seconds of everything, on the clock.
    pub wall_s: f64,
    /// Seconds of everything, processor time.
    pub cpu_s: f64,
    /// The process's largest resident memory, bytes.
    pub peak_memory_bytes: Option<u64>,
}

/// Everything in `summary.json`.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Summary {
    /// The counts.
    #[serde(flatten)]
    pub counts: ModelFigures,
    /// How well planes fit.
    pub errors: PlaneErrors,
    /// What of the recording was used.
    pub scans: ScanFigures,
    /// What the model was made of.
    #[serde(flatten)]
    pub source: SourceFigures,
    /// Stages in the order in which they ran.
    pub stages: Vec<StageFigures>,
    /// Time and memory of everything.
    #[serde(flatten)]
    pub cost: CostFigures,
    /// All parameters.
    pub parameters: Parameters,
    /// The program's version.
    pub version: &'static str,
}

/// What a build was asked for.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Parameters {
    /// Of the stages of modeling.
    pub build: BuildParams,
    /// Side of a cell of the floor map, meters.
    pub map_resolution_m: f64,
    /// Bound on the model's triangles, if one was given.
    pub max_triangles: Option<usize>,
    /// Whether surfaces stayed as they were seen.
    pub as_seen: bool,
}

impl Summary {
    /// The counts of a build's output.
    pub(crate) fn new(counts: &Counts, model: &Model, model_triangles: usize) -> Self {
        let figures = ModelFigures {
            raw_points: counts.raw_points,
            revisited_points: counts.revisited_points,
            raw_triangles: counts.raw_triangles,
            planes: counts.planes,
            polygons: counts.polygons,
            polygons_left_out: counts.polygons_left_out,
            holes: counts.holes,
            leftover_triangles: counts.leftover_triangles,
            reduction_percent: counts.reduction_percent(),
            model_triangles,
            inferred: InferredFigures::of(model),
        };
        Self {
            counts: figures,
            errors: PlaneErrors::of(model, counts.sigma_m, counts.sigma_source),
            scans: ScanFigures::default(),
            source: SourceFigures::default(),
            stages: Vec::new(),
            cost: CostFigures::default(),
            parameters: Parameters::default(),
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    /// What the raw triangles became, in words: for the command line.
    #[cfg(feature = "cli")]
    pub(crate) fn reduction(&self) -> String {
        format!(
            "{} -> {} with {} on {} + {}: {} fewer",
            counted(self.counts.raw_triangles, "triangle"),
            counted(self.counts.polygons, "polygon"),
            counted(self.counts.holes, "hole"),
            counted(self.counts.planes, "plane"),
            counted(self.counts.leftover_triangles, "triangle"),
            percent_text(self.counts.reduction_percent)
        )
    }
}

/// A share in percent with one decimal, with as many more as it takes that almost all is not all.
pub(crate) fn percent_text(percent: f64) -> String {
    let mut rounded = (1..=4).map(|decimals| format!("{percent:.decimals$}"));
    let is_true = |text: &String| percent >= 100.0 || !text.starts_with("100");
    rounded.find(is_true).unwrap_or_else(|| percent.to_string()) + " %"
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::Summary;
    use crate::model::sample;
    use crate::pipeline::Counts;

    #[test]
    fn the_counts_of_the_contract_stand_at_the_top_as_integers() {
        let counts = Counts {
            raw_points: 82_592,
            raw_triangles: 163_336,
            planes: 40,
            polygons: 868,
            holes: 12,
            leftover_triangles: 24_996,
            ..Counts::default()
        };
        let model = sample::model();
        let text = serde_json::to_string(&Summary::new(&counts, &model, 11)).unwrap();
        let value: Value = serde_json::from_str(&text).unwrap();
        for (key, expected) in [
            ("raw_points", 82_592),
            ("raw_triangles", 163_336),
            ("planes", 40),
            ("polygons", 868),
            ("holes", 12),
            ("leftover_triangles", 24_996),
        ] {
            assert_eq!(value[key].as_u64(), Some(expected), "{key}");
        }
        // The paper's corridor: 84 % fewer.
        assert!((value["reduction_percent"].as_f64().unwrap() - 84.165).abs() < 0.001);
        // sqrt((900 * 0.011^2 + 500 * 0.009^2) / 1400)
        assert!((value["errors"]["rms_m"].as_f64().unwrap() - 0.010330).abs() < 1e-6);
    }
    #[test]
    fn what_is_left_is_never_rounded_away() {
        for (percent, text) in [
            (84.165, "84.2 %"),
            (99.94, "99.9 %"),
            (99.976, "99.98 %"),
            (99.996, "99.996 %"),
            (100.0, "100.0 %"),
        ] {
            assert_eq!(super::percent_text(percent), text);
        }
    }

    #[test]
    fn one_is_no_plural() {
        let counts = Counts {
            raw_triangles: 2,
            planes: 1,
            polygons: 1,
            holes: 1,
            leftover_triangles: 1,
            ..Counts::default()
        };
        let text = Summary::new(&counts, &sample::model(), 3).reduction();
        assert_eq!(text, "2 triangles -> 1 polygon with 1 hole on 1 plane + 1 triangle: 0.0 % fewer");
    }
}
