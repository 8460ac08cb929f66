//! One line of a CARMEN log, as text in and values out.
//!
//! ```text
//! FLASER n r1..rn  x y theta  odom_x odom_y odom_theta  ipc_stamp host logger_stamp
//! RAWLASER1 type start fov resolution max_range accuracy remission_mode
//!     n r1..rn  m e1..em  ipc_stamp host logger_stamp
//! ROBOTLASER1 as RAWLASER1 up to e1..em, then
//!     laser_x laser_y laser_theta  robot_x robot_y robot_theta  tv rv forward side turn
//!     ipc_stamp host logger_stamp
//! ODOM x y theta  tv rv accel  ipc_stamp host logger_stamp
//! ```
//! Meters, radians, seconds. Source: the log format page of CARMEN's logger.

use crate::recordings::stamp_text::parse_seconds_ns;

/// What a line holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Line {
    /// A scan of the front laser.
    Laser(LaserLine),
    /// The base's own odometry.
    Odometry(OdometryLine),
    /// A line that carries no data: blank, comment, PARAM, SYNC.
    Nothing,
    /// A message of a kind that this import does not take, by its first word.
    Other(String),
}

/// The kinds of lines that carry a front laser's scans. A log that has several kinds holds each scan several
/// times.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum LaserKind {
    /// `FLASER`, with poses.
    Flaser,
    /// `ROBOTLASER1`, with poses and the fan's geometry.
    RobotLaser1,
    /// `RAWLASER1`, with the fan's geometry and without poses.
    RawLaser1,
}

impl LaserKind {
    /// The line's first word.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Flaser => "FLASER",
            Self::RobotLaser1 => "ROBOTLASER1",
            Self::RawLaser1 => "RAWLASER1",
        }
    }
}

/// The geometry of a fan, where the line itself tells it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LaserConfig {
    /// Direction of the first beam, radians, counter-clockwise from the middle beam.
    pub first_rad: f64,
    /// From one beam to the next, radians.
    pub increment_rad: f64,
    /// A range from here on is no range, meters.
    pub max_range_m: f32,
}

/// A scan as its line holds it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LaserLine {
    /// Which kind of line it was.
    pub kind: LaserKind,
    /// Ranges, meters, first beam first.
    pub ranges_m: Vec<f32>,
    /// Remission values; as many as the line has, often none.
    pub remissions: Vec<f32>,
    /// Geometry of the fan; `None` for `FLASER`, which does not tell.
    pub laser_config: Option<LaserConfig>,
    /// Odometry pose of the robot `x, y, theta`, meters and radians.
    pub odometry: Option<[f64; 3]>,
    /// The line's own stamp (ipc_stamp).
    pub stamp_ns: i64,
}

/// An `ODOM` line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OdometryLine {
    /// Pose `x, y, theta`, meters and radians.
    pub pose: [f64; 3],
    /// Forward speed, m/s.
    pub forward_m_s: f64,
    /// Turn rate, rad/s.
    pub turn_rad_s: f64,
    /// The line's own stamp (ipc_stamp).
    pub stamp_ns: i64,
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum LineError {
    /// The line ends too early.
    #[error("the line ends where {expected} should stand")]
    Ends {
        /// What should have come.
        expected: &'static str,
    },
    /// A field does not read as what it should be.
    #[error("expected {expected}, found \"{found}\"")]
    Field {
        /// What should stand there.
        expected: &'static str,
        /// What stands there, shortened.
        found: String,
    },
    /// More fields than the line's own counts say.
    #[error(
        "the line goes on after its logger stamp with \"{found}\": its number of values is not the one it names"
    )]
    TooLong {
        /// The first field too many, shortened.
        found: String,
    },
    /// A scan of no beams.
    #[error("the scan has no beams")]
    NoBeams,
}

/// The fields of a line, taken one by one.
struct Fields<'a>(std::str::SplitWhitespace<'a>);

impl<'a> Fields<'a> {
    fn text(&mut self, expected: &'static str) -> Result<&'a str, LineError> {
        self.0.next().ok_or(LineError::Ends { expected })
    }

    fn parsed<T>(
        &mut self,
        expected: &'static str,
        parse: impl FnOnce(&str) -> Option<T>,
    ) -> Result<T, LineError> {
        let text = self.text(expected)?;
        parse(text).ok_or_else(|| LineError::Field { expected, found: shortened(text) })
    }

    /// A finite number.
    fn number(&mut self, expected: &'static str) -> Result<f64, LineError> {
        self.parsed(expected, |text| text.parse().ok().filter(|value: &f64| value.is_finite()))
    }

    fn numbers<const N: usize>(&mut self, expected: &'static str) -> Result<[f64; N], LineError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.number(expected)?;
        }
        Ok(values)
    }

    /// A count and then as many values. The count alone allocates nothing.
    fn counted(&mut self, count: &'static str, each: &'static str) -> Result<Vec<f32>, LineError> {
        let count: usize = self.parsed(count, |text| text.parse().ok())?;
        let mut values = Vec::new();
        for _ in 0..count {
            values.push(self.parsed(each, |text| text.parse().ok())?);
        }
        Ok(values)
    }

    /// The tail that all kinds share: stamp, host and logger stamp; the last two may be missing.
    fn stamp_ns(mut self) -> Result<i64, LineError> {
        let stamp_ns = self.parsed("the time stamp", |text| parse_seconds_ns(text).filter(|ns| *ns >= 0))?;
        match self.0.nth(2) {
            Some(found) => Err(LineError::TooLong { found: shortened(found) }),
            None => Ok(stamp_ns),
        }
    }
}

fn shortened(text: &str) -> String {
    const LONGEST: usize = 24;
    if text.chars().count() <= LONGEST {
        return text.to_owned();
    }
    text.chars().take(LONGEST).chain("...".chars()).collect()
}

/// Reads one line.
///
/// # Errors
/// When a line of a kind that is taken does not hold what it should.
pub(super) fn parse_line(text: &str) -> Result<Line, LineError> {
    let mut fields = Fields(text.split_whitespace());
    let Some(kind) = fields.0.next() else { return Ok(Line::Nothing) };
    match kind {
        "FLASER" => flaser(fields),
        "RAWLASER1" => with_geometry(LaserKind::RawLaser1, fields),
        "ROBOTLASER1" => with_geometry(LaserKind::RobotLaser1, fields),
        "ODOM" => odometry(fields),
        "PARAM" | "SYNC" => Ok(Line::Nothing),
        _ if kind.starts_with('#') => Ok(Line::Nothing),
        _ => Ok(Line::Other(shortened(kind))),
    }
}

fn flaser(mut fields: Fields<'_>) -> Result<Line, LineError> {
    let ranges_m = fields.counted("the number of ranges", "a range")?;
    let _laser: [f64; 3] = fields.numbers("the laser's pose")?;
    let odometry = Some(fields.numbers("the odometry's pose")?);
    let stamp_ns = fields.stamp_ns()?;
    laser(LaserLine {
        kind: LaserKind::Flaser,
        ranges_m,
        remissions: Vec::new(),
        laser_config: None,
        odometry,
        stamp_ns,
    })
}

fn with_geometry(kind: LaserKind, mut fields: Fields<'_>) -> Result<Line, LineError> {
    fields.text("the laser's type")?;
    let [first_rad, _fov_rad, increment_rad, max_range_m] = fields.numbers("the fan's geometry")?;
    let _accuracy_and_mode: [f64; 2] = fields.numbers("the laser's accuracy and remission mode")?;
    let ranges_m = fields.counted("the number of ranges", "a range")?;
    let remissions = fields.counted("the number of remissions", "a remission")?;
    let odometry = match kind {
        LaserKind::RobotLaser1 => {
            let _laser: [f64; 3] = fields.numbers("the laser's pose")?;
            let robot = fields.numbers("the robot's pose")?;
            let _speeds_and_distances: [f64; 5] = fields.numbers("the robot's speeds and distances")?;
            Some(robot)
        }
        LaserKind::Flaser | LaserKind::RawLaser1 => None,
    };
    let stamp_ns = fields.stamp_ns()?;
    // A file that leaves the geometry out writes zeros; the number of beams then tells it, as for FLASER.
    let max_range_m = max_range_m as f32;
    let laser_config = (increment_rad > 0.0).then_some(LaserConfig { first_rad, increment_rad, max_range_m });
    laser(LaserLine { kind, ranges_m, remissions, laser_config, odometry, stamp_ns })
}

fn laser(line: LaserLine) -> Result<Line, LineError> {
    if line.ranges_m.is_empty() { Err(LineError::NoBeams) } else { Ok(Line::Laser(line)) }
}

fn odometry(mut fields: Fields<'_>) -> Result<Line, LineError> {
    let pose = fields.numbers("the odometry's pose")?;
    let [forward_m_s, turn_rad_s, _acceleration] = fields.numbers("the odometry's speeds")?;
    let stamp_ns = fields.stamp_ns()?;
    Ok(Line::Odometry(OdometryLine { pose, forward_m_s, turn_rad_s, stamp_ns }))
}

#[cfg(test)]
mod tests {
    use super::{LaserConfig, LaserKind, LaserLine, Line, LineError, OdometryLine, parse_line};

    fn flaser(ranges_m: &[f32], odometry: [f64; 3], stamp_ns: i64) -> Line {
        Line::Laser(LaserLine {
            kind: LaserKind::Flaser,
            ranges_m: ranges_m.to_vec(),
            remissions: Vec::new(),
            laser_config: None,
            odometry: Some(odometry),
            stamp_ns,
        })
    }

    #[test]
    fn each_kind_of_line_reads_as_what_its_format_says() {
        let laser_config = LaserConfig { first_rad: -1.5, increment_rad: 0.5, max_range_m: 81.9 };
        let raw = LaserLine {
            kind: LaserKind::RawLaser1,
            ranges_m: vec![1.5, 2.5],
            remissions: vec![7.0],
            laser_config: Some(laser_config),
            odometry: None,
            stamp_ns: 12_345_678_000,
        };
        let robot = LaserLine {
            kind: LaserKind::RobotLaser1,
            remissions: Vec::new(),
            odometry: Some([4.0, 5.0, 6.0]),
            ..raw.clone()
        };
        let odometry = OdometryLine {
            pose: [1.0, 2.0, 3.0],
            forward_m_s: 0.5,
            turn_rad_s: -0.25,
            stamp_ns: 9_000_000_001,
        };
        let table = [
            (
                "FLASER 3 1.07 81.83 0.5 1 2 3 4 5 6 976052857.337530 nohost 0.1",
                flaser(&[1.07, 81.83, 0.5], [4.0, 5.0, 6.0], 976_052_857_337_530_000),
            ),
            ("  FLASER 1 1  0 0 0  0 0 0  2.5\r\n", flaser(&[1.0], [0.0; 3], 2_500_000_000)),
            ("RAWLASER1 0 -1.5 3.0 0.5 81.9 0.01 0 2 1.5 2.5 1 7 12.345678 h 1", Line::Laser(raw)),
            (
                "ROBOTLASER1 0 -1.5 3.0 0.5 81.9 0.01 0 2 1.5 2.5 0 1 2 3 4 5 6 .1 .2 .3 .4 .5 12.345678 h 1",
                Line::Laser(robot),
            ),
            ("ODOM 1 2 3 0.5 -0.25 0 9.000000001 b21 1.0", Line::Odometry(odometry)),
            ("", Line::Nothing),
            ("# FLASER num_readings", Line::Nothing),
            ("PARAM robot_length 0.3 nohost 0", Line::Nothing),
            ("SYNC Carmen::Playback 0 nohost 0", Line::Nothing),
            ("RLASER 1 1 0 0 0 0 0 0 2.5", Line::Other("RLASER".to_owned())),
        ];
        for (text, expected) in table {
            assert_eq!(parse_line(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn a_broken_line_says_what_is_wrong_with_it() {
        let table = [
            ("FLASER", "the line ends where the number of ranges should stand"),
            ("FLASER x", "expected the number of ranges, found \"x\""),
            ("FLASER -1 2", "expected the number of ranges, found \"-1\""),
            ("FLASER 0 0 0 0 0 0 0 1.5", "the scan has no beams"),
            ("FLASER 3 1.0 2.0", "the line ends where a range should stand"),
            ("FLASER 999999999999 1.0 2.0", "the line ends where a range should stand"),
            ("FLASER 2 1.0 2.0 0 0 0 0 0 0", "the line ends where the time stamp should stand"),
            ("FLASER 2 1.0 2.a 0 0 0 0 0 0 1", "expected a range, found \"2.a\""),
            ("FLASER 2 1.0 2.0 0 0 0 0 nan 0 1", "expected the odometry's pose, found \"nan\""),
            ("FLASER 2 1.0 0 0 0 0 0 0 1.5 nohost 2.5", "expected the time stamp, found \"nohost\""),
            ("FLASER 2 1.0 2.0 0 0 0 0 0 0 -1.5", "expected the time stamp, found \"-1.5\""),
            (
                "FLASER 2 1 2 3 0 0 0 0 0 0 1.5 nohost 2.5",
                "the line goes on after its logger stamp with \"2.5\": its number of values is not the one it names",
            ),
            ("ODOM 1 2", "the line ends where the odometry's pose should stand"),
            ("RAWLASER1 0 a", "expected the fan's geometry, found \"a\""),
            (
                "FLASER 1 1.0123456789012345678901234567890x",
                "expected a range, found \"1.0123456789012345678901...\"",
            ),
        ];
        for (text, expected) in table {
            let error: LineError = parse_line(text).unwrap_err();
            assert_eq!(error.to_string(), expected, "{text}");
        }
    }

    #[test]
    fn no_cut_of_a_line_is_taken_for_a_shorter_scan() {
        let line = "FLASER 3 1.07 1.08 1.09 1 2 3 4 5 6 976052857.5";
        let fields: Vec<&str> = line.split(' ').collect();
        for kept in 1..fields.len() {
            assert!(parse_line(&fields[..kept].join(" ")).is_err(), "{kept} fields");
        }
    }
}
