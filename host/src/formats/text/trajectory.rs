//! Trajectories as text: poses of `base_link` in `map`, one a line, in the TUM form or as `t x y theta`.
//!
//! Seconds, meters, radians. Which of both forms a file has is seen from its first pose; `t x y theta` is a
//! pose on the flat floor.

use crate::formats::text::short::short;
use crate::recordings::deskew::FARTHEST_M;
use crate::recordings::deskew::{orientation_xyzw, roll_pitch_yaw_rad};
use std::io::{self, BufRead, Write};

use crate::recordings::deskew::StampedPose;
use crate::recordings::stamp_text::format_seconds;
use crate::recordings::stamp_text::parse_seconds_ns;

/// How far a quaternion's length may be from one.
const QUATERNION_TOLERANCE: f64 = 0.01;

/// What is wrong in a trajectory file.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryError {
    /// Reading failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A line does not hold a pose.
    #[error("line {line}: expected {}, found \"{found}\"", format.description())]
    Line {
        /// Line number from 1.
        line: usize,
        /// The form that the first pose has.
        format: TrajectoryFormat,
        /// The line, shortened.
        found: String,
    },
    /// No line holds a pose.
    #[error("there is no pose in it")]
    Empty,
}

/// The text forms of a trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TrajectoryFormat {
    /// `t x y z qx qy qz qw`.
    #[default]
    Tum,
    /// `t x y theta`.
    XyTheta,
}

impl TrajectoryFormat {
    /// The form of a line with a pose: four fields are `t x y theta`.
    fn of(line: &str) -> Self {
        if line.split_whitespace().count() == 4 { Self::XyTheta } else { Self::Tum }
    }

    fn description(self) -> &'static str {
        match self {
            Self::Tum => "\"t x y z qx qy qz qw\" (seconds, meters up to 1e6, unit quaternion)",
            Self::XyTheta => "\"t x y theta\" (seconds, meters up to 1e6, radians)",
        }
    }
}

/// Reads a trajectory: a pose a line, `#` comments. The order of the file stays.
///
/// # Errors
/// When a line does not read as a pose of the same form as the first one, or there is none.
pub fn read_poses(input: impl BufRead) -> Result<Vec<StampedPose>, TrajectoryError> {
    let mut poses = Vec::new();
    let mut format = None;
    for (index, line) in input.lines().enumerate() {
        let line = line?;
        let text = line.trim();
        if text.is_empty() || text.starts_with('#') {
            continue;
        }
        let format = *format.get_or_insert_with(|| TrajectoryFormat::of(text));
        poses.push(parse_line(text, format).ok_or_else(|| TrajectoryError::Line {
            line: index + 1,
            format,
            found: short(text),
        })?);
    }
    if poses.is_empty() { Err(TrajectoryError::Empty) } else { Ok(poses) }
}

fn parse_line(text: &str, format: TrajectoryFormat) -> Option<StampedPose> {
    let mut fields = text.split_whitespace();
    let stamp_ns = parse_seconds_ns(fields.next()?)?;
    let values: Vec<f64> =
        fields.map(|field| field.parse().ok().filter(|v: &f64| v.is_finite())).collect::<Option<_>>()?;
    let ([x_m, y_m, z_m], [roll_rad, pitch_rad, theta_rad]) = match (format, &values[..]) {
        (TrajectoryFormat::XyTheta, &[x_m, y_m, theta_rad]) => ([x_m, y_m, 0.0], [0.0, 0.0, theta_rad]),
        (TrajectoryFormat::Tum, &[x_m, y_m, z_m, qx, qy, qz, qw]) => {
            let length = [qx, qy, qz, qw].iter().map(|v| v * v).sum::<f64>().sqrt();
            if (length - 1.0).abs() > QUATERNION_TOLERANCE {
                return None;
            }
            ([x_m, y_m, z_m], roll_pitch_yaw_rad([qx, qy, qz, qw]))
        }
        _ => return None,
    };
    // Farther off nothing is measured any more: a wild value would only swell the map.
    let near = [x_m, y_m, z_m].iter().all(|v| v.abs() <= FARTHEST_M);
    near.then_some(StampedPose { stamp_ns, x_m, y_m, theta_rad, z_m, roll_rad, pitch_rad })
}

/// Writes one pose a line: `t` in seconds with nine decimals, lengths in meters, angles in radians.
///
/// # Errors
/// When writing fails.
pub fn write_poses(out: &mut impl Write, poses: &[StampedPose], format: TrajectoryFormat) -> io::Result<()> {
    for pose in poses {
        let t = format_seconds(pose.stamp_ns);
        match format {
            TrajectoryFormat::Tum => {
                let [qx, qy, qz, qw] = orientation_xyzw(pose);
                writeln!(
                    out,
                    "{t} {:.6} {:.6} {:.6} {qx:.9} {qy:.9} {qz:.9} {qw:.9}",
                    pose.x_m, pose.y_m, pose.z_m
                )?;
            }
            TrajectoryFormat::XyTheta => {
                writeln!(out, "{t} {:.6} {:.6} {:.9}", pose.x_m, pose.y_m, pose.theta_rad)?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::TrajectoryFormat;
    use super::read_poses;
    use super::write_poses;
    use crate::recordings::deskew::StampedPose;
    use crate::recordings::deskew::heading_rad;

    #[test]
    fn both_text_forms_hold_the_stamp_to_the_nanosecond() {
        let stamp_ns = 976_052_857_337_530_001;
        let poses =
            [StampedPose { stamp_ns, x_m: 1.25, y_m: -3.5, theta_rad: FRAC_PI_2, ..StampedPose::default() }];
        let written = |format| {
            let mut out = Vec::new();
            write_poses(&mut out, &poses, format).unwrap();
            String::from_utf8(out).unwrap()
        };
        assert_eq!(
            written(TrajectoryFormat::Tum),
            "976052857.337530001 1.250000 -3.500000 0.000000 0.000000000 0.000000000 0.707106781 0.707106781\n"
        );
        assert_eq!(
            written(TrajectoryFormat::XyTheta),
            "976052857.337530001 1.250000 -3.500000 1.570796327\n"
        );
    }

    #[test]
    fn a_heading_is_the_turn_about_z_alone() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let table = [
            ([0.0, 0.0, 0.0, 1.0], 0.0),
            ([0.0, 0.0, half, half], FRAC_PI_2),
            ([0.0, 0.0, -half, half], -FRAC_PI_2),
            ([half, 0.0, 0.0, half], 0.0),
            ([0.0; 4], 0.0),
        ];
        for (orientation, heading) in table {
            assert!((heading_rad(orientation) - heading).abs() < 1e-12, "{orientation:?}");
        }
        assert!((heading_rad([0.0, 0.0, 1.0, 0.0]).abs() - PI).abs() < 1e-12);
    }

    #[test]
    fn a_tilted_pose_is_written_whole_and_reads_back() {
        let (roll_rad, pitch_rad, theta_rad) = (0.02, -0.1, 2.5);
        let pose = StampedPose { z_m: 1.05, roll_rad, pitch_rad, theta_rad, ..StampedPose::default() };
        let mut out = Vec::new();
        write_poses(&mut out, &[pose], TrajectoryFormat::Tum).unwrap();
        let read = read_poses(&out[..]).unwrap()[0];
        let off = [read.z_m - 1.05, read.roll_rad - roll_rad, read.pitch_rad - pitch_rad];
        assert!(off.iter().all(|off| off.abs() < 1e-8) && read.turn_rad(&pose).abs() < 1e-8, "{read:?}");
    }

    #[test]
    fn both_text_forms_read_back_and_a_broken_line_is_named() {
        let text = "# t x y z qx qy qz qw\n\n1.5 1 2 3 0 0 0 1\n0.5 0 0 0 0 0 0.7071068 0.7071068\n";
        let poses = read_poses(text.as_bytes()).unwrap();
        assert_eq!(
            poses[0],
            StampedPose { stamp_ns: 1_500_000_000, x_m: 1.0, y_m: 2.0, z_m: 3.0, ..StampedPose::default() }
        );
        assert_eq!(poses[1].stamp_ns, 500_000_000);
        assert!((poses[1].theta_rad - FRAC_PI_2).abs() < 1e-6);
        for broken in
            ["1 2 3", "1 0 0 0 0 0 0 0", "1 0 0 0 0 0 0 1 9", "a 0 0 0 0 0 0 1", "1 inf 0 0 0 0 0 1"]
        {
            let error = read_poses(format!("# x\n{broken}\n").as_bytes()).unwrap_err().to_string();
            assert!(error.starts_with("line 2: expected") && error.contains(broken), "{error}");
        }
        let mixed = read_poses(&b"1 2 3 0.5\n1 0 0 0 0 0 0 1\n"[..]).unwrap_err().to_string();
        assert!(mixed.starts_with("line 2: expected \"t x y theta\""), "{mixed}");
        assert_eq!(
            read_poses(&b"1.5 1 2 -0.5\n"[..]).unwrap(),
            [StampedPose {
                stamp_ns: 1_500_000_000,
                x_m: 1.0,
                y_m: 2.0,
                theta_rad: -0.5,
                ..StampedPose::default()
            }]
        );
        assert_eq!(read_poses(&b"# nothing\n"[..]).unwrap_err().to_string(), "there is no pose in it");
    }
}
