//! Registration: where a scan lies on a map or on another scan, by search and by Gauss-Newton alignment.
//!
//! There is one alignment over whatever can be asked for its nearest surface, one search over a lattice and
//! one by branch and bound. The tracker aligns scans with its [`LocalMap`](crate::LocalMap), loop closing
//! aligns submaps of a drive with a [`PointMap`](crate::PointMap).

pub(crate) mod covariance;
pub(crate) mod degeneracy;
pub(crate) mod field_gradient;
pub(crate) mod gauss_newton;
pub(crate) mod journal;
pub(crate) mod likelihood_field;
pub(crate) mod normal_equations;
pub(crate) mod search;
pub(crate) mod surface_map;
pub(crate) mod verdict;
