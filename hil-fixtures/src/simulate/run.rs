//! From a world and a rig to the capture and its truth.

use super::devices::{LaserRun, record_base, record_laser};
use super::fan_laser::record_fan_laser;
use super::inertial::{record_inertial, record_inertial_line};
use super::options::START_UTC_NS;
use super::times::Times;
use super::{SimulateError, SimulateOptions, SimulateReport};
use crate::capture::file::{About, InertialReads, write_capture};
use crate::faults::Place;
use crate::rig::simulated::{LaserRole, SimulatedLaser, SimulatedRig, variant_of};
use crate::simulate::truth::Truth;
use crate::simulate::truth_folder::{prepare, truth_files};
use crate::world::World;
use crate::world::path::Path as DrivePath;
use biplane_ifc::Plan;
use biplane_recording::mcap::write::check_outputs;
use biplane_recording::rig::Laser;
use biplane_recording::{Rig, WriteError};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Simulates and writes the files.
pub fn run(options: &SimulateOptions) -> Result<SimulateReport, SimulateError> {
    check_files(options)?;
    options.faults.check(Place::Simulate)?;
    let world = World::open_storey(&options.world, &options.storey)?;
    let (path, plan) = drive_path(&world, options)?;
    let rig = match &options.rig {
        Some(file) => Rig::load(file)?,
        None => Rig::default(),
    };
    check(&rig, options)?;
    let simulated = SimulatedRig::new(&world, &path, &rig, &options.params, options.seed)?;
    if let Some(directory) = &options.truth {
        prepare(directory, options.overwrite)?;
    }
    let times = Times::plan(&simulated, options);
    simulated.start_drive_at(times.drive_ns);
    let mut report = SimulateReport {
        duration_s: times.end_ns as f64 * 1e-9,
        driven_m: simulated.drive().length_m(),
        rooms: plan.as_ref().and_then(rooms_entered),
        ..SimulateReport::default()
    };

    let horizontal = record_any_laser(&simulated.horizontal(), &rig.horizontal, &times, options)?;
    report.scans_horizontal = horizontal.first_beams_ns.len();
    let vertical = match (simulated.vertical(), &rig.vertical) {
        (Some(laser), Some(settings)) => Some(record_any_laser(&laser, settings, &times, options)?),
        _ => None,
    };
    let mut lines = horizontal.lines;
    if let Some(vertical) = &vertical {
        report.scans_vertical = vertical.first_beams_ns.len();
        report.echoes_vertical = vertical.echoes;
        lines.extend(vertical.lines.clone());
    }
    if rig.base.is_present() {
        let base = record_base(&simulated, &times, options)?;
        report.odometry = base.reports;
        lines.extend(base.lines);
    }
    let mut inertial = InertialReads::new();
    match &rig.imu {
        Some(unit) if unit.is_serial() => {
            let (line, samples) = record_inertial_line(&simulated, unit, &times, options)?;
            report.inertial = samples;
            lines.push(line);
        }
        Some(unit) => {
            inertial = record_inertial(&simulated, unit, &times, options);
            report.inertial = inertial.len();
        }
        None => {}
    }
    report.serial_bytes = lines.iter().flat_map(|line| &line.reads).map(|read| read.bytes.len() as u64).sum();

    let about = about(options, &world, &path);
    let mut clock = options.faults.host_clock(START_UTC_NS);
    write_capture(&options.output, options.overwrite, &rig, &about, (&lines, inertial), &mut clock)?;
    if let Some(directory) = &options.truth {
        let truth = Truth::new(&simulated, directory, START_UTC_NS);
        truth.scans(LaserRole::Horizontal, &horizontal.first_beams_ns)?;
        if let Some(vertical) = &vertical {
            truth.scans(LaserRole::Vertical, &vertical.first_beams_ns)?;
        }
        truth.trajectory(0, times.end_ns)?;
        truth.surfaces()?;
        match plan {
            Some(plan) => truth.plan(&plan)?,
            None => truth.round_things(&world.rounds)?,
        }
    }
    Ok(report)
}

fn record_any_laser(
    source: &SimulatedLaser,
    laser: &Laser,
    times: &Times,
    options: &SimulateOptions,
) -> Result<LaserRun, SimulateError> {
    match record_fan_laser(source, laser, times, options)? {
        Some(run) => Ok(run),
        None => record_laser(source, laser, times, options),
    }
}

/// World, path and rig may be files that are read; capture and truth are written.
fn check_files(options: &SimulateOptions) -> Result<(), WriteError> {
    let read = [Some(options.world.as_ref()), options.path.as_deref().map(Path::new), options.rig.as_deref()];
    let read: Vec<PathBuf> = read.into_iter().flatten().map(Path::to_owned).collect();
    let truth = options.truth.as_deref().map(truth_files).unwrap_or_default();
    let written: Vec<&Path> = std::iter::once(&options.output).chain(&truth).map(PathBuf::as_path).collect();
    check_outputs(&written, &read, options.overwrite)
}

/// How many rooms of a plan the drive enters, and of how many, where that is known.
fn rooms_entered(plan: &Plan) -> Option<[usize; 2]> {
    let entered: Vec<bool> = plan.rooms.iter().filter_map(|room| room.entered).collect();
    (!entered.is_empty()).then(|| [entered.iter().filter(|entered| **entered).count(), entered.len()])
}

/// The path, and the true plan of the world where it is known, with the rooms that the path enters.
fn drive_path(world: &World, options: &SimulateOptions) -> Result<(DrivePath, Option<Plan>), SimulateError> {
    let (mut path, plan) = match (&options.path, &world.plan) {
        (None, Some(_)) => world.planned(options.seed).map(|(path, plan)| (path, Some(plan)))?,
        _ => (world.path_or_file(options.path.as_deref())?, world.plan.clone()),
    };
    if let Some(speed_m_s) = options.speed_m_s {
        path.speed_m_s = speed_m_s;
    }
    Ok((path, plan))
}

fn check(rig: &Rig, options: &SimulateOptions) -> Result<(), SimulateError> {
    for laser in [Some(&rig.horizontal), rig.vertical.as_ref()].into_iter().flatten() {
        if !laser.is_lms2xx() {
            options.faults.check_fan_laser()?;
            continue;
        }
        if variant_of(laser).is_none() {
            let found = format!("{} ({} degrees)", laser.resolution_deg, laser.fov_deg);
            let expected = "100 degrees in steps of 0.25, 0.5 or 1 and 180 degrees in steps of 0.5 or 1 can";
            return Err(SimulateError::Unsupported { what: "resolution_deg", found, expected });
        }
    }
    if !(0.0..=3600.0).contains(&options.stand_s) {
        let expected = "0 to 3600 seconds";
        return Err(SimulateError::BadNumber { what: "stand_s", found: options.stand_s, expected });
    }
    Ok(())
}

fn about(options: &SimulateOptions, world: &World, path: &DrivePath) -> About {
    let values = [
        ("program", concat!("biplane-mock ", env!("CARGO_PKG_VERSION"), " simulate").to_owned()),
        ("world", world.name.clone()),
        ("path", path.name.clone()),
        ("seed", options.seed.to_string()),
        ("origin", "synthetic".to_owned()),
    ];
    let values = values.into_iter().map(|(key, value)| (key.to_owned(), value)).collect::<BTreeMap<_, _>>();
    About { name: "biplane-mock".to_owned(), values }
}
