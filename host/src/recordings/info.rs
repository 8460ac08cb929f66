//! What a recording or capture holds: topics, counts, rates, gaps, drops, duration, rig.
//!
//! Times in nanoseconds. A topic's times are its messages' own stamps (`publish_time`), for serial bytes the
//! time of the read.

use biplane_geometry::quantile::upper_median;
use std::collections::BTreeMap;
use std::path::PathBuf;

use biplane_recording::messages::{ByteArray, DiagnosticArray, Message};
use biplane_recording::{Entry, ReadError, Recording, Rig, Topic};
use serde::Serialize;

/// An interval this many times the usual one is a gap.
const GAP_FACTOR: i64 = 3;

/// One topic of a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct TopicInfo {
    /// Its name.
    pub name: String,
    /// Its message type.
    #[serde(rename = "type")]
    pub type_name: String,
    /// How many messages.
    pub messages: u64,
    /// Their size in the file before compression, bytes.
    pub bytes: u64,
    /// For serial lines: how many bytes went over the line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub serial_bytes: Option<u64>,
    /// The earliest stamp.
    pub first_ns: i64,
    /// The latest stamp.
    pub last_ns: i64,
    /// Messages a second between first and last.
    pub rate_hz: f64,
    /// Intervals over three times the usual one.
    pub gaps: u64,
    /// The longest interval, seconds.
    pub longest_interval_s: f64,
    /// Messages whose stamp lies before that of the message before.
    pub backward_stamps: u64,
    /// Messages that the sequence numbers say are missing.
    pub missing: u64,
}

/// A word of a device's health.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Health {
    /// Whose.
    pub name: String,
    /// 0 good, 1 warning, 2 error, 3 stale.
    pub level: u8,
    /// In words.
    pub message: String,
    /// Its figures, as the last diagnostics give them.
    pub values: BTreeMap<String, String>,
}

/// The parts of a recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct PartsInfo {
    /// All parts of a recording in parts, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<String>,
    /// Numbers of parts that are not among these.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts_missing: Vec<u32>,
    /// Parts that were never finished, and are not read.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts_unfinished: Vec<String>,
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct FileInfo {
    /// Its name; the first part's of a recording in parts.
    pub file: String,
    /// Of a recording in parts.
    #[serde(flatten)]
    pub of_parts: PartsInfo,
    /// Its size, bytes.
    pub bytes: u64,
    /// The MCAP profile, `ros2` for what ROS 2 opens.
    pub profile: String,
    /// The program that wrote it.
    pub library: String,
    /// The first message's log time.
    pub start_ns: i64,
    /// The last message's log time.
    pub end_ns: i64,
    /// Between them, seconds.
    pub duration_s: f64,
    /// All messages.
    pub messages: u64,
    /// The topics by name.
    pub topics: Vec<TopicInfo>,
    /// The last word of `/diagnostics`.
    pub health: Vec<Health>,
    /// Names of the attachments.
    pub attachments: Vec<String>,
    /// Metadata by record.
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// The text of the rig, resolved.
    pub rig: Option<String>,
}

/// Counts of a topic while the file is read.
#[derive(Default)]
struct Tally {
    info: TopicInfo,
    previous_ns: Option<i64>,
    intervals_ns: Vec<i64>,
    next_sequence: u32,
}

impl Tally {
    fn add(&mut self, entry: &Entry) {
        let info = &mut self.info;
        let serial = matches!(entry.topic, Some(Topic::Serial(..)));
        let stamp_ns = if serial { entry.log_time_ns } else { entry.publish_time_ns };
        if info.messages == 0 {
            info.name.clone_from(&entry.topic_name);
            info.type_name.clone_from(&entry.type_name);
            (info.first_ns, info.last_ns) = (stamp_ns, stamp_ns);
            self.next_sequence = entry.sequence;
        }
        info.missing += u64::from(entry.sequence.saturating_sub(self.next_sequence));
        self.next_sequence = entry.sequence.saturating_add(1);
        info.messages += 1;
        info.bytes += entry.bytes.len() as u64;
        if serial && let Ok(message) = ByteArray::decode(&entry.bytes) {
            *info.serial_bytes.get_or_insert(0) += message.data.len() as u64;
        }
        info.first_ns = info.first_ns.min(stamp_ns);
        info.last_ns = info.last_ns.max(stamp_ns);
        if let Some(previous_ns) = self.previous_ns.replace(stamp_ns) {
            let interval_ns = stamp_ns.saturating_sub(previous_ns);
            info.backward_stamps += u64::from(interval_ns < 0);
            self.intervals_ns.push(interval_ns.max(0));
        }
    }

    fn finish(mut self) -> TopicInfo {
        let mut info = self.info;
        let span_ns = info.last_ns.saturating_sub(info.first_ns);
        if span_ns > 0 {
            info.rate_hz = (info.messages - 1) as f64 / seconds(span_ns);
        }
        self.intervals_ns.sort_unstable();
        if let (Some(usual_ns), Some(&longest_ns)) =
            (upper_median(&self.intervals_ns), self.intervals_ns.last())
        {
            let limit_ns = usual_ns.saturating_mul(GAP_FACTOR);
            let from = self.intervals_ns.partition_point(|&interval_ns| interval_ns <= limit_ns);
            info.gaps = (self.intervals_ns.len() - from) as u64;
            info.longest_interval_s = seconds(longest_ns);
        }
        info
    }
}

fn seconds(span_ns: i64) -> f64 {
    span_ns as f64 / 1e9
}

/// Reads a whole file, or all parts of a recording, and sums up what it holds.
///
/// # Errors
/// When the file is missing, no MCAP file, cut off or damaged.
pub(crate) fn read(paths: &[PathBuf]) -> Result<FileInfo, ReadError> {
    let recording = Recording::open(paths)?;
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    let mut times_ns: Option<[i64; 2]> = None;
    let mut health = Vec::new();
    for entry in recording.messages() {
        let entry = entry?;
        let [first_ns, last_ns] = times_ns.unwrap_or([entry.log_time_ns; 2]);
        times_ns = Some([first_ns.min(entry.log_time_ns), last_ns.max(entry.log_time_ns)]);
        if entry.topic == Some(Topic::Diagnostics)
            && let Ok(message) = DiagnosticArray::decode(&entry.bytes)
        {
            health = health_of(message);
        }
        if !tallies.contains_key(&entry.topic_name) {
            tallies.insert(entry.topic_name.clone(), Tally::default());
        }
        if let Some(tally) = tallies.get_mut(&entry.topic_name) {
            tally.add(&entry);
        }
    }
    let [start_ns, end_ns] = times_ns.unwrap_or_default();
    let topics: Vec<TopicInfo> = tallies.into_values().map(Tally::finish).collect();
    let reader = recording.first();
    let names: Vec<_> = recording.paths().map(|path| path.display().to_string()).collect();
    Ok(FileInfo {
        file: names[0].clone(),
        of_parts: PartsInfo {
            parts: if names.len() > 1 { names } else { Vec::new() },
            parts_missing: recording.missing(),
            parts_unfinished: recording.unfinished().iter().map(|part| part.display().to_string()).collect(),
        },
        bytes: recording.size(),
        profile: reader.profile().to_owned(),
        library: reader.library().to_owned(),
        start_ns,
        end_ns,
        duration_s: seconds(end_ns.saturating_sub(start_ns)),
        messages: topics.iter().map(|topic| topic.messages).sum(),
        topics,
        health,
        attachments: reader.attachment_names()?,
        metadata: reader.metadata()?,
        rig: reader.rig()?.as_ref().map(Rig::to_toml),
    })
}

fn health_of(message: DiagnosticArray) -> Vec<Health> {
    let status = |status: biplane_recording::messages::DiagnosticStatus| Health {
        name: status.name,
        level: status.level,
        message: status.message,
        values: status.values.into_iter().map(|value| (value.key, value.value)).collect(),
    };
    message.status.into_iter().map(status).collect()
}

#[cfg(test)]
mod tests {
    use biplane_recording::messages::LaserScan;
    use biplane_recording::{Direction, Port, Rig, Topic, Writer, WriterOptions};

    use super::read;

    #[test]
    fn counts_rates_gaps_and_bytes_are_those_that_were_written() {
        let path = std::env::temp_dir().join(format!("biplane-info-{}.mcap", std::process::id()));
        let options = WriterOptions { overwrite: true, ..WriterOptions::default() };
        let mut writer = Writer::create(&path, &options).unwrap();
        writer.attach("rig.toml", "application/toml", Rig::default().to_toml().as_bytes()).unwrap();
        // Ten scans a second for two seconds, one second of silence, one scan more, and one that steps back.
        let mut stamps_ns: Vec<i64> = (0..=20).map(|index| index * 100_000_000).collect();
        stamps_ns.extend([3_000_000_000, 2_990_000_000]);
        for stamp_ns in stamps_ns {
            let scan = LaserScan { stamp_ns, ranges_m: vec![1.0; 5], ..LaserScan::default() };
            writer.write(Topic::ScanHorizontal, stamp_ns, stamp_ns, &scan).unwrap();
        }
        writer.write_serial(Port::Base, Direction::Rx, 3_500_000_000, &[1, 2, 3]).unwrap();
        writer.write_serial(Port::Base, Direction::Rx, 4_000_000_000, &[4]).unwrap();
        writer.finish().unwrap();

        let info = read(std::slice::from_ref(&path)).unwrap();
        assert_eq!((info.messages, info.start_ns, info.end_ns, info.duration_s), (25, 0, 4_000_000_000, 4.0));
        let [scans, serial] = &info.topics[..] else { panic!("{:?}", info.topics) };
        assert_eq!(
            (scans.name.as_str(), scans.type_name.as_str()),
            ("/scan/horizontal", "sensor_msgs/msg/LaserScan")
        );
        assert_eq!((scans.messages, scans.gaps, scans.backward_stamps, scans.missing), (23, 1, 1, 0));
        assert_eq!((scans.longest_interval_s, scans.last_ns), (1.0, 3_000_000_000));
        assert!((scans.rate_hz - 22.0 / 3.0).abs() < 1e-12);
        assert_eq!((serial.messages, serial.serial_bytes), (2, Some(4)));
        assert_eq!(Rig::parse(info.rig.as_deref().unwrap()).unwrap(), Rig::default());
        std::fs::remove_file(path).unwrap();
    }
}
