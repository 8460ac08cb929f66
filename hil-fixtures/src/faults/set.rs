//! The faults of one run: which presets, their numbers and the seed, and what they make of a rig's parts.

use super::clock_step::{ClockStepParams, HostClock};
use super::{ActsOn, Misplaced, Place, Preset};
use crate::devices::base::BaseParams;
use crate::devices::device::Device;
use crate::devices::inertial::XsensParams;
use crate::devices::lms::LmsParams;
use crate::devices::lms::scans::feed::ScanFeed;
use crate::faults::device::dazzle::{Dazzle, DazzleParams};
use crate::faults::device::left_streaming::LeftStreamingParams;
use crate::faults::device::power_cycle::{PowerCycle, PowerCycleParams};
use crate::faults::device::scan_fault::{ScanFault, SpoiledFeed};
use crate::faults::device::window_dirty::{WindowDirty, WindowDirtyParams};
use crate::faults::line::bit_noise::{BitNoise, BitNoiseParams};
use crate::faults::line::loose_connector::{LooseConnector, LooseConnectorParams};
use crate::faults::line::usb_stall::{UsbStall, UsbStallParams};

use super::episodes::Episode;
use super::unplug::Unplug;
use crate::line::{Channel, Fault, LatencyTimer, LatencyTimerParams};
use crate::rng::Rng;

/// The numbers of all presets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaultParams {
    /// Of `bit-noise`.
    pub bit_noise: BitNoiseParams,
    /// Of `loose-connector`.
    pub loose_connector: LooseConnectorParams,
    /// Of `usb-stall`.
    pub usb_stall: UsbStallParams,
    /// Of `power-cycle`.
    pub power_cycle: PowerCycleParams,
    /// Of `dazzle`.
    pub dazzle: DazzleParams,
    /// Of `window-dirty`.
    pub window_dirty: WindowDirtyParams,
    /// Of `clock-step`.
    pub clock_step: ClockStepParams,
    /// Of `left-streaming`.
    pub left_streaming: LeftStreamingParams,
}

/// The faults of one run. Every part asks for its own: those that do not concern it are passed over.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// In the order asked for; of those on lines the first is nearest to the device.
    pub presets: Vec<Preset>,
    /// Of all chance.
    pub seed: u64,
    /// How bad they are.
    pub params: FaultParams,
    /// Plugs that are pulled, each of one device.
    pub unplugs: Vec<Unplug>,
    /// The latency timer of the USB adapters, in what they hand to the host: behind all faults of the line.
    pub latency_timer: Option<LatencyTimerParams>,
}

/// Streams of random numbers of the parts that faults act on.
const LINE: u64 = 0xFA17_0000;
const POWER: u64 = 0xFA17_1000;
const MEASUREMENT: u64 = 0xFA17_2000;
const CLOCK: u64 = 0xFA17_3000;

impl Faults {
    /// Presets with their default numbers.
    #[must_use]
    pub fn new(presets: &[Preset], seed: u64) -> Self {
        Self { presets: presets.to_vec(), seed, ..Self::default() }
    }

    /// Refuses what has nothing to act on.
    ///
    /// # Errors
    /// One of the presets cannot be had at that place.
    pub fn check(&self, place: Place) -> Result<(), Misplaced> {
        self.presets.iter().try_for_each(|preset| preset.check(place))
    }

    /// Refuses what spoils scans, for a laser of today: only the scans of an LMS 2xx can be spoiled.
    ///
    /// # Errors
    /// One of the presets acts on the measurement.
    pub fn check_fan_laser(&self) -> Result<(), Misplaced> {
        let why = "only scans of an LMS 2xx can be spoiled, and the rig has another laser";
        match self.acting_on(ActsOn::Measurement).next() {
            Some((preset, _)) => Err(Misplaced { preset, why }),
            None => Ok(()),
        }
    }

    /// While the plug of the device with this link is out.
    #[must_use]
    pub fn unplugged(&self, link: &str) -> Vec<Episode> {
        self.unplugs.iter().filter(|unplug| unplug.link == link).map(|unplug| unplug.out).collect()
    }

    fn acting_on(&self, what: ActsOn) -> impl Iterator<Item = (Preset, i64)> + '_ {
        let presets = self.presets.iter().copied().zip(0..);
        presets.filter(move |(preset, _)| preset.acts_on() == what)
    }

    /// One direction of a line; `stream` tells directions and lines apart (2 n from device n, 2 n + 1 to it).
    #[must_use]
    pub fn channel(&self, stream: u64) -> Channel {
        let faults = self.acting_on(ActsOn::Line).filter_map(|(preset, place)| {
            let rng = Rng::new(self.seed, LINE + stream, place);
            let fault: Box<dyn Fault> = match preset {
                Preset::BitNoise => Box::new(BitNoise::new(self.params.bit_noise, rng)),
                Preset::LooseConnector => Box::new(LooseConnector::new(self.params.loose_connector, rng)),
                Preset::UsbStall => Box::new(UsbStall::new(self.params.usb_stall, rng)),
                _ => return None,
            };
            Some(fault)
        });
        let timer = self.latency_timer.filter(|_| stream.is_multiple_of(2)).map(LatencyTimer::new);
        let timer = timer.map(|timer| Box::new(timer) as Box<dyn Fault>);
        Channel::of(faults.chain(timer).collect())
    }

    /// The device in place `device` of the rig, behind its switch.
    #[must_use]
    pub fn power(&self, device: Box<dyn Device>, place: u64) -> Box<dyn Device> {
        self.acting_on(ActsOn::Power).fold(device, |device, (_, order)| {
            let rng = Rng::new(self.seed, POWER + place, order);
            Box::new(PowerCycle::new(device, self.params.power_cycle, rng))
        })
    }

    /// The faults of the measurement of the laser in that place of the rig.
    #[must_use]
    pub fn measurement(&self, place: u64) -> Vec<Box<dyn ScanFault>> {
        let faults = self.acting_on(ActsOn::Measurement).filter_map(|(preset, order)| {
            let rng = Rng::new(self.seed, MEASUREMENT + place, order);
            let fault: Box<dyn ScanFault> = match preset {
                Preset::Dazzle => Box::new(Dazzle::new(self.params.dazzle, rng)),
                Preset::WindowDirty => Box::new(WindowDirty::new(self.params.window_dirty, rng)),
                _ => return None,
            };
            Some(fault)
        });
        faults.collect()
    }

    /// The scans of the laser in that place, spoiled.
    #[must_use]
    pub fn feed(&self, feed: Box<dyn ScanFeed>, place: u64) -> Box<dyn ScanFeed> {
        let faults = self.measurement(place);
        if faults.is_empty() { feed } else { Box::new(SpoiledFeed::new(feed, faults)) }
    }

    /// A laser as it is found.
    #[must_use]
    pub fn laser(&self, mut params: LmsParams) -> LmsParams {
        self.acting_on(ActsOn::Start).for_each(|_| self.params.left_streaming.leave_laser(&mut params));
        params
    }

    /// A base as it is found.
    #[must_use]
    pub fn base(&self, mut params: BaseParams) -> BaseParams {
        self.acting_on(ActsOn::Start).for_each(|_| self.params.left_streaming.leave_base(&mut params));
        params
    }

    /// An inertial unit as it is found.
    #[must_use]
    pub fn inertial(&self, mut params: XsensParams) -> XsensParams {
        self.acting_on(ActsOn::Start).for_each(|_| self.params.left_streaming.leave_inertial(&mut params));
        params
    }

    /// The host's clock: `zero_utc_ns` at time 0 of the run.
    #[must_use]
    pub fn host_clock(&self, zero_utc_ns: i64) -> HostClock {
        match self.acting_on(ActsOn::HostClock).next() {
            Some((_, order)) => {
                let rng = Rng::new(self.seed, CLOCK, order);
                HostClock::stepping(zero_utc_ns, self.params.clock_step, rng)
            }
            None => HostClock::steady(zero_utc_ns),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latency_timer_holds_what_the_device_says_and_not_what_it_hears() {
        let faults = Faults {
            latency_timer: Some(LatencyTimerParams::default()),
            ..Faults::new(&[Preset::BitNoise], 1)
        };
        let arrivals = |stream| {
            let mut channel = faults.channel(stream);
            let mut out = Vec::new();
            let mut arrived = Vec::new();
            for ms in 0..100_i64 {
                if ms < 40 {
                    channel.push(ms * 1_000_000, &[0x55]);
                }
                channel.take(ms * 1_000_000, &mut out);
                arrived.extend((!out.is_empty()).then_some((ms, out.len())));
                out.clear();
            }
            arrived
        };
        assert_eq!(arrivals(0), [(16, 16), (32, 16), (48, 8)]);
        assert_eq!(arrivals(1).len(), 40);
    }

    #[test]
    fn without_faults_bytes_pass_at_once() {
        let mut channel = Faults::new(&[], 1).channel(0);
        channel.push(5, b"abc");
        let mut out = Vec::new();
        channel.take(5, &mut out);
        assert_eq!(out, b"abc");
        assert_eq!(channel.changed_bytes(), 0);
    }

    #[test]
    fn every_fault_of_a_stack_acts() {
        let mut channel = Faults::new(&[Preset::UsbStall, Preset::BitNoise], 1).channel(0);
        channel.push(0, &vec![0; 1_000_000]);
        let mut out = Vec::new();
        channel.take(10_000_000_000, &mut out);
        let flipped = out.iter().filter(|&&byte| byte != 0).count();
        assert!((60..140).contains(&flipped), "{flipped}");
    }

    #[test]
    fn stacked_faults_repeat_with_their_seed_and_differ_with_another() {
        let run = |seed| {
            let mut channel = Faults::new(&Preset::ALL, seed).channel(3);
            let mut out = Vec::new();
            for step in 0..20_000 {
                channel.push(step * 1_000_000, &[0x55; 4]);
                channel.take(step * 1_000_000, &mut out);
            }
            out
        };
        assert_eq!(run(7), run(7));
        assert_ne!(run(7), run(8));
    }
}
