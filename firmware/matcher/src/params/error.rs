//! What is wrong with a parameter's name or value, with names like the one that was given.

use crate::parameter_group::Parameter;

/// A parameter that cannot be set so.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum ParameterError {
    /// No parameter has this name.
    #[error("no parameter of the matcher is called \"{found}\"{}", suggestion(.near))]
    Unknown {
        /// What was given.
        found: String,
        /// Names like it, the nearest first.
        near: Vec<&'static str>,
    },
    /// The value is outside what makes sense, or no number.
    #[error("{} is from {} to {}, found {found}", .parameter.name, .parameter.minimum, .parameter.maximum)]
    OutOfRange {
        /// The parameter.
        parameter: Parameter,
        /// What was given.
        found: f64,
    },
    /// A count with a fraction.
    #[error("{} is a whole number, found {found}", .parameter.name)]
    NotWhole {
        /// The parameter.
        parameter: Parameter,
        /// What was given.
        found: f64,
    },
}

fn suggestion(near: &[&str]) -> String {
    if near.is_empty() { String::new() } else { format!("; there is {}", near.join(", ")) }
}

/// Names that a wrong one may have meant, at most.
const NEAR: usize = 3;

impl ParameterError {
    /// No such name among these parameters.
    pub(crate) fn unknown(found: &str, parameters: impl Iterator<Item = &'static Parameter>) -> Self {
        let field = |name: &'static str| name.split_once('.').map_or(name, |(_, field)| field);
        let mut near: Vec<_> = parameters
            .map(|p| (edits(found, p.name).min(edits(found, field(p.name))), p.name))
            .filter(|(edits, _)| 3 * edits <= found.chars().count())
            .collect();
        near.sort_by_key(|(edits, _)| *edits);
        let near = near.into_iter().take(NEAR).map(|(_, name)| name).collect();
        Self::Unknown { found: found.to_owned(), near }
    }
}

/// Letters to insert, leave out or change to make one word of another (Levenshtein).
fn edits(from: &str, to: &str) -> usize {
    let mut row: Vec<usize> = (0..=to.chars().count()).collect();
    for (i, a) in from.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, b) in to.chars().enumerate() {
            let changed = diagonal + usize::from(a != b);
            diagonal = row[j + 1];
            row[j + 1] = changed.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row.last().copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_are_counted_as_by_hand() {
        for (from, to, count) in [("", "", 0), ("", "ab", 2), ("kitten", "sitting", 3), ("flaw", "lawn", 2)] {
            assert_eq!((edits(from, to), edits(to, from)), (count, count), "{from} {to}");
        }
    }
}
