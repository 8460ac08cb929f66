//! A recording on a simulated disk, written as the recorder's writing thread does it, and the truth of what
//! was in it.

use std::path::Path;

use biplane_mock::rng::Rng;
use biplane_recording::messages::{LaserScan, Message, Odometry, TfMessage, TransformStamped};
use biplane_recording::{Direction, PartsWriter, Port, Rig, Rotation, Topic, WriteError, WriterOptions};

use super::disk::{SimDisk, below};
use crate::rig::{MS, S};

/// When rides begin.
pub(super) const START_NS: i64 = 1_700_000_000 * S;

/// A message as it went into the queue.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Sent {
    pub log_ns: i64,
    pub topic: Topic,
    /// Its number on its topic.
    pub number: u32,
    pub cdr: Vec<u8>,
}

/// What happens in a ride.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub seconds: i64,
    pub rotation: Rotation,
    /// Times between which nothing comes, not even diagnostics.
    pub silence_ns: Option<(i64, i64)>,
}

impl Plan {
    /// One of the seed's: 5 to 9 seconds, in parts or not, every third with a silence.
    pub(super) fn of(seed: u64) -> Self {
        let mut rng = Rng::new(seed, 0x91DE, 0);
        let rotation = match seed % 3 {
            0 => Rotation::default(),
            1 => Rotation { span_ns: Some(S + (rng.unit() * 2e9) as i64), bytes: None },
            _ => Rotation { span_ns: None, bytes: Some(30_000 + rng.bits() % 100_000) },
        };
        let silence_from = START_NS + (rng.between(0.5, 4.0) * 1e9) as i64;
        let silence_ns = (seed % 4 == 1).then(|| (silence_from, silence_from + 3 * S));
        Self { seconds: 5 + below(&mut rng, 5) as i64, rotation, silence_ns }
    }
}

/// All messages of a ride, in order.
pub(super) fn messages(plan: &Plan, seed: u64) -> Vec<Sent> {
    let mut rng = Rng::new(seed, 0x5E27, 0);
    let mut sent = vec![(START_NS, Topic::TfStatic, encoded(&transforms()))];
    for step in 0..plan.seconds * 75 / 2 {
        let log_ns = START_NS + step * 26_640_000 + (rng.unit() * 5e6) as i64;
        if plan.silence_ns.is_some_and(|(from, to)| (from..to).contains(&log_ns)) {
            continue;
        }
        sent.push((log_ns, Topic::ScanHorizontal, encoded(&scan(log_ns, &mut rng))));
        sent.push((log_ns + MS, Topic::ScanVertical, encoded(&scan(log_ns, &mut rng))));
        sent.push((log_ns + 2 * MS, Topic::Odom, encoded(&odometry(log_ns, step))));
        let bytes: Vec<u8> = (0..below(&mut rng, 400)).map(|_| rng.bits() as u8).collect();
        sent.push((log_ns + 3 * MS, Topic::Serial(Port::Base, Direction::Rx), bytes_of(&bytes)));
    }
    let mut numbers = std::collections::BTreeMap::new();
    let numbered = sent.into_iter().map(|(log_ns, topic, cdr)| {
        let number: &mut u32 = numbers.entry(topic).or_default();
        *number += 1;
        Sent { log_ns, topic, number: *number - 1, cdr }
    });
    numbered.collect()
}

fn encoded<M: Message>(message: &M) -> Vec<u8> {
    let mut cdr = Vec::new();
    message.encode(&mut cdr);
    cdr
}

fn bytes_of(bytes: &[u8]) -> Vec<u8> {
    let mut cdr = Vec::new();
    biplane_recording::messages::ByteArray::encode_slice(bytes, &mut cdr);
    cdr
}

fn scan(stamp_ns: i64, rng: &mut Rng) -> LaserScan {
    let near = rng.between(1.0, 9.0);
    let ranges_m = (0..181).map(|_| (near + rng.normal() * 0.01) as f32).collect();
    LaserScan { stamp_ns, frame_id: "laser".to_owned(), ranges_m, ..LaserScan::default() }
}

fn odometry(stamp_ns: i64, step: i64) -> Odometry {
    Odometry {
        stamp_ns,
        frame_id: "odom".to_owned(),
        position_m: [step as f64, 0.0, 0.0],
        ..Odometry::default()
    }
}

fn transforms() -> TfMessage {
    let frame_id = "base_link".to_owned();
    TfMessage { transforms: vec![TransformStamped { frame_id, ..TransformStamped::default() }] }
}

/// How a ride ended.
pub(super) struct Ridden {
    /// The error that ended it, if one did.
    pub error: Option<WriteError>,
    /// The worst age of a message before it was on the disk, by the writer's own word.
    pub reported_ns: i64,
}

/// Writes the messages at their times to `folder/run.mcap`, as the recorder's writing thread does.
pub(super) fn ride(disk: &SimDisk, folder: &Path, plan: &Plan, messages: &[Sent]) -> Ridden {
    let mut reported_ns = 0;
    let error = try_ride(disk, folder, plan, messages, &mut reported_ns).err();
    Ridden { error, reported_ns }
}

fn try_ride(
    disk: &SimDisk,
    folder: &Path,
    plan: &Plan,
    messages: &[Sent],
    reported_ns: &mut i64,
) -> Result<(), WriteError> {
    let options = WriterOptions { sync: true, disk: disk.disk(), ..WriterOptions::default() };
    let mut writer = PartsWriter::create(&folder.join("run.mcap"), &options, plan.rotation)?;
    writer.attach("rig.toml", "application/toml", Rig::default().to_toml().as_bytes())?;
    let mut left = messages.iter().peekable();
    while left.peek().is_some() {
        let mut is_idle = true;
        while let Some(sent) = left.next_if(|sent| sent.log_ns <= disk.now_ns()) {
            is_idle = false;
            writer.write_encoded(sent.topic, sent.log_ns, sent.log_ns, &sent.cdr)?;
        }
        let saved = writer.save_if_due(&|| disk.now_ns())?;
        *reported_ns = writer.take_worst_age_ns().max(*reported_ns);
        if is_idle && !saved {
            disk.wait_until(disk.now_ns() + 2 * MS);
        }
    }
    writer.finish().map(drop)
}
