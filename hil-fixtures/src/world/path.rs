//! Where a robot drives through a world: waypoints on a floor, and how it takes them.
//!
//! In the frame of the world's own file; meters, seconds, degrees. As a file (TOML), for `simulate --path`:
//! ```toml
//! waypoints_m = [[0.0, 0.0], [10.0, 0.0]]
//! floor_z_m = 0.0        # everything below has a default
//! follow_ground = true
//! speed_m_s = 0.4
//! without_objects = ["IfcDoor"]
//! ```

use serde::Deserialize;

/// A drive to be made.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Path {
    /// What the path is called.
    pub name: String,
    /// Corners of the way on the floor, x and y; the robot starts at the first, looking at the second.
    pub waypoints_m: Vec<[f64; 2]>,
    /// Height of the floor: where `base_link` moves.
    pub floor_z_m: f64,
    /// Whether the robot stands on the surfaces under its wheels: ramps and bumps lift and tilt it. It starts
    /// at `floor_z_m`, where the ground must be level. Otherwise it moves at that height, never tilted.
    pub follow_ground: bool,
    /// Cruising speed. Faster: fewer scans a meter, more distortion within a scan.
    pub speed_m_s: f64,
    /// Speeding up and slowing down. Smaller: softer starts, longer drives.
    pub acceleration_m_s2: f64,
    /// How far before and after a waypoint the curve reaches (less where legs are short). Larger: wider
    /// curves.
    pub corner_m: f64,
    /// Fastest turning; the robot slows down in curves to keep it. Smaller: slower curves.
    pub turn_deg_s: f64,
    /// Sideways swing about the way, as of a hand-driven robot. 0: drives like on rails.
    pub weave_m: f64,
    /// Length of one swing.
    pub weave_length_m: f64,
    /// Roll and pitch of the moving base, one standard deviation each, as on rough ground. 0 indoors.
    pub shake_deg: f64,
    /// Objects of the world's file that are not there during this drive, by the beginning of their names:
    /// doors that stand open.
    pub without_objects: Vec<String>,
}

impl Default for Path {
    fn default() -> Self {
        Self {
            name: "path".to_owned(),
            waypoints_m: Vec::new(),
            floor_z_m: 0.0,
            follow_ground: false,
            speed_m_s: 0.3,
            acceleration_m_s2: 0.3,
            corner_m: 1.0,
            turn_deg_s: 30.0,
            weave_m: 0.0,
            weave_length_m: 6.0,
            shake_deg: 0.0,
            without_objects: Vec::new(),
        }
    }
}

/// The sharpest turn at a waypoint, degrees.
pub(crate) const MAX_TURN_DEG: f64 = 150.0;

/// How far one turns at the middle one of three places, radians.
pub(crate) fn turn_rad(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
    (u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1])
}

/// Why a path cannot be driven.
#[derive(Debug, thiserror::Error)]
pub enum PathError {
    /// The file is no path.
    #[error("line {line}: {message}")]
    Syntax {
        /// Counted from 1.
        line: usize,
        /// What is wrong there.
        message: String,
    },
    /// Nothing to drive.
    #[error("a path needs at least two waypoints that differ; {found} found")]
    TooShort {
        /// Waypoints that differ from the one before.
        found: usize,
    },
    /// A turn on the spot, which this drive does not do.
    #[error(
        "the path turns by {turn_deg:.0} degrees at waypoint {waypoint} (from 0); at most {max_deg:.0} can be driven"
    )]
    TooSharp {
        /// Index of the waypoint.
        waypoint: usize,
        /// The turn there.
        turn_deg: f64,
        /// The sharpest turn that can be driven.
        max_deg: f64,
    },
    /// A way that nobody drives in one go.
    #[error("the path is {found_m:.0} m long; at most {max_m:.0} m can be driven")]
    TooLong {
        /// Length from waypoint to waypoint.
        found_m: f64,
        /// The longest way.
        max_m: f64,
    },
    /// Nothing to stand on.
    #[error("no ground within {reach_m} m under the robot at x = {x_m:.2} m, y = {y_m:.2} m of the map")]
    NoGround {
        /// Where, in `map`.
        x_m: f64,
        /// See `x_m`.
        y_m: f64,
        /// How far down was looked.
        reach_m: f64,
    },
    /// A drive that takes too long.
    #[error(
        "the drive would take {found_s:.0} s; at most {max_s:.0} s can be driven: drive faster (speed, acceleration, turning)"
    )]
    TooSlow {
        /// Time from start to end.
        found_s: f64,
        /// The longest drive.
        max_s: f64,
    },
    /// A number that makes no drive.
    #[error("{field} = {value}: expected {expected}")]
    BadNumber {
        /// Name of the field.
        field: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        expected: &'static str,
    },
}

impl PathError {
    /// In one line: the parser's own report draws the place over several.
    fn syntax(text: &str, error: &toml::de::Error) -> Self {
        let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
        let message = error.message().split_whitespace().collect::<Vec<_>>().join(" ");
        Self::Syntax { line: 1 + before.matches('\n').count(), message }
    }
}

impl Path {
    /// Reads a path file.
    pub fn parse(text: &str) -> Result<Self, PathError> {
        let path: Self = toml::from_str(text).map_err(|error| PathError::syntax(text, &error))?;
        path.check()?;
        Ok(path)
    }

    /// Whether every number can be driven.
    pub fn check(&self) -> Result<(), PathError> {
        let positive = [
            ("speed_m_s", self.speed_m_s),
            ("acceleration_m_s2", self.acceleration_m_s2),
            ("turn_deg_s", self.turn_deg_s),
            ("weave_length_m", self.weave_length_m),
        ];
        for (field, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(PathError::BadNumber { field, value, expected: "a number above 0" });
            }
        }
        let not_negative =
            [("corner_m", self.corner_m), ("weave_m", self.weave_m), ("shake_deg", self.shake_deg)];
        for (field, value) in not_negative {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(PathError::BadNumber { field, value, expected: "0 or more" });
            }
        }
        let coordinates = self.waypoints_m.iter().flatten().chain([&self.floor_z_m]);
        for value in coordinates {
            if value.abs() > 1e5 || value.is_nan() {
                return Err(PathError::BadNumber {
                    field: "waypoints_m",
                    value: *value,
                    expected: "meters within 100 km",
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::Path;

    #[test]
    fn a_path_file_may_leave_out_everything_but_waypoints() {
        let path = Path::parse("waypoints_m = [[0, 0], [2.5, 1]]\nspeed_m_s = 1").expect("a path");
        assert_eq!(path.waypoints_m, vec![[0.0, 0.0], [2.5, 1.0]]);
        assert_eq!((path.speed_m_s, path.floor_z_m), (1.0, 0.0));
    }

    #[test]
    fn a_file_that_is_no_path_is_told_in_one_line_with_the_place() {
        for (text, line) in [
            ("waypoints_m = [[0, 0], [1, 0]]\n\nspeed_m_s = \"fast\"\n", "line 3: "),
            ("waypoints_m = [[0, 0],\n", "line "),
            ("name = \"a\"\nspeed = 1\n", "line 2: "),
        ] {
            let message = Path::parse(text).expect_err("refused").to_string();
            assert!(message.starts_with(line) && !message.contains('\n'), "{message}");
        }
    }

    #[test]
    fn unknown_keys_and_impossible_numbers_are_refused_by_name() {
        for (text, word) in [
            ("waypoints = [[0, 0]]", "waypoints"),
            ("waypoints_m = [[0, 0], [1, 0]]\nspeed_m_s = 0", "speed_m_s"),
            ("waypoints_m = [[0, 0], [1, 0]]\nweave_m = -1", "weave_m"),
            ("waypoints_m = [[0, nan], [1, 0]]", "waypoints_m"),
        ] {
            let error = Path::parse(text).expect_err(text).to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
