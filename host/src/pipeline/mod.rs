//! The whole of modeling on one page: each line of [`build`] is one stage, in the order of the paper.
//!
//! Frame `map`, meters. Deterministic: the same input and parameters give the same output on any number of
//! threads.

use crate::model::{Cloud, Mesh, Model};
use crate::pipeline::params::BuildParams;
use crate::reconstruct::cloud::pose_scans;
use crate::reconstruct::leftovers;
use crate::reconstruct::mesh;
use crate::reconstruct::planes;
use crate::reconstruct::planes::labeled::SigmaSource;
use crate::reconstruct::polygons;
use crate::recordings::deskew::Trajectory;
use crate::recordings::scan_geometry::RangeScan;
use crate::recordings::scan_geometry::ScanGeometry;

/// What modeling needs of a recording.
#[derive(Clone, Debug)]
pub struct BuildInput<'a> {
    /// The vertical laser.
    pub geometry: &'a ScanGeometry,
    /// Its scans, in time order.
    pub range_scans: &'a [RangeScan],
    /// The poses of the base.
    pub trajectory: &'a Trajectory,
}

/// One line of [`build`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Beams to points.
    Cloud,
    /// Points to raw triangles.
    Mesh,
    /// Points to planes.
    Planes,
    /// Triangles of a plane to polygons.
    Polygons,
    /// Triangles of no plane to a cleaned mesh.
    Leftovers,
}

impl Stage {
    /// The stage's name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cloud => "cloud",
            Self::Mesh => "mesh",
            Self::Planes => "planes",
            Self::Polygons => "polygons",
            Self::Leftovers => "leftovers",
        }
    }
}

/// Watches a build: times its stages, shows progress. Time comes from the caller, because libraries read no
/// clock.
pub trait Observer {
    /// A stage begins.
    fn begins(&mut self, stage: Stage);
    /// This share of a stage's work is done, 0 to 1; said of stages that know it.
    fn goes_on(&mut self, _stage: Stage, _share: f64) {}
    /// A stage ended with `count` things made (points, triangles, planes, polygons, triangles).
    fn ended(&mut self, stage: Stage, count: usize);
}

/// Watches nothing.
impl Observer for () {
    fn begins(&mut self, _stage: Stage) {}
    fn ended(&mut self, _stage: Stage, _count: usize) {}
}

/// The figures of a build.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Points of the cloud.
    pub raw_points: usize,
    /// Triangles of the raw mesh.
    pub raw_triangles: usize,
    /// Planes with at least one polygon.
    pub planes: usize,
    /// Polygons.
    pub polygons: usize,
    /// Holes of all polygons.
    pub holes: usize,
    /// Triangles on no plane.
    pub leftover_triangles: usize,
    /// Raw triangles dropped because they only bridge a gap along a beam, or hang on a mixed pixel.
    pub jump_edge_triangles: usize,
    /// Scans dropped because the robot had not moved.
    pub scans_still: usize,
    /// Scans without a pose.
    pub scans_unposed: usize,
    /// Range noise, meters.
    pub sigma_m: f64,
    /// Where it comes from.
    pub sigma_source: SigmaSource,
}

impl Counts {
    /// Counts the surfaces of a model anew, after some were taken out.
    pub fn recount(&mut self, model: &Model) {
        self.polygons = model.polygons.len();
        self.holes = model.polygons.iter().map(|polygon| polygon.holes_m.len()).sum();
        self.leftover_triangles = model.leftovers.triangles.len();
    }

    /// How much smaller the model is than the raw mesh, percent: 100 (1 - (polygons + leftover triangles) /
    /// raw triangles).
    pub fn reduction_percent(&self) -> f64 {
        if self.raw_triangles == 0 {
            return 0.0;
        }
        100.0 * (1.0 - (self.polygons + self.leftover_triangles) as f64 / self.raw_triangles as f64)
    }
}

/// Everything a build makes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BuildOutput {
    /// The raw 3D points.
    pub cloud: Cloud,
    /// For every point the index of its plane in `model.planes`, or -1.
    pub labels: Vec<i32>,
    /// The raw 3D mesh over the cloud's points.
    pub mesh: Mesh,
    /// The compact model.
    pub model: Model,
    /// The figures.
    pub counts: Counts,
}

/// Why there is no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BuildError {
    /// Not one beam became a point.
    #[error(
        "no 3D point in {range_scans} vertical scans: {unposed} have no pose, the others saw nothing between {min_range_m} m and {max_range_m} m"
    )]
    NoPoints {
        /// Vertical scans given.
        range_scans: usize,
        /// Of these, outside the trajectory's time.
        unposed: usize,
        /// The range limits that were applied, meters.
        min_range_m: f32,
        /// See `min_range_m`.
        max_range_m: f32,
    },
}

/// Builds the compact model of a recording.
pub fn build(
    input: &BuildInput<'_>,
    params: &BuildParams,
    observer: &mut dyn Observer,
) -> Result<BuildOutput, BuildError> {
    observer.begins(Stage::Cloud);
    let posed = pose_scans(&params.cloud, input.geometry, input.range_scans, input.trajectory);
    observer.ended(Stage::Cloud, posed.cloud.len());
    if posed.cloud.is_empty() {
        return Err(BuildError::NoPoints {
            range_scans: input.range_scans.len(),
            unposed: posed.scans_unposed,
            min_range_m: params.cloud.min_range_m,
            max_range_m: params.cloud.max_range_m,
        });
    }
    let mut output = model_of(posed.cloud, params, observer);
    output.counts.scans_still = posed.scans_still;
    output.counts.scans_unposed = posed.scans_unposed;
    Ok(output)
}

/// Builds the compact model of an organized cloud: everything after its points are posed.
pub fn model_of(cloud: Cloud, params: &BuildParams, observer: &mut dyn Observer) -> BuildOutput {
    observer.begins(Stage::Mesh);
    let mesh = mesh::join(&params.mesh, &cloud);
    observer.ended(Stage::Mesh, mesh.triangles.len());

    observer.begins(Stage::Planes);
    let mut progress = |percent: u64| observer.goes_on(Stage::Planes, percent as f64 / 100.0);
    let found = planes::extract_with_progress(&params.planes, &cloud, &mut progress);
    observer.ended(Stage::Planes, found.planes.len());

    observer.begins(Stage::Polygons);
    let merged = polygons::merge(&params.polygons, &cloud, &mesh, &found);
    observer.ended(Stage::Polygons, merged.polygons.len());

    observer.begins(Stage::Leftovers);
    let leftovers = leftovers::collect(&params.leftovers, &mesh, &merged.rest);
    observer.ended(Stage::Leftovers, leftovers.triangles.len());

    let mut counts = Counts {
        raw_points: cloud.len(),
        raw_triangles: mesh.triangles.len(),
        planes: found.planes.len(),
        jump_edge_triangles: merged.jump_edges,
        sigma_m: found.sigma_m,
        sigma_source: found.sigma_source,
        ..Counts::default()
    };
    let model = Model { planes: found.planes, polygons: merged.polygons, leftovers };
    counts.recount(&model);
    BuildOutput { cloud, labels: found.labels, mesh, model, counts }
}

pub(crate) mod compact;
pub(crate) mod params;
pub(crate) mod plane_report;
pub(crate) mod summary;
#[cfg(test)]
mod tests;
