//! One run with faults, and whether everything was as it should be.

use biplane_mock::devices::base::BaseParams;
use biplane_mock::devices::base::rflex::RflexParams;
use biplane_mock::devices::base::roboclaw::RoboClawParams;
use biplane_mock::devices::inertial::XsensParams;
use biplane_mock::devices::lms::LmsParams;
use biplane_mock::faults::{Faults, Preset};
use biplane_mock::rng::Rng;
use biplane_onboard::{Event, ForeignProtocol, Health, LineFault, LineHealth, RunReport};
use biplane_recording::rig::BaseProtocol;
use biplane_recording::{Port, Rig};

use super::fault::{Fault, Outage};
use super::outcome::Outcome;
use crate::rig::devices::{idle_laser, idle_lines, laser, pioneer};
use crate::rig::line::SimLine;
use crate::rig::pairs::{sent_axes, sent_counts};
use crate::rig::plan::Plan;
use crate::rig::verdict::inertial::{inertial_account, sent_samples};
use crate::rig::verdict::truth::{
    Account, LONGEST_PARTIAL_FRAME_NS, LONGEST_PROMISE_NS, base_account, laser_account, pioneer_account,
    sent_scans,
};
use crate::rig::verdict::witness::Witness;
use crate::rig::{MS, PORTS, S, SimRig, place};

/// Every device is found at the rig's rate, so that its first measurement comes within this time.
const UP_NS: i64 = 3 * S;
/// An outage is noticed within this time.
const NOTICED_NS: i64 = S;
/// Shorter ones need not be.
const SURELY_NOTICED_NS: i64 = 12 * S / 10;
/// Another device is named within this time, if it can be heard.
const SURELY_NAMED_NS: i64 = 5 * S;
/// An outage of this length stands in the diagnostics, which come once a second.
const SURELY_REPORTED_NS: i64 = 22 * S / 10;
/// The longest that the telegram listing allows a laser from power-on until it speaks.
const LONG_BOOT_NS: i64 = 60 * S;
/// How long is looked on after the fault.
const AFTER_NS: i64 = 10 * S;

/// One run with these faults.
pub(super) fn run(faults: &[(Port, Fault)], rig: &Rig, seed: u64) -> Outcome {
    let mut rng = Rng::new(seed, 0xFA_0175, faults.len() as i64);
    let outages: Vec<(Port, Fault, Outage)> = faults
        .iter()
        .map(|&(port, fault)| (port, fault, fault.outage(port, boot_ns(rig, port, fault), &mut rng)))
        .collect();
    let happenings = outages.iter().flat_map(|(port, _, outage)| {
        outage.happenings.iter().map(|(at_ns, happening)| (*at_ns, *port, happening.clone()))
    });
    let plan = Plan::new(happenings.collect());
    let presets: Vec<Preset> = faults.iter().flat_map(|(_, fault)| fault.presets()).copied().collect();
    let places: Vec<u64> = faults.iter().map(|(port, _)| place(*port) as u64).collect();
    let mut lines = idle_lines(rig, seed, &Faults::new(&presets, seed), &places);
    for (port, _) in faults.iter().filter(|(_, fault)| *fault == Fault::LongStart) {
        lines[place(*port)] = Some(slow_laser(rig, seed, *port));
    }
    for (port, fault) in faults {
        if let Fault::StrictBase(left_open) = *fault {
            let params = BaseParams { strict: true, left_open, ..BaseParams::default() };
            lines[place(*port)] = Some(SimLine::new(pioneer(&rig.base, params), seed, 2));
        }
    }
    let mut sim = SimRig::new(rig, lines, plan, Witness::default());
    let last_ns = outages.iter().map(|(_, _, outage)| outage.answering_ns).max().unwrap_or(0);
    sim.run(last_ns + AFTER_NS, |_| false);
    let mut outcome = Outcome { runs: 1, ..Outcome::default() };
    for (port, fault, outage) in &outages {
        judge(&mut sim, *port, *fault, outage, &mut outcome);
        judge_foreign(&sim, rig, *port, *fault, outage, &mut outcome);
        judge_damage(&sim, *port, &mut outcome);
    }
    for port in PORTS {
        let fault = faults.iter().find(|(hit, _)| *hit == port).map(|(_, fault)| *fault);
        judge_telegrams(&mut sim, rig, port, fault, &mut outcome);
    }
    let transcript = sim.transcript();
    if rig.imu.is_some() {
        let end_ns = sim.now_ns();
        judge_inertial_report(&sim.engine.finish(end_ns).0, &mut outcome);
    }
    if !outcome.wrong.is_empty() {
        let what = outcome.wrong.join("; ");
        let times: Vec<String> = outages
            .iter()
            .map(|(port, fault, o)| {
                format!("{port:?} {fault:?} from {} to {} ms", o.begin_ns / MS, o.answering_ns / MS)
            })
            .collect();
        outcome.wrong =
            vec![format!("seed {seed}, {} Bd, {times:?}: {what}\n{transcript}", rig.horizontal.baud)];
    }
    outcome
}

/// The last line of a run counts what a unit lost on the way, and no loss where all that came intact is kept.
fn judge_inertial_report(report: &RunReport, outcome: &mut Outcome) {
    if report.losses.lost > 0 || report.exit_code() != 0 {
        outcome.wrong.push(format!("exit code {}, {:?}", report.exit_code(), report.losses));
    }
    if outcome.hit.damaged > 0 && report.arrival.damaged + report.arrival.lost_samples == 0 {
        outcome.wrong.push(format!("{} are damaged, {:?}", outcome.hit.damaged, report.arrival));
    }
}

/// A laser that takes its time when it is switched on.
fn slow_laser(rig: &Rig, seed: u64, port: Port) -> SimLine {
    let params = LmsParams { boot_ns: LONG_BOOT_NS, ..idle_laser(rig.horizontal.baud) };
    let stream = place(port) as u64;
    SimLine::new(laser(params, &Faults::default(), seed, stream), seed, stream)
}

/// From power-on until the device answers.
fn boot_ns(rig: &Rig, port: Port, fault: Fault) -> i64 {
    match (port, rig.base.protocol) {
        (Port::Base, BaseProtocol::P2os { .. }) => BaseParams::default().boot_ns,
        (Port::Base, BaseProtocol::RoboClaw { .. }) => RoboClawParams::default().boot_ns,
        (Port::Base, BaseProtocol::Rflex { .. }) => RflexParams::default().boot_ns,
        (Port::Imu, _) => XsensParams::default().boot_ns,
        _ if fault == Fault::LongStart => LONG_BOOT_NS,
        _ => LmsParams::default().boot_ns,
    }
}

fn account(sim: &mut SimRig<Witness>, rig: &Rig, port: Port, fault: Option<Fault>) -> Account {
    let wait_ns = match fault {
        Some(Fault::Harm(..)) => LONGEST_PROMISE_NS,
        _ => LONGEST_PARTIAL_FRAME_NS,
    };
    let Some(line) = &sim.lines[place(port)] else { return Account::default() };
    let witness = sim.engine.sink();
    match (port, rig.base.protocol) {
        (Port::Base, BaseProtocol::P2os { .. }) => {
            pioneer_account(&line.sent, &line.delivered, 0, &witness.odometry_ns, &sim.reported, wait_ns)
        }
        (Port::Base, BaseProtocol::RoboClaw { address, .. }) => {
            let answers = sent_counts(address, &line.asked, &line.sent, &line.delivered);
            base_account(&answers, &witness.odometry_ns, &sim.reported, wait_ns, |_| true)
        }
        (Port::Base, BaseProtocol::Rflex { .. }) => {
            let pairs = sent_axes(&line.sent, &line.delivered);
            base_account(&pairs, &witness.odometry_ns, &sim.reported, wait_ns, |_| true)
        }
        (Port::Imu, _) => {
            inertial_account(&sent_samples(&line.sent, &line.delivered), &line.delivered, &witness.samples)
        }
        (laser, _) => {
            let telegrams = sent_scans(&line.sent, &line.delivered);
            laser_account(laser, &telegrams, &line.delivered, &witness.scans[place(laser)], &sim.reported)
        }
    }
}

/// Nothing that arrived intact is lost, nothing that is damaged is kept; a line without a fault says nothing
/// and is told of as well.
fn judge_telegrams(
    sim: &mut SimRig<Witness>,
    rig: &Rig,
    port: Port,
    fault: Option<Fault>,
    outcome: &mut Outcome,
) {
    if sim.lines[place(port)].is_none() {
        return;
    }
    let is_hit = fault.is_some();
    let account = account(sim, rig, port, fault);
    // The exclusive or of an rFLEX packet is the same in any order of its bytes: one that nobody can tell
    // from a true one takes the place of that which it was made of.
    let is_blind = matches!((port, rig.base.protocol), (Port::Base, BaseProtocol::Rflex { .. }));
    let misled = if is_blind && matches!(fault, Some(Fault::Harm(..))) { account.undetected } else { 0 };
    if account.lost() > misled || account.wrongly_kept > 0 || (!is_hit && account.undetected > 0) {
        outcome.wrong.push(format!("{port:?}: {account:?}"));
    }
    if is_hit {
        outcome.hit.add(&account);
        return;
    }
    outcome.others.add(&account);
    let reported = sim.reported.iter().any(|reported| reported.port == port && reported.event.is_warning());
    let transcript = states(sim, port).iter().any(|(at_ns, line)| *at_ns > UP_NS && !is_well(line));
    if reported || transcript {
        outcome.wrong.push(format!("{port:?} was disturbed"));
    }
}

fn is_well(line: &LineHealth) -> bool {
    line.streaming && line.fault == LineFault::None
}

/// What the diagnostics told of a line, and when.
fn states(sim: &mut SimRig<Witness>, port: Port) -> Vec<(i64, LineHealth)> {
    let line = |health: &Health| match port {
        Port::Horizontal => health.horizontal,
        Port::Vertical => health.vertical,
        Port::Base => health.base,
        Port::Imu => health.imu,
    };
    sim.engine.sink().health.iter().map(|(at_ns, health)| (*at_ns, line(health))).collect()
}

/// When measurements of a line were recorded.
fn recorded_ns(sim: &mut SimRig<Witness>, port: Port) -> Vec<i64> {
    let witness = sim.engine.sink();
    match port {
        Port::Base => witness.odometry_ns.clone(),
        Port::Imu => witness.samples.iter().map(|sample| sample.log_ns).collect(),
        laser => witness.scans[place(laser)].iter().map(|scan| scan.log_ns).collect(),
    }
}

fn judge(sim: &mut SimRig<Witness>, port: Port, fault: Fault, outage: &Outage, outcome: &mut Outcome) {
    if !fault.is_noise() {
        judge_notice(sim, port, fault, outage, outcome);
    }
    let recorded_ns = recorded_ns(sim, port);
    match recorded_ns.iter().find(|at_ns| **at_ns > outage.answering_ns) {
        Some(at_ns) => {
            let back_ns = at_ns - outage.answering_ns;
            outcome.back_ns = outcome.back_ns.max(back_ns);
            if back_ns > outage.back_within_ns {
                outcome.wrong.push(format!("{port:?} back after {} ms", back_ns / MS));
            }
        }
        None => outcome.wrong.push(format!("{port:?} not back")),
    }
    if !fault.is_at_start() && recorded_ns.first().is_none_or(|first_ns| *first_ns > UP_NS) {
        outcome.wrong.push(format!("{port:?} did not come up in time"));
    }
    let end_ns = sim.now_ns();
    if recorded_ns.last().is_none_or(|last_ns| end_ns - last_ns > S) {
        outcome.wrong.push(format!("{port:?} silent at the end"));
    }
    if states(sim, port).last().is_none_or(|(_, line)| !is_well(line)) {
        outcome.wrong.push(format!("{port:?} is told of as out of order at the end"));
    }
}

/// Who is on a port instead is said once, and rightly; of the device that belongs there nothing of the kind
/// is ever said.
fn judge_foreign(
    sim: &SimRig<Witness>,
    rig: &Rig,
    port: Port,
    fault: Fault,
    outage: &Outage,
    outcome: &mut Outcome,
) {
    let baud = match port {
        Port::Base => rig.base.baud,
        Port::Imu => rig.imu.as_ref().map_or(0, |unit| unit.baud),
        Port::Horizontal | Port::Vertical => rig.horizontal.baud,
    };
    let wanted = fault.foreign_device().and_then(|foreign_device| foreign_device.received_by(port, baud));
    let reported: Vec<ForeignProtocol> = sim
        .reported
        .iter()
        .filter(|reported| reported.port == port)
        .filter_map(|reported| match reported.event {
            Event::ForeignDevice(foreign_protocol) => Some(foreign_protocol),
            _ => None,
        })
        .collect();
    let is_long = outage.answering_ns - outage.begin_ns >= SURELY_NAMED_NS;
    if reported.len() > 1
        || reported.first().is_some_and(|foreign_protocol| Some(*foreign_protocol) != wanted)
    {
        outcome.wrong.push(format!("{port:?}: said {reported:?}, is {wanted:?}"));
    } else if is_long && reported.first().copied() != wanted {
        outcome.wrong.push(format!("{port:?}: did not say {wanted:?}"));
    }
}

/// That telegrams arrive damaged is said once, and so is that they no longer do.
fn judge_damage(sim: &SimRig<Witness>, port: Port, outcome: &mut Outcome) {
    let of_damage = sim.reported.iter().filter(|reported| reported.port == port).filter_map(|reported| {
        match reported.event {
            Event::Damaged { percent, .. } => Some(percent.is_some()),
            _ => None,
        }
    });
    let of_damage: Vec<bool> = of_damage.collect();
    if !matches!(of_damage[..], [] | [true] | [true, false]) {
        outcome.wrong.push(format!("{port:?}: said to be damaged, or no more, {of_damage:?}"));
    }
    outcome.damage_reported += u64::from(!of_damage.is_empty());
}

/// An outage is noticed in time, stands in the diagnostics while it lasts, and each thing is said of it once.
fn judge_notice(sim: &mut SimRig<Witness>, port: Port, fault: Fault, outage: &Outage, outcome: &mut Outcome) {
    let kinds: [fn(&Event) -> bool; 4] = [
        |event: &Event| matches!(event, Event::PortLost),
        |event: &Event| matches!(event, Event::Silent { .. } | Event::Garbled { .. }),
        |event: &Event| matches!(event, Event::PoweredOn),
        |event: &Event| matches!(event, Event::NotFound { .. }),
    ];
    let is_foreign: fn(&Event) -> bool = |event| matches!(event, Event::ForeignDevice(_));
    let reported = |is_kind: fn(&Event) -> bool| {
        let of_kind =
            sim.reported.iter().filter(move |reported| reported.port == port && is_kind(&reported.event));
        of_kind.map(|reported| reported.at_ns)
    };
    outcome.reported = kinds.iter().map(|kind| reported(*kind).count() as u64).max().unwrap_or(0);
    if outcome.reported > 1 {
        outcome.wrong.push(format!("{port:?}: said {} times", outcome.reported));
    }
    let length_ns = outage.answering_ns - outage.begin_ns;
    if fault.is_at_start() {
        // That nobody answers is said when all rates have been tried.
        let is_reported = [kinds[3], is_foreign].into_iter().any(|kind| reported(kind).next().is_some());
        if length_ns >= SURELY_REPORTED_NS && !is_reported {
            outcome.wrong.push(format!("{port:?}: that nobody answers is not said"));
        }
        return;
    }
    match kinds[..3].iter().filter_map(|kind| reported(*kind).next()).min() {
        Some(at_ns) => {
            let noticed_ns = at_ns - outage.begin_ns;
            outcome.noticed_ns = outcome.noticed_ns.max(noticed_ns);
            if noticed_ns > NOTICED_NS {
                outcome.wrong.push(format!("{port:?} noticed after {} ms", noticed_ns / MS));
            }
        }
        None if length_ns >= SURELY_NOTICED_NS => outcome.wrong.push(format!("{port:?} not noticed")),
        None => {}
    }
    let lasts = outage.begin_ns..outage.answering_ns;
    let transcript = states(sim, port).iter().any(|(at_ns, line)| {
        lasts.contains(at_ns) && !line.streaming && matches!(line.fault, LineFault::Lasts(_))
    });
    if length_ns >= SURELY_REPORTED_NS && !transcript {
        outcome.wrong.push(format!("{port:?} not told in the diagnostics"));
    }
}
