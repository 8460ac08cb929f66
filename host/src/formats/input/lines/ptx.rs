//! PTX, Leica's text of structured scans: any number of scans one after the other.
//!
//! A scan begins with its columns, its rows, the scanner's position, three lines of its axes, and four of a
//! matrix. Then follows a point a line, `x y z` and what else is known of it. A point is a row vector: its
//! place is `(x, y, z, 1)` times the matrix, whose last row moves. What the scanner did not see is `0 0 0`,
//! and stays in its place as a point that is nowhere (NaN). Columns and rows decide no memory: points are
//! counted as they come. Meters.

use std::io::BufRead;

use biplane_recording::file_kind::text_of;

use crate::formats::input::cloud_file::{CloudFile, CloudFileError, ScanStart};
use crate::formats::input::lines::{BYTE_ORDER_MARK, Lines};

/// How far the last column of a matrix may be off that of a motion.
const LAST_COLUMN_TOLERANCE: f64 = 1e-6;

/// Whether a file that begins so is PTX: two lines with one whole number each.
pub(crate) fn is_ptx(start: &[u8]) -> bool {
    let Some(text) = text_of(start) else { return false };
    let mut lines =
        text.trim_start_matches(BYTE_ORDER_MARK).lines().map(str::trim).filter(|line| !line.is_empty());
    let mut is_count = || lines.next().is_some_and(|line| line.parse::<u64>().is_ok());
    is_count() && is_count()
}

/// Reads all scans of a file.
pub(crate) fn read(text: impl BufRead) -> Result<CloudFile, CloudFileError> {
    let mut reader = Reader { lines: Lines::of(text), scans: Vec::new(), positions_m: Vec::new() };
    while reader.scan()? {}
    Ok(CloudFile { scans: reader.scans, ..CloudFile::of_positions(&reader.positions_m) })
}

/// What is read of a file so far.
#[derive(Debug)]
struct Reader<R> {
    lines: Lines<R>,
    scans: Vec<ScanStart>,
    positions_m: Vec<[f64; 3]>,
}

impl<R: BufRead> Reader<R> {
    /// Reads the next scan, if there is one.
    fn scan(&mut self) -> Result<bool, CloudFileError> {
        let scan = self.scans.len();
        let Some(row) = self.row()? else { return Ok(false) };
        let columns = count(&row)
            .ok_or_else(|| self.error(format!("the number of columns of scan {scan}"), Some(&row)))?;
        let rows = self.header(&format!("the number of rows of scan {scan}"), count)?;
        let position_m = self.header("the scanner's position as three numbers", numbers)?;
        for axis in ["x", "y", "z"] {
            self.header::<[f64; 3]>(&format!("the scanner's {axis} axis as three numbers"), numbers)?;
        }
        let mut matrix = [[0.0; 4]; 4];
        for (line, row) in matrix.iter_mut().enumerate() {
            *row = self.header(&format!("four numbers, row {line} of the matrix"), numbers)?;
            let last = if line == 3 { 1.0 } else { 0.0 };
            if (row[3] - last).abs() > LAST_COLUMN_TOLERANCE {
                let expected = format!("{last} at the end of row {line} of the matrix (its last row moves)");
                return Err(self.error(expected, Some(&row[3].to_string())));
            }
        }
        self.scans.push(ScanStart {
            first_point: self.positions_m.len(),
            position_m: Some(scanner_m(position_m, &matrix)),
        });
        self.points(u128::from(columns) * u128::from(rows), &matrix)?;
        Ok(true)
    }

    /// Reads the points of a scan.
    fn points(&mut self, count: u128, matrix: &[[f64; 4]; 4]) -> Result<(), CloudFileError> {
        let scan = self.scans.len() - 1;
        let mut point = 0;
        while point < count {
            let expected = || format!("x, y and z of point {point} of {count} in scan {scan}");
            let row = self.row()?;
            let Some(at_m) = row.as_deref().and_then(coordinates) else {
                return Err(self.error(expected(), row.as_deref()));
            };
            let is_seen = at_m != [0.0; 3];
            self.positions_m.push(if is_seen { moved(at_m, matrix) } else { [f64::NAN; 3] });
            point += 1;
        }
        Ok(())
    }

    /// What a line of a header holds.
    fn header<T>(&mut self, expected: &str, of: impl Fn(&str) -> Option<T>) -> Result<T, CloudFileError> {
        let row = self.row()?;
        let value = row.as_deref().and_then(of);
        value.ok_or_else(|| self.error(expected.to_owned(), row.as_deref()))
    }

    /// The next line that is not empty.
    fn row(&mut self) -> Result<Option<String>, CloudFileError> {
        while let Some((_, line)) = self.lines.next_line()? {
            if !line.is_empty() {
                return Ok(Some(line.into_owned()));
            }
        }
        Ok(None)
    }

    fn error(&self, expected: String, found: Option<&str>) -> CloudFileError {
        CloudFileError::line(self.lines.number, expected, found)
    }
}

/// Where the scanner stood. Some programs leave that at zero: then where the matrix moves the scan's own
/// origin to.
fn scanner_m(position_m: [f64; 3], matrix: &[[f64; 4]; 4]) -> [f64; 3] {
    if position_m == [0.0; 3] { moved(position_m, matrix) } else { position_m }
}

/// A row vector times the matrix.
fn moved(at_m: [f64; 3], matrix: &[[f64; 4]; 4]) -> [f64; 3] {
    let [x, y, z] = at_m;
    std::array::from_fn(|k| x * matrix[0][k] + y * matrix[1][k] + z * matrix[2][k] + matrix[3][k])
}

fn count(row: &str) -> Option<u64> {
    row.parse().ok()
}

/// So many finite numbers, and no more.
fn numbers<const N: usize>(row: &str) -> Option<[f64; N]> {
    let mut fields = row.split_whitespace();
    let mut out = [0.0; N];
    for value in &mut out {
        *value = fields.next()?.parse().ok().filter(|value: &f64| value.is_finite())?;
    }
    fields.next().is_none().then_some(out)
}

/// The first three numbers of a point.
fn coordinates(row: &str) -> Option<[f64; 3]> {
    let mut fields = row.split_whitespace().map(|field| field.parse().ok());
    Some([fields.next()??, fields.next()??, fields.next()??])
}

#[cfg(test)]
mod tests {
    use super::{is_ptx, read};

    /// A scan of two columns and two rows. Its matrix turns by 90 degrees about z (x becomes y, y becomes -x)
    /// and moves by (500000, 20, 3).
    const FIRST: &str = "2\n2\n500000 20 3\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n500000 20 3 1\n\
        1 2 0.5 0.25 255 0 0\n0 0 0 0.5 0 0 0\n-4 0.125 1e1 0.75 1 2 3\n0 0 1 0 0 0 0\n";
    /// A scan of one column and two rows without colors, which only moves. Its position is left out.
    const SECOND: &str = "1\r\n2\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n0 0 1\r\n1 0 0 0\r\n0 1 0 0\r\n0 0 1 0\r\n\
        499990 10 1 1\r\n1 1 1 0.5\r\n2.5 0 0 0.5\r\n";
    const POINTS: [[f64; 3]; 6] = [
        [499_998.0, 21.0, 3.5],
        [f64::NAN; 3],
        [499_999.875, 16.0, 13.0],
        [500_000.0, 20.0, 4.0],
        [499_991.0, 11.0, 2.0],
        [499_992.5, 10.0, 1.0],
    ];

    fn error(text: &str) -> String {
        read(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn scans_are_moved_by_their_matrices_and_what_was_not_seen_is_nowhere() {
        let text = [FIRST, "\n", SECOND].concat();
        assert!(is_ptx(text.as_bytes()));
        let file = read(text.as_bytes()).unwrap();
        assert_eq!(file.cloud.len(), POINTS.len());
        for (point, expected) in file.cloud.points_m.iter().zip(POINTS) {
            for axis in 0..3 {
                let found = f64::from(point[axis]) + file.shift_m[axis];
                assert!(found == expected[axis] || expected[axis].is_nan() && found.is_nan(), "{point:?}");
            }
        }
        let starts: Vec<_> = file.scans.iter().map(|scan| (scan.first_point, scan.position_m)).collect();
        assert_eq!(starts, [(0, Some([500_000.0, 20.0, 3.0])), (4, Some([499_990.0, 10.0, 1.0]))]);
    }

    #[test]
    fn an_error_says_what_was_expected_and_found_and_in_which_line() {
        for (from, to, says) in [
            (
                "500000 20 3\n0 1",
                "500000 20\n0 1",
                "line 3: expected the scanner's position as three numbers, found `500000 20`",
            ),
            (
                "\n0 1 0\n",
                "\n0 nan 0\n",
                "line 4: expected the scanner's x axis as three numbers, found `0 nan 0`",
            ),
            ("2\n2\n", "2\ntwo\n", "line 2: expected the number of rows of scan 0, found `two`"),
            (
                "2\n2\n",
                "2\n3\n",
                "line 15: expected x, y and z of point 4 of 6 in scan 0, found the end of the file",
            ),
            (
                "2\n2\n",
                "1\n2\n",
                "line 13: expected the number of columns of scan 1, found `-4 0.125 1e1 0.75 1 2 3`",
            ),
            (
                "-4 0.125",
                "-4 zwei",
                "line 13: expected x, y and z of point 2 of 4 in scan 0, found `-4 zwei 1e1 0.75 1 2 3`",
            ),
            ("-1 0 0 0\n", "-1 0 0\n", "line 8: expected four numbers, row 1 of the matrix, found `-1 0 0`"),
            // A matrix for column vectors.
            (
                "0 1 0 0\n",
                "0 -1 0 500000\n",
                "line 7: expected 0 at the end of row 0 of the matrix (its last row moves), found `500000`",
            ),
        ] {
            assert!(FIRST.contains(from), "{from}");
            assert_eq!(error(&FIRST.replacen(from, to, 1)), says);
        }
    }

    #[test]
    fn every_cut_is_an_error_and_a_boast_takes_no_memory() {
        // The digits and the color of the last point may be cut, and nobody knows.
        for end in 1..FIRST.len() - "1 0 0 0 0\n".len() {
            assert!(read(&FIRST.as_bytes()[..end]).is_err(), "cut at {end}");
        }
        let boast = FIRST.replacen("2\n2\n", "18446744073709551615\n18446744073709551615\n", 1);
        assert!(error(&boast).contains("point 4 of 340282366920938463426481119284349108225 in scan 0"));
        let none = FIRST.replacen("2\n2\n", "0\n2\n", 1);
        assert!(error(&none).starts_with("line 11: expected the number of columns of scan 1"));
    }

    #[test]
    fn other_texts_are_no_ptx() {
        for other in ["1 2 3\n4 5 6\n", "2\n1 2 3\n4 5 6\n", "2\n", "", "2\n-2\n"] {
            assert!(!is_ptx(other.as_bytes()), "{other}");
        }
    }
}
