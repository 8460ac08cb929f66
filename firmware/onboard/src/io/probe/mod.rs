//! `probe`: asks each device of a rig what it is and how it is set, and changes nothing but a running output,
//! which it stops.

pub(crate) mod device_report;
pub(crate) mod hokuyo_report;
pub(crate) mod laser_report;
pub(crate) mod network_laser_report;

use std::io;
use std::thread;

use biplane_recording::rig::{ColaLaser, Laser};
use biplane_recording::{Port, Rig};

use crate::io::line::OpenLine;
use crate::io::line::open_error::reason;
use crate::io::port_check;
use crate::io::port_check::NeededPort;
use crate::io::probe::device_report::DeviceReport;
use crate::session::base::{BaseSession, BaseSettings};
use crate::session::cola::ColaSession;
use crate::session::cola::settings::ColaSettings;
use crate::session::device_session::{Input, MAX_INPUT_BYTES, Output, Session};
use crate::session::event::Event;
use crate::session::inertial::InertialSession;
use crate::session::lms::LaserSession;
use crate::session::lms::setup::settings::LaserSettings;
use crate::session::scip::ScipSession;
use crate::session::scip::settings::ScipSettings;
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
/// When the rig names one port twice, or has not what is wanted.
pub fn probe(rig: &Rig, wanted: &[Port]) -> Result<Vec<DeviceReport>, OnboardError> {
    port_check::check(rig)?;
    let mut devices = port_check::of_rig(rig);
    if let Some(missing) = wanted.iter().find(|wanted| !devices.iter().any(|port| port.device == **wanted)) {
        return Err(OnboardError::NotInRig {
            device: device_name(*missing),
            why: why_not_asked(rig, *missing),
        });
    }
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

/// Why a device that was named is on no port of the rig.
fn why_not_asked(rig: &Rig, device: Port) -> &'static str {
    match device {
        Port::Imu if rig.imu.is_some() => {
            "its samples come with the base's or from a bag, and not from a port of its own"
        }
        Port::Imu => "the rig has no [imu]",
        Port::Base => "the rig has protocol = \"none\" in [base]",
        Port::Vertical => "the rig has no [vertical]",
        Port::Horizontal => "the rig has no [horizontal]",
    }
}

/// What a device's thread says, or what was asked without one.
fn report(
    device: Port,
    asked: Result<thread::ScopedJoinHandle<'_, DeviceReport>, DeviceReport>,
) -> DeviceReport {
    let nothing = || DeviceReport { device: device_name(device), ..DeviceReport::default() };
    asked.map_or_else(|report| report, |thread| thread.join().unwrap_or_else(|_| nothing()))
}

fn ask(rig: &Rig, needed: NeededPort<'_>) -> DeviceReport {
    let NeededPort { device, path, baud } = needed;
    let nothing = DeviceReport {
        device: device_name(device),
        port: path.to_owned(),
        baud_configured: baud.unwrap_or_default(),
        ..DeviceReport::default()
    };
    let result = needed.open().and_then(|port| match device {
        Port::Base => ask_base(rig, &port, &nothing),
        Port::Imu => ask_inertial(rig, &port, &nothing),
        Port::Horizontal => ask_laser(&rig.horizontal, &port, &nothing),
        Port::Vertical => ask_laser(rig.vertical.as_ref().unwrap_or(&rig.horizontal), &port, &nothing),
    });
    result.unwrap_or_else(|error| DeviceReport { problem: Some(reason(&error)), ..nothing })
}

fn ask_laser(laser: &Laser, port: &OpenLine, nothing: &DeviceReport) -> io::Result<DeviceReport> {
    if let Some(cola) = laser.cola() {
        return ask_network_laser(cola, port, nothing);
    }
    if laser.scip().is_some() {
        return ask_hokuyo(laser, port, nothing);
    }
    let settings = LaserSettings::from(laser);
    let mut session = LaserSession::probing(settings, biplane_clock::monotonic_ns());
    if converse(&mut session, port)? != Talk::Done {
        return Ok(no_answer(nothing));
    }
    Ok(laser_report::report(session.info(), &settings, nothing))
}

/// A laser that does not answer in one dialect is asked in the other one, on a new connection.
fn ask_network_laser(cola: &ColaLaser, port: &OpenLine, nothing: &DeviceReport) -> io::Result<DeviceReport> {
    let settings = ColaSettings::from(cola);
    let mut session = ColaSession::probing(settings, biplane_clock::monotonic_ns());
    let mut again = None;
    loop {
        match converse(&mut session, again.as_ref().unwrap_or(port))? {
            Talk::Done => return Ok(network_laser_report::report(session.info(), &settings, nothing)),
            Talk::NoAnswer => return Ok(no_answer(nothing)),
            Talk::Reconnect => {
                port.hang_up();
                again = Some(OpenLine::network(&cola.address)?);
                session.handle(biplane_clock::monotonic_ns(), Input::PortBack);
            }
        }
    }
}

/// A laser whose connection was half open is asked on a new one.
fn ask_hokuyo(laser: &Laser, port: &OpenLine, nothing: &DeviceReport) -> io::Result<DeviceReport> {
    let settings = ScipSettings::from(laser);
    let mut session = ScipSession::probing(settings, biplane_clock::monotonic_ns());
    let mut again = None;
    loop {
        match (converse(&mut session, again.as_ref().unwrap_or(port))?, laser.address()) {
            (Talk::Done, _) => return Ok(hokuyo_report::report(session.info(), &settings, nothing)),
            (Talk::Reconnect, Some(address)) => {
                port.hang_up();
                again = Some(OpenLine::network(address)?);
                session.handle(biplane_clock::monotonic_ns(), Input::PortBack);
            }
            _ => return Ok(no_answer(nothing)),
        }
    }
}

fn ask_base(rig: &Rig, port: &OpenLine, nothing: &DeviceReport) -> io::Result<DeviceReport> {
    let mut session = BaseSession::probing(BaseSettings::from(&rig.base), biplane_clock::monotonic_ns());
    if converse(&mut session, port)? != Talk::Done {
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

fn ask_inertial(rig: &Rig, port: &OpenLine, nothing: &DeviceReport) -> io::Result<DeviceReport> {
    let unit = rig.imu.clone().unwrap_or_default();
    let mut session = InertialSession::probing(&unit, biplane_clock::monotonic_ns());
    if converse(&mut session, port)? != Talk::Done {
        return Ok(no_answer(nothing));
    }
    let info = session.info();
    Ok(DeviceReport {
        answered: true,
        baud_found: Some(unit.baud),
        kind: Some(info.class.to_string()),
        fault: info.has_fault,
        ..nothing.clone()
    })
}

fn no_answer(nothing: &DeviceReport) -> DeviceReport {
    DeviceReport { problem: Some("no answer".to_owned()), ..nothing.clone() }
}

/// How a talk ended.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum Talk {
    /// The session has what it wanted.
    Done,
    /// The device does not answer.
    NoAnswer,
    /// The session needs a new connection.
    Reconnect,
}

/// Lets a session talk until it is done.
fn converse(session: &mut dyn Session, port: &OpenLine) -> io::Result<Talk> {
    let start_ns = biplane_clock::monotonic_ns();
    loop {
        if let Some(end) = serve(session, port)? {
            return Ok(end);
        }
        let now_ns = biplane_clock::monotonic_ns();
        if session.is_done() {
            return Ok(Talk::Done);
        }
        if now_ns - start_ns > LIMIT_NS {
            return Ok(Talk::NoAnswer);
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

/// Does what the session wants done; how the talk ended, if it did.
fn serve(session: &mut dyn Session, port: &OpenLine) -> io::Result<Option<Talk>> {
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
            Output::Event(Event::NotFound { rounds }) if rounds >= ROUNDS => return Ok(Some(Talk::NoAnswer)),
            Output::Reconnect => return Ok(Some(Talk::Reconnect)),
            Output::Event(_)
            | Output::Scan(_)
            | Output::TimedScan
            | Output::Odometry(_)
            | Output::Inertial(_) => {}
            Output::WaitUntil(_) => return Ok(None),
        }
    }
}
