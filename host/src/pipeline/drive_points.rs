//! All points of a drive with their planes, also those that nobody holds: posed once more, one by one.

use std::io;

use crate::formats::ply::write::{PointRow, PointTable};
use crate::pipeline::BuildOutput;
use crate::reconstruct::revisits::split::Drive;

/// The points of a drive, for a file.
pub(crate) struct DrivePoints<'a> {
    /// What they are made of.
    pub drive: Drive<'a>,
    /// What was made of them.
    pub output: &'a BuildOutput,
    /// What they come from, see `crate::formats::source_name`.
    pub source: &'a str,
}

impl PointTable for DrivePoints<'_> {
    fn count(&self) -> usize {
        self.output.revisits.kept.points()
    }

    fn has_scans(&self) -> bool {
        true
    }

    fn origins_m(&self) -> &[[f32; 3]] {
        &self.output.revisits.scans.origins_m
    }

    fn shift_m(&self) -> [f64; 3] {
        [0.0; 3]
    }

    fn source(&self) -> &str {
        self.source
    }

    fn visit(&self, visit: &mut dyn FnMut(&PointRow) -> io::Result<()>) -> io::Result<()> {
        let BuildOutput { cloud, labels, model, revisits, .. } = self.output;
        self.drive.visit(&revisits.kept, |point| {
            let plane = match point.first_view {
                Some(index) => labels.get(index).copied().unwrap_or(-1),
                None => revisits.near.label(&model.planes, point.point_m),
            };
            let stamp_ns = revisits.scans.stamps_ns.get(point.scan as usize);
            let delay_ns = cloud.delays_ns.get(usize::from(point.beam));
            visit(&PointRow {
                point_m: point.point_m,
                numbers: [plane, point.scan as i32, i32::from(point.beam)],
                stamp_ns: stamp_ns
                    .zip(delay_ns)
                    .map(|(stamp_ns, delay_ns)| stamp_ns.saturating_add(*delay_ns)),
            })
        })
    }
}
