//! A laser of today in a capture (SICK on a network, Hokuyo on any line): the mock device itself, which a
//! client asks who it is and then for scans.
//!
//! The device runs twice. The first run shows which fans it will measure; their rays are cast on all
//! processors, and the second run sends them.

mod client;
mod settings;
#[cfg(test)]
mod tests;

use super::devices::{LaserRun, place_of, through_faults};
use super::times::Times;
use super::{SimulateError, SimulateOptions};
use crate::capture::file::LineReads;
use crate::devices::cola::{ColaDevice, ColaParams};
use crate::devices::device::Device;
use crate::devices::scip::{ScipDevice, ScipLink, ScipParams, ScipState};
use crate::line::{Adapter, SerialRead, transfer_ns};
use crate::rig::fan::{Fan, FanSource};
use crate::rig::simulated::SimulatedLaser;
use crate::rng::Rng;
use crate::simulate::devices::in_parallel;
use biplane_recording::rig::{Laser, LaserProtocol};
use biplane_wire::scip::ScanRequest;
use client::{Output, cola_requests, scip_requests, talk};
use std::sync::mpsc::channel;

/// The end of a reply in SCIP.
const EMPTY_LINE: &[u8] = b"\n\n";

/// What is to be run.
enum Kind {
    Cola(ColaParams),
    Scip(ScipParams, ScanRequest),
}

/// The laser's part of the capture; `None` for an LMS 2xx.
pub(crate) fn record_fan_laser(
    source: &SimulatedLaser,
    laser: &Laser,
    times: &Times,
    options: &SimulateOptions,
) -> Result<Option<LaserRun>, SimulateError> {
    let (port, place) = place_of(source.role());
    let Some(kind) = Kind::of(laser, options, place)? else { return Ok(None) };
    let requests = kind.requests(times)?;
    let run = |source: FanSource| kind.whole(talk(&mut *kind.device(source), &requests, times.end_ns));
    let (note, noted) = channel();
    let sent = run(Box::new(move |fan: &Fan| {
        // The other end outlives the run.
        let _ = note.send(*fan);
        vec![0; usize::from(fan.count)]
    }));
    let fans: Vec<Fan> = noted.iter().take(sent.scans.unwrap_or(usize::MAX)).collect();
    let measured = in_parallel(&fans, |fan| source.measure_fan(fan));
    let echoes = measured.iter().flatten().filter(|range_mm| **range_mm > 0).count();
    let mut next = measured.into_iter();
    // A scan that is not whole at the end is cut off again: whatever it holds.
    let sent = run(Box::new(move |fan| next.next().unwrap_or_else(|| vec![0; usize::from(fan.count)])));
    let delay_ns = (laser.delay_ms * 1e6).round() as i64;
    let reads = through_faults(kind.reads(&sent, delay_ns, options, place), &options.faults, place);
    let asked = requests.into_iter().map(|(time_ns, bytes)| SerialRead { time_ns, bytes }).collect();
    let lines = vec![LineReads::sent(port, asked), LineReads::received(port, reads)];
    Ok(Some(LaserRun { lines, first_beams_ns: fans.iter().map(|fan| fan.first_beam_ns).collect(), echoes }))
}

/// What a device sent, up to its last whole telegram.
struct Sent {
    outputs: Vec<Output>,
    /// Whole scans, where the last one may have been cut.
    scans: Option<usize>,
}

impl Kind {
    /// The device of the rig, as the rig asks it to be set; `None` for an LMS 2xx.
    fn of(laser: &Laser, options: &SimulateOptions, place: u64) -> Result<Option<Self>, SimulateError> {
        let phase = Rng::new(options.seed, 0x9A5E, place.cast_signed()).unit();
        let ppm = options.lasers.mirror_ppm[usize::from(place > 0)];
        match &laser.protocol {
            LaserProtocol::Lms2xx => Ok(None),
            LaserProtocol::Cola(cola) => {
                let mut params = settings::set_as_asked(&options.lasers.network_laser, cola)?;
                params.slow_ppm += ppm;
                params.phase_ns = (phase * params.turn_ns(&params.scan) as f64) as i64;
                Ok(Some(Self::Cola(params)))
            }
            LaserProtocol::Scip(scip) => {
                let mut params = options.lasers.hokuyo.clone().on_line(scip.address.is_some(), laser.baud);
                let request = settings::scan_request(&params, scip)?;
                params.state = ScipState::Idle;
                params.slow_ppm += ppm;
                params.phase_ns = (phase * params.turn_ns() as f64) as i64;
                Ok(Some(Self::Scip(params, request)))
            }
        }
    }

    fn requests(&self, times: &Times) -> Result<Vec<(i64, Vec<u8>)>, SimulateError> {
        match self {
            Self::Cola(params) => cola_requests(params.dialect, times),
            Self::Scip(_, request) => scip_requests(*request, times),
        }
    }

    fn device(&self, source: FanSource) -> Box<dyn Device> {
        match self {
            Self::Cola(params) => Box::new(ColaDevice::new(params.clone(), source)),
            Self::Scip(params, _) => Box::new(ScipDevice::new(params.clone(), source)),
        }
    }

    /// Rate of a serial line, Bd.
    fn baud(&self) -> Option<u32> {
        match self {
            Self::Scip(ScipParams { link: ScipLink::Serial(baud), .. }, _) => Some(*baud),
            _ => None,
        }
    }

    fn is_network(&self) -> bool {
        match self {
            Self::Cola(_) => true,
            Self::Scip(params, _) => params.link == ScipLink::Network,
        }
    }

    /// Cuts off a scan that was still on the line at the end. A SICK laser's telegrams leave at once.
    fn whole(&self, mut outputs: Vec<Output>) -> Sent {
        let Self::Scip(_, _) = self else { return Sent { outputs, scans: None } };
        let bytes: Vec<u8> = outputs.iter().flat_map(|(_, bytes)| bytes.iter().copied()).collect();
        let ends = || bytes.windows(EMPTY_LINE.len()).enumerate().filter(|(_, pair)| *pair == EMPTY_LINE);
        let end = ends().next_back().map_or(0, |(at, _)| at + EMPTY_LINE.len());
        let mut left = end;
        for (_, bytes) in &mut outputs {
            bytes.truncate(left);
            left -= bytes.len();
        }
        outputs.retain(|(_, bytes)| !bytes.is_empty());
        Sent { outputs, scans: Some(ends().count().saturating_sub(client::SCIP_REQUESTS)) }
    }

    /// When the computer reads it: by segments from a network, else as an adapter hands it over.
    fn reads(&self, sent: &Sent, delay_ns: i64, options: &SimulateOptions, place: u64) -> Vec<SerialRead> {
        let params = if self.is_network() { options.reads.on_network() } else { options.reads };
        let byte_ns = self.baud().map_or(0, |baud| transfer_ns(1, baud));
        let mut adapter = Adapter::new(params, options.seed, place);
        let mut free_ns = i64::MIN;
        for (last_ns, bytes) in &sent.outputs {
            for (behind, byte) in (0..bytes.len() as i64).rev().zip(bytes) {
                free_ns = free_ns.max(last_ns + delay_ns - behind * byte_ns);
                adapter.push(*byte, free_ns, byte_ns);
            }
        }
        adapter.finish()
    }
}
