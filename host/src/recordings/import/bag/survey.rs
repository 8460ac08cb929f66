//! The first reading of bags: which lasers, odometry and frames they hold, and what they do not say.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use biplane_recording::messages::{LaserScan, Odometry};

use super::container::{BagFile, Kind, Losses, RawMessage};
use super::error::BagError;
use super::frames::{Frames, bare};
use super::messages::BagMessage;
use super::messages::scans::{is_usable, stated_increment_s};
use super::options::Echo;

/// A break in a laser's scans is one that takes so many of their periods.
const GAP_PERIODS: i64 = 3;

/// A laser: scans of one frame on one topic.
#[derive(Clone, Debug, Default)]
pub(crate) struct LaserSeen {
    /// Its topic as the bag writes it.
    pub topic: String,
    /// Its frame without a leading slash.
    pub frame: String,
    /// Scans that can be used.
    pub scans: usize,
    /// Scans without beams.
    pub empty: usize,
    /// Scans whose directions are no numbers.
    pub odd: usize,
    /// The first scan that can be used, without its ranges.
    pub first: Option<LaserScan>,
    /// Number of beams, and how many scans have it.
    pub beams: BTreeMap<usize, usize>,
    /// Scans that tell no time from beam to beam.
    pub untimed: usize,
    /// Beams with several echoes, of a device that tells.
    pub several_echoes: Option<usize>,
    /// Stamps of the scans, ns.
    stamps_ns: Vec<i64>,
    /// From stamp to receipt, ns.
    lags_ns: Vec<i64>,
}

impl LaserSeen {
    fn take(&mut self, scan: LaserScan, several_echoes: Option<usize>, received_ns: i64) {
        if scan.ranges_m.is_empty() {
            self.empty += 1;
            return;
        }
        if !is_usable(&scan) {
            self.odd += 1;
            return;
        }
        self.scans += 1;
        *self.beams.entry(scan.ranges_m.len()).or_default() += 1;
        self.untimed += usize::from(stated_increment_s(&scan).is_none());
        self.stamps_ns.push(scan.stamp_ns);
        self.lags_ns.push(received_ns.saturating_sub(scan.stamp_ns));
        if let Some(several) = several_echoes {
            *self.several_echoes.get_or_insert(0) += several;
        }
        if self.first.is_none() {
            self.first = Some(LaserScan { ranges_m: Vec::new(), intensities: Vec::new(), ..scan });
        }
    }

    /// Beams of a scan of the usual kind.
    pub(crate) fn usual_beams(&self) -> usize {
        self.beams.iter().max_by_key(|(_, scans)| **scans).map_or(0, |(beams, _)| *beams)
    }

    /// Whether no scan has a stamp.
    pub(crate) fn is_unstamped(&self) -> bool {
        self.stamps_ns.iter().all(|stamp| *stamp == 0)
    }

    /// The middle of what lies between stamp and receipt, ns.
    pub(crate) fn lag_ns(&self) -> i64 {
        median(self.lags_ns.clone()).unwrap_or_default()
    }

    /// From a scan to the next as a rule, and the gaps: how many, and the longest; ns.
    pub(crate) fn periods(&self, receipt: bool) -> Option<(i64, usize, i64)> {
        let mut stamps = self.stamps_ns.clone();
        if receipt {
            stamps.iter_mut().zip(&self.lags_ns).for_each(|(stamp, lag)| *stamp = stamp.saturating_add(*lag));
        }
        stamps.sort_unstable();
        stamps.dedup();
        let steps: Vec<i64> = stamps.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
        let period = median(steps.clone())?;
        let gaps = steps.iter().filter(|step| **step > period.saturating_mul(GAP_PERIODS));
        Some((period, gaps.clone().count(), gaps.copied().max().unwrap_or_default()))
    }
}

fn median(mut values: Vec<i64>) -> Option<i64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable(middle).1)
}

/// Odometry on a topic of its own.
#[derive(Clone, Debug, Default)]
pub(crate) struct OdometrySeen {
    /// Its topic as the bag writes it.
    pub topic: String,
    /// Messages.
    pub count: usize,
    /// The frame whose motion it is.
    pub child: String,
    lags_ns: Vec<i64>,
}

impl OdometrySeen {
    fn take(&mut self, message: &Odometry, received_ns: i64) {
        self.count += 1;
        self.lags_ns.push(received_ns.saturating_sub(message.stamp_ns));
        if self.child.is_empty() {
            self.child = bare(&message.child_frame_id).to_owned();
        }
    }

    /// The middle of what lies between stamp and receipt, ns.
    pub(crate) fn lag_ns(&self) -> i64 {
        median(self.lags_ns.clone()).unwrap_or_default()
    }
}

/// Messages of a topic that are not taken.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct OtherSeen {
    pub type_name: String,
    pub count: usize,
    /// Why they are not, where they would be.
    pub refused: Option<String>,
}

/// What bags hold.
#[derive(Clone, Debug, Default)]
pub(crate) struct Survey {
    /// Whether Biplane itself wrote one of them.
    pub is_ours: bool,
    /// Lasers by topic without a leading slash, then frame.
    pub lasers: BTreeMap<(String, String), LaserSeen>,
    /// Odometry by topic without a leading slash.
    pub odometry: BTreeMap<String, OdometrySeen>,
    /// Inertial units by topic without a leading slash: topic as written, and messages.
    pub imus: BTreeMap<String, (String, usize)>,
    /// Their frames.
    pub imu_frames: BTreeMap<String, String>,
    /// Frames.
    pub frames: Frames,
    /// What is not taken, by topic.
    pub others: BTreeMap<String, OtherSeen>,
}

/// Reads a bag's files; the times of its first and last messages by receipt, ns.
pub(crate) fn survey(
    files: &[BagFile],
    spool: &Path,
    losses: &mut Losses,
    into: &mut Survey,
) -> Result<Option<[i64; 2]>, BagError> {
    let mut span: Option<[i64; 2]> = None;
    for file in files {
        let mut undecoded = Losses::default();
        file.read(spool, losses, &mut |raw| {
            let [first, last] = span.unwrap_or([raw.received_ns; 2]);
            span = Some([first.min(raw.received_ns), last.max(raw.received_ns)]);
            if let Err(what) = into.take(raw) {
                undecoded.add(file.path(), &what);
            }
            ControlFlow::Continue(())
        })?;
        losses.merge(undecoded);
    }
    Ok(span)
}

impl Survey {
    fn take(&mut self, raw: &RawMessage<'_>) -> Result<(), String> {
        let topic = &raw.channel.topic;
        if raw.channel.kind == Kind::Other {
            let other = self.others.entry(topic.clone()).or_default();
            other.count += 1;
            if other.count == 1 {
                other.type_name.clone_from(&raw.channel.type_name);
                other.refused.clone_from(&raw.channel.refused);
            }
            return Ok(());
        }
        let message = BagMessage::decode(raw, Echo::First)
            .map_err(|error| format!("a {} on {topic}: {error}", raw.channel.type_name))?;
        let key = bare(topic).to_owned();
        match message {
            BagMessage::Scan { scan, several_echoes } => {
                let frame = bare(&scan.frame_id).to_owned();
                let laser = self.lasers.entry((key, frame.clone())).or_default();
                laser.topic.clone_from(topic);
                laser.frame = frame;
                laser.take(scan, several_echoes, raw.received_ns);
            }
            BagMessage::Odometry(odometry) => {
                let seen = self.odometry.entry(key).or_default();
                seen.topic.clone_from(topic);
                seen.take(&odometry, raw.received_ns);
            }
            BagMessage::Tf(tf) => {
                let is_static = key.rsplit('/').next() == Some("tf_static");
                tf.transforms.iter().for_each(|transform| self.frames.take(transform, is_static));
            }
            BagMessage::Imu(imu) => {
                self.imu_frames.entry(key.clone()).or_insert_with(|| bare(&imu.frame_id).to_owned());
                self.imus.entry(key).or_insert_with(|| (topic.clone(), 0)).1 += 1;
            }
            BagMessage::Other => {}
        }
        Ok(())
    }
}
