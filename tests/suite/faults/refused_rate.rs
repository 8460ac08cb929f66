//! A laser that refuses the configured rate: it is asked for it once, that is said once, and it streams at
//! the rate that it has.

use biplane_mock::devices::lms::LmsParams;
use biplane_mock::faults::Faults;
use biplane_onboard::Event;
use biplane_recording::{Port, Rig};

use super::seeds;
use crate::rig::devices::{idle_laser, idle_lines, laser, rig_at};
use crate::rig::line::SimLine;
use crate::rig::plan::Plan;
use crate::rig::verdict::truth::{Account, laser_account, sent_scans};
use crate::rig::verdict::witness::Witness;
use crate::rig::{MS, S, SimRig};

/// A run lasts so long.
const LASTS_NS: i64 = 12 * S;
/// Streaming by then: the rate must be searched.
const UP_NS: i64 = 9 * S;
/// The rate that the rig asks for, what the laser runs at, and its request.
const REFUSED: [(u32, u32, [u8; 8]); 3] = [
    (500_000, 38_400, [0x02, 0x00, 0x02, 0x00, 0x20, 0x48, 0x58, 0x08]),
    (500_000, 9600, [0x02, 0x00, 0x02, 0x00, 0x20, 0x48, 0x58, 0x08]),
    (38_400, 9600, [0x02, 0x00, 0x02, 0x00, 0x20, 0x40, 0x50, 0x08]),
];

/// What runs have shown.
#[derive(Default)]
struct Shown {
    runs: u32,
    up_ns: i64,
    account: Account,
    wrong: Vec<String>,
}

fn run(wanted: u32, kept: u32, request: [u8; 8], left_streaming: bool, seed: u64, shown: &mut Shown) {
    let mut rig: Rig = rig_at(38_400);
    rig.horizontal.baud = wanted;
    let mut lines = idle_lines(&rig, seed, &Faults::default(), &[]);
    let params = LmsParams { max_baud: kept, left_streaming, ..idle_laser(kept) };
    lines[0] = Some(SimLine::new(laser(params, &Faults::default(), seed, 0), seed, 0));
    let mut sim = SimRig::new(&rig, lines, Plan::default(), Witness::default());
    sim.run(LASTS_NS, |_| false);
    let of_rate = |event: &Event| matches!(event, Event::RateKept { .. });
    let reported: Vec<&Event> = sim.reported.iter().map(|r| &r.event).filter(|e| of_rate(e)).collect();
    let is_reported_once =
        matches!(reported[..], [Event::RateKept { wanted: w, kept: k }] if (*w, *k) == (wanted, kept));
    let others = sim.reported.iter().any(|r| r.port != Port::Horizontal && r.event.is_warning());
    let line = sim.lines[0].as_ref().unwrap();
    let asked = line.asked.pieces().filter(|(_, bytes)| *bytes == request).count();
    let telegrams = sent_scans(&line.sent, &line.delivered);
    let scans = &sim.engine.sink().scans[0];
    let account = laser_account(Port::Horizontal, &telegrams, &line.delivered, scans, &sim.reported);
    let up_ns = scans.first().map_or(i64::MAX, |scan| scan.log_ns);
    let is_lossless = account.lost() + account.wrongly_kept + account.undetected == 0;
    if !is_reported_once || asked != 1 || others || up_ns > UP_NS || !is_lossless || account.recorded == 0 {
        shown.wrong.push(format!(
            "{wanted} Bd refused at {kept}, streaming {left_streaming}, seed {seed}: asked {asked} times, said \
             {reported:?}, up after {} ms, {account:?}\n{}",
            up_ns / MS,
            sim.transcript()
        ));
    }
    shown.runs += 1;
    shown.up_ns = shown.up_ns.max(up_ns);
    shown.account.add(&account);
}

#[test]
fn a_rate_that_a_laser_refuses_is_asked_for_once_and_said_once_and_it_streams_at_its_own() {
    let mut shown = Shown::default();
    for (wanted, kept, request) in REFUSED {
        for left_streaming in [false, true] {
            for seed in seeds(1, 1) {
                run(wanted, kept, request, left_streaming, seed, &mut shown);
            }
        }
    }
    let Shown { runs, up_ns, account, wrong } = shown;
    let (recorded, intact) = (account.recorded, account.intact);
    println!("| a refused rate | {runs} runs | {recorded} of {intact} | first scan by {} ms |", up_ns / MS);
    assert!(wrong.is_empty(), "{} runs are wrong, the first:\n{}", wrong.len(), wrong[0]);
}
