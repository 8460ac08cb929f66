//! What is taken of a bag, and as what: found where only one choice makes sense, otherwise asked for.

mod base;
mod lasers;
mod listing;
mod placed;
mod preset;
mod timing;

use biplane_recording::rig::Mount;
use nalgebra::Isometry3;

use super::error::BagError;
use super::frames::bare;
use super::messages::scans::BeamTimes;
use super::options::{BagOptions, TopicChoice};
use super::survey::Survey;
use crate::recordings::mounts::mount_of;

/// Clocks of laser and odometry that are farther apart are not the same, ns.
const SAME_CLOCK_NS: i64 = 1_000_000_000;

/// A laser that is taken.
#[derive(Clone, Debug)]
pub(crate) struct LaserPlan {
    /// Its topic without a leading slash.
    pub topic: String,
    /// Its frame without a leading slash.
    pub frame: String,
    /// Where it sits.
    pub mount: Mount,
    /// What stands in for the beams' times where a scan tells none, or for what it tells.
    pub times: Option<BeamTimes>,
    /// Whether `times` goes before what a scan tells.
    pub is_override: bool,
    /// Added to its stamps, ns.
    pub delay_ns: i64,
    /// Whether stamps are those of the receipt.
    pub by_receipt: bool,
    /// Beams of its usual scan.
    pub beams: usize,
}

/// Where odometry comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum OdometrySource {
    None,
    /// A topic, without a leading slash.
    Topic(String),
    /// Transforms from a parent to a child.
    Transforms {
        parent: String,
        child: String,
    },
}

/// What is taken.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub horizontal: LaserPlan,
    pub vertical: Option<LaserPlan>,
    pub odometry: OdometrySource,
    /// Takes points of the base into the frame whose odometry there is.
    pub child_from_base: Isometry3<f64>,
    /// The inertial unit: topic without a leading slash, and where it sits if that is known.
    pub imu: Option<(String, Option<Mount>)>,
    /// What somebody should know: a sentence each.
    pub notes: Vec<String>,
}

/// Decides.
pub(crate) fn plan(survey: &Survey, options: &BagOptions) -> Result<Plan, BagError> {
    let mut notes = Vec::new();
    let (odometry, child) = base::odometry_source(survey, &options.odometry, &mut notes)?;
    let base_frame = base::frame(survey, options.base_frame.as_deref(), child.as_deref(), &mut notes)?;
    let placed = lasers::placed(survey, base_frame.as_deref(), options, &mut notes);
    let chosen = lasers::choose(&placed, options, &mut notes)?;
    // Of stamps that Biplane itself has made nothing is to be said.
    let [flag, vertical_flag] =
        ["--delay-ms", "--vertical-delay-ms"].map(|flag| (!survey.is_ours).then_some(flag));
    let stamps = options.stamps;
    let horizontal = timing::laser_plan(chosen.horizontal, &options.horizontal, stamps, flag, &mut notes);
    let vertical = chosen
        .vertical
        .map(|laser| timing::laser_plan(laser, &options.vertical, stamps, vertical_flag, &mut notes));
    let child_from_base = base::child_from_base(survey, child.as_deref(), base_frame.as_deref())?;
    if let OdometrySource::Topic(topic) = &odometry
        && !horizontal.by_receipt
    {
        same_clock(survey, topic, chosen.horizontal.seen.lag_ns())?;
    }
    let imu = imu(survey, &options.imu, base_frame.as_deref())?;
    Ok(Plan { horizontal, vertical, odometry, child_from_base, imu, notes })
}

fn same_clock(survey: &Survey, topic: &str, laser_lag_ns: i64) -> Result<(), BagError> {
    let Some(seen) = survey.odometry.get(topic) else { return Ok(()) };
    let apart_ns = seen.lag_ns().saturating_sub(laser_lag_ns);
    if apart_ns.saturating_abs() <= SAME_CLOCK_NS {
        return Ok(());
    }
    Err(BagError::Choice(format!(
        "the clocks of {} and of the laser are {:.3} s apart by their receipt: `--stamps receipt` takes the recorder's \
         clock for both, `--odom none` leaves the odometry out",
        seen.topic,
        apart_ns as f64 / 1e9
    )))
}

fn imu(
    survey: &Survey,
    choice: &TopicChoice,
    base_frame: Option<&str>,
) -> Result<Option<(String, Option<Mount>)>, BagError> {
    let topics = || listing::topics(survey.imus.values().map(|(topic, count)| (topic.as_str(), *count)));
    let key = match choice {
        TopicChoice::Without => return Ok(None),
        TopicChoice::Named(name) => match survey.imus.contains_key(bare(name)) {
            true => bare(name).to_owned(),
            false => {
                let text = format!("no sensor_msgs/Imu on {name}; on others: {}", topics());
                return Err(BagError::Choice(text));
            }
        },
        TopicChoice::Any => match survey.imus.len() {
            0 => return Ok(None),
            1 => survey.imus.keys().next().cloned().unwrap_or_default(),
            _ => {
                let text =
                    format!("several inertial units: {}; choose with --imu TOPIC or --imu none", topics());
                return Err(BagError::Choice(text));
            }
        },
    };
    let frame = survey.imu_frames.get(&key).map_or("", String::as_str);
    let mount = base_frame.and_then(|base| survey.frames.between(base, frame));
    Ok(Some((key, mount.map(|transform| mount_of(&transform)))))
}
