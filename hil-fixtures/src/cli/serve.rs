//! `serve`: a mock rig on pseudo-terminals until it is told to stop.

use super::fan_lasers::FanLaserTypes;
use super::{BadArgument, MirrorPpm, worlds};
use crate::capture::source::Capture;
use crate::devices::lms::LmsParams;
use crate::devices::lms::model::Model;
use crate::devices::lms::settings::OLD_CONFIG_BYTES;
use crate::faults::unplug::Unplug;
use crate::faults::{Faults, Place, Preset};
use crate::line::LatencyTimerParams;
use crate::rig::simulated::SimulationParams;
use crate::rig::tick::metres_per_tick;
use biplane_cli::counted;

use crate::serve::{PortReport, ServeOptions, Source, serve};
use crate::simulate::truth_folder::truth_files;
use biplane_recording::WriteError;
use biplane_recording::mcap::write::check_outputs;
use biplane_recording::rig::{BaseProtocol, Laser};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Serve a mock rig: two lasers and a base, on pseudo-terminals or TCP ports of this machine.
///
/// A laser with protocol = "cola" in the rig, or with protocol = "scip" and an address, is on the
/// network: DIR/lms-horizontal.address then holds its host:port. A laser with protocol = "scip" and
/// a port is on a pseudo-terminal like an LMS 2xx. Of a capture only the scans in it can be had: such a
/// laser refuses other settings.
///
/// The base is a P2OS, RoboClaw or rFLEX, as the rig says. DIR/lms-horizontal, DIR/lms-vertical and
/// DIR/base appear when their devices are ready; open them as you would open a serial port. The
/// devices answer their protocols (rate, mode, variant, configuration, status), then stream. The
/// drive through a world begins one second after all of them stream. A capture begins when all of
/// them stream; a laser alone waits 0.6 s for the others. When none streams any more, the next
/// client finds drive or capture at its start again. Ends with SIGINT or SIGTERM; links are removed.
///
/// Examples:
///   biplane-mock serve --world corridor --links /tmp/rig --truth /tmp/truth
///   biplane-mock serve --capture corridor.mcap --links /tmp/rig --fault bit-noise --fault usb-stall
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
#[command(group = clap::ArgGroup::new("source").required(true).args(["capture", "world"]))]
pub(super) struct Serve {
    /// Capture to play: serial bytes, or a recording made with --raw.
    #[arg(long, value_name = "C.mcap")]
    capture: Option<PathBuf>,
    #[command(flatten)]
    drive: Drive,
    /// Folder for the links; made when it is missing.
    #[arg(long, value_name = "DIR")]
    links: PathBuf,
    /// Run N times as fast as real time.
    #[arg(long, value_name = "N", default_value_t = 1.0, value_parser = super::above_zero)]
    speed: f64,
    #[command(flatten)]
    chance: Chance,
    /// At the end of the drive or capture, fall silent and end (else the last scan goes on).
    #[arg(long)]
    once: bool,
    /// Begin the drive S seconds after the links are there, instead of when all devices stream.
    #[arg(long, value_name = "S", value_parser = super::zero_or_more)]
    start_after: Option<f64>,
    #[command(flatten)]
    lasers: Lasers,
    /// Millionths by which the mirrors turn too slowly: P for both lasers or H,V.
    #[arg(long, value_name = "P|H,V", default_value = "0", value_parser = super::mirror_ppm, allow_hyphen_values = true, conflicts_with = "capture")]
    mirror_ppm: MirrorPpm,
    /// Subclass of a P2OS base: its packets count in that subclass's units unless the rig says otherwise.
    #[arg(long, value_name = "NAME", default_value = "p3dx-sh")]
    base_subclass: String,
    /// A P2OS base that takes any packet before SYNC0 for a SYNC out of turn, as the simulator AMRISim does.
    #[arg(long)]
    strict_base: bool,
    /// Understand clients whatever line speed they have set (for those that set theirs by a custom divisor).
    #[arg(long)]
    any_baud: bool,
}

/// The world that is driven through, and its truth.
#[derive(Debug, clap::Args)]
struct Drive {
    /// World to drive through: a built-in name, or an OBJ, PLY or IFC file. Built in are corridor, building,
    /// office, ramp-up, ramp-level, ramp-down, ramp-curved, sill, decks, hall, street and pillars. Of an
    /// IFC file the lowest storey is taken, with its doors closed.
    #[arg(long, value_name = "W")]
    world: Option<String>,
    /// Path through the world: a built-in name or a .toml file; the usual one when left out.
    #[arg(long, value_name = "P", conflicts_with = "capture")]
    path: Option<String>,
    /// Rig that drives through the world (mounts, base); the template when left out.
    #[arg(long, value_name = "rig.toml", conflicts_with = "capture")]
    rig: Option<PathBuf>,
    /// Folder for the truth of a world: surfaces.ply and trajectory.tum from the start of a drive on,
    /// poses.tum and scan times when the mock ends. Stamped in UTC, all drives one after the other.
    #[arg(long, value_name = "DIR", conflicts_with = "capture")]
    truth: Option<PathBuf>,
    /// Replace an earlier truth in that folder.
    #[arg(long, visible_alias = "overwrite", requires = "truth")]
    force: bool,
}

impl Drive {
    /// Looks before the world is read: no file of the truth may be one that is read.
    fn check_truth(&self) -> Result<(), WriteError> {
        let Some(folder) = &self.truth else { return Ok(()) };
        let named = [&self.world, &self.path].into_iter().flatten().map(PathBuf::from);
        let read: Vec<PathBuf> = named.chain(self.rig.clone()).collect();
        let truth = truth_files(folder);
        check_outputs(&truth.iter().map(PathBuf::as_path).collect::<Vec<_>>(), &read, self.force)
    }
}

/// What goes wrong, and the chance behind it.
#[derive(Debug, clap::Args)]
struct Chance {
    /// Fault; may be given several times: bit-noise, loose-connector, usb-stall, power-cycle, dazzle,
    /// window-dirty, left-streaming.
    #[arg(long = "fault", value_name = "PRESET")]
    faults: Vec<Preset>,
    /// Pull the plug of one device, horizontal, vertical, base or imu, AT seconds after the start, and put it
    /// back FOR seconds later; may be given several times. The device keeps its power.
    #[arg(long = "unplug", value_name = "DEVICE:AT:FOR")]
    unplugs: Vec<Unplug>,
    /// Latency timer of the USB adapters in milliseconds (16 on an FTDI as delivered): bytes wait until 62
    /// have come or the timer has run.
    #[arg(long, value_name = "MS", default_value_t = 0.0, value_parser = super::zero_or_more)]
    latency_timer_ms: f64,
    /// Seed of noise and faults.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// How the lasers are at the start.
#[derive(Debug, clap::Args)]
struct Lasers {
    /// Rate of the lasers at the start: 9600 after power-on, or what an earlier client left.
    #[arg(long, value_name = "BAUD", default_value = "9600", value_parser = ["9600", "19200", "38400", "500000"])]
    laser_baud: String,
    /// The lasers stream from the start, as a client that crashed leaves them.
    #[arg(long)]
    left_streaming: bool,
    /// The lasers say that they have just been switched on.
    #[arg(long)]
    power_on_message: bool,
    /// From power-on or reset until a laser says so, seconds; a real one takes up to 60.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = super::zero_or_more)]
    boot: f64,
    /// Type of the lasers, as they leave the factory: LMS200, LMS211, LMS220, LMS221, LMS291, S14, or a whole
    /// type text.
    #[arg(long, value_name = "TYPE", default_value = "LMS291;S05;X01.27 ")]
    laser_type: String,
    #[command(flatten)]
    types: FanLaserTypes,
    /// A fault in the lasers' list of faults (32h), until a reset: TYPE 1 info, 2 warning, 3 error, 4 fatal.
    /// May be given several times.
    #[arg(long = "laser-error", value_name = "TYPE:NUMBER", value_parser = laser_error)]
    laser_errors: Vec<(u8, u8)>,
    /// The lasers have an old firmware, with 32 bytes of configuration.
    #[arg(long)]
    old_firmware: bool,
}

impl Serve {
    /// Serves until a signal.
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let options = self.options()?;
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            signal_hook::flag::register(signal, Arc::clone(&stop))?;
        }
        let report = serve(&options, &stop, |length_s| {
            let links = self.links.display();
            eprintln!("serving in {links}: {length_s:.0} s, from when all devices stream; Ctrl-C ends it");
            addresses(&options).iter().for_each(|words| eprintln!("{words}"));
        })?;
        report.ports.iter().for_each(print_port);
        Ok(())
    }

    fn source(&self) -> anyhow::Result<Source> {
        match (&self.capture, &self.drive.world) {
            (Some(capture), _) => Ok(Source::Capture { capture: Box::new(read_capture(capture)?) }),
            (None, world) => {
                let (world, path) = worlds::load(world.as_deref().unwrap_or(""), self.drive.path.as_deref())?;
                let mut rig = Box::new(worlds::rig(self.drive.rig.as_deref())?);
                if let BaseProtocol::P2os { metres_per_tick: unit @ None } = &mut rig.base.protocol {
                    *unit = Some(metres_per_tick(&self.base_subclass));
                }
                Ok(Source::World {
                    world: Box::new(world),
                    path: Box::new(path),
                    rig,
                    params: SimulationParams::default(),
                })
            }
        }
    }

    fn options(&self) -> anyhow::Result<ServeOptions> {
        let mut faults = Faults::new(&self.chance.faults, self.chance.seed);
        let timer =
            LatencyTimerParams { timer_ms: self.chance.latency_timer_ms, ..LatencyTimerParams::default() };
        faults.latency_timer = (self.chance.latency_timer_ms > 0.0).then_some(timer);
        faults.unplugs.clone_from(&self.chance.unplugs);
        faults.check(Place::Serve).map_err(|error| BadArgument(error.to_string()))?;
        self.drive.check_truth()?;
        let source = self.source()?;
        let mut options = ServeOptions::new(source, self.links.clone());
        options.speed = self.speed;
        options.once = self.once;
        options.faults = faults;
        options.seed = self.chance.seed;
        options.start_after_s = self.start_after;
        options.any_baud = self.any_baud;
        options.truth = self.drive.truth.clone();
        options.overwrite = self.drive.force;
        options.mirror_ppm = self.mirror_ppm;
        options.laser = LmsParams::of_type(Model::text_of_name(&self.lasers.laser_type));
        options.network_laser = self.lasers.types.network_laser.clone();
        options.laser.errors = self.lasers.laser_errors.clone();
        if self.lasers.old_firmware {
            options.laser.config_bytes = OLD_CONFIG_BYTES;
        }
        options.laser.baud = self.lasers.laser_baud.parse()?;
        options.laser.left_streaming = self.lasers.left_streaming;
        options.laser.boot_ns = (self.lasers.boot * 1e9) as i64;
        options.network_laser.boot_ns = options.laser.boot_ns;
        options.hokuyo = self.lasers.types.hokuyo.clone();
        options.hokuyo.boot_ns = options.laser.boot_ns;
        options.laser.power_on_message = self.lasers.power_on_message;
        options.base.identity.subclass.clone_from(&self.base_subclass);
        options.base.strict = self.strict_base;
        Ok(options)
    }
}

/// Where the lasers on a network are, which listen on free ports of this machine.
fn addresses(options: &ServeOptions) -> Vec<String> {
    let rig = match &options.source {
        Source::World { rig, .. } => Some(rig),
        Source::Capture { .. } => None,
    };
    let lasers = [
        ("lms-horizontal", rig.map(|rig| &rig.horizontal)),
        ("lms-vertical", rig.and_then(|rig| rig.vertical.as_ref())),
    ];
    let served = lasers.into_iter().filter_map(|(name, laser)| {
        let file = options.links.join(format!("{name}.address"));
        let address = std::fs::read_to_string(&file).ok()?;
        let unused = laser.and_then(Laser::address);
        let unused = unused.map_or_else(String::new, |of_rig| format!(", not at {of_rig} as in the rig"));
        Some(format!("{name} at {}{unused} ({})", address.trim(), file.display()))
    });
    served.collect()
}

fn laser_error(text: &str) -> Result<(u8, u8), String> {
    let parts =
        text.split_once(':').and_then(|(kind, number)| Some((kind.parse().ok()?, number.parse().ok()?)));
    parts
        .filter(|(kind, _)| (1..=4).contains(kind))
        .ok_or_else(|| "expected TYPE:NUMBER, TYPE 1 to 4".to_owned())
}

fn read_capture(path: &Path) -> anyhow::Result<Capture> {
    let capture = Capture::read(path)?;
    for (name, track) in [("horizontal", &capture.horizontal), ("vertical", &capture.vertical)] {
        if let Some(track) = track {
            eprintln!(
                "{name}: {} of {} ({} of other kinds, {} in no telegram)",
                counted(track.times_ns().len(), "scan"),
                counted(track.beams(), "value"),
                track.other_scans(),
                counted(track.skipped_bytes(), "byte")
            );
        }
    }
    if let Some(track) = &capture.base {
        eprintln!(
            "base: {} ({} in no packet)",
            counted(track.packets.len() + track.counts.len(), "odometry report"),
            counted(track.skipped_bytes, "byte")
        );
    }
    Ok(capture)
}

fn print_port(port: &PortReport) {
    let counts = &port.device;
    eprintln!(
        "{}: {} ({} cut off, {} skipped), {} sent ({} lost without a reader, {} touched by faults), \
         {} ({} refused, {} with a wrong checksum), {} of noise, {}",
        port.name,
        counted(counts.telegrams, "telegram"),
        counts.cut,
        counted(counts.skipped, "scan"),
        counted(counts.bytes_sent, "byte"),
        port.lost_bytes,
        port.faulted_bytes,
        counted(counts.requests, "request"),
        counts.refused,
        counts.bad_checksums,
        counted(counts.noise_bytes, "byte"),
        counted(counts.power_cycles, "power cycle")
    );
}
