//! Every parameter by its name, for command lines, records of a run and tests: `align.outlier_m` is
//! `TrackerParams::align.outlier_m`. Units are in the names. Numbers pass as `f64`; counts must be whole.
//!
//! Name, meaning and sensible range come from the struct itself: its stage declares it with `named_parameters!`, whose
//! doc comments are the only description there is.

use crate::align::AlignParams;
use crate::belief::BeliefParams;
use crate::gradient::GradientParams;
use crate::local_map::MapParams;
use crate::motion::MotionParams;
use crate::params::TrackerParams;
use crate::points::PointParams;
use crate::search::SearchParams;

/// One parameter, whatever its value.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Parameter {
    /// `stage.field`.
    pub name: &'static str,
    /// What it is and what it trades.
    pub meaning: &'static str,
    /// The smallest value that makes sense.
    pub least: f64,
    /// The largest value that makes sense.
    pub most: f64,
    /// Whether it counts something.
    pub whole: bool,
}

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
    #[error("{} is from {} to {}, found {found}", .parameter.name, .parameter.least, .parameter.most)]
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

/// A stage's struct of parameters by name.
pub(crate) trait Named {
    /// Its parameters, in the order of the fields.
    const PARAMETERS: &'static [Parameter];
    /// A value, when the stage has a parameter of this name.
    fn get(&self, name: &str) -> Option<f64>;
    /// Changes a value, when the stage has a parameter of this name; the value is one that makes sense.
    fn set(&mut self, name: &str, value: f64);
}

/// Most that a count may be, where the field says nothing else: memory is made for some of them.
pub(crate) const MOST: f64 = 1e5;

/// Declares a stage's parameters: the struct as it would stand without, `name: type` or `name: type [least, most]`, after
/// the stage's name.
macro_rules! named_parameters {
    (@range) => { [0.0, crate::named::MOST] };
    (@range [$least:expr, $most:expr]) => { [$least, $most] };
    ($stage:literal; $(#[$meta:meta])* pub struct $params:ident {
        $($(#[doc = $doc:literal])+ pub $field:ident : $kind:tt $([$least:expr, $most:expr])?,)+
    }) => {
        $(#[$meta])*
        pub struct $params { $($(#[doc = $doc])+ pub $field: $kind,)+ }

        impl crate::named::Named for $params {
            const PARAMETERS: &'static [crate::named::Parameter] = &[$({
                let [least, most] = crate::named::named_parameters!(@range $([$least, $most])?);
                crate::named::Parameter {
                    name: concat!($stage, ".", stringify!($field)),
                    meaning: concat!($($doc),+).trim_ascii(),
                    least,
                    most,
                    whole: <$kind as crate::named::Number>::WHOLE,
                }
            }),+];

            fn get(&self, name: &str) -> Option<f64> {
                match name {
                    $(concat!($stage, ".", stringify!($field)) => Some(self.$field as f64),)+
                    _ => None,
                }
            }

            fn set(&mut self, name: &str, value: f64) {
                match name {
                    $(concat!($stage, ".", stringify!($field)) => {
                        self.$field = <$kind as crate::named::Number>::from_f64(value);
                    })+
                    _ => {}
                }
            }
        }
    };
}
pub(crate) use named_parameters;

/// The types of parameters.
pub(crate) trait Number {
    /// Whether only whole numbers are values.
    const WHOLE: bool;
    /// The value; the caller has made sure that it is one.
    fn from_f64(value: f64) -> Self;
}

impl Number for f64 {
    const WHOLE: bool = false;
    fn from_f64(value: f64) -> Self {
        value
    }
}

macro_rules! counts {
    ($($kind:ident),*) => { $(impl Number for $kind {
        const WHOLE: bool = true;
        fn from_f64(value: f64) -> Self {
            value as $kind
        }
    })* };
}
counts!(usize, u32, i16);

impl TrackerParams {
    /// All parameters, stage by stage.
    pub fn parameters() -> impl Iterator<Item = &'static Parameter> {
        let stages = [
            MotionParams::PARAMETERS,
            PointParams::PARAMETERS,
            GradientParams::PARAMETERS,
            MapParams::PARAMETERS,
            AlignParams::PARAMETERS,
            SearchParams::PARAMETERS,
            BeliefParams::PARAMETERS,
        ];
        stages.into_iter().flatten()
    }

    /// The value of a parameter.
    ///
    /// # Errors
    /// When no parameter has this name.
    pub fn get(&self, name: &str) -> Result<f64, ParameterError> {
        let value = self.motion.get(name).or_else(|| self.points.get(name));
        let value = value.or_else(|| self.gradient.get(name)).or_else(|| self.map.get(name));
        value
            .or_else(|| self.align.get(name))
            .or_else(|| self.search.get(name))
            .or_else(|| self.belief.get(name))
            .ok_or_else(|| unknown(name))
    }

    /// Changes a parameter.
    ///
    /// # Errors
    /// When no parameter has this name, or the value is none for it.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), ParameterError> {
        let parameter = *Self::parameters().find(|p| p.name == name).ok_or_else(|| unknown(name))?;
        if !(parameter.least..=parameter.most).contains(&value) {
            return Err(ParameterError::OutOfRange { parameter, found: value });
        }
        if parameter.whole && value.fract() != 0.0 {
            return Err(ParameterError::NotWhole { parameter, found: value });
        }
        self.motion.set(name, value);
        self.points.set(name, value);
        self.gradient.set(name, value);
        self.map.set(name, value);
        self.align.set(name, value);
        self.search.set(name, value);
        self.belief.set(name, value);
        Ok(())
    }
}

/// Names that a wrong one may have meant, at most.
const NEAR: usize = 3;

fn unknown(found: &str) -> ParameterError {
    let field = |name: &'static str| name.split_once('.').map_or(name, |(_, field)| field);
    let mut near: Vec<_> = TrackerParams::parameters()
        .map(|p| (edits(found, p.name).min(edits(found, field(p.name))), p.name))
        .filter(|(edits, _)| 3 * edits <= found.chars().count())
        .collect();
    near.sort_by_key(|(edits, _)| *edits);
    let near = near.into_iter().take(NEAR).map(|(_, name)| name).collect();
    ParameterError::Unknown { found: found.to_owned(), near }
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
    fn every_field_of_every_stage_has_its_name_a_meaning_and_a_default_within_its_range() {
        let defaults = TrackerParams::default();
        let text = format!("{defaults:?}");
        let fields = text.matches(": ").count() - 1 - 7; // without the method and the seven stages themselves
        assert_eq!(TrackerParams::parameters().count(), fields, "{text}");
        for parameter in TrackerParams::parameters() {
            let default = defaults.get(parameter.name).unwrap();
            assert!((parameter.least..=parameter.most).contains(&default), "{parameter:?}");
            assert!(parameter.meaning.ends_with('.'), "{parameter:?}");
        }
    }

    #[test]
    fn a_parameter_that_is_set_by_name_is_read_back_by_name_and_changes_the_struct() {
        for Parameter { name, .. } in TrackerParams::parameters() {
            let mut params = TrackerParams::default();
            let doubled = params.get(name).unwrap() * 2.0;
            params.set(name, doubled).unwrap();
            assert_eq!(params.get(name), Ok(doubled), "{name}");
            assert_ne!(params, TrackerParams::default(), "{name}");
        }
    }

    #[test]
    fn an_unknown_name_is_refused_with_names_like_it_and_a_value_that_is_none_with_the_range() {
        let refused = |name, value| TrackerParams::default().set(name, value).unwrap_err().to_string();
        let none = "no parameter of the matcher is called";
        assert_eq!(refused("align.typo", 1.0), format!("{none} \"align.typo\""));
        assert_eq!(
            refused("align.outlier", 1.0),
            format!("{none} \"align.outlier\"; there is align.outlier_m")
        );
        assert_eq!(
            refused("merge_acros_m", 1.0),
            format!("{none} \"merge_acros_m\"; there is map.merge_across_m")
        );
        assert_eq!(refused("map.tiles", 1.5), "map.tiles is a whole number, found 1.5");
        assert_eq!(refused("map.tiles", 0.0), "map.tiles is from 1 to 65534, found 0");
        assert_eq!(refused("align.outlier_m", f64::NAN), "align.outlier_m is from 0.0001 to 100, found NaN");
    }

    #[test]
    fn edits_are_counted_as_by_hand() {
        for (from, to, count) in [("", "", 0), ("", "ab", 2), ("kitten", "sitting", 3), ("flaw", "lawn", 2)] {
            assert_eq!((edits(from, to), edits(to, from)), (count, count), "{from} {to}");
        }
    }
}
