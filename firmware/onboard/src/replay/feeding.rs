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
                self.engine.bytes(now_ns, port, &bytes.data);
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

fn decode<M: Message>(entry: &Entry) -> Result<M, ReadError> {
    M::decode(&entry.bytes).map_err(|source| ReadError::Message {
        path: None,
        topic: entry.topic_name.clone(),
        log_time_ns: entry.log_time_ns,
        source,
    })
}
