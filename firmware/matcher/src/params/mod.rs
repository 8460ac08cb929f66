//! The methods by name, and the tracker's parameters together: each stage keeps its own beside its code, and
//! only this module knows all of them. By name, for command lines and records of a run: `align.outlier_m` is
//! `TrackerParams::align.outlier_m`.

mod error;
mod method;

pub use error::ParameterError;
pub use method::{Method, UnknownMethod};

use crate::map::MapParams;
use crate::motion::params::MotionParams;
use crate::parameter_group::{Parameter, ParameterGroup};
use crate::pose_covariance::PoseCovarianceParams;
use crate::registration::gauss_newton::params::AlignParams;
use crate::registration::likelihood_field::GradientParams;
use crate::registration::search::correlative::SearchParams;
use crate::scan::end_points::PointParams;

/// Stages that have parameters.
const GROUPS: usize = 7;

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
    pub pose_covariance: PoseCovarianceParams,
}

impl TrackerParams {
    /// The defaults of a method.
    #[must_use]
    pub fn for_method(method: Method) -> Self {
        Self { method, ..Self::default() }
    }

    /// All parameters that have a name, stage by stage.
    pub fn parameters() -> impl Iterator<Item = &'static Parameter> {
        let groups = [
            MotionParams::parameters(),
            PointParams::parameters(),
            GradientParams::parameters(),
            MapParams::parameters(),
            AlignParams::parameters(),
            SearchParams::parameters(),
            PoseCovarianceParams::parameters(),
        ];
        groups.into_iter().flatten()
    }

    fn groups(&self) -> [&dyn ParameterGroup; GROUPS] {
        let Self { method: _, motion, points, gradient, map, align, search, pose_covariance } = self;
        [motion, points, gradient, map, align, search, pose_covariance]
    }

    fn groups_mut(&mut self) -> [&mut dyn ParameterGroup; GROUPS] {
        let Self { method: _, motion, points, gradient, map, align, search, pose_covariance } = self;
        [motion, points, gradient, map, align, search, pose_covariance]
    }

    /// The value of a parameter.
    ///
    /// # Errors
    /// When no parameter has this name.
    pub fn get(&self, name: &str) -> Result<f64, ParameterError> {
        let value = self.groups().into_iter().find_map(|group| group.get(name));
        value.ok_or_else(|| ParameterError::unknown(name, Self::parameters()))
    }

    /// Changes a parameter.
    ///
    /// # Errors
    /// When no parameter has this name, or the value is none for it.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), ParameterError> {
        let known = Self::parameters().find(|parameter| parameter.name == name);
        let parameter = *known.ok_or_else(|| ParameterError::unknown(name, Self::parameters()))?;
        if !(parameter.minimum..=parameter.maximum).contains(&value) {
            return Err(ParameterError::OutOfRange { parameter, found: value });
        }
        if parameter.whole && value.fract() != 0.0 {
            return Err(ParameterError::NotWhole { parameter, found: value });
        }
        self.groups_mut().into_iter().for_each(|group| group.set(name, value));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn thirty_parameters_at_most_have_a_name_of_their_own_a_meaning_and_a_default_within_its_range() {
        let defaults = TrackerParams::default();
        let names: BTreeSet<_> = TrackerParams::parameters().map(|parameter| parameter.name).collect();
        assert_eq!(names.len(), TrackerParams::parameters().count());
        assert!(names.len() <= 30, "{}", names.len());
        for parameter in TrackerParams::parameters() {
            let default = defaults.get(parameter.name).unwrap();
            assert!((parameter.minimum..=parameter.maximum).contains(&default), "{parameter:?}");
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
}
