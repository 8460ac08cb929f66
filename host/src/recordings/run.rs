//! A recording as modeling and mapping want it: its rig, the poses in it, its scans one by one.
//!
//! Frame `map`, meters, stamps in nanoseconds. Horizontal scans are streamed, so the memory does not grow
//! with a recording's ranges.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};

use biplane_recording::messages::{DiagnosticArray, LaserScan, Message, PoseWithCovarianceStamped};
use biplane_recording::rig::Laser;
use biplane_recording::{AnyMessage, ReadError, Recording, Rig, Topic};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::recordings::deskew::FARTHEST_M;
use crate::recordings::deskew::roll_pitch_yaw_rad;
use crate::recordings::deskew::{StampedPose, Trajectory};
use crate::recordings::scan_geometry::BeamGeometry;
use crate::recordings::scan_geometry::RangeScan;
use crate::recordings::scan_geometry::ScanGeometry;
use crate::recordings::self_report::{metres_per_tick, mountings};
use crate::recordings::step_back::longest_step_back_ns;
use crate::recordings::wild_poses::remove_wild;

/// A scan without a pose of its own takes the pose between its neighbors when these are at most this far
/// apart.
const LONGEST_GAP_NS: i64 = 1_000_000_000;
const NS_PER_S: f64 = 1e9;
/// Times from beam to beam that are nearer to each other are the same, in s.
const SAME_INCREMENT_S: f64 = 1e-7;

/// Why a recording does not serve.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It says nothing of the robot.
    #[error("{} has no attachment rig.toml: where the lasers sit on the robot is not known", path.display())]
    NoRig {
        /// The file.
        path: PathBuf,
    },
    /// No horizontal scan.
    #[error("{} holds no scan on /scan/horizontal{}", path.display(), hint(*.serial))]
    NoScans {
        /// The file.
        path: PathBuf,
        /// Whether it holds serial bytes.
        serial: bool,
    },
    /// No pose.
    #[error(
        "{} holds {scans} horizontal scans and no pose{}: `biplane-onboard replay` makes a posed recording of it",
        path.display(), but_wild(*.wild)
    )]
    NoPoses {
        /// The file.
        path: PathBuf,
        /// Horizontal scans in it.
        scans: usize,
        /// Poses that are nowhere.
        wild: usize,
    },
}

fn hint(serial: bool) -> &'static str {
    if serial {
        ": it is a capture of serial bytes, `biplane-onboard replay` makes a posed recording of it"
    } else {
        ""
    }
}

fn but_wild(wild: usize) -> String {
    match wild {
        0 => String::new(),
        _ => format!(" but {wild} that are no numbers or farther than {FARTHEST_M} m from the start"),
    }
}

/// An open recording.
#[derive(Debug)]
pub struct Run {
    recording: Recording,
}

/// The poses of a recording and the stamps that they belong to, in file order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunPoses {
    /// Stamps of the horizontal scans.
    pub scan_stamps_ns: Vec<i64>,
    /// Poses at horizontal scans.
    pub poses: Vec<StampedPose>,
    /// Poses at vertical scans.
    pub vertical_poses: Vec<StampedPose>,
    /// Vertical scans in the recording.
    pub vertical_scans: usize,
    /// The base's own odometry: poses of the base in `odom`.
    pub odometry: Vec<StampedPose>,
    /// Poses that were left out because they are no numbers, or so far off that no motion explains them: what
    /// spans them would only take memory.
    pub wild_poses: usize,
    /// How far the stamp of a pose lies before the latest one ahead of it in the file, at the farthest.
    pub step_back_ns: i64,
    /// What the robot said of lasers that do not sit as the rig says, in the end: the laser and what was
    /// noticed.
    pub mountings: Vec<String>,
    /// What a unit of the base's position was taken as, where it said so, meters.
    pub metres_per_tick: Option<f64>,
}

impl RunPoses {
    /// All poses in the order of time.
    pub fn trajectory(&self) -> Trajectory {
        let mut poses = self.poses.clone();
        poses.extend_from_slice(&self.vertical_poses);
        Trajectory::new(poses)
    }

    /// One pose a horizontal scan, with the scan's own stamp, in file order: the pose recorded with that
    /// stamp, else the one between its neighbors. `None` where nothing is near.
    pub fn at_scans(&self) -> Vec<Option<StampedPose>> {
        one_per_stamp(&self.scan_stamps_ns, &self.poses, &self.trajectory())
    }

    /// The odometry's pose at each horizontal scan, found as [`RunPoses::at_scans`] finds the matched ones.
    pub fn odometry_at_scans(&self) -> Vec<Option<StampedPose>> {
        one_per_stamp(&self.scan_stamps_ns, &self.odometry, &Trajectory::new(self.odometry.clone()))
    }
}

/// One pose a stamp: the one that has it, else the one between its neighbors.
fn one_per_stamp(
    stamps_ns: &[i64],
    poses: &[StampedPose],
    trajectory: &Trajectory,
) -> Vec<Option<StampedPose>> {
    let mut by_stamp: BTreeMap<i64, VecDeque<StampedPose>> = BTreeMap::new();
    for pose in poses {
        by_stamp.entry(pose.stamp_ns).or_default().push_back(*pose);
    }
    let of_stamp = |stamp_ns: &i64| match by_stamp.get_mut(stamp_ns) {
        // Several scans of one stamp have as many poses, in the same order; the last one serves the rest.
        Some(poses) if poses.len() > 1 => poses.pop_front(),
        Some(poses) => poses.front().copied(),
        None => trajectory.at(*stamp_ns, LONGEST_GAP_NS),
    };
    stamps_ns.iter().map(of_stamp).collect()
}

/// The scans of one laser.
#[derive(Clone, Debug, PartialEq)]
pub struct VerticalScans {
    /// The laser's geometry.
    pub geometry: ScanGeometry,
    /// The scans, in file order.
    pub range_scans: Vec<RangeScan>,
    /// Scans left out because their fan is another than the first one's.
    pub odd_scans: usize,
}

impl Run {
    /// Opens a finished recording: one file, or its parts (see [`Recording`]).
    ///
    /// # Errors
    /// When a file is missing, no MCAP file, or cut off, or when several are no parts of one recording.
    pub fn open(paths: &[PathBuf]) -> Result<Self, RunError> {
        Ok(Self { recording: Recording::open(paths)? })
    }

    /// The file's name; the first one's of several.
    pub fn path(&self) -> &Path {
        self.recording.path()
    }

    /// The files, in order.
    pub fn recording(&self) -> &Recording {
        &self.recording
    }

    /// The robot that it was recorded with.
    ///
    /// # Errors
    /// When the file does not tell.
    pub fn rig(&self) -> Result<Rig, RunError> {
        self.recording.rig()?.ok_or_else(|| RunError::NoRig { path: self.path().to_owned() })
    }

    /// Reads all poses.
    ///
    /// # Errors
    /// When the file is damaged, or holds no horizontal scan or no pose.
    pub fn poses(&self) -> Result<RunPoses, RunError> {
        let found = self.stamps_and_poses()?;
        if found.poses.is_empty() {
            return Err(RunError::NoPoses {
                path: self.path().to_owned(),
                scans: found.scan_stamps_ns.len(),
                wild: found.wild_poses,
            });
        }
        Ok(found)
    }

    /// Reads the stamps of all scans, and the poses if there are any.
    ///
    /// # Errors
    /// When the file is damaged or holds no horizontal scan.
    pub fn stamps_and_poses(&self) -> Result<RunPoses, RunError> {
        let mut found = RunPoses::default();
        let mut serial = false;
        for entry in self.recording.messages() {
            let entry = entry?;
            match entry.topic {
                Some(Topic::ScanVertical) => found.vertical_scans += 1,
                Some(Topic::Serial(..)) => serial = true,
                Some(Topic::Diagnostics) => {
                    if let Ok(message) = DiagnosticArray::decode(&entry.bytes) {
                        found.mountings = mountings(&message);
                        found.metres_per_tick = metres_per_tick(&message).or(found.metres_per_tick);
                    }
                }
                Some(Topic::ScanHorizontal | Topic::Pose | Topic::PoseVertical | Topic::Odom) => {
                    match entry.decode()? {
                        AnyMessage::Scan(scan) => found.scan_stamps_ns.push(scan.stamp_ns),
                        AnyMessage::Pose(pose) if entry.topic == Some(Topic::Pose) => {
                            found.poses.push(posed(&pose));
                        }
                        AnyMessage::Pose(pose) => found.vertical_poses.push(posed(&pose)),
                        AnyMessage::Odometry(odometry) => found.odometry.push(stamped(
                            odometry.stamp_ns,
                            odometry.position_m,
                            odometry.orientation_xyzw,
                        )),
                        _ => {}
                    }
                }
                _ => {}
            }
        }
        found.step_back_ns = longest_step_back_ns(&found.poses);
        for poses in [&mut found.poses, &mut found.vertical_poses, &mut found.odometry] {
            let before = poses.len();
            poses.retain(|pose| [pose.x_m, pose.y_m].iter().all(|v| v.abs() <= FARTHEST_M));
            found.wild_poses += before - poses.len() + remove_wild(poses);
        }
        if found.scan_stamps_ns.is_empty() {
            return Err(RunError::NoScans { path: self.path().to_owned(), serial });
        }
        Ok(found)
    }

    /// Visits the scans of a topic in file order.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn for_each_scan(&self, topic: Topic, mut visit: impl FnMut(LaserScan)) -> Result<(), RunError> {
        for entry in self.recording.messages() {
            let entry = entry?;
            if entry.topic == Some(topic)
                && let AnyMessage::Scan(scan) = entry.decode()?
            {
                visit(scan);
            }
        }
        Ok(())
    }

    /// Ranges that the vertical laser has measured; 0 when it is not known. Reads all of the recording.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn vertical_ranges(&self) -> Result<u64, RunError> {
        let mut ranges = 0;
        if self.rig()?.vertical.is_some() {
            self.for_each_scan(Topic::ScanVertical, |scan| ranges += scan.ranges_m.len() as u64)?;
        }
        Ok(ranges)
    }

    /// Whether there is a scan of the horizontal laser.
    pub(crate) fn has_horizontal_scans(&self) -> Result<bool, RunError> {
        let mut scans = 0_u64;
        self.for_each_scan(Topic::ScanHorizontal, |_| scans += 1)?;
        Ok(scans > 0)
    }

    /// Reads the scans of the vertical laser; `None` when there is none.
    ///
    /// # Errors
    /// When the file is damaged or says nothing of the robot.
    pub fn vertical_scans(&self) -> Result<Option<VerticalScans>, RunError> {
        let Some(laser) = self.rig()?.vertical else { return Ok(None) };
        self.scans_of(Topic::ScanVertical, &laser)
    }

    /// Reads the scans of the horizontal laser; `None` when there is none.
    ///
    /// # Errors
    /// When the file is damaged or says nothing of the robot.
    pub(crate) fn horizontal_scans(&self) -> Result<Option<VerticalScans>, RunError> {
        self.scans_of(Topic::ScanHorizontal, &self.rig()?.horizontal)
    }

    fn scans_of(&self, topic: Topic, laser: &Laser) -> Result<Option<VerticalScans>, RunError> {
        let mut scans: Option<VerticalScans> = None;
        self.for_each_scan(topic, |scan| {
            let all = scans.get_or_insert_with(|| VerticalScans {
                geometry: scan_geometry_of(&scan, laser),
                range_scans: Vec::new(),
                odd_scans: 0,
            });
            if scan.ranges_m.len() == all.geometry.beams.len() {
                all.range_scans.push(RangeScan { stamp_ns: scan.stamp_ns, ranges_m: scan.ranges_m });
            } else {
                all.odd_scans += 1;
            }
        })?;
        Ok(scans)
    }
}

/// The geometry of a scan's laser. The time of a beam is that of the rig's model; a recording that tells no
/// `time_increment` (an imported one) has all beams at the scan's stamp.
pub(crate) fn scan_geometry_of(scan: &LaserScan, laser: &Laser) -> ScanGeometry {
    let count = scan.ranges_m.len();
    let increment_s = f64::from(scan.time_increment_s);
    // Another laser with as many beams has its own time from beam to beam.
    let modeled =
        count == laser.beam_count() && (increment_s - laser.time_increment_s()).abs() < SAME_INCREMENT_S;
    let beam = |index: usize| BeamGeometry {
        angle_rad: f64::from(scan.angle_min_rad) + index as f64 * f64::from(scan.angle_increment_rad),
        delay_ns: match increment_s {
            none if none <= 0.0 || none.is_nan() => 0,
            _ if modeled => laser.beam_delay_ns(index),
            _ => (index as f64 * increment_s * NS_PER_S) as i64,
        },
    };
    let [x, y, z] = laser.mount.translation_m();
    let [qx, qy, qz, qw] = laser.mount.rotation_xyzw();
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(qw, qx, qy, qz));
    ScanGeometry {
        base_from_laser: Isometry3::from_parts(Translation3::new(x, y, z), rotation),
        beams: (0..count).map(beam).collect(),
    }
}

fn posed(pose: &PoseWithCovarianceStamped) -> StampedPose {
    stamped(pose.stamp_ns, pose.position_m, pose.orientation_xyzw)
}

fn stamped(stamp_ns: i64, [x_m, y_m, z_m]: [f64; 3], orientation_xyzw: [f64; 4]) -> StampedPose {
    let [roll_rad, pitch_rad, theta_rad] = roll_pitch_yaw_rad(orientation_xyzw);
    StampedPose { stamp_ns, x_m, y_m, theta_rad, z_m, roll_rad, pitch_rad }
}

#[cfg(test)]
mod tests {
    use biplane_recording::messages::LaserScan;
    use biplane_recording::rig::Laser;

    use super::{RunPoses, scan_geometry_of};
    use crate::recordings::deskew::StampedPose;

    fn pose(stamp_ns: i64, x_m: f64) -> StampedPose {
        StampedPose { stamp_ns, x_m, ..StampedPose::default() }
    }

    #[test]
    fn each_scan_has_its_own_pose_also_where_stamps_step_back_or_repeat() {
        let run = RunPoses {
            scan_stamps_ns: vec![30, 10, 10, 20, 25, 9_000_000_000],
            poses: vec![pose(30, 3.0), pose(10, 1.0), pose(10, 1.5), pose(20, 2.0)],
            ..RunPoses::default()
        };
        let found: Vec<Option<f64>> = run.at_scans().iter().map(|pose| pose.map(|pose| pose.x_m)).collect();
        assert_eq!(found, [Some(3.0), Some(1.0), Some(1.5), Some(2.0), Some(2.5), None]);
    }

    #[test]
    fn an_imported_scan_has_all_its_beams_at_once_and_a_recorded_one_has_the_rigs_times() {
        let laser = Laser { resolution_deg: 0.5, ..Laser::vertical() };
        let mut scan = LaserScan {
            angle_min_rad: -std::f32::consts::FRAC_PI_2,
            angle_increment_rad: 0.5_f32.to_radians(),
            ranges_m: vec![1.0; 361],
            ..LaserScan::default()
        };
        assert!(scan_geometry_of(&scan, &laser).beams.iter().all(|beam| beam.delay_ns == 0));
        scan.time_increment_s = 18.5e-6;
        let geometry = scan_geometry_of(&scan, &laser);
        assert_eq!([0, 1, 2].map(|index: usize| geometry.beams[index].delay_ns), [0, 13_338_500, 37_000]);
        assert!((geometry.beams[360].angle_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-4);
        // The template's vertical laser: its middle beam points up.
        let up = geometry.base_from_laser * nalgebra::Point3::new(1.0, 0.0, 0.0);
        assert!((up.z - 1.45).abs() < 1e-12 && (up.x - 0.05).abs() < 1e-12);
    }
}
