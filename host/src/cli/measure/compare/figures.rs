//! What `compare` says.

use clap::ValueEnum;
use serde::Serialize;

use crate::metrics::blocked_rays::Blocked;
use crate::metrics::compare::CompareParams;
use crate::metrics::surface_distance::Distances;

/// One surface of a build.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Figures {
    /// Triangles of its file.
    pub triangles: usize,
    /// What the paper counts: polygons, and triangles that are part of none.
    pub surfaces: usize,
    /// Polygons with holes that its triangles stand for.
    pub polygons: Option<usize>,
    /// Size of its PLY file.
    pub bytes: u64,
    /// From the surface to the reference: how wrong it is.
    pub to_truth: Distances,
    /// From what was seen of the reference to the surface: what it misses.
    pub from_truth: Distances,
    /// Mean of the two mean distances, meters.
    pub symmetric_mean_m: f64,
    /// Rays of the laser that it blocks wrongly; `None` when the folder does not tell where they began.
    pub rays: Option<Blocked>,
}

/// In what a simplification equals the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Equal {
    /// In the triangles of its file
    Triangles,
    /// In the bytes of its file
    Bytes,
    /// In the RMS distance from the surface to the reference
    Rms,
}

/// A simplification that equals the model in one thing.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Simplified {
    /// In what.
    pub equal: Equal,
    /// False where no number of triangles has so small an error; the figures are then those of the least one.
    pub is_reached: bool,
    /// What came out.
    pub figures: Figures,
}

/// What `compare` says.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Report {
    /// What distances are measured against: the truth's file, or the raw points.
    pub reference: String,
    /// Faces of the truth that the laser hit, when the truth tells its faces apart (property `plane`).
    pub true_faces_seen: Option<usize>,
    /// The raw mesh, of first views where places were seen again.
    pub raw: Figures,
    /// Triangles of all passes of the drive, as `build` counts them.
    pub raw_triangles_of_all_passes: usize,
    /// The raw mesh simplified to the model's number of surfaces.
    pub qslim: Figures,
    /// The raw mesh simplified until it equals the model in what was asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub equal: Vec<Simplified>,
    /// The flat surfaces alone.
    pub planes: Figures,
    /// Flat surfaces and leftovers.
    pub model: Figures,
    /// How it was measured.
    pub parameters: CompareParams,
}

/// A raw mesh that lies farther than this from the truth in the mean lies in another frame, meters: poses of
/// a drive that tore are off by less over most of it.
const OTHER_FRAME_M: f64 = 0.3;

impl Report {
    /// What to look at first where the truth seems to lie in another frame.
    pub(super) fn other_frame(&self) -> Option<String> {
        let away_m = self.raw.to_truth.mean_m;
        (away_m > OTHER_FRAME_M).then(|| {
            format!(
                "biplane: the raw mesh lies {away_m:.2} m from {} in the mean: is that in the frame `map` of the \
                 recording, and in meters?",
                self.reference
            )
        })
    }
}
