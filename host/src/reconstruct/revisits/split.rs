//! A drive's points: the first views as a cloud, and all of them again, one by one.
//!
//! Points of later passes are not held: whoever needs them has the drive posed again. Frame `map`, meters.

use super::first_views::FirstViews;
use super::params::RevisitParams;
use crate::model::Cloud;
use crate::reconstruct::cloud::{CloudParams, LeftOut, PosedScan, ScanPoser};
use crate::reconstruct::mesh::{MeshParams, TriangleCount};
use crate::recordings::deskew::Trajectory;
use crate::recordings::scan_geometry::{RangeScan, ScanGeometry};

/// What a drive's points are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drive<'a> {
    /// Which beams become points.
    pub params: &'a CloudParams,
    /// The vertical laser.
    pub geometry: &'a ScanGeometry,
    /// Its scans, in time order.
    pub range_scans: &'a [RangeScan],
    /// The poses of the base.
    pub trajectory: &'a Trajectory,
}

/// The points that show something new, and what is known of the others.
#[derive(Clone, Debug, Default)]
pub(crate) struct Split {
    /// The first views.
    pub cloud: Cloud,
    /// Where all scans were taken from, also those without a first view, and when.
    pub scans: Scans,
    /// Which of all points these are.
    pub kept: Kept,
    /// What was left out.
    pub left_out: LeftOut,
    /// Triangles that a raw mesh of all points has.
    pub raw_triangles: usize,
}

/// All scans of a drive.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Scans {
    /// Position of the laser in `map`, meters.
    pub origins_m: Vec<[f32; 3]>,
    /// Stamps, nanoseconds.
    pub stamps_ns: Vec<i64>,
}

/// A yes or no for each point of a drive, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Kept {
    words: Vec<u64>,
    points: usize,
    kept: usize,
}

impl Kept {
    fn push(&mut self, is_kept: bool) {
        if self.points.is_multiple_of(64) {
            self.words.push(0);
        }
        if let Some(word) = self.words.last_mut() {
            *word |= u64::from(is_kept) << (self.points % 64);
        }
        self.points += 1;
        self.kept += usize::from(is_kept);
    }

    /// Whether a point is a first view.
    pub(crate) fn is_kept(&self, point: usize) -> bool {
        self.words.get(point / 64).is_some_and(|word| word >> (point % 64) & 1 == 1)
    }

    /// All points.
    pub(crate) fn points(&self) -> usize {
        self.points
    }

    /// Points that show nothing new.
    pub(crate) fn revisited(&self) -> usize {
        self.points - self.kept
    }
}

/// One point of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DrivePoint {
    /// Where it is.
    pub point_m: [f32; 3],
    /// Its place among the first views; `None` for one that shows nothing new.
    pub first_view: Option<usize>,
    /// Its scan's number.
    pub scan: u32,
    /// Its beam.
    pub beam: u16,
}

impl Drive<'_> {
    /// Poses everything and keeps what shows something new.
    pub(crate) fn split(&self, params: &RevisitParams, mesh: &MeshParams) -> Split {
        let mut poser = ScanPoser::new(self.params, self.geometry, self.trajectory);
        let mut out = Split { cloud: poser.empty_cloud(), ..Split::default() };
        let beams = &self.geometry.beams;
        let beam_step_rad = beams.get(1).map_or(0.0, |second| (second.angle_rad - beams[0].angle_rad).abs());
        let mut first_views = FirstViews::new(params, beam_step_rad);
        let mut triangles = TriangleCount::new(mesh, out.cloud.beams_per_scan);
        let mut row = PosedScan::default();
        let mut keep = |row: &PosedScan, kept: Option<&[bool]>| out.keep(row, kept);
        for range_scan in self.range_scans {
            if poser.pose(range_scan, &mut row) {
                triangles.push(&row);
                first_views.push(&row, &mut keep);
            }
        }
        first_views.finish(&mut keep);
        (out.left_out, out.raw_triangles) = (poser.left_out, triangles.triangles);
        let enough = params.min_share * out.kept.points() as f64;
        let mut out = if (out.kept.revisited() as f64) < enough { self.whole(&out) } else { out };
        out.cloud.points_m.shrink_to_fit();
        out.cloud.scan.shrink_to_fit();
        out.cloud.beam.shrink_to_fit();
        out
    }

    /// All points, whatever they show.
    fn whole(&self, split: &Split) -> Split {
        let mut poser = ScanPoser::new(self.params, self.geometry, self.trajectory);
        let (left_out, raw_triangles) = (split.left_out, split.raw_triangles);
        let mut out = Split { cloud: poser.empty_cloud(), left_out, raw_triangles, ..Split::default() };
        let mut row = PosedScan::default();
        for range_scan in self.range_scans {
            if poser.pose(range_scan, &mut row) {
                out.keep(&row, Some(&vec![true; row.points_m.len()]));
            }
        }
        out
    }

    /// Poses everything again and visits each point, in order, with what the first time told of it.
    ///
    /// # Errors
    /// The visitor's.
    pub(crate) fn visit<E>(
        &self,
        kept: &Kept,
        mut visit: impl FnMut(DrivePoint) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut poser = ScanPoser::new(self.params, self.geometry, self.trajectory);
        let mut row = PosedScan::default();
        let (mut scan, mut point, mut first_view) = (0, 0, 0);
        for range_scan in self.range_scans {
            if !poser.pose(range_scan, &mut row) {
                continue;
            }
            for (point_m, beam) in row.points_m.iter().zip(&row.beams) {
                let is_kept = kept.is_kept(point);
                let first = is_kept.then_some(first_view);
                visit(DrivePoint { point_m: *point_m, first_view: first, scan, beam: *beam })?;
                first_view += usize::from(is_kept);
                point += 1;
            }
            scan += 1;
        }
        Ok(())
    }
}

impl Split {
    fn keep(&mut self, row: &PosedScan, kept: Option<&[bool]>) {
        self.scans.origins_m.push(row.origin_m);
        self.scans.stamps_ns.push(row.stamp_ns);
        // A scan that is as good as the one before is none of the cloud, so that its neighbors are joined.
        let Some(kept) = kept else {
            row.points_m.iter().for_each(|_| self.kept.push(false));
            return;
        };
        let scan = self.cloud.origins_m.len() as u32;
        for ((point, beam), is_kept) in row.points_m.iter().zip(&row.beams).zip(kept) {
            self.kept.push(*is_kept);
            if *is_kept {
                self.cloud.points_m.push(*point);
                self.cloud.beam.push(*beam);
                self.cloud.scan.push(scan);
            }
        }
        self.cloud.origins_m.push(row.origin_m);
        self.cloud.stamps_ns.push(row.stamp_ns);
    }
}
