//! `probe`: asks each device of a rig what it is and how it is set, and changes nothing but a running output,
//! which it stops.

pub(crate) mod device_report;
pub(crate) mod laser_report;

use std::io;
use std::path::Path;
use std::thread;

use biplane_recording::{Port, Rig};

use crate::io::open_error::reason;
use crate::io::port_check;
use crate::io::port_check::NeededPort;
use crate::io::probe::device_report::DeviceReport;
use crate::io::tty::Tty;
use crate::session::base::{BaseSession, BaseSettings};
use crate::session::device_session::{Input, MAX_INPUT_BYTES, Output, Session};
use crate::session::event::Event;
use crate::session::lms::LaserSession;
use crate::session::lms::setup::settings::LaserSettings;
use crate::types::device_name::device_name;
use crate::types::error::OnboardError;

/// A device that has not answered in so many rounds over all rates is not there.
const ROUNDS: u32 = 2;
/// Whatever happens, a device is left alone after so long, nanoseconds.
const LIMIT_NS: i64 = 20_000_000_000;
/// Without bytes, the session is asked again after so long, nanoseconds.
const READ_TIMEOUT_NS: i64 = 50_000_000;

/// Asks devices of a rig, all at once; in the rig's order. Those that are `wanted`, or every one when none is
/// named.
///
/// # Errors
/// When the rig names one port twice, or a base that cannot be talked to.
pub fn probe(rig: &Rig, wanted: &[Port]) -> Result<Vec<DeviceReport>, OnboardError> {
    port_check::check(rig)?;
    let mut devices = port_check::of_rig(rig);
    devices.retain(|port| wanted.is_empty() || wanted.contains(&port.device));
    Ok(thread::scope(|scope| {
        // A thread that is refused: its device is asked here and now.
        let asked: Vec<_> = devices
            .iter()
            .map(|&port| {
                let started = thread::Builder::new().spawn_scoped(scope, move || ask(rig, port));
                (port.device, started.map_err(|_refused| ask(rig, port)))
            })
            .collect();
        asked.into_iter().map(|(device, asked)| report(device, asked)).collect()
    }))
}

/// What a device's thread says, or what was asked without one.
fn report(
    device: Port,
    asked: Result<thread::ScopedJoinHandle<'_, DeviceReport>, DeviceReport>,
) -> DeviceReport {
    let nothing = || DeviceReport { device: device_name(device), ..DeviceReport::default() };
    asked.map_or_else(|report| report, |thread| thread.join().unwrap_or_else(|_| nothing()))
}

fn ask(rig: &Rig, NeededPort { device, path, baud }: NeededPort<'_>) -> DeviceReport {
    let nothing = DeviceReport {
        device: device_name(device),
        port: path.to_owned(),
        baud_configured: baud,
        ..DeviceReport::default()
    };
    let result = Tty::open(Path::new(path), baud).and_then(|port| match device {
        Port::Base => ask_base(rig, &port, &nothing),
        Port::Horizontal => ask_laser(&rig.horizontal, &port, &nothing),
        Port::Vertical => ask_laser(rig.vertical.as_ref().unwrap_or(&rig.horizontal), &port, &nothing),
    });
    result.unwrap_or_else(|error| DeviceReport { problem: Some(reason(&error)), ..nothing })
}

fn ask_laser(
    laser: &biplane_recording::rig::Laser,
    port: &Tty,
    nothing: &DeviceReport,
) -> io::Result<DeviceReport> {
    let settings = LaserSettings::from(laser);
    let mut session = LaserSession::probing(settings, biplane_clock::monotonic_ns());
    if !converse(&mut session, port)? {
        return Ok(no_answer(nothing));
    }
    Ok(laser_report::report(session.info(), &settings, nothing))
}

fn ask_base(rig: &Rig, port: &Tty, nothing: &DeviceReport) -> io::Result<DeviceReport> {
    let mut session = BaseSession::probing(BaseSettings::from(&rig.base), biplane_clock::monotonic_ns());
    if !converse(&mut session, port)? {
        return Ok(no_answer(nothing));
    }
    let info = session.info();
    Ok(DeviceReport {
        answered: true,
        baud_found: Some(rig.base.baud),
        kind: Some(format!("{} {}", info.class, info.subclass).trim_end().to_owned()),
        firmware: Some(info.name.to_string()).filter(|text| !text.is_empty()),
        fault: info.has_fault,
        ..nothing.clone()
    })
}

fn no_answer(nothing: &DeviceReport) -> DeviceReport {
    DeviceReport { problem: Some("no answer".to_owned()), ..nothing.clone() }
}

/// Lets a session talk until it is done; false when the device does not answer.
fn converse(session: &mut dyn Session, port: &Tty) -> io::Result<bool> {
    let start_ns = biplane_clock::monotonic_ns();
    loop {
        if !serve(session, port)? {
            return Ok(false);
        }
        let now_ns = biplane_clock::monotonic_ns();
        if session.is_done() {
            return Ok(true);
        }
        if now_ns - start_ns > LIMIT_NS {
            return Ok(false);
        }
        let mut bytes = [0; MAX_INPUT_BYTES];
        match port.read(&mut bytes, READ_TIMEOUT_NS)? {
            Some(count) => {
                let read_ns = biplane_clock::monotonic_ns();
                session.handle(read_ns, Input::Bytes(bytes.get(..count).unwrap_or_default()));
            }
            None => session.handle(biplane_clock::monotonic_ns(), Input::Time),
        }
    }
}

/// Does what the session wants done; false when it has looked everywhere in vain.
fn serve(session: &mut dyn Session, port: &Tty) -> io::Result<bool> {
    loop {
        match session.poll() {
            Output::Write(bytes) => port.write_all(&bytes)?,
            Output::SetBaud(baud) => match port.set_baud(baud) {
                Err(error) if error.kind() == io::ErrorKind::Unsupported => {
                    session.handle(biplane_clock::monotonic_ns(), Input::RateRefused(baud));
                }
                result => result?,
            },
            Output::Event(event @ Event::RateRefused { .. }) => tracing::warn!("{event}"),
            Output::Event(Event::NotFound { rounds }) if rounds >= ROUNDS => return Ok(false),
            Output::Event(_) | Output::Scan(_) | Output::Odometry(_) => {}
            Output::WaitUntil(_) => return Ok(true),
        }
    }
}
