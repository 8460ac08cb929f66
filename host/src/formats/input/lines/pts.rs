//! The counts of PTS: each scan of such a file begins with a line that says how many points it has.
//!
//! A scan that ends before its count is an error: the file is cut, or something else. One that goes on is
//! taken as it is, since what stands there are points.

use crate::formats::input::cloud_file::CloudFileError;

/// How many points the scans of a file should have.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Counts {
    /// Of the scan that is read; `None` where the file does not begin with a count.
    scan: Option<Count>,
    /// Scans before that.
    scans: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Count {
    points: u64,
    /// Where it stands.
    line: usize,
    /// Points of the file before it.
    before: usize,
}

impl Counts {
    /// Whether counts may stand in this file.
    pub(crate) fn are_there(&self) -> bool {
        self.scan.is_some()
    }

    /// Takes the count in a line, after so many points.
    pub(crate) fn begin(&mut self, points: u64, line: usize, before: usize) -> Result<(), CloudFileError> {
        self.end(line, before, Some(&points.to_string()))?;
        self.scans += usize::from(self.are_there());
        self.scan = Some(Count { points, line, before });
        Ok(())
    }

    /// Looks whether the scan has its points, where it ends by what was `found` in a line (`None`: the file's
    /// end).
    pub(crate) fn end(&self, line: usize, points: usize, found: Option<&str>) -> Result<(), CloudFileError> {
        let Some(scan) = self.scan else { return Ok(()) };
        let read = points - scan.before;
        if read as u64 >= scan.points {
            return Ok(());
        }
        let expected = format!(
            "point {read} of {} in scan {} (line {} counts them)",
            scan.points, self.scans, scan.line
        );
        Err(CloudFileError::line(line, expected, found))
    }
}
