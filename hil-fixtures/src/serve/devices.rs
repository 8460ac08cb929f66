//! The devices of a rig for each kind of source: a world driven through, or a capture played back.

use super::ahead::AheadSource;
use super::ahead_fan::ahead;
use super::truth::{NotingFeed, SentScans};
use super::{LinkName, ServeError, ServeOptions, Source};
use crate::capture::source::base_counts::CaptureCounts;
use crate::capture::source::base_feed::CapturePackets;
use crate::capture::source::base_track::BaseTrack;
use crate::capture::source::fan::cola::RecordedColaScans;
use crate::capture::source::fan::scip::RecordedScipScans;
use crate::capture::source::inertial_track::CapturedInertial;
use crate::capture::source::laser_feed::CaptureScans;
use crate::capture::source::laser_track::LaserTrack;
use crate::capture::source::{Capture, CapturedLaser};
use crate::devices::base::counters::{CountScale, CountsFeed, SourceCounts};
use crate::devices::base::feed::{CycleFeed, SipFeed};
use crate::devices::base::report::Identity;
use crate::devices::base::rflex::{RflexDevice, RflexParams};
use crate::devices::base::roboclaw::{RoboClawDevice, RoboClawParams};
use crate::devices::base::{BaseDevice, BaseParams};
use crate::devices::cola::ColaDevice;
use crate::devices::device::Device;
use crate::devices::inertial::feed::DrivenInertial;
use crate::devices::inertial::{XsensDevice, XsensParams};
use crate::devices::lms::scans::feed::{Mirror, MirrorFeed, ScanFeed, Timeline};
use crate::devices::lms::settings::Variant;
use crate::devices::lms::{LmsDevice, LmsParams};
use crate::devices::run::{Run, RunRules};
use crate::devices::scip::{ScipDevice, ScipLink, ScipParams};
use crate::rig::fan::{Fan, FanSource};
use crate::rig::inertial::{InertialParams, SimulatedInertial};
use crate::rig::simulated::{SimulatedLaser, SimulatedRig, base_from_laser};
use crate::rng::Rng;
use biplane_recording::rig::{Base, BaseProtocol, InertialUnit, Laser};
use std::sync::Arc;

const MS: i64 = 1_000_000;
const NS_PER_S: f64 = 1e9;

/// A packet of odometry each tenth of a second.
const SIP_CYCLE_NS: i64 = 100 * MS;

/// Between the last device's start and the drive's.
const WORLD_PAUSE_NS: i64 = 1_000 * MS;

/// Between the last device's start and the capture's: enough for every device to be ready for the first scan.
const CAPTURE_PAUSE_NS: i64 = 200 * MS;

/// A laser of a capture waits this long for the other devices: less than the second after which clients give
/// a laser up.
const CAPTURE_PATIENCE_NS: i64 = 600 * MS;

/// Requests may be held up by the scheduler of a busy machine; a real device allows 6 ms between bytes.
const REQUEST_GAP_NS: i64 = 25 * MS;

/// A device to be put on a line.
pub(super) struct Served {
    /// Name of its link.
    pub name: LinkName,
    /// The device.
    pub device: Box<dyn Device>,
    /// Whether it is on the network instead of a serial line.
    pub is_network: bool,
}

impl Served {
    fn serial(name: LinkName, device: impl Device + 'static) -> Self {
        Self { name, device: Box::new(device), is_network: false }
    }
}

/// The devices of a rig, ready to be put on lines.
pub(super) struct Devices {
    /// Devices by the names of their links.
    pub list: Vec<Served>,
    /// What they share.
    pub run: Run,
    /// Length of the drive or capture.
    pub length_ns: i64,
    /// The truth, when it is known.
    pub world: Option<WorldTruth>,
}

/// The truth behind a world's devices.
pub(super) struct WorldTruth {
    /// The world and the drive.
    pub rig: SimulatedRig,
    /// Scans that the horizontal laser sent.
    pub horizontal: SentScans,
    /// Scans that the vertical laser sent.
    pub vertical: SentScans,
}

impl Devices {
    /// Makes the devices that the options ask for.
    pub(super) fn new(options: &ServeOptions) -> Result<Self, ServeError> {
        match &options.source {
            Source::World { world, path, rig, params } => {
                let simulated = SimulatedRig::new(world, path, rig, params, options.seed)?;
                Ok(of_world(&simulated, options)?.behind_switches(options))
            }
            Source::Capture { capture } => Ok(of_capture(capture, options).behind_switches(options)),
        }
    }

    /// Every device with the power faults asked for.
    fn behind_switches(mut self, options: &ServeOptions) -> Self {
        let behind_switch = |(served, place): (Served, u64)| {
            let device = options.faults.power(served.device, place);
            Served { device, ..served }
        };
        self.list = self.list.into_iter().zip(0..).map(behind_switch).collect();
        self
    }
}

fn rules(options: &ServeOptions, lasers: usize, others: usize) -> RunRules {
    let of_world = matches!(options.source, Source::World { .. });
    RunRules {
        lasers,
        others,
        pause_ns: if of_world { WORLD_PAUSE_NS } else { CAPTURE_PAUSE_NS },
        patience_ns: (!of_world).then_some(CAPTURE_PATIENCE_NS),
        start_at_ns: options.start_after_s.map(|s| (s * NS_PER_S) as i64),
    }
}

/// Two mirrors are not coupled: each rig has its own phases, by its seed.
fn laser_params(options: &ServeOptions, place: u64) -> LmsParams {
    let mut params = options.faults.laser(options.laser.clone());
    let turn_ns = Mirror::TURN_NS;
    let phase_ns = (Rng::new(options.seed, 0x0EC0_4A5E, place.cast_signed()).unit() * turn_ns as f64) as i64;
    let ppm = usize::try_from(place).ok().and_then(|place| options.mirror_ppm.get(place));
    params.mirror = Mirror::of_ppm(phase_ns, ppm.copied().unwrap_or(0.0));
    params.request_gap_ns =
        params.request_gap_ns.max((REQUEST_GAP_NS as f64 * options.speed.max(1.0)) as i64);
    params
}

fn of_world(simulated: &SimulatedRig, options: &ServeOptions) -> Result<Devices, ServeError> {
    let vertical = simulated.vertical();
    let has_base = simulated.rig().base.is_present();
    let unit = simulated.rig().imu.clone().filter(InertialUnit::is_serial);
    let others = usize::from(has_base) + usize::from(unit.is_some());
    let run = Run::new(rules(options, 1 + usize::from(vertical.is_some()), others));
    let sent = [SentScans::default(), SentScans::default()];
    let mut list = Vec::new();
    let rig = simulated.rig();
    let lasers = [
        (LinkName::Horizontal, Some(simulated.horizontal()), Some(&rig.horizontal)),
        (LinkName::Vertical, vertical, rig.vertical.as_ref()),
    ];
    for (place, ((name, laser, of_rig), sent)) in (0..).zip(lasers.into_iter().zip(&sent)) {
        let Some((laser, of_rig)) = laser.zip(of_rig) else { continue };
        let refused = |source| ServeError::Refused { name, source };
        if of_rig.cola().is_some() {
            let device = network_laser(laser, &run, sent.clone(), options, place).map_err(refused)?;
            list.push(Served { name, device: Box::new(device), is_network: true });
            continue;
        }
        if of_rig.scip().is_some() {
            let params = hokuyo_params(of_rig, options, place);
            let measured = measured_fans(laser, &run, sent.clone()).map_err(refused)?;
            let is_network = params.link == ScipLink::Network;
            list.push(Served { name, device: Box::new(ScipDevice::new(params, measured)), is_network });
            continue;
        }
        let ahead = AheadSource::new(laser).map_err(refused)?;
        let feed = MirrorFeed::new(Box::new(ahead), Box::new(run.clone()));
        let feed = NotingFeed { feed, sent: sent.clone() };
        let feed = options.faults.feed(Box::new(feed), place);
        list.push(Served::serial(name, LmsDevice::new(laser_params(options, place), feed)));
    }
    if has_base {
        let device = base_of_world(simulated, &run, options);
        list.push(Served { name: LinkName::Base, device, is_network: false });
    }
    if let Some(unit) = unit {
        list.push(Served::serial(LinkName::Imu, unit_of_world(simulated, &unit, &run, options)));
    }
    let length_ns = (simulated.drive_duration_s() * NS_PER_S) as i64;
    let [horizontal, vertical] = sent;
    let world = Some(WorldTruth { rig: simulated.clone(), horizontal, vertical });
    Ok(Devices { list, run, length_ns, world })
}

/// A laser on the network that measures what the robot's laser sees, and notes when.
fn network_laser(
    laser: SimulatedLaser,
    run: &Run,
    sent: SentScans,
    options: &ServeOptions,
    place: u64,
) -> std::io::Result<ColaDevice> {
    let mut params = options.network_laser.clone();
    let turn_ns = params.turn_ns(&params.scan);
    let phase = Rng::new(options.seed, 0x0EC0_4A5E, place.cast_signed()).unit();
    params.phase_ns = (phase * turn_ns as f64) as i64;
    Ok(ColaDevice::new(params, measured_fans(laser, run, sent)?))
}

/// What the robot's laser sees, noted when it is asked for.
fn measured_fans(laser: SimulatedLaser, run: &Run, sent: SentScans) -> std::io::Result<FanSource> {
    let run = run.clone();
    let mut measured = ahead(Box::new(move |fan| {
        laser.measure_fan(&Fan { first_beam_ns: run.world_ns(fan.first_beam_ns), ..*fan })
    }))?;
    Ok(Box::new(move |fan| {
        sent.note(fan.first_beam_ns);
        measured(fan)
    }))
}

/// A Hokuyo laser on the line that the rig has it on.
fn hokuyo_params(of_rig: &Laser, options: &ServeOptions, place: u64) -> ScipParams {
    let mut params = options.hokuyo.clone();
    params.link = match (of_rig.address(), params.link) {
        (Some(_), _) => ScipLink::Network,
        (None, ScipLink::Network) => ScipLink::Usb,
        (None, link) => link,
    };
    let phase = Rng::new(options.seed, 0x0EC0_4A5E, place.cast_signed()).unit();
    params.phase_ns = (phase * params.turn_ns() as f64) as i64;
    params
}

/// The base that the rig's protocol asks for.
fn base_of_world(simulated: &SimulatedRig, run: &Run, options: &ServeOptions) -> Box<dyn Device> {
    let base = &simulated.rig().base;
    let (source, timeline) = (Box::new(simulated.base()), Box::new(run.clone()));
    match CountScale::of(&base.protocol) {
        Some(scale) => counting_base(base, Box::new(SourceCounts::new(source, timeline, scale)), options),
        None => {
            let feed = CycleFeed::new(source, timeline, SIP_CYCLE_NS);
            Box::new(BaseDevice::new(options.faults.base(options.base.clone()), Box::new(feed)))
        }
    }
}

/// The inertial unit on the robot.
fn unit_of_world(
    simulated: &SimulatedRig,
    unit: &InertialUnit,
    run: &Run,
    options: &ServeOptions,
) -> XsensDevice {
    let (rig, mount) = (simulated.clone(), base_from_laser(&unit.mount));
    let map_from_unit = move |time_ns: i64| rig.map_from_base(time_ns).then(&mount);
    let errors = match &options.source {
        Source::World { params, .. } => params.inertial,
        Source::Capture { .. } => InertialParams::default(),
    };
    let source = SimulatedInertial::new(map_from_unit, errors, options.seed);
    let feed = DrivenInertial::new(source, Box::new(run.clone()));
    let params = XsensParams { baud: unit.baud, ..XsensParams::default() };
    XsensDevice::new(options.faults.inertial(params), Box::new(feed))
}

/// A base that reports counts.
fn counting_base(base: &Base, feed: Box<dyn CountsFeed>, options: &ServeOptions) -> Box<dyn Device> {
    let boot_ns = options.base.boot_ns;
    match base.protocol {
        BaseProtocol::RoboClaw { address, .. } => {
            let params = RoboClawParams { address, baud: base.baud, boot_ns, ..RoboClawParams::default() };
            Box::new(RoboClawDevice::new(params, feed))
        }
        _ => {
            let left_open = options.faults.base(options.base.clone()).left_open;
            // The scheduler of a busy machine may deliver two commands at once.
            let silence_ns = 0;
            let params =
                RflexParams { baud: base.baud, boot_ns, left_open, silence_ns, ..RflexParams::default() };
            Box::new(RflexDevice::new(params, feed))
        }
    }
}

fn of_capture(capture: &Capture, options: &ServeOptions) -> Devices {
    let lasers = [(LinkName::Horizontal, &capture.horizontal), (LinkName::Vertical, &capture.vertical)];
    let present = lasers.iter().filter(|(_, track)| track.is_some()).count();
    let others = usize::from(capture.base.is_some()) + usize::from(capture.inertial.is_some());
    let run = Run::new(rules(options, present, others));
    let origin_ns = capture.first_ns().unwrap_or(0);
    let mut list = Vec::new();
    for (place, (name, laser)) in (0..).zip(lasers) {
        let Some(laser) = laser else { continue };
        let of_rig = capture.rig.as_ref().and_then(|rig| match name {
            LinkName::Horizontal => Some(&rig.horizontal),
            _ => rig.vertical.as_ref(),
        });
        list.push(captured_laser(name, place, laser, of_rig, (origin_ns, &run), options));
    }
    if let Some(track) = &capture.base {
        let device = base_of_capture(capture, track, origin_ns, &run, options);
        list.push(Served { name: LinkName::Base, device, is_network: false });
    }
    if let Some(track) = &capture.inertial {
        let baud = capture
            .rig
            .as_ref()
            .and_then(|rig| rig.imu.as_ref())
            .map_or(XsensParams::default().baud, |unit| unit.baud);
        let feed = CapturedInertial::new(Arc::new(track.clone()), origin_ns, run.clone(), options.once);
        let params = XsensParams { baud, ..XsensParams::default() };
        let device = XsensDevice::new(options.faults.inertial(params), Box::new(feed));
        list.push(Served::serial(LinkName::Imu, device));
    }
    Devices { list, run, length_ns: capture.duration_ns(), world: None }
}

/// A laser that was recorded, on the line that it was on.
fn captured_laser(
    name: LinkName,
    place: u64,
    laser: &CapturedLaser,
    of_rig: Option<&Laser>,
    (origin_ns, run): (i64, &Run),
    options: &ServeOptions,
) -> Served {
    let (run, once) = (run.clone(), options.once);
    match laser {
        CapturedLaser::Lms(track) => {
            let params = captured_params(track, laser_params(options, place));
            let feed = CaptureScans::new(Arc::new(track.clone()), origin_ns, run, once);
            let feed = options.faults.feed(Box::new(feed) as Box<dyn ScanFeed>, place);
            Served::serial(name, LmsDevice::new(params, feed))
        }
        CapturedLaser::Cola(track) => {
            let params = track.params(&options.network_laser);
            let scans = RecordedColaScans::new(Arc::new(track.clone()), origin_ns, run, once);
            let device = Box::new(ColaDevice::of_scans(params, Box::new(scans)));
            Served { name, device, is_network: true }
        }
        CapturedLaser::Scip(track) => {
            let is_network = of_rig.is_some_and(|laser| laser.address().is_some());
            let baud = of_rig.map_or(0, |laser| laser.baud);
            let params = track.params(options.hokuyo.clone(), is_network, baud);
            let scans = RecordedScipScans::new(Arc::new(track.clone()), origin_ns, run, once);
            let device = Box::new(ScipDevice::of_scans(params, Box::new(scans)));
            Served { name, device, is_network }
        }
    }
}

/// The base that was recorded.
fn base_of_capture(
    capture: &Capture,
    track: &BaseTrack,
    origin_ns: i64,
    run: &Run,
    options: &ServeOptions,
) -> Box<dyn Device> {
    let track = Arc::new(track.clone());
    let base = capture.rig.as_ref().map_or_else(Base::default, |rig| rig.base.clone());
    if CountScale::of(&base.protocol).is_some() {
        let feed = CaptureCounts::new(track, origin_ns, run.clone(), options.once);
        return counting_base(&base, Box::new(feed), options);
    }
    let identity = track.identity.clone().map(|[name, class, subclass]| Identity { name, class, subclass });
    let params = BaseParams {
        identity: identity.unwrap_or_else(|| options.base.identity.clone()),
        ..options.faults.base(options.base.clone())
    };
    let feed = CapturePackets::new(track, origin_ns, run.clone(), options.once);
    Box::new(BaseDevice::new(params, Box::new(feed) as Box<dyn SipFeed>))
}

/// A laser that was recorded comes up as it was: its variant, its units, its name.
fn captured_params(track: &LaserTrack, mut params: LmsParams) -> LmsParams {
    params.variant = track.variant().unwrap_or(Variant::of(180, 50));
    params.config = track.initial_config();
    if let Some(type_text) = &track.type_text {
        params.type_text.clone_from(type_text);
    }
    params
}
