//! The methods by name.

use std::fmt;
use std::str::FromStr;

/// How scans are matched.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum Method {
    /// The paper's (section 2): gradient ascent on a likelihood field with occlusion, made from earlier
    /// scans.
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
