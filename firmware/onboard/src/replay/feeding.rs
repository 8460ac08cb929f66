//! From a file into an engine: serial bytes or decoded measurements, each at its `log_time`. Shared by
//! `replay`, `bench` and `basin`.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use biplane_matcher::TrackerParams;
use biplane_recording::messages::{ByteArray, Imu, LaserScan, Message, Odometry};
use biplane_recording::rig::{BaseProtocol, InertialUnit};
use biplane_recording::{Direction, Entry, Port, ReadError, Recording, Rig, Topic};

use crate::engine::Engine;
use crate::engine::localize::tracker_inputs::KeptScans;
use crate::engine::options::{EngineOptions, Feed};
use crate::engine::out::sink::NoSink;
use crate::engine::out::sink::Sink;
use crate::session::event::Event;
use crate::types::error::OnboardError;
use crate::types::run_report::{RunEnd, RunReport};

/// What an input holds.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Content {
    /// Bytes of serial lines.
    Serial {
        /// Whether samples come as bytes of the rig's inertial unit: decoded ones are the same then.
        inertial: bool,
    },
    /// Scans and odometry of another recording.
    Decoded,
}

/// Whether the file holds serial bytes or decoded scans, and the time of its first message. Serial bytes go
/// first: a recording made with `--raw` has both. What a RoboClaw answered is refused without what it was
/// asked: its answers have no header to know them by.
pub(crate) fn survey(input: &Recording, rig: &Rig) -> Result<(Content, i64), OnboardError> {
    let (mut serial, mut decoded, mut start_ns) = (false, false, None);
    let (mut answers, mut questions, mut inertial) = (false, false, false);
    for entry in input.messages() {
        let entry = entry?;
        if let Some(Topic::Serial(Port::Base, direction)) = entry.topic {
            answers |= direction == Direction::Rx;
            questions |= direction == Direction::Tx;
        }
        match entry.topic {
            // Scans are what is replayed: samples alone are nothing.
            Some(Topic::Serial(Port::Imu, Direction::Rx)) => inertial = true,
            Some(Topic::Serial(_, Direction::Rx)) => serial = true,
            Some(Topic::ScanHorizontal | Topic::ScanVertical) => decoded = true,
            Some(Topic::Odom) => {}
            _ => continue,
        }
        start_ns.get_or_insert(entry.log_time_ns);
    }
    if matches!(rig.base.protocol, BaseProtocol::RoboClaw { .. }) && answers && !questions {
        let (path, protocol) = (input.path().to_owned(), rig.base.protocol.name());
        return Err(OnboardError::NoQuestions { path, protocol });
    }
    let inertial = inertial && rig.imu.as_ref().is_some_and(InertialUnit::is_serial);
    let content = match (serial, decoded) {
        (true, _) => Content::Serial { inertial },
        (false, true) => Content::Decoded,
        (false, false) => {
            return Err(OnboardError::NothingToReplay { path: input.path().to_owned() });
        }
    };
    Ok((content, start_ns.unwrap_or_default()))
}

/// An engine that lives on a file.
pub(crate) struct Feeding<S> {
    engine: Engine<S>,
    content: Content,
    end_ns: i64,
}

impl<S: Sink> Feeding<S> {
    /// Of a file that [`survey`] has looked through.
    pub(crate) fn new(engine: Engine<S>, content: Content, start_ns: i64) -> Self {
        Self { engine, content, end_ns: start_ns }
    }

    /// The engine.
    pub(crate) fn engine(&mut self) -> &mut Engine<S> {
        &mut self.engine
    }

    /// Feeds all of the file, each message after `wait_for` its time (nanoseconds), until `stop` is set.
    pub(crate) fn feed(
        &mut self,
        input: &Recording,
        wait_for: impl Fn(i64),
        stop: &AtomicBool,
    ) -> Result<RunEnd, OnboardError> {
        for entry in input.messages() {
            let entry = entry?;
            wait_for(entry.log_time_ns);
            if stop.load(Ordering::Relaxed) {
                return Ok(RunEnd::Interrupted);
            }
            self.take(&entry).map_err(|error| error.in_file(input.path()))?;
            self.say_events();
            self.engine.sink().check()?;
        }
        Ok(RunEnd::InputOver)
    }

    /// The file is over.
    pub(crate) fn finish(self) -> (RunReport, S) {
        self.engine.finish(self.end_ns)
    }

    fn take(&mut self, entry: &Entry) -> Result<(), ReadError> {
        let now_ns = entry.log_time_ns;
        match (self.content, entry.topic) {
            (Content::Serial { .. }, Some(Topic::Serial(port, Direction::Rx))) => {
                let bytes: ByteArray = decode(entry)?;
                self.engine.recorded_bytes(now_ns, unheard_ns(entry), port, &bytes.data);
            }
            (Content::Serial { .. }, Some(Topic::Serial(port, Direction::Tx))) => {
                let bytes: ByteArray = decode(entry)?;
                self.engine.host_sent(now_ns, port, &bytes.data);
            }
            (Content::Decoded, Some(Topic::ScanHorizontal)) => {
                self.engine.decoded_scan(now_ns, Port::Horizontal, &decode::<LaserScan>(entry)?);
            }
            (Content::Decoded, Some(Topic::ScanVertical)) => {
                self.engine.decoded_scan(now_ns, Port::Vertical, &decode::<LaserScan>(entry)?);
            }
            (Content::Decoded, Some(Topic::Odom)) => {
                self.engine.decoded_odometry(now_ns, &decode::<Odometry>(entry)?);
            }
            (Content::Serial { inertial: true }, Some(Topic::Imu)) => {}
            (_, Some(Topic::Imu)) => self.engine.decoded_inertial(now_ns, &decode::<Imu>(entry)?),
            _ => return Ok(()),
        }
        self.end_ns = self.end_ns.max(now_ns);
        Ok(())
    }

    fn say_events(&mut self) {
        while let Some((port, event)) = self.engine.next_event() {
            match event {
                // What devices once said is over; how they sit is in the recording.
                Event::Mounting { begins: true, .. } => tracing::warn!("{}: {event}", port.name()),
                _ => tracing::debug!("{}: {event}", port.name()),
            }
        }
        while self.engine.next_command().is_some() {}
    }
}

/// The scans of a file as the tracker of `record` or `replay` gets them; the file's own rig when none is
/// given.
pub(crate) fn kept_scans(
    inputs: &[PathBuf],
    rig: Option<&Rig>,
    matcher: &TrackerParams,
) -> Result<KeptScans, OnboardError> {
    let input = Recording::open(inputs)?;
    let rig = match rig {
        Some(rig) => rig.clone(),
        None => input.rig()?.ok_or_else(|| OnboardError::NoRig { path: input.path().to_owned() })?,
    };
    let (content, start_ns) = survey(&input, &rig)?;
    let options = EngineOptions { rig, matcher: *matcher, feed: Feed::Recorded, raw: false };
    let mut feeding = Feeding::new(Engine::new(&options, NoSink, start_ns), content, start_ns);
    feeding.engine().keep_scans();
    feeding.feed(&input, |_| {}, &AtomicBool::new(false))?;
    let kept = feeding.engine().take_kept_scans();
    if kept.is_empty() {
        return Err(OnboardError::NothingToReplay { path: input.path().to_owned() });
    }
    Ok(kept)
}

/// For how long nobody had listened to a line when a read returned, nanoseconds: from the publish time to the
/// log time. 0 where nothing is known of it.
fn unheard_ns(entry: &Entry) -> i64 {
    match entry.publish_time_ns {
        ..=0 => 0,
        listened_ns => entry.log_time_ns.saturating_sub(listened_ns).max(0),
    }
}

fn decode<M: Message>(entry: &Entry) -> Result<M, ReadError> {
    M::decode(&entry.bytes).map_err(|source| ReadError::Message {
        path: None,
        topic: entry.topic_name.clone(),
        log_time_ns: entry.log_time_ns,
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::synthetic::{self, START_NS};
    use crate::engine::tests::MemorySink;
    use biplane_recording::{Writer, WriterOptions};

    const MS: i64 = 1_000_000;

    fn engine(raw: bool) -> Engine<MemorySink> {
        let (rig, matcher) = (synthetic::rig(), TrackerParams::default());
        let options = EngineOptions { rig, matcher, feed: Feed::Recorded, raw };
        Engine::new(&options, MemorySink::default(), START_NS)
    }

    fn scans(sink: &MemorySink) -> Vec<&[u8]> {
        let is_scan = |topic: &Topic| matches!(topic, Topic::ScanHorizontal | Topic::ScanVertical);
        let messages = sink.messages.iter().filter(|(topic, ..)| is_scan(topic));
        messages.map(|(.., cdr)| cdr.as_slice()).collect()
    }

    #[test]
    fn a_replay_knows_when_the_host_had_stood_still_and_stamps_as_the_run_did() {
        let mut run = engine(true);
        let reads = synthetic::drive(4, 60);
        let mut listened_ns = [START_NS; Port::ALL.len()];
        for read in &reads {
            // Twice the host stands still, and then finds in one read what had come meanwhile.
            let stands_still = [100, 420]
                .map(|from_ms| START_NS + from_ms * MS)
                .map(|from_ns| (from_ns, from_ns + 290 * MS));
            let late =
                stands_still.iter().find(|(from_ns, to_ns)| (*from_ns..*to_ns).contains(&read.time_ns));
            let read_ns = late.map_or(read.time_ns, |(_, to_ns)| *to_ns);
            run.read_watermark(read.port, listened_ns[read.port.index()]);
            run.bytes(read_ns, read.port, &read.bytes);
            listened_ns[read.port.index()] = late.map_or(read_ns - MS, |(from_ns, _)| *from_ns);
        }
        let (_, recorded) = run.finish(reads.last().unwrap().time_ns);

        let path = std::env::temp_dir().join(format!("biplane-unheard-{}.mcap", std::process::id()));
        let mut writer = Writer::create(&path, &WriterOptions::default()).unwrap();
        writer.attach("rig.toml", "application/toml", synthetic::rig().to_toml().as_bytes()).unwrap();
        for (topic, log_ns, publish_ns, cdr) in &recorded.messages {
            if matches!(topic, Topic::Serial(..)) {
                writer.write_encoded(*topic, *log_ns, *publish_ns, cdr).unwrap();
            }
        }
        writer.finish().unwrap();

        let input = Recording::open(std::slice::from_ref(&path)).unwrap();
        let mut feeding = Feeding::new(engine(false), Content::Serial { inertial: false }, START_NS);
        feeding.feed(&input, |_| {}, &AtomicBool::new(false)).unwrap();
        let (_, replayed) = feeding.finish();
        assert!(scans(&recorded).len() > 60 && scans(&recorded) == scans(&replayed));
        let _ = std::fs::remove_file(&path);
    }
}
