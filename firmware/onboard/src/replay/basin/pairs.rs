//! The list of pairs: lines `stamp_a stamp_b x y theta`, the base at scan b seen from the base at scan a;
//! seconds, meters, radians. `#` begins a remark.

use std::path::Path;

use crate::types::error::PairsError;
use biplane_matcher::Pose2;

/// Two scans and their true pose.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Pair {
    /// Stamps as the list has them, nanoseconds: good to half of the last digit that it writes, or to 5 ms.
    pub stamps_ns: [i64; 2],
    /// The base at the second scan, seen from the base at the first.
    pub first_from_second: Pose2,
}

/// Reads a list of pairs.
///
/// # Errors
/// When it cannot be read, a line is not five finite numbers, or there is no line.
pub(crate) fn read_pairs(path: &Path) -> Result<Vec<Pair>, PairsError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| PairsError::Unreadable { path: path.to_owned(), source })?;
    let mut pairs = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let words = line.split('#').next().unwrap_or_default().trim();
        if words.is_empty() {
            continue;
        }
        let pair = pair(words).ok_or_else(|| PairsError::Line {
            path: path.to_owned(),
            line: index + 1,
            found: line.to_owned(),
        })?;
        pairs.push(pair);
    }
    if pairs.is_empty() {
        return Err(PairsError::Empty { path: path.to_owned() });
    }
    Ok(pairs)
}

fn pair(words: &str) -> Option<Pair> {
    let numbers: Vec<f64> = words.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    let [first_s, second_s, x_m, y_m, theta_rad] = numbers[..] else { return None };
    let stamp_ns = |seconds: f64| (seconds * 1e9).round() as i64;
    let is_fine = numbers.iter().all(|number| number.is_finite());
    is_fine.then(|| Pair {
        stamps_ns: [stamp_ns(first_s), stamp_ns(second_s)],
        first_from_second: Pose2::new(x_m, y_m, theta_rad),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<Pair>, PairsError> {
        let name = format!("biplane-pairs-{}-{}", std::process::id(), text.len());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, text).unwrap();
        let pairs = read_pairs(&path);
        std::fs::remove_file(&path).unwrap();
        pairs
    }

    #[test]
    fn lines_are_pairs_and_remarks_are_none() {
        let pairs = read("# by hand\n1.5 2.25 1.0 -0.5 0.1 # good\n\n3 4 0 0 0\n").unwrap();
        assert_eq!(pairs.len(), 2);
        assert_eq!(pairs[0].stamps_ns, [1_500_000_000, 2_250_000_000]);
        assert_eq!(pairs[0].first_from_second, Pose2::new(1.0, -0.5, 0.1));
    }

    #[test]
    fn what_is_no_pair_is_told_with_its_line() {
        for line in ["1 2 3 4", "1 2 3 4 5 6", "1 2 3 4 x", "1 2 3 4 nan"] {
            let error = read(&format!("# head\n{line}\n")).unwrap_err().to_string();
            assert!(error.contains("line 2") && error.contains(line), "{error}");
        }
        assert!(matches!(read("# nothing\n"), Err(PairsError::Empty { .. })));
        assert!(matches!(read_pairs(Path::new("/nowhere")), Err(PairsError::Unreadable { .. })));
    }
}
