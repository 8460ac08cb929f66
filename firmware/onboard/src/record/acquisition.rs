//! The loop of a live run: reads of the ports in, commands to the ports out.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use crate::engine::Engine;
use crate::engine::options::Command;
use crate::io::clock::RunClock;
use crate::io::reader::News;
use crate::record::lines::Lines;
use crate::record::recorder::queue::QueueSink;
use crate::record::recorder::writer::Writing;
use crate::record::status::notifier::EventNotifier;
use crate::session::event::Event;
use crate::session::event::Step;
use crate::types::device_name::device_name;
use crate::types::run_report::{RunEnd, RunReport};

/// The loop looks around at least so often, nanoseconds.
const LONGEST_PARK_NS: i64 = 5_000_000;
/// Time that has come is told to the engine this much later, nanoseconds, so that a read that is just under
/// way is not overtaken.
const READ_UNDER_WAY_NS: i64 = 3_000_000;
/// Devices get this long to be left idle, nanoseconds.
const STOP_NS: i64 = 3_000_000_000;
/// The same while the configuration of one is being written: 15 s for that, and for what follows; the service
/// manager waits for 20 s.
const STOP_WRITING_NS: i64 = 18_000_000_000;

/// The loop: reads in, commands out.
pub(crate) struct Acquisition {
    /// Sessions, matcher, and what they publish.
    pub engine: Engine<QueueSink>,
    /// The ports.
    pub lines: Lines,
    /// The run's time.
    pub clock: RunClock,
    /// What is told.
    pub event_notifier: EventNotifier,
}

/// What a run is told while it goes on.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Controls<'a> {
    /// Set: the run shall end.
    pub stop: &'a AtomicBool,
    /// Set: the next part of the recording shall begin. It is taken back.
    pub rotate: &'a AtomicBool,
}

impl Acquisition {
    /// Runs until it is told to stop, then until the devices are idle; returns why.
    pub(crate) fn run(&mut self, end_ns: i64, controls: Controls<'_>, writing: &Writing) -> RunEnd {
        self.serve_engine();
        let mut ending: Option<(RunEnd, i64)> = None;
        loop {
            self.event_notifier.beat();
            let received_ns = self.lines.received_ns();
            self.take_reads();
            for (port, up_to_ns) in received_ns {
                self.engine.read_watermark(port, up_to_ns);
            }
            let now_ns = self.clock.now_ns();
            self.engine.advance(now_ns - READ_UNDER_WAY_NS);
            self.serve_engine();
            if controls.rotate.swap(false, Ordering::Relaxed) {
                writing.rotate();
            }
            match ending {
                Some((end, give_up_ns)) if self.engine.is_stopped() || now_ns >= give_up_ns => {
                    self.say_unstopped();
                    return end;
                }
                Some(_) => {}
                None => {
                    let patience_ns = if self.engine.is_writing() { STOP_WRITING_NS } else { STOP_NS };
                    ending = why_end(now_ns, end_ns, controls, writing)
                        .map(|end| (end, now_ns.saturating_add(patience_ns)));
                    if ending.is_some() {
                        self.engine.stop(now_ns);
                        self.serve_engine();
                        continue;
                    }
                }
            }
            self.wait();
        }
    }

    fn say_unstopped(&mut self) {
        for port in self.engine.unstopped() {
            self.event_notifier.say(port, Event::GivenUp { step: Step::StopStream });
        }
    }

    fn take_reads(&mut self) {
        while let Some((link, reader)) = self.lines.earliest() {
            let device = link.device;
            let Ok(chunk) = reader.chunks.pop() else { return };
            match chunk.news {
                News::Bytes(bytes) => {
                    self.engine.read_watermark(device, chunk.received_ns);
                    self.engine.bytes(chunk.time_ns, device, &bytes);
                }
                News::Lost => self.engine.port_lost(chunk.time_ns, device),
                News::Back => self.engine.port_back(chunk.time_ns, device),
            }
            self.serve_engine();
        }
    }

    /// Sends what the sessions want sent, says what they say.
    fn serve_engine(&mut self) {
        while let Some((port, command)) = self.engine.next_command() {
            let Some(link) = self.lines.link(port) else { continue };
            let result = match &command {
                Command::Write(bytes) => link.write(bytes),
                Command::SetBaud(baud) => link.set_baud(*baud),
                Command::Reconnect => {
                    link.hang_up();
                    Ok(())
                }
            };
            let Err(error) = result else { continue };
            tracing::debug!("{} ({}): {error}", device_name(port), link.path().display());
            if let (Command::SetBaud(baud), io::ErrorKind::Unsupported) = (command, error.kind()) {
                self.engine.rate_refused(self.clock.now_ns(), port, baud);
            }
        }
        while let Some((port, event)) = self.engine.next_event() {
            self.event_notifier.say(port, event);
        }
    }

    /// Until a read wakes it or something is due.
    fn wait(&self) {
        let due_ns = self.engine.wake_ns().saturating_add(READ_UNDER_WAY_NS);
        let park_ns = due_ns.saturating_sub(self.clock.now_ns()).clamp(0, LONGEST_PARK_NS);
        thread::park_timeout(Duration::from_nanos(park_ns.unsigned_abs()));
    }

    pub(crate) fn finish(self) -> RunReport {
        drop(self.lines);
        let (report, _) = self.engine.finish(self.clock.now_ns());
        // The sink is gone now: the writing thread sees that nothing more comes.
        report
    }
}

fn why_end(now_ns: i64, end_ns: i64, controls: Controls<'_>, writing: &Writing) -> Option<RunEnd> {
    if writing.has_failed() {
        Some(RunEnd::WriteFailed)
    } else if writing.ended_with_bytes().is_some() {
        Some(RunEnd::DiskLow)
    } else if controls.stop.load(Ordering::Relaxed) {
        Some(RunEnd::Stopped)
    } else {
        (now_ns >= end_ns).then_some(RunEnd::DurationOver)
    }
}
