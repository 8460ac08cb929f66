//! Every parameter by its name, for command lines, records of a run and tests: `align.outlier_m` is
//! `TrackerParams::align.outlier_m`. Units are in the names. Numbers pass as `f64`; counts are rounded and cut to their type.

use crate::params::TrackerParams;

/// A parameter's name that is not known.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("no parameter of the matcher is called \"{found}\"")]
pub struct UnknownParameter {
    /// What was given.
    pub found: String,
}

macro_rules! named {
    ($($group:ident . $field:ident : $kind:ty),* $(,)?) => {
        impl TrackerParams {
            /// The names of all parameters, as `group.field`.
            pub const NAMES: &'static [&'static str] =
                &[$(concat!(stringify!($group), ".", stringify!($field))),*];

            /// The value of a parameter.
            ///
            /// # Errors
            /// When no parameter has this name.
            pub fn get(&self, name: &str) -> Result<f64, UnknownParameter> {
                match name {
                    $(concat!(stringify!($group), ".", stringify!($field)) => Ok(self.$group.$field as f64),)*
                    _ => Err(UnknownParameter { found: name.to_owned() }),
                }
            }

            /// Changes a parameter.
            ///
            /// # Errors
            /// When no parameter has this name.
            pub fn set(&mut self, name: &str, value: f64) -> Result<(), UnknownParameter> {
                match name {
                    $(concat!(stringify!($group), ".", stringify!($field)) => {
                        self.$group.$field = value.number();
                    })*
                    _ => return Err(UnknownParameter { found: name.to_owned() }),
                }
                Ok(())
            }
        }
    };
}

/// From `f64` to a parameter's own type.
trait Number<T> {
    fn number(self) -> T;
}

impl Number<f64> for f64 {
    fn number(self) -> f64 {
        self
    }
}

impl Number<usize> for f64 {
    fn number(self) -> usize {
        self.round() as usize
    }
}

impl Number<u32> for f64 {
    fn number(self) -> u32 {
        self.round() as u32
    }
}

impl Number<i16> for f64 {
    fn number(self) -> i16 {
        self.round() as i16
    }
}

named! {
    motion.position_m_per_m: f64,
    motion.position_m_per_rad: f64,
    motion.heading_rad_per_rad: f64,
    motion.heading_rad_per_m: f64,
    motion.position_floor_m: f64,
    motion.heading_floor_rad: f64,
    motion.jump_m: f64,
    motion.jump_rad: f64,
    motion.unmeasured_m: f64,
    motion.unmeasured_rad: f64,
    points.max_beams: usize,
    points.min_points: usize,
    points.range_min_m: f64,
    points.range_max_m: f64,
    points.spacing_m: f64,
    points.normal_reach_m: f64,
    points.line_length_m: f64,
    points.line_tolerance_m: f64,
    points.grazing_sine: f64,
    gradient.cell_m: f64,
    gradient.half_window_m: f64,
    gradient.cutoff_m: f64,
    gradient.occlusion_margin_m: f64,
    gradient.gap_rad: f64,
    gradient.reference_scans: usize,
    gradient.reference_every_m: f64,
    gradient.reference_every_rad: f64,
    gradient.max_iterations: u32,
    gradient.first_step_m: f64,
    gradient.step_growth: f64,
    gradient.step_shrink: f64,
    gradient.rest_m: f64,
    gradient.noise_m: f64,
    gradient.direction_noise_rad: f64,
    gradient.explained_m: f64,
    map.cell_m: f64,
    map.reach_m: f64,
    map.tiles: usize,
    map.surfaces: usize,
    map.memory_hits: f64,
    map.merge_across_m: f64,
    map.evidence_per_hit: i16,
    map.evidence_max: i16,
    map.carve_every_beams: usize,
    map.carve_margin_m: f64,
    map.learn_every_m: f64,
    map.learn_every_rad: f64,
    align.max_iterations: u32,
    align.capture_m: f64,
    align.outlier_m: f64,
    align.range_noise_m: f64,
    align.point_noise_m: f64,
    align.line_strength: f64,
    align.direction_noise_rad: f64,
    align.beams_per_independent_one: f64,
    align.rest_m: f64,
    align.rest_rad: f64,
    align.explained_m: f64,
    align.weak_m: f64,
    search.glance_rad: f64,
    search.below_score: f64,
    search.lost_below_score: f64,
    search.min_informative: f64,
    search.least_half_m: f64,
    search.least_half_rad: f64,
    search.step_m: f64,
    search.step_rad: f64,
    search.max_shifts: f64,
    search.max_turns: f64,
    search.beams: usize,
    search.blur_m: f64,
    search.free_space_cost: f64,
    search.patience_scans: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_of_every_stage_has_its_name_in_the_list() {
        let text = format!("{:?}", TrackerParams::default());
        let fields = text.matches(": ").count() - 1 - 6; // without the method and the six stages themselves
        assert_eq!(TrackerParams::NAMES.len(), fields, "{text}");
    }

    #[test]
    fn a_parameter_that_is_set_by_name_is_read_back_by_name_and_changes_the_struct() {
        for name in TrackerParams::NAMES {
            let mut params = TrackerParams::default();
            let before = params.get(name).unwrap();
            params.set(name, before * 2.0).unwrap();
            assert_eq!(params.get(name).unwrap(), before * 2.0, "{name}");
            assert_ne!(params, TrackerParams::default(), "{name}");
        }
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_name() {
        let error = TrackerParams::default().set("align.typo", 1.0).unwrap_err();
        assert_eq!(error.to_string(), "no parameter of the matcher is called \"align.typo\"");
    }
}
