//! 2D scan matching with covariances: the public surface of the crate, and the floors it is built in.
//!
#![doc = include_str!("../README.md")]
//!
//! # Floors
//! The modules from bottom to top; each uses only those before it, and its own parts: `parameter_group` <
//! `placement`, `lanes` < `scan` < `map` < `moving`, `registration` < `motion` < `pose_covariance` < `params`
//! < `tracker`. Each stage declares its parameters beside its code; only `params` knows all of them.

mod lanes;
mod map;
mod motion;
mod moving;
mod parameter_group;
mod params;
mod placement;
mod pose_covariance;
mod registration;
mod scan;
mod tracker;

pub use biplane_geometry::{Pose2, wrap_angle};
pub use map::point_map::PointMap;
pub use map::surfel::Surfel;
pub use map::{LocalMap, MapParams, MapSize};
pub use motion::odometry::Odometry;
pub use motion::odometry_scale::{Estimate, OdometryScale};
pub use motion::params::MotionParams;
pub use moving::segments::free_standing;
pub use parameter_group::Parameter;
pub use params::{Method, ParameterError, TrackerParams, UnknownMethod};
pub use placement::Placement;
pub use pose_covariance::PoseCovarianceParams;
pub use registration::gauss_newton::params::AlignParams;
pub use registration::gauss_newton::point_alignment::PointAlignment;
pub use registration::journal::{Iteration, Journal};
pub use registration::likelihood_field::GradientParams;
pub use registration::search::correlative::SearchParams;
pub use registration::search::score_pyramid::ScorePyramid;
pub use registration::search::{Candidate, Strip, Window};
pub use scan::end_points::{EndPoint, EndPoints, Kind, Mobility, PointParams};
pub use scan::{Beam, Scan};
pub use tracker::pair::{Guess, PairMatch, PairMatcher};
pub use tracker::{Outcome, Tracked, Tracker};
