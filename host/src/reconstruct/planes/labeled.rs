//! The planes of a cloud and which point is on which: the result of the search.

use crate::model::Plane;
use serde::{Deserialize, Serialize};

/// The planes of a cloud and which point is on which.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planes {
    /// The planes, largest first.
    pub planes: Vec<Plane>,
    /// For every point the index of its plane, or -1.
    pub labels: Vec<i32>,
    /// The range noise that was given, estimated or assumed, meters.
    pub sigma_m: f64,
    /// Where `sigma_m` comes from.
    pub sigma_source: SigmaSource,
}

/// Where the range noise comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SigmaSource {
    /// The caller said it.
    Given,
    /// From the cloud itself: the median error of local planes.
    Estimated,
    /// The cloud is too small to tell: that of a typical laser.
    #[default]
    Assumed,
}

impl SigmaSource {
    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Given => "as given",
            Self::Estimated => "estimated",
            Self::Assumed => "assumed: the points do not show it",
        }
    }
}
