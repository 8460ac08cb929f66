//! The recording again, with better poses: `/pose`, `/pose/vertical` and `/tf` are new, `/pose_incremental` keeps the old `/pose`, and
//! every other message is written as it stands.

use std::collections::BTreeMap;
use std::path::PathBuf;

use biplane_matcher::Pose2;
use biplane_recording::msg::{AnyMessage, PoseWithCovarianceStamped, TfMessage, TransformStamped};
use biplane_recording::topics::{FRAME_BASE, FRAME_MAP, FRAME_ODOM};
use biplane_recording::{Entry, ReadError, Topic, WriteError, WriteReport, Writer, WriterOptions};

use super::corrected::{ByStamps, Corrected};
use crate::deskew::StampedPose;
use crate::run::Run;
use crate::trajectory::heading_rad;

/// Why there is no optimised recording.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// An input cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The output cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Writes recordings with their optimised poses into one file, one after the other, each attachment and piece of metadata as in the
/// first. `told` is added as metadata `optimize`.
///
/// # Errors
/// When reading or writing fails.
pub fn write(
    path: &std::path::Path,
    runs: &[(&Run, &Corrected)],
    overwrite: bool,
    told: &BTreeMap<String, String>,
) -> Result<WriteReport, OutputError> {
    let inputs: Vec<PathBuf> =
        runs.iter().flat_map(|(run, _)| run.recording().paths()).map(Into::into).collect();
    let options = WriterOptions { overwrite, inputs, ..WriterOptions::default() };
    let mut writer = Writer::create(path, &options)?;
    for (number, (run, corrected)) in runs.iter().enumerate() {
        let first = run.recording().first();
        if number == 0 {
            for name in first.attachment_names()? {
                let data = first.attachment(&name)?.unwrap_or_default();
                let media_type =
                    if name.ends_with(".json") { "application/json" } else { "application/toml" };
                writer.attach(&name, media_type, &data)?;
            }
            for (name, values) in first.metadata()? {
                writer.metadata(&name, &values)?;
            }
            writer.metadata("optimize", told)?;
        }
        copy(&mut writer, run, corrected, number == 0)?;
    }
    Ok(writer.finish()?)
}

fn copy(writer: &mut Writer, run: &Run, corrected: &Corrected, latched: bool) -> Result<(), OutputError> {
    // One optimised before keeps the poses that it had at the very first.
    let optimised = is_optimised(run)?;
    let (mut of_poses, mut of_frames) = (corrected.by_stamps(), corrected.by_stamps());
    for entry in run.recording().messages() {
        let entry = entry?;
        match (entry.topic, entry.decode_posed()?) {
            (Some(Topic::Pose), Some(AnyMessage::Pose(mut pose))) => {
                if !optimised {
                    writer.write_encoded(
                        Topic::PoseIncremental,
                        entry.log_time_ns,
                        entry.publish_time_ns,
                        &entry.bytes,
                    )?;
                }
                let new = of_poses.next(&recorded(&pose));
                put(writer, &entry, Topic::Pose, &mut pose, &new)?;
            }
            (Some(Topic::PoseVertical), Some(AnyMessage::Pose(mut pose))) => {
                let new = corrected.at(&recorded(&pose));
                put(writer, &entry, Topic::PoseVertical, &mut pose, &new)?;
            }
            (Some(Topic::Tf), Some(AnyMessage::Tf(mut frames))) => {
                correct(&mut frames, &mut of_frames);
                writer.write(Topic::Tf, entry.log_time_ns, entry.publish_time_ns, &frames)?;
            }
            (Some(topic), _) if topic.is_latched() && !latched => {}
            _ => writer.copy(&entry)?,
        }
    }
    Ok(())
}

/// The message of an entry that has a pose in it; others are not taken apart.
trait DecodePosed {
    fn decode_posed(&self) -> Result<Option<AnyMessage>, ReadError>;
}

impl DecodePosed for Entry {
    fn decode_posed(&self) -> Result<Option<AnyMessage>, ReadError> {
        match self.topic {
            Some(Topic::Pose | Topic::PoseVertical | Topic::Tf) => self.decode().map(Some),
            _ => Ok(None),
        }
    }
}

/// Whether a recording is the output of an optimisation.
///
/// # Errors
/// When it is damaged.
pub fn is_optimised(run: &Run) -> Result<bool, ReadError> {
    for entry in run.recording().messages() {
        match entry?.topic {
            Some(Topic::PoseIncremental) => return Ok(true),
            Some(Topic::Pose) => return Ok(false), // the old pose is written before the new one
            _ => {}
        }
    }
    Ok(false)
}

fn recorded(pose: &PoseWithCovarianceStamped) -> StampedPose {
    let [x_m, y_m, _] = pose.position_m;
    StampedPose { stamp_ns: pose.stamp_ns, x_m, y_m, theta_rad: heading_rad(pose.orientation_xyzw) }
}

fn put(
    writer: &mut Writer,
    entry: &Entry,
    topic: Topic,
    pose: &mut PoseWithCovarianceStamped,
    new: &Pose2,
) -> Result<(), WriteError> {
    (pose.position_m[0], pose.position_m[1]) = (new.x_m, new.y_m);
    pose.orientation_xyzw = orientation(new.theta_rad);
    writer.write(topic, entry.log_time_ns, entry.publish_time_ns, pose)
}

/// `map` -> `odom` such that both frames give the new pose of the base.
fn correct(frames: &mut TfMessage, of_frames: &mut ByStamps<'_>) {
    let place = |frames: &TfMessage, frame: &str, child: &str| {
        frames.transforms.iter().position(|found| found.frame_id == frame && found.child_frame_id == child)
    };
    let (Some(map), Some(odom)) =
        (place(frames, FRAME_MAP, FRAME_ODOM), place(frames, FRAME_ODOM, FRAME_BASE))
    else {
        return;
    };
    let odom_from_base = planar(&frames.transforms[odom]);
    let old = planar(&frames.transforms[map]) * odom_from_base;
    let stamp_ns = frames.transforms[map].stamp_ns;
    let old = StampedPose { stamp_ns, x_m: old.x_m, y_m: old.y_m, theta_rad: old.theta_rad };
    let new = of_frames.next(&old) * odom_from_base.inverse();
    let transform = &mut frames.transforms[map];
    (transform.translation_m[0], transform.translation_m[1]) = (new.x_m, new.y_m);
    transform.rotation_xyzw = orientation(new.theta_rad);
}

fn planar(transform: &TransformStamped) -> Pose2 {
    let [x_m, y_m, _] = transform.translation_m;
    Pose2::new(x_m, y_m, heading_rad(transform.rotation_xyzw))
}

fn orientation(theta_rad: f64) -> [f64; 4] {
    let (sin, cos) = (theta_rad / 2.0).sin_cos();
    [0.0, 0.0, sin, cos]
}
