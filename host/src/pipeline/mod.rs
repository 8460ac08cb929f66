//! The whole of modeling on one page: each line of [`build`] is one stage, in the order of the paper.
//!
//! Frame `map`, meters. Deterministic: the same input and parameters give the same output on any number of
//! threads.

use crate::model::{Cloud, Mesh, Model};
use crate::pipeline::params::BuildParams;
use crate::reconstruct::leftovers;
use crate::reconstruct::mesh;
use crate::reconstruct::planes;
use crate::reconstruct::planes::labeled::{Planes, SigmaSource};
use crate::reconstruct::planes::search::searched::Searched;
use crate::reconstruct::polygons;
use crate::reconstruct::revisits::fuse::fuse;
use crate::reconstruct::revisits::labels::PlanesNear;
use crate::reconstruct::revisits::split::{Drive, Kept, Scans};
use crate::reconstruct::shapes;
use crate::recordings::deskew::Trajectory;
use crate::recordings::scan_geometry::RangeScan;
use crate::recordings::scan_geometry::ScanGeometry;

/// What modeling needs of a recording.
#[derive(Clone, Copy, Debug)]
pub struct BuildInput<'a> {
    /// The vertical laser.
    pub geometry: &'a ScanGeometry,
    /// Its scans, in time order.
    pub range_scans: &'a [RangeScan],
    /// The poses of the base.
    pub trajectory: &'a Trajectory,
}

impl<'a> BuildInput<'a> {
    /// What its points are made of.
    pub(crate) fn drive(&self, params: &'a BuildParams) -> Drive<'a> {
        let Self { geometry, range_scans, trajectory } = *self;
        Drive { params: &params.cloud, geometry, range_scans, trajectory }
    }
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
    /// So many points show something new: all stages to come cost by them.
    ///
    /// # Errors
    /// A sentence, when that is too much.
    fn first_views(&mut self, _points: usize) -> Result<(), String> {
        Ok(())
    }
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
    /// Points of the drive.
    pub raw_points: usize,
    /// Of these, seen again: on surfaces that earlier passes have covered, fused with the planes.
    pub revisited_points: usize,
    /// Triangles of the raw mesh of all points.
    pub raw_triangles: usize,
    /// Planes with at least one polygon.
    pub planes: usize,
    /// Polygons.
    pub polygons: usize,
    /// Holes of all polygons.
    pub holes: usize,
    /// Polygons that a bound on the model's size left out.
    pub polygons_left_out: usize,
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
    /// The raw 3D points; of a drive those that show something new.
    pub cloud: Cloud,
    /// For every point of the cloud the index of its plane in `model.planes`, or -1.
    pub labels: Vec<i32>,
    /// The raw 3D mesh over the cloud's points.
    pub mesh: Mesh,
    /// The compact model.
    pub model: Model,
    /// The figures.
    pub counts: Counts,
    /// What tells of points that are not in the cloud.
    pub(crate) revisits: Revisits,
}

/// Points that show nothing new, which nobody holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Revisits {
    /// Which points are in the cloud.
    pub kept: Kept,
    /// All scans.
    pub scans: Scans,
    /// On which planes the others lie.
    pub near: PlanesNear,
}

/// Why there is no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BuildError {
    /// The observer wants no more.
    #[error("{0}")]
    Refused(String),
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

/// Tells what was found in a cloud, or why there is nothing.
pub(crate) type SearchElsewhere<'a> = dyn Fn(&Cloud) -> Result<Searched, String> + 'a;

/// Builds the compact model of a recording.
pub fn build(
    input: &BuildInput<'_>,
    params: &BuildParams,
    observer: &mut dyn Observer,
) -> Result<BuildOutput, BuildError> {
    build_searched(input, params, None, observer)
}

/// [`build`] with planes that were searched elsewhere: `search` has what was found in a cloud.
pub(crate) fn build_searched(
    input: &BuildInput<'_>,
    params: &BuildParams,
    search: Option<&SearchElsewhere<'_>>,
    observer: &mut dyn Observer,
) -> Result<BuildOutput, BuildError> {
    observer.begins(Stage::Cloud);
    let drive = input.drive(params);
    let split = drive.split(&params.revisits, &params.mesh);
    observer.ended(Stage::Cloud, split.kept.points());
    if split.cloud.is_empty() {
        return Err(BuildError::NoPoints {
            range_scans: input.range_scans.len(),
            unposed: split.left_out.scans_unposed,
            min_range_m: params.cloud.min_range_m,
            max_range_m: params.cloud.max_range_m,
        });
    }
    observer.first_views(split.cloud.len()).map_err(BuildError::Refused)?;
    let searched = search.map(|search| search(&split.cloud)).transpose().map_err(BuildError::Refused)?;
    let mut near = PlanesNear::default();
    let mut fuse = |cloud: &Cloud, found: &mut Planes| near = fuse(&drive, cloud, &split.kept, found);
    let mut output = model_with(split.cloud, searched, params, observer, &mut fuse);
    output.counts.raw_points = split.kept.points();
    output.counts.raw_triangles = split.raw_triangles;
    output.counts.revisited_points = split.kept.revisited();
    output.counts.scans_still = split.left_out.scans_still;
    output.counts.scans_unposed = split.left_out.scans_unposed;
    output.revisits = Revisits { kept: split.kept, scans: split.scans, near };
    Ok(output)
}

/// Builds the compact model of an organized cloud: everything after its points are posed.
pub fn model_of(cloud: Cloud, params: &BuildParams, observer: &mut dyn Observer) -> BuildOutput {
    model_with(cloud, None, params, observer, &mut |_, _| ())
}

/// [`model_of`], with planes that `fuse` makes more exact before they get polygons.
fn model_with(
    cloud: Cloud,
    searched: Option<Searched>,
    params: &BuildParams,
    observer: &mut dyn Observer,
    fuse: &mut dyn FnMut(&Cloud, &mut Planes),
) -> BuildOutput {
    observer.begins(Stage::Mesh);
    let mesh = mesh::join(&params.mesh, &cloud);
    observer.ended(Stage::Mesh, mesh.triangles.len());

    observer.begins(Stage::Planes);
    let mut progress = |percent: u64| observer.goes_on(Stage::Planes, percent as f64 / 100.0);
    let mut found = match searched {
        Some(searched) => planes::extract_searched(&params.planes, &cloud, searched, &mut progress),
        None => planes::extract_with_progress(&params.planes, &cloud, &mut progress),
    };
    let rounds = shapes::extract(&params.shapes, &cloud, &mut found);
    fuse(&cloud, &mut found);
    observer.ended(Stage::Planes, found.planes.len());

    observer.begins(Stage::Polygons);
    let mut merged = polygons::merge(&params.polygons, &cloud, &mesh, &found);
    rounds.settle(&cloud, &mesh, &found, &mut merged);
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
    let model = Model {
        planes: found.planes,
        polygons: merged.polygons,
        leftovers,
        cylinders: rounds.cylinders,
        ..Model::default()
    };
    counts.recount(&model);
    BuildOutput { cloud, labels: found.labels, mesh, model, counts, revisits: Revisits::default() }
}

pub(crate) mod compact;
pub(crate) mod drive_points;
pub(crate) mod params;
pub(crate) mod plane_report;
pub(crate) mod rooms;
pub(crate) mod storey_fit;
mod storey_part;
pub(crate) mod summary;
#[cfg(test)]
mod tests;
pub(crate) mod tiles;
