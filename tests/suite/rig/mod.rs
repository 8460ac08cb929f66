//! The onboard engine against mock devices in simulated time: no threads, no ports, no clock, the same run
//! for the same seed.
//!
//! ```text
//! Engine (live) -- commands --> line model -- bytes at their times --> mock device (sans I/O)
//!        ^                                                                  |
//!        +------- reads, late by the adapter <-- faults <-- line model -----+
//! ```
//! One loop takes whatever is due next: a byte's arrival, a device's turn, the engine's own wake-up,
//! something that happens to a line. Times are nanoseconds since the start.

pub(crate) mod devices;
pub(crate) mod disk;
pub(crate) mod host;
pub(crate) mod laser_client;
pub(crate) mod line;
pub(crate) mod pairs;
pub(crate) mod plan;
pub(crate) mod verdict;
pub(crate) mod world;

use std::ops::RangeInclusive;

use biplane_matcher::TrackerParams;
use biplane_onboard::test_support::during;
use biplane_onboard::{Command, Engine, EngineOptions, Event, Feed, Sink};
use biplane_recording::{Port, Rig};

use host::Host;
use line::SimLine;
use plan::{Happening, Plan};

/// Nanoseconds of a millisecond.
pub(crate) const MS: i64 = 1_000_000;
/// Nanoseconds of a second.
pub(crate) const S: i64 = 1_000_000_000;

/// The seeds that a test runs: a few, so that it is quick. `BIPLANE_SEEDS` asks for so many (`.ci/run
/// faults`), divided by `share` where a seed costs more; `BIPLANE_SEED` for one alone, to look at.
#[must_use]
pub(crate) fn seeds(few: u64, share: u64) -> RangeInclusive<u64> {
    asked_seeds(few, share, &["BIPLANE_SEEDS"])
}

/// The same for the fault matrix, which is large: `BIPLANE_FAULT_SEEDS` asks for another number of it.
#[must_use]
pub(crate) fn fault_seeds(few: u64, share: u64) -> RangeInclusive<u64> {
    asked_seeds(few, share, &["BIPLANE_FAULT_SEEDS", "BIPLANE_SEEDS"])
}

fn asked_seeds(few: u64, share: u64, names: &[&str]) -> RangeInclusive<u64> {
    let number = |name| std::env::var(name).ok().and_then(|text: String| text.parse::<u64>().ok());
    match (number("BIPLANE_SEED"), names.iter().copied().find_map(number)) {
        (Some(seed), _) => seed..=seed,
        (None, Some(many)) => 1..=many.div_ceil(share),
        (None, None) => 1..=few,
    }
}

/// Steps at one and the same time after which the loop is taken to hang.
const HANG_STEPS: u32 = 100_000;

/// The devices of a simulated rig.
pub(crate) const PORTS: [Port; 4] = Port::ALL;
/// Those that every rig has.
pub(crate) const LASERS_AND_BASE: [Port; 3] = [Port::Horizontal, Port::Vertical, Port::Base];

/// Lines in the order of [`PORTS`]; `None` for a device that the rig does not have.
pub(crate) type Lines = [Option<SimLine>; PORTS.len()];

/// Something that a session said, and when.
#[derive(Clone, Debug)]
pub(crate) struct ReportedEvent {
    /// When.
    pub at_ns: i64,
    /// Of which device.
    pub port: Port,
    /// What.
    pub event: Event,
}

/// The engine, its lines, and what happens to them.
pub(crate) struct SimRig<K> {
    /// The engine.
    pub engine: Engine<K>,
    /// Its lines.
    pub lines: Lines,
    /// What the sessions said.
    pub reported: Vec<ReportedEvent>,
    /// How often the engine has allocated.
    pub engine_allocations: u64,
    /// Is told of every read.
    pub tap: Option<Tap>,
    /// The computer between the lines and the engine; without, each byte is read as soon as it comes, and
    /// each time is kept.
    pub host: Option<Host>,
    /// What happens.
    pub plan: Plan,
    now_ns: i64,
    chunk: Vec<u8>,
}

/// Takes a line's reads with their times, nanoseconds.
pub(crate) type Tap = Box<dyn FnMut(Port, i64, &[u8])>;

/// Place of a port in [`SimRig::lines`].
#[must_use]
pub(crate) fn place(port: Port) -> usize {
    port.index()
}

impl<K: Sink> SimRig<K> {
    /// A rig at time 0 whose devices have been as they are for a while.
    pub(crate) fn new(rig: &Rig, lines: Lines, plan: Plan, sink: K) -> Self {
        let options = EngineOptions {
            rig: rig.clone(),
            matcher: TrackerParams::default(),
            feed: Feed::Live,
            raw: false,
        };
        let engine = Engine::new(&options, sink, 0);
        let mut sim = Self {
            engine,
            lines,
            reported: Vec::new(),
            engine_allocations: 0,
            tap: None,
            host: None,
            plan,
            now_ns: 0,
            chunk: Vec::new(),
        };
        sim.serve_engine();
        sim
    }

    /// The time that has been reached.
    #[must_use]
    pub(crate) fn now_ns(&self) -> i64 {
        self.now_ns
    }

    /// Runs until `end_ns`, or until `until` says that it is enough. Returns whether it did.
    pub(crate) fn run(&mut self, end_ns: i64, mut until: impl FnMut(&mut Self) -> bool) -> bool {
        let mut steps = 0;
        loop {
            let due_ns = self.next_ns();
            if due_ns > end_ns {
                self.now_ns = end_ns;
                return false;
            }
            steps = if due_ns > self.now_ns { 0 } else { steps + 1 };
            assert!(steps < HANG_STEPS, "the loop hangs at {due_ns} ns");
            self.now_ns = self.now_ns.max(due_ns);
            self.step();
            if until(self) {
                return true;
            }
        }
    }

    /// The run shall end: the devices are to be left idle.
    pub(crate) fn stop(&mut self) {
        self.engine.stop(self.now_ns);
        self.serve_engine();
    }

    /// What was said, a line each, in milliseconds.
    #[must_use]
    pub(crate) fn transcript(&self) -> String {
        let line = |reported: &ReportedEvent| {
            format!("{:8} ms {:?}: {}\n", reported.at_ns / MS, reported.port, reported.event)
        };
        self.reported.iter().map(line).collect()
    }

    fn next_ns(&self) -> i64 {
        let lines = self.lines.iter().flatten().map(SimLine::next_ns);
        let host_ns = self.host.as_ref().map_or_else(|| self.engine.wake_ns(), Host::next_ns);
        lines.chain([host_ns, self.plan.next_ns()]).min().unwrap_or(i64::MAX)
    }

    fn step(&mut self) {
        let now_ns = self.now_ns;
        while let Some((port, happening)) = self.plan.take(now_ns) {
            self.happen(port, happening);
        }
        for port in PORTS {
            let Some(line) = &mut self.lines[place(port)] else { continue };
            if line.next_ns() > now_ns {
                continue;
            }
            line.run(now_ns);
            while let Some(line) = &mut self.lines[place(port)]
                && line.read(now_ns, &mut self.chunk)
            {
                if let Some(host) = &mut self.host {
                    host.arrived(now_ns, place(port), &self.chunk);
                    continue;
                }
                if let Some(tap) = &mut self.tap {
                    tap(port, now_ns, &self.chunk);
                }
                let ((), allocated) = during(|| self.engine.bytes(now_ns, port, &self.chunk));
                self.engine_allocations += allocated.expect("this program counts");
                self.serve_engine();
            }
        }
        if self.host.is_some() {
            self.serve_host();
        } else if self.engine.wake_ns() <= now_ns {
            let ((), allocated) = during(|| self.engine.advance(now_ns));
            self.engine_allocations += allocated.expect("this program counts");
            self.serve_engine();
        }
    }

    fn serve_host(&mut self) {
        let (now_ns, Some(host)) = (self.now_ns, &mut self.host) else { return };
        if host.next_ns() <= now_ns && host.run(now_ns) {
            let (lines, reported) = (&mut self.lines, &mut self.reported);
            self.engine_allocations +=
                host.turn(now_ns, &mut self.engine, |engine| serve(now_ns, engine, lines, reported));
        }
    }

    fn happen(&mut self, port: Port, happening: Happening) {
        // As `record` does it: the port's reading thread tells that it is gone, and that it is back.
        match (&happening, &mut self.host) {
            (Happening::Unplug, Some(host)) => host.port(self.now_ns, place(port), false),
            (Happening::Plug, Some(host)) => host.port(self.now_ns, place(port), true),
            (Happening::Unplug, None) => self.engine.port_lost(self.now_ns, port),
            (Happening::Plug, None) => self.engine.port_back(self.now_ns, port),
            _ => {}
        }
        if let Some(line) = &mut self.lines[place(port)] {
            line.happen(self.now_ns, happening);
        }
        self.serve_engine();
    }

    fn serve_engine(&mut self) {
        serve(self.now_ns, &mut self.engine, &mut self.lines, &mut self.reported);
    }
}

/// Does what the engine wants done, and keeps what it says.
fn serve<K: Sink>(now_ns: i64, engine: &mut Engine<K>, lines: &mut Lines, reported: &mut Vec<ReportedEvent>) {
    while let Some((port, command)) = engine.next_command() {
        let Some(line) = &mut lines[place(port)] else { continue };
        match command {
            Command::Write(bytes) => line.write(now_ns, &bytes),
            Command::SetBaud(baud) => line.set_baud(baud),
            // No serial line is asked for one.
            Command::Reconnect => {}
        }
    }
    while let Some((port, event)) = engine.next_event() {
        reported.push(ReportedEvent { at_ns: now_ns, port, event });
    }
}
