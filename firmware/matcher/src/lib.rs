//! Incremental 2D scan matching after Hähnel, Burgard and Thrun, "Learning Compact 3D Models of Indoor and Outdoor
//! Environments with a Mobile Robot" (section 2), and what has been learnt since.
//!
//! A [`Tracker`] takes one [`Scan`] after the other with the odometry's pose and answers each with the base's pose in
//! the map and its covariance. The crate knows no files, no devices and no clock; time comes in with the scans, and
//! nothing is allocated after [`Tracker::new`]. Units: metres, radians, seconds; stamps are nanoseconds.

mod align;
mod belief;
mod carve;
mod contest;
mod covariance;
mod doubt;
mod engine;
mod field;
mod gradient;
mod grid;
mod journal;
mod line;
mod local_map;
mod map_matcher;
mod motion;
mod named;
mod normal;
mod odometry;
mod paint;
mod pair;
mod params;
mod points;
mod pose;
mod scan;
mod search;
mod surface;
mod tracker;

pub use align::AlignParams;
pub use belief::BeliefParams;
pub use gradient::GradientParams;
pub use journal::{Iteration, Journal};
pub use local_map::{LocalMap, MapParams};
pub use motion::MotionParams;
pub use named::{Parameter, ParameterError};
pub use odometry::Odometry;
pub use pair::{Guess, PairMatch, PairMatcher};
pub use params::{Method, TrackerParams, UnknownMethod};
pub use points::{EndPoint, EndPoints, Kind, PointParams};
pub use pose::{Pose2, wrap_angle};
pub use scan::{Beam, Scan};
pub use search::SearchParams;
pub use surface::{Placement, Surface};
pub use tracker::{MapSize, Outcome, Tracked, Tracker};
