//! The methods by name, and the tracker's parameters together: each stage keeps its own beside its code.

use std::fmt;
use std::str::FromStr;

use crate::align::AlignParams;
use crate::belief::BeliefParams;
use crate::gradient::GradientParams;
use crate::local_map::MapParams;
use crate::motion::MotionParams;
use crate::points::PointParams;
use crate::search::SearchParams;

/// How scans are matched.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum Method {
    /// The paper's (section 2): gradient ascent on a likelihood field with occlusion, made from earlier scans.
    Gradient,
    /// Every scan against a map of everything seen so far.
    #[default]
    Map,
}

/// A matcher's name that is not known.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("expected a matcher (gradient or map), found \"{found}\"")]
pub struct UnknownMethod {
    /// What was given.
    pub found: String,
}

impl Method {
    /// All methods, the default first.
    pub const ALL: [Self; 2] = [Self::Map, Self::Gradient];

    /// The name by which command lines know the method.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Gradient => "gradient",
            Self::Map => "map",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(text: &str) -> Result<Self, UnknownMethod> {
        let found = Self::ALL.into_iter().find(|method| method.name() == text);
        found.ok_or_else(|| UnknownMethod { found: text.to_owned() })
    }
}

/// All parameters of a [`Tracker`](crate::Tracker).
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct TrackerParams {
    /// How scans are matched.
    pub method: Method,
    /// What the odometry is worth.
    pub motion: MotionParams,
    /// Which beams are used.
    pub points: PointParams,
    /// The paper's method.
    pub gradient: GradientParams,
    /// The map of the default method.
    pub map: MapParams,
    /// The alignment with the map.
    pub align: AlignParams,
    /// The search when that fails.
    pub search: SearchParams,
    /// What the covariance takes for granted.
    pub belief: BeliefParams,
}

impl TrackerParams {
    /// The defaults of a method.
    #[must_use]
    pub fn for_method(method: Method) -> Self {
        Self { method, ..Self::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_is_found_by_its_name_and_others_are_refused_with_what_was_given() {
        for method in Method::ALL {
            assert_eq!(method.name().parse(), Ok(method));
        }
        let error = "csm".parse::<Method>().unwrap_err();
        assert_eq!(error.to_string(), "expected a matcher (gradient or map), found \"csm\"");
        assert_eq!(Method::default(), Method::ALL[0]);
    }
}
