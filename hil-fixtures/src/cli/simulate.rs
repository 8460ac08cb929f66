//! `simulate`: a drive through a known world, as a capture with its truth.

use super::fan_lasers::FanLaserTypes;
use super::{BadArgument, MirrorPpm};
use crate::faults::{Faults, Preset};
use crate::line::ReadParams;
use crate::simulate::{LaserOptions, SimulateError, SimulateOptions, run};
use crate::world::WorldError;
use crate::world::ifc::StoreyChoice;
use biplane_cli::counted;
use std::path::PathBuf;

/// Drive a rig through a known world: the serial bytes that its devices would send, and the truth.
///
/// The truth folder gets surfaces.ply (a plane label per face), trajectory.tum (dense), poses.tum
/// and scans_horizontal.txt (at each scan's first beam) and the vertical laser's. The same options
/// and seed give byte-identical files.
///
/// The truth of an IFC file is also in truth.json: rooms, walls, doors and windows.
///
/// A laser with protocol = "cola" or "scip" in the rig is the one of --network-laser or --hokuyo, set
/// as the rig asks.
///
/// Example: biplane-mock simulate --world corridor --seed 1 -o corridor.mcap --truth truth
///
/// Example: biplane-mock simulate --world house.ifc --doors open -o house.mcap --truth truth
///
/// Example: biplane-mock simulate --world office --rig ust20lx.toml -o office.mcap
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(super) struct Simulate {
    #[command(flatten)]
    drive: Drive,
    /// Seed of all noise and phases.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Capture to write.
    #[arg(short, long, value_name = "C.mcap")]
    output: PathBuf,
    /// Folder for the truth.
    #[arg(long, value_name = "DIR")]
    truth: Option<PathBuf>,
    /// Replace an existing capture and an existing truth.
    #[arg(long, visible_alias = "overwrite")]
    force: bool,
    /// Begin with what the devices answer while they are set up.
    #[arg(long)]
    start_up: bool,
    /// Standing still before and after the drive, seconds.
    #[arg(long, value_name = "S", default_value_t = 0.5, value_parser = super::zero_or_more)]
    stand: f64,
    /// Fault; may be given several times: bit-noise, loose-connector, usb-stall, dazzle, window-dirty,
    /// clock-step.
    #[arg(long = "fault", value_name = "PRESET")]
    faults: Vec<Preset>,
    #[command(flatten)]
    reads: Reads,
    /// Millionths by which the mirrors turn too slowly: P for both lasers or H,V.
    #[arg(long, value_name = "P|H,V", default_value = "0", value_parser = super::mirror_ppm, allow_hyphen_values = true)]
    mirror_ppm: MirrorPpm,
    #[command(flatten)]
    types: FanLaserTypes,
}

/// How doors stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Doors {
    /// All of them are there.
    Closed,
    /// None of them is there.
    Open,
}

/// What drives where.
#[derive(Debug, clap::Args)]
struct Drive {
    /// World: a built-in name, or an OBJ, PLY or IFC file. Built in are corridor, building, office, ramp-up,
    /// ramp-level, ramp-down, ramp-curved, sill, decks, hall, street and pillars. An IFC file needs no path:
    /// the drive leads through all rooms that the robot reaches, and the seed varies it.
    #[arg(long, value_name = "W")]
    world: String,
    /// Storey of an IFC file, counted from 0 at the lowest.
    #[arg(long, value_name = "N", default_value_t = 0)]
    storey: usize,
    /// Doors of an IFC file: closed as they are drawn, or open (taken out).
    #[arg(long, value_enum, default_value_t = Doors::Closed)]
    doors: Doors,
    /// Path through it: a built-in name or a .toml file; the usual one when left out.
    #[arg(long, value_name = "P")]
    path: Option<String>,
    /// Cruising speed instead of the path's, m/s.
    #[arg(long, value_name = "M/S", value_parser = super::above_zero)]
    cruise: Option<f64>,
    /// Rig: mounts, rates, variants; the template when left out.
    #[arg(long, value_name = "rig.toml")]
    rig: Option<PathBuf>,
}

/// How the bytes reach the computer.
#[derive(Debug, clap::Args)]
struct Reads {
    /// Most bytes that a read returns; more make a smaller file.
    #[arg(long, value_name = "N", default_value_t = 32)]
    read_bytes: usize,
    /// Latency timer of the USB adapters in milliseconds (16 on an FTDI as delivered): bytes wait until 62
    /// have come or the timer has run.
    #[arg(long, value_name = "MS", default_value_t = 0.0, value_parser = super::zero_or_more)]
    latency_timer_ms: f64,
    /// Share of the reads that come up to 8 ms late.
    #[arg(long, value_name = "P", default_value_t = ReadParams::default().hiccup_share, value_parser = super::share)]
    hiccup_share: f64,
}

impl Simulate {
    /// Simulates and says what came of it.
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let options = SimulateOptions {
            world: self.drive.world.clone(),
            storey: StoreyChoice { index: self.drive.storey, doors_open: self.drive.doors == Doors::Open },
            path: self.drive.path.clone(),
            speed_m_s: self.drive.cruise,
            rig: self.drive.rig.clone(),
            seed: self.seed,
            output: self.output.clone(),
            truth: self.truth.clone(),
            overwrite: self.force,
            start_up: self.start_up,
            stand_s: self.stand,
            reads: ReadParams {
                max_bytes: self.reads.read_bytes.max(1),
                timer_ms: self.reads.latency_timer_ms,
                hiccup_share: self.reads.hiccup_share,
                ..ReadParams::default()
            },
            lasers: LaserOptions {
                mirror_ppm: self.mirror_ppm,
                network_laser: self.types.network_laser.clone(),
                hokuyo: self.types.hokuyo.clone(),
            },
            faults: Faults::new(&self.faults, self.seed),
            ..SimulateOptions::default()
        };
        let report = run(&options).map_err(argument)?;
        eprintln!(
            "{}: {:.1} s, {:.1} m driven, {} horizontal and {}, {}, {}",
            self.output.display(),
            report.duration_s,
            report.driven_m,
            report.scans_horizontal,
            counted(report.scans_vertical, "vertical scan"),
            counted(report.odometry, "odometry packet"),
            counted(report.serial_bytes, "serial byte")
        );
        if let Some([entered, all]) = report.rooms {
            let doors_are_shut = entered < all && self.drive.doors == Doors::Closed;
            let hint = if doors_are_shut { "; --doors open takes the doors out" } else { "" };
            eprintln!(
                "{}: the drive enters {entered} of {}{hint}",
                self.output.display(),
                counted(all, "room")
            );
        }
        Ok(())
    }
}

fn argument(error: SimulateError) -> anyhow::Error {
    match &error {
        SimulateError::World(
            WorldError::Unknown { .. }
            | WorldError::UnknownPath { .. }
            | WorldError::NoPath { .. }
            | WorldError::NoStoreys { .. },
        )
        | SimulateError::Fault(_)
        | SimulateError::BadNumber { .. } => BadArgument(error.to_string()).into(),
        _ => error.into(),
    }
}
