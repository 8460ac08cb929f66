//! Point clouds as text: a point a line, as XYZ, TXT, ASC, CSV and PTS files have them.
//!
//! Numbers stand between blanks, commas or semicolons; between semicolons a comma is a decimal one. Lines
//! that are empty or begin with `#` or `//` are left out. The first other line may name the columns or, in
//! PTS, count the points; then each further scan begins with a count, too ([`Counts`]). Coordinates are the
//! columns named x, y and z, or the first three.

use std::io::BufRead;

use biplane_recording::file_kind::text_of;

use crate::formats::input::cloud_file::{CloudFile, CloudFileError};
use crate::formats::input::lines::pts::Counts;
use crate::formats::input::lines::{BYTE_ORDER_MARK, Lines};

/// Whether a file that begins so is a cloud in text: one of its first three lines that are no comments has
/// three numbers.
pub(crate) fn is_xyz(start: &[u8]) -> bool {
    let Some(text) = text_of(start) else { return false };
    text.lines()
        .map(content)
        .filter(|line| !line.is_empty())
        .take(3)
        .any(|line| position(line, [0, 1, 2]).is_some())
}

/// Reads the points of a text.
pub(crate) fn read(text: impl BufRead) -> Result<CloudFile, CloudFileError> {
    let mut positions_m = Vec::new();
    let mut columns = [0, 1, 2];
    let mut lines = Lines::of(text);
    let mut counts = Counts::default();
    let mut is_first = true;
    while let Some((line, whole)) = lines.next_line()? {
        let row = content(&whole);
        if row.is_empty() {
            if let Some(named) = named_columns(comment(&whole)).filter(|_| is_first) {
                columns = named;
            }
            continue;
        }
        match position(row, columns) {
            Some(point_m) => positions_m.push(point_m),
            None => match row.parse::<u64>() {
                Ok(points) if is_first || counts.are_there() => {
                    counts.begin(points, line, positions_m.len())?;
                }
                _ if is_first => columns = first_line(row, line)?.unwrap_or(columns),
                _ => return Err(no_point(row, line)),
            },
        }
        is_first = false;
    }
    counts.end(lines.number, positions_m.len(), None)?;
    Ok(CloudFile::of_positions(&positions_m))
}

/// The columns that a first line without a point names, `None` for words above unnamed columns.
fn first_line(row: &str, line: usize) -> Result<Option<[usize; 3]>, CloudFileError> {
    match named_columns(row) {
        Some(columns) => Ok(Some(columns)),
        None if fields(row).all(|field| field.parse::<f64>().is_err()) => Ok(None),
        // A line that has a number is a damaged point.
        None => Err(no_point(row, line)),
    }
}

/// What stands in a line, without comments.
fn content(line: &str) -> &str {
    let line = line.trim_start_matches(BYTE_ORDER_MARK).trim();
    if line.starts_with('#') || line.starts_with("//") { "" } else { line }
}

/// A comment without its marks; some programs name columns there.
fn comment(line: &str) -> &str {
    line.trim_start_matches(BYTE_ORDER_MARK).trim().trim_start_matches(['#', '/'])
}

fn fields(row: &str) -> impl Iterator<Item = &str> {
    let has_semicolons = row.contains(';');
    row.split(move |c: char| if has_semicolons { c == ';' } else { c == ',' || c.is_whitespace() })
        .map(str::trim)
        .filter(|field| !field.is_empty())
}

fn named_columns(row: &str) -> Option<[usize; 3]> {
    let place = |name: &str| fields(row).position(|field| field.trim_matches('"').eq_ignore_ascii_case(name));
    Some([place("x")?, place("y")?, place("z")?])
}

/// The numbers in these columns of a row, if they are there.
pub(crate) fn position(row: &str, columns: [usize; 3]) -> Option<[f64; 3]> {
    let has_decimal_commas = row.contains(';');
    let value = |column| number(fields(row).nth(column)?, has_decimal_commas);
    let [x, y, z] = columns.map(value);
    Some([x?, y?, z?])
}

fn number(field: &str, has_decimal_commas: bool) -> Option<f64> {
    if has_decimal_commas && field.contains(',') {
        return field.replacen(',', ".", 1).parse().ok();
    }
    field.parse().ok()
}

fn no_point(row: &str, line: usize) -> CloudFileError {
    CloudFileError::line(line, "x, y and z as numbers".to_owned(), Some(row))
}
