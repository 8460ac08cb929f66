//! A laser that starts seconds after the others, or ends before them: the account at the end of the run says
//! which one and how long, of nothing else, and what arrived intact is recorded.

use biplane_mock::devices::lms::LmsParams;
use biplane_mock::faults::Faults;
use biplane_mock::rng::Rng;
use biplane_recording::Port;

use super::{LASERS, seeds};
use crate::rig::devices::{idle_lines, rig_at};
use crate::rig::plan::{Happening, Plan};
use crate::rig::verdict::truth::{Account, laser_account, sent_scans};
use crate::rig::verdict::witness::Witness;
use crate::rig::{S, SimRig, place};

/// A run lasts so long.
const LASTS_NS: i64 = 26 * S;
/// What is missing is told as it was, within this, seconds.
const MAX_OFF_S: f64 = 0.6;

/// When a laser is there.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Presence {
    /// Its power comes late.
    Late,
    /// Its power goes early.
    Early,
    /// Both.
    Middle,
    /// From the start to the end.
    Whole,
}

/// What runs have shown.
#[derive(Default)]
struct Shown {
    runs: u32,
    /// Most that was missing, and most that what was said of it was off, seconds.
    longest_s: f64,
    off_s: f64,
    account: Account,
    wrong: Vec<String>,
}

fn happenings(presence: Presence, port: Port, rng: &mut Rng) -> Vec<(i64, Port, Happening)> {
    let mut at_ns = |from_s: f64, to_s: f64| (rng.between(from_s, to_s) * S as f64) as i64;
    let boot_ns = LmsParams::default().boot_ns;
    let late = [(0, port, Happening::PowerOff), (at_ns(5.0, 13.0) - boot_ns, port, Happening::PowerOn)];
    let early = [(at_ns(17.0, 22.0), port, Happening::PowerOff)];
    match presence {
        Presence::Late => late.to_vec(),
        Presence::Early => early.to_vec(),
        Presence::Middle => [&late[..], &early].concat(),
        Presence::Whole => Vec::new(),
    }
}

fn run(presence: Presence, port: Port, seed: u64, shown: &mut Shown) {
    let rig = rig_at(38_400);
    let mut rng = Rng::new(seed, 0x1A7E, place(port) as i64);
    let plan = Plan::new(happenings(presence, port, &mut rng));
    let lines = idle_lines(&rig, seed, &Faults::default(), &[]);
    let mut sim = SimRig::new(&rig, lines, plan, Witness::default());
    sim.run(LASTS_NS, |_| false);
    let mut account = Account::default();
    for laser in LASERS {
        let line = sim.lines[place(laser)].as_ref().unwrap();
        let telegrams = sent_scans(&line.sent, &line.delivered);
        let scans = &sim.engine.sink().scans[place(laser)];
        account.add(&laser_account(laser, &telegrams, &line.delivered, scans, &sim.reported));
    }
    let (transcript, now_ns) = (sim.transcript(), sim.now_ns());
    let (report, witness) = sim.engine.finish(now_ns);
    // Truth: the times at which scans of it and measurements of the base were recorded.
    let scans = &witness.scans[place(port)];
    let (first_ns, last_ns) = (scans[0].log_ns, scans[scans.len() - 1].log_ns);
    let base_first_ns = witness.odometry_ns[0];
    let other_ns = witness.scans[1 - place(port)][0].log_ns;
    let missing_s = [first_ns - base_first_ns.min(other_ns), now_ns - last_ns].map(|ns| ns as f64 * 1e-9);
    let name = if port == Port::Horizontal { "horizontal laser" } else { "vertical laser" };
    let is_reported = match &report.uncovered[..] {
        [] => presence == Presence::Whole,
        [one] => {
            let off_s = (one.at_start_s - missing_s[0]).abs().max((one.at_end_s - missing_s[1]).abs());
            shown.off_s = shown.off_s.max(off_s);
            shown.longest_s = shown.longest_s.max(one.at_start_s).max(one.at_end_s);
            presence != Presence::Whole && one.device == name && off_s <= MAX_OFF_S
        }
        _ => false,
    };
    let is_lossless = account.lost() + account.wrongly_kept + account.undetected == 0;
    if !is_reported || !is_lossless || report.losses.lost > 0 || report.exit_code() != 0 {
        let reported = &report.uncovered;
        shown.wrong.push(format!(
            "{presence:?}, {port:?}, seed {seed}: missing {missing_s:?} s, said {reported:?}, {account:?}, lost {}\n\
             {transcript}",
            report.losses.lost
        ));
    }
    shown.runs += 1;
    shown.account.add(&account);
}

#[test]
fn a_laser_that_starts_late_or_stops_early_is_named_at_the_end_and_nothing_intact_is_lost() {
    let mut shown = Shown::default();
    for presence in [Presence::Late, Presence::Early, Presence::Middle, Presence::Whole] {
        for port in LASERS {
            for seed in seeds(1, 1) {
                run(presence, port, seed, &mut shown);
            }
        }
    }
    let Shown { runs, longest_s, off_s, account, wrong } = shown;
    let (recorded, intact) = (account.recorded, account.intact);
    println!(
        "| late or early | {runs} runs | {recorded} of {intact} | {longest_s:.1} s | off {off_s:.2} s |"
    );
    assert!(wrong.is_empty(), "{} runs are wrong, the first:\n{}", wrong.len(), wrong[0]);
}
