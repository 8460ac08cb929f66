//! The recording again, with better poses: `/pose`, `/pose/vertical` and `/tf` are new, `/pose_incremental`
//! keeps the old `/pose`, and every other message is written as it stands. Of several recordings in one file
//! those that overlap in time follow each other (see [`one_by_one`]).

pub(crate) mod one_by_one;

use biplane_geometry::pose3::quaternion_of_heading_xyzw;
use std::collections::BTreeMap;
use std::path::PathBuf;

use biplane_matcher::Pose2;
use biplane_recording::messages::{AnyMessage, PoseWithCovarianceStamped, TfMessage, TransformStamped};
use biplane_recording::topics::{FRAME_BASE, FRAME_MAP, FRAME_ODOM};
use biplane_recording::{
    Entry, PartsWriter, ReadError, Rotation, Topic, WriteError, WriteReport, Writer, WriterOptions,
};
use nalgebra::{Isometry3, Quaternion, UnitQuaternion};

use crate::recordings::deskew::StampedPose;
use crate::recordings::deskew::{heading_rad, orientation_xyzw};
use crate::recordings::run::Run;
use crate::slam::corrected_poses::{ByStamps, Corrected};
use crate::slam::refinement::spatial::choice::Refined;

/// Why there is no optimized recording.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OutputError {
    /// An input cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The output cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// A recording that goes into the file.
#[derive(Clone, Copy)]
pub(crate) struct Member<'a> {
    /// As it was recorded.
    pub run: &'a Run,
    /// Its new poses, at the times of the recording.
    pub corrected: &'a Corrected,
    /// What is added to all its times in the file.
    pub delay_ns: i64,
}

/// Writes recordings with their optimized poses into one file, one after the other, each attachment and piece
/// of metadata as in the first. `reported` is added as metadata `optimize`.
///
/// # Errors
/// When reading or writing fails. Then nothing that was begun here is left behind.
pub(crate) fn write(
    path: &std::path::Path,
    members: &[Member<'_>],
    overwrite: bool,
    reported: &BTreeMap<String, String>,
) -> Result<WriteReport, OutputError> {
    let inputs: Vec<PathBuf> =
        members.iter().flat_map(|member| member.run.recording().paths()).map(Into::into).collect();
    let options = WriterOptions { overwrite, inputs, ..WriterOptions::default() };
    let writer = Writer::create(path, &options)?;
    let written = fill(writer, members, reported);
    if written.is_err() {
        PartsWriter::remove_begun(path, &options, Rotation::default());
    }
    written
}

fn fill(
    mut writer: Writer,
    members: &[Member<'_>],
    reported: &BTreeMap<String, String>,
) -> Result<WriteReport, OutputError> {
    for (number, member) in members.iter().enumerate() {
        let first = member.run.recording().first();
        if number == 0 {
            first.for_each_attachment(|attachment| {
                writer.copy_attachment(attachment).map_err(OutputError::from)
            })?;
            for (name, values) in first.metadata()? {
                writer.metadata(&name, &values)?;
            }
            writer.metadata("optimize", reported)?;
        }
        copy(&mut writer, member, number == 0)?;
    }
    Ok(writer.finish()?)
}

fn copy(writer: &mut Writer, member: &Member<'_>, latched: bool) -> Result<(), OutputError> {
    let &Member { run, corrected, delay_ns } = member;
    // One optimized before keeps the poses that it had at the very first.
    let optimized = is_optimized(run)?;
    let (mut of_poses, mut of_frames) = (corrected.by_stamps(), corrected.by_stamps());
    for entry in run.recording().messages() {
        let entry = entry?;
        let (topic, posed) = (entry.topic, entry.decode_posed()?);
        let entry = entry.later(delay_ns);
        match (topic, posed) {
            (Some(topic @ (Topic::Pose | Topic::PoseVertical)), Some(AnyMessage::Pose(mut pose))) => {
                let of_base = topic == Topic::Pose;
                if of_base && !optimized {
                    writer.write_encoded(
                        Topic::PoseIncremental,
                        entry.log_time_ns,
                        entry.publish_time_ns,
                        &entry.bytes,
                    )?;
                }
                let old = recorded(&pose);
                let new = if of_base { of_poses.next(&old) } else { corrected.at(&old) };
                set_pose(&mut pose, corrected, &new);
                pose.stamp_ns = pose.stamp_ns.saturating_add(delay_ns);
                writer.write(topic, entry.log_time_ns, entry.publish_time_ns, &pose)?;
            }
            (Some(Topic::Tf), Some(AnyMessage::Tf(mut frames))) => {
                correct(&mut frames, &mut of_frames);
                if let Some(refined) = &corrected.refined {
                    lift(&mut frames, refined);
                }
                for transform in &mut frames.transforms {
                    transform.stamp_ns = transform.stamp_ns.saturating_add(delay_ns);
                }
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

/// Whether a recording is the output of an optimization.
///
/// # Errors
/// When it is damaged.
pub(crate) fn is_optimized(run: &Run) -> Result<bool, ReadError> {
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
    StampedPose::planar(pose.stamp_ns, Pose2::new(x_m, y_m, heading_rad(pose.orientation_xyzw)))
}

/// The new pose, and its covariance where one is known.
fn set_pose(pose: &mut PoseWithCovarianceStamped, corrected: &Corrected, new: &Pose2) {
    set_covariance(pose, corrected);
    let Some(refined) = &corrected.refined else {
        (pose.position_m[0], pose.position_m[1]) = (new.x_m, new.y_m);
        pose.orientation_xyzw = quaternion_of_heading_xyzw(new.theta_rad);
        return;
    };
    let full = refined.knots.pose(pose.stamp_ns);
    pose.position_m = [full.x_m, full.y_m, full.z_m];
    pose.orientation_xyzw = orientation_xyzw(&full);
    if let Some(covariance) = refined.certainty.at(pose.stamp_ns) {
        pose.covariance = std::array::from_fn(|at| covariance[at / 6][at % 6]);
    }
}

/// The optimized pose's covariance of x, y and heading in place of the recorded one's; it stays where none is
/// known.
fn set_covariance(pose: &mut PoseWithCovarianceStamped, corrected: &Corrected) {
    const AXES: [usize; 3] = [0, 1, 5];
    let Some(planar) = corrected.covariance_at(pose.stamp_ns) else { return };
    for (i, row) in AXES.into_iter().enumerate() {
        for (j, column) in AXES.into_iter().enumerate() {
            pose.covariance[6 * row + column] = planar[(i, j)];
        }
    }
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
    let old = StampedPose::planar(stamp_ns, old);
    let new = of_frames.next(&old) * odom_from_base.inverse();
    let transform = &mut frames.transforms[map];
    (transform.translation_m[0], transform.translation_m[1]) = (new.x_m, new.y_m);
    transform.rotation_xyzw = quaternion_of_heading_xyzw(new.theta_rad);
}

/// `map` -> `odom` such that both frames give the refined pose of the base, with height and tilt.
fn lift(frames: &mut TfMessage, refined: &Refined) {
    let Some(map) = frames.transforms.iter().position(|found| found.frame_id == FRAME_MAP) else { return };
    let Some(odom) = frames.transforms.iter().find(|found| found.child_frame_id == FRAME_BASE) else {
        return;
    };
    let isometry = |at_m: [f64; 3], [x, y, z, w]: [f64; 4]| {
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        Isometry3::from_parts(at_m.into(), turn)
    };
    let pose = refined.knots.pose(frames.transforms[map].stamp_ns);
    let map_from_base = isometry([pose.x_m, pose.y_m, pose.z_m], orientation_xyzw(&pose));
    let odom_from_base = isometry(odom.translation_m, odom.rotation_xyzw);
    let map_from_odom = map_from_base * odom_from_base.inverse();
    let transform = &mut frames.transforms[map];
    transform.translation_m = map_from_odom.translation.vector.into();
    let turn = map_from_odom.rotation;
    transform.rotation_xyzw = [turn.i, turn.j, turn.k, turn.w];
}

fn planar(transform: &TransformStamped) -> Pose2 {
    let [x_m, y_m, _] = transform.translation_m;
    Pose2::new(x_m, y_m, heading_rad(transform.rotation_xyzw))
}

#[cfg(test)]
mod tests {
    use super::{Corrected, Member, OutputError, Run, write};
    use biplane_recording::{ReadError, Reader, Topic, Writer, WriterOptions};
    use std::collections::BTreeMap;
    use std::path::Path;

    /// Name, media type, times and bytes of each attachment.
    fn attachments(path: &Path) -> Vec<(String, String, [u64; 2], Vec<u8>)> {
        let mut all = Vec::new();
        let reader = Reader::open(path).unwrap();
        let visited: Result<(), ReadError> = reader.for_each_attachment(|found| {
            let times_ns = [found.log_time_ns, found.create_time_ns];
            all.push((found.name.to_owned(), found.media_type.to_owned(), times_ns, found.data.to_vec()));
            Ok(())
        });
        visited.unwrap();
        all
    }

    #[test]
    fn attachments_are_copied_as_they_are_whatever_their_names() {
        let folder = std::env::temp_dir().join(format!("biplane-output-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let [input, output] = ["run.mcap", "opt.mcap"].map(|name| folder.join(name));
        let mut writer = Writer::create(&input, &WriterOptions::default()).unwrap();
        writer.attach("rig.toml", "application/toml", b"[base]").unwrap();
        writer.attach("door.jpg", "image/jpeg", &[0xff, 0xd8]).unwrap();
        writer.attach("note", "text/plain", b"the first note").unwrap();
        writer.attach("note", "text/markdown", b"the second *note*").unwrap();
        writer.finish().unwrap();
        let run = Run::open(std::slice::from_ref(&input)).unwrap();
        write(
            &output,
            &[Member { run: &run, corrected: &Corrected::default(), delay_ns: 0 }],
            false,
            &BTreeMap::new(),
        )
        .unwrap();
        assert_eq!(attachments(&input).len(), 4);
        assert_eq!(attachments(&output), attachments(&input));
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_fails_on_a_bad_message_leaves_nothing_that_blocks_the_next_attempt() {
        let folder = std::env::temp_dir().join(format!("biplane-bad-tf-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let [input, output] = ["run.mcap", "opt.mcap"].map(|name| folder.join(name));
        let mut writer = Writer::create(&input, &WriterOptions::default()).unwrap();
        // A sequence of a transform whose texts are longer than the message.
        let bad = [&[0, 1, 0, 0, 1, 0, 0, 0], &[0xff; 24][..]].concat();
        writer.write_encoded(Topic::Tf, 5, 5, &bad).unwrap();
        writer.finish().unwrap();
        let run = Run::open(std::slice::from_ref(&input)).unwrap();
        let corrected = Corrected::default();
        let members = [Member { run: &run, corrected: &corrected, delay_ns: 0 }];
        for _ in 0..2 {
            let failed = write(&output, &members, false, &BTreeMap::new());
            assert!(matches!(failed, Err(OutputError::Read(_))), "{failed:?}");
            assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "only the input is there");
        }
        // What somebody else has begun is his.
        let begun = folder.join("opt.mcap.active");
        std::fs::write(&begun, "somebody's").unwrap();
        write(&output, &members, false, &BTreeMap::new()).unwrap_err();
        assert_eq!(std::fs::read(&begun).unwrap(), b"somebody's");
        std::fs::remove_dir_all(folder).unwrap();
    }
}
