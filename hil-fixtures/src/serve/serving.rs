//! The mock from its start to its end: ports opened, a thread each, the truth kept.

use super::client_rate::ClientRate;
use super::clock::VirtualClock;
use super::devices::{Devices, Served, WorldTruth};
use super::lock::FolderLock;
use super::network_port::NetworkPort;
use super::port::{Port, PortReport};
use super::truth::{TruthRun, TruthWriter};
use super::{LinkName, ServeError, ServeOptions, Source};
use crate::devices::pty::Pty;
use crate::devices::run::Run;
use crate::faults::Place;
use crate::rng::Rng;
use crate::simulate::truth_folder::{TruthError, prepare};
use std::sync::atomic::{AtomicBool, Ordering};

/// With `once`, the mock ends this long after the drive or capture, on the wall: a client has noticed the
/// silence by then, and a port that other work held up has sent the last of it.
const SILENCE_NS: i64 = 1_000_000_000;

/// Rate of a terminal whose device takes any.
const USB_BAUD: u32 = 115_200;

/// How often the main thread looks whether to stop; wall time.
const LOOK_NS: i64 = 20_000_000;

/// What the mock has done.
#[derive(Clone, Debug, Default)]
pub struct ServeReport {
    /// One entry a device.
    pub ports: Vec<PortReport>,
}

/// Serves until `stop`, or until the end with `once`. `ready` is called when all links are there, with the
/// length of the drive or capture in seconds.
pub fn serve(
    options: &ServeOptions,
    stop: &AtomicBool,
    ready: impl FnOnce(f64),
) -> Result<ServeReport, ServeError> {
    if !(options.speed.is_finite() && options.speed > 0.0) {
        return Err(ServeError::Speed { speed: options.speed });
    }
    options.faults.check(Place::Serve)?;
    std::fs::create_dir_all(&options.links)
        .map_err(|source| ServeError::Links { path: options.links.clone(), source })?;
    if options.truth.is_some() && matches!(options.source, Source::Capture { .. }) {
        return Err(ServeError::NoTruth);
    }
    // Held to the end: links that stand here without it are those of a mock that is dead.
    let _lock = FolderLock::take(&options.links)?;
    if let Some(folder) = &options.truth {
        prepare(folder, options.overwrite)?;
    }
    let mut devices = Devices::new(options)?;
    let ports = open_ports(options, &mut devices)?;
    run_ports(ports, options, &devices, stop, ready)
}

/// A port of either kind.
enum AnyPort {
    /// A pseudo-terminal.
    Serial(Box<Port>),
    /// A TCP port.
    Network(Box<NetworkPort>),
}

impl AnyPort {
    fn name(&self) -> LinkName {
        match self {
            Self::Serial(port) => port.name,
            Self::Network(port) => port.name,
        }
    }

    fn run(self, clock: VirtualClock, run: &Run, stop: &AtomicBool) -> PortReport {
        match self {
            Self::Serial(port) => port.run(clock, run, stop),
            Self::Network(port) => port.run(clock, run, stop),
        }
    }
}

fn open_ports(options: &ServeOptions, devices: &mut Devices) -> Result<Vec<AnyPort>, ServeError> {
    let list = devices.list.drain(..).enumerate();
    list.map(|(place, served)| open_port(options, place, served)).collect()
}

fn open_port(options: &ServeOptions, place: usize, served: Served) -> Result<AnyPort, ServeError> {
    let Served { name, device, is_network } = served;
    let stream = place as u64;
    let channels = [2 * stream, 2 * stream + 1].map(|stream| options.faults.channel(stream));
    if is_network {
        let port = NetworkPort::open(name, place, device, channels, &options.links);
        let mut port = port.map_err(|source| ServeError::Network { name, source })?;
        port.unplugged = options.faults.unplugged(name.name());
        return Ok(AnyPort::Network(Box::new(port)));
    }
    // Where any rate will do, a terminal has one all the same.
    let baud = if device.baud() == 0 { USB_BAUD } else { device.baud() };
    let mut pty = Pty::open(baud)?;
    let link = options.links.join(name.name());
    pty.publish(&link)?;
    let [to_host, from_host] = channels;
    Ok(AnyPort::Serial(Box::new(Port {
        name,
        place,
        device,
        pty,
        link,
        unplugged: options.faults.unplugged(name.name()),
        to_host,
        from_host,
        noise: Rng::new(options.seed, 0x0015_E000 + stream, 0),
        any_baud: options.any_baud,
        client_rate: ClientRate::default(),
    })))
}

fn run_ports(
    ports: Vec<AnyPort>,
    options: &ServeOptions,
    devices: &Devices,
    stop: &AtomicBool,
    ready: impl FnOnce(f64),
) -> Result<ServeReport, ServeError> {
    let clock = VirtualClock::start(options.speed);
    let stop_all = AtomicBool::new(false);
    let run = &devices.run;
    std::thread::scope(|scope| {
        let mut threads = Vec::new();
        for port in ports {
            let (name, serving) = (port.name(), || port.run(clock, run, &stop_all));
            let started = std::thread::Builder::new().spawn_scoped(scope, serving);
            threads.push((
                name,
                started.map_err(|source| {
                    // Those that run already would be waited for.
                    stop_all.store(true, Ordering::Relaxed);
                    ServeError::Refused { name, source }
                })?,
            ));
        }
        ready(devices.length_ns as f64 * 1e-9);
        let mut truth = TruthKeeper { options, devices, clock, runs: Vec::new(), failed: None };
        while !stop.load(Ordering::Relaxed) && !threads.iter().any(|(_, thread)| thread.is_finished()) {
            truth.look();
            let over = truth
                .runs
                .last()
                .map(|run| clock.wall_between_ns(run.begun.start_ns + devices.length_ns, clock.now_ns()))
                .is_some_and(|silent_ns| silent_ns > SILENCE_NS);
            if options.once && over || truth.failed.is_some() {
                break;
            }
            biplane_clock::sleep_ns(LOOK_NS);
        }
        stop_all.store(true, Ordering::Relaxed);
        let mut report = ServeReport::default();
        for (name, thread) in threads {
            report.ports.push(thread.join().map_err(|_| ServeError::Thread { name })?);
        }
        truth.finish()?;
        Ok(report)
    })
}

/// Writes the truth: the drive when it begins, the scans at the end.
struct TruthKeeper<'a> {
    options: &'a ServeOptions,
    devices: &'a Devices,
    clock: VirtualClock,
    /// The runs seen.
    runs: Vec<TruthRun>,
    failed: Option<TruthError>,
}

impl TruthKeeper<'_> {
    fn writer(&self) -> Option<(TruthWriter<'_>, &WorldTruth)> {
        let (folder, world) = (self.options.truth.as_deref()?, self.devices.world.as_ref()?);
        let writer = TruthWriter { folder, rig: &world.rig, clock: self.clock, runs: &self.runs };
        (!self.runs.is_empty()).then_some((writer, world))
    }

    fn look(&mut self) {
        let begun = self.devices.run.begun();
        let last = self.runs.last().map(|run| run.begun);
        if let Some(run) = self.runs.last_mut().filter(|run| begun != Some(run.begun)) {
            run.ended_ns.get_or_insert(self.clock.now_ns());
        }
        if let Some(begun) = begun.filter(|begun| last != Some(*begun)) {
            self.runs.push(TruthRun { begun, ended_ns: None });
            let written = self.writer().map_or(Ok(()), |(writer, _)| writer.write_drive());
            self.failed = written.err();
        }
    }

    fn finish(mut self) -> Result<(), TruthError> {
        if let Some(failed) = self.failed.take() {
            return Err(failed);
        }
        let Some((writer, world)) = self.writer() else { return Ok(()) };
        writer.write_scans("scans_horizontal.txt", "poses.tum", &world.horizontal)?;
        if world.rig.vertical().is_some() {
            writer.write_scans("scans_vertical.txt", "poses_vertical.tum", &world.vertical)?;
        }
        Ok(())
    }
}
