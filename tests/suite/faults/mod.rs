//! Every fault, at every place, for many seeds: noticed, said once, over by itself, and nothing lost that
//! arrived intact.
//!
//! A run lasts some 20 s of simulated time: three seconds undisturbed, the fault, and ten seconds in which
//! everything must be as before. `BIPLANE_SEEDS=100 cargo test --release -p biplane-tests --test suite
//! faults:: -- --nocapture` prints the full table.

pub(crate) mod checksum;
pub(crate) mod clock_steps;
pub(crate) mod fault;
pub(crate) mod host_faults;
mod judge;
mod late_start;
mod mirror_rate;
mod other_programs;
mod outcome;
mod refused_rate;

use std::ops::RangeInclusive;

use biplane_mock::faults::Preset;
use biplane_recording::rig::{BaseProtocol, Laser, Units};
use biplane_recording::{Port, Rig};

use crate::rig::LASERS_AND_BASE;
use crate::rig::devices::foreign::ForeignDevice;
use crate::rig::devices::{rflex_base, rig_at, roboclaw_base, with_inertial_unit};
use crate::rig::fault_seeds as seeds;
use crate::rig::line::byte_faults::Harm;
use fault::Fault;
use judge::run;
use outcome::{HEAD, Outcome};

const LASERS: [Port; 2] = [Port::Horizontal, Port::Vertical];

/// Rates of an inertial unit's line and of its measurements; and of how many seeds one is run.
const UNITS: [((u32, u16), u64); 3] = [((115_200, 100), 2), ((115_200, 25), 4), ((230_400, 400), 10)];

/// Runs a fault at some ports of a rig; returns rows of the table, and what was wrong.
fn rows(
    fault: Fault,
    ports: &[Port],
    rig: &Rig,
    seeds: RangeInclusive<u64>,
    wrong: &mut Vec<String>,
) -> String {
    let mut rows = String::new();
    for &port in ports {
        let mut all = Outcome::default();
        for seed in seeds.clone() {
            all.add(run(&[(port, fault)], rig, seed));
        }
        let place = match port {
            Port::Base => rig.base.protocol.name().to_owned(),
            Port::Imu => {
                rig.imu.as_ref().map_or_else(String::new, |unit| format!("xsens, {} Hz", unit.rate_hz))
            }
            laser => format!("{} at {} Bd", laser.name(), rig.horizontal.baud),
        };
        rows += &all.row(&fault.name(), &place);
        wrong.extend(all.wrong);
    }
    rows
}

#[track_caller]
fn conclude(rows: &str, wrong: &[String]) {
    println!("{HEAD}{rows}");
    assert!(wrong.is_empty(), "{} runs are wrong, the first:\n{}", wrong.len(), wrong[0]);
}

/// At 38400 Bd and, for fewer seeds, at 500000.
#[track_caller]
fn check_at(fault: Fault, ports: &[Port]) {
    let mut wrong = Vec::new();
    let mut table = rows(fault, ports, &rig_at(38_400), seeds(fault.few(), 1), &mut wrong);
    table += &rows(fault, &LASERS, &rig_at(500_000), seeds(1, 10), &mut wrong);
    conclude(&table, &wrong);
}

/// At an inertial unit, beside lasers and base that nothing happens to: at the usual rate, and at the least
/// and the greatest.
#[track_caller]
fn check_inertial(fault: Fault) {
    let mut wrong = Vec::new();
    let mut table = String::new();
    for ((baud, rate_hz), share) in UNITS {
        let rig = with_inertial_unit(rig_at(38_400), baud, rate_hz);
        table += &rows(fault, &[Port::Imu], &rig, seeds(1, share), &mut wrong);
    }
    conclude(&table, &wrong);
}

/// The same, and at bases that speak otherwise and at an inertial unit.
#[track_caller]
fn check(fault: Fault) {
    let mut wrong = Vec::new();
    let mut table = String::new();
    for base in [roboclaw_base(), rflex_base()] {
        let rig = Rig { base, ..rig_at(38_400) };
        table += &rows(fault, &[Port::Base], &rig, seeds(1, 4), &mut wrong);
    }
    conclude(&table, &wrong);
    check_inertial(fault);
    check_at(fault, &LASERS_AND_BASE);
}

#[test]
fn an_unplugged_adapter() {
    check(Fault::Unplug);
}

#[test]
fn a_cable_pulled_for_a_moment() {
    check(Fault::Jerk);
}

#[test]
fn a_pulled_cable() {
    check(Fault::Cable);
}

#[test]
fn a_power_cycle() {
    check(Fault::PowerCycle);
}

#[test]
fn a_power_cycle_of_a_laser_that_takes_a_minute_to_start() {
    let mut wrong = Vec::new();
    let table = rows(Fault::LongStart, &LASERS, &rig_at(38_400), seeds(1, 10), &mut wrong);
    conclude(&table, &wrong);
}

#[test]
fn silence() {
    check(Fault::Silence);
}

#[test]
fn garbage() {
    check(Fault::Garbage);
}

#[test]
fn bit_noise() {
    check(Fault::Noise(&[Preset::BitNoise]));
}

#[test]
fn a_loose_connector() {
    check(Fault::Noise(&[Preset::LooseConnector]));
}

#[test]
fn a_usb_stall() {
    check(Fault::Noise(&[Preset::UsbStall]));
}

#[test]
fn a_dazzled_laser() {
    check_at(Fault::Noise(&[Preset::Dazzle]), &LASERS);
}

#[test]
fn a_dirty_window() {
    check_at(Fault::Noise(&[Preset::WindowDirty]), &LASERS);
}

#[test]
fn devices_left_streaming() {
    check_at(Fault::Noise(&[Preset::LeftStreaming]), &LASERS_AND_BASE);
    check_inertial(Fault::Noise(&[Preset::LeftStreaming]));
}

#[test]
fn a_base_that_takes_any_packet_before_sync0_for_a_sync_out_of_turn() {
    let mut wrong = Vec::new();
    let mut table = String::new();
    for left_open in [false, true] {
        table += &rows(Fault::StrictBase(left_open), &[Port::Base], &rig_at(38_400), 1..=20, &mut wrong);
    }
    conclude(&table, &wrong);
}

#[test]
fn bit_noise_behind_a_stalling_adapter_with_a_loose_connector() {
    check(Fault::Noise(&[Preset::LooseConnector, Preset::BitNoise, Preset::UsbStall]));
}

/// How often bytes are harmed: a scan now and then, a third of them, nearly all.
const ONCE_IN: [u32; 3] = [10_000, 1000, 200];

#[track_caller]
fn check_harm(harm: Harm) {
    for once_in in ONCE_IN {
        check(Fault::Harm(harm, once_in));
    }
    check(Fault::HarmAtStart(harm, 50));
}

#[test]
fn bytes_dropped() {
    check_harm(Harm::Drop);
}

#[test]
fn bits_flipped() {
    check_harm(Harm::Flip);
}

#[test]
fn bytes_duplicated() {
    check_harm(Harm::Duplicate);
}

#[test]
fn bytes_reordered() {
    check_harm(Harm::Reorder);
}

#[test]
fn bytes_stalled() {
    check_harm(Harm::Stall);
}

#[test]
fn bursts_of_noise() {
    check_harm(Harm::Burst);
}

#[test]
fn a_laser_at_another_rate_all_at_once() {
    for baud in [9600, 19_200, 38_400, 500_000] {
        let mut wrong = Vec::new();
        let rig = rig_at(if baud == 38_400 { 500_000 } else { 38_400 });
        let table = rows(Fault::OtherRate(baud), &LASERS, &rig, seeds(1, 2), &mut wrong);
        conclude(&table, &wrong);
    }
}

/// With each of these devices at some ports of a rig, from the start on or later.
fn foreign_rows(
    foreign_devices: &[ForeignDevice],
    ports: &[Port],
    rig: &Rig,
    wrong: &mut Vec<String>,
) -> String {
    let both = |device: &ForeignDevice| [Fault::ForeignDevice(*device), Fault::ForeignFirst(*device)];
    foreign_devices.iter().flat_map(both).map(|fault| rows(fault, ports, rig, seeds(1, 2), wrong)).collect()
}

#[test]
fn another_device_on_a_lasers_port() {
    let mut wrong = Vec::new();
    let foreign_devices = [
        ForeignDevice::Pioneer,
        ForeignDevice::Rflex(9600),
        ForeignDevice::RoboClaw(38_400),
        ForeignDevice::Inertial(38_400),
        ForeignDevice::Receiver,
        ForeignDevice::Modem,
        ForeignDevice::Echo,
    ];
    let table = foreign_rows(&foreign_devices, &LASERS, &rig_at(38_400), &mut wrong);
    conclude(&table, &wrong);
}

#[test]
fn another_device_on_the_bases_port() {
    let mut wrong = Vec::new();
    let mut table = String::new();
    for base in [Rig::default().base, roboclaw_base(), rflex_base()] {
        let baud = base.baud;
        let mut foreign_devices = vec![
            ForeignDevice::Laser(baud),
            ForeignDevice::Laser(500_000),
            ForeignDevice::Inertial(baud),
            ForeignDevice::Receiver,
            ForeignDevice::Modem,
            ForeignDevice::Echo,
        ];
        match base.protocol {
            BaseProtocol::P2os { .. } => {
                foreign_devices.extend([ForeignDevice::RoboClaw(baud), ForeignDevice::Rflex(baud)]);
            }
            _ => foreign_devices.push(ForeignDevice::Pioneer),
        }
        let rig = Rig { base, ..rig_at(38_400) };
        table += &foreign_rows(&foreign_devices, &[Port::Base], &rig, &mut wrong);
    }
    conclude(&table, &wrong);
}

#[test]
fn another_device_on_an_inertial_units_port() {
    let mut wrong = Vec::new();
    let foreign_devices = [
        ForeignDevice::Laser(115_200),
        ForeignDevice::Laser(500_000),
        ForeignDevice::Pioneer,
        ForeignDevice::Rflex(115_200),
        ForeignDevice::RoboClaw(115_200),
        ForeignDevice::Receiver,
        ForeignDevice::Modem,
        ForeignDevice::Echo,
    ];
    let rig = with_inertial_unit(rig_at(38_400), 115_200, 100);
    let table = foreign_rows(&foreign_devices, &[Port::Imu], &rig, &mut wrong);
    conclude(&table, &wrong);
}

#[test]
fn half_degrees_in_millimeters_with_index_bytes_on_a_bad_line() {
    let mut rig = rig_at(38_400);
    for laser in [Some(&mut rig.horizontal), rig.vertical.as_mut()].into_iter().flatten() {
        *laser = Laser { resolution_deg: 0.5, units: Units::Mm, index_bytes: Some(true), ..laser.clone() };
    }
    let mut wrong = Vec::new();
    let mut table = String::new();
    for fault in [
        Fault::Noise(&[Preset::LooseConnector, Preset::BitNoise, Preset::UsbStall]),
        Fault::PowerCycle,
        Fault::Garbage,
    ] {
        table += &rows(fault, &LASERS, &rig, seeds(2, 1), &mut wrong);
    }
    conclude(&table, &wrong);
}

#[test]
fn two_faults_at_once() {
    let pairs: [&[(Port, Fault)]; 6] = [
        &[(Port::Horizontal, Fault::Unplug), (Port::Vertical, Fault::PowerCycle)],
        &[(Port::Horizontal, Fault::Garbage), (Port::Vertical, Fault::Noise(&[Preset::LooseConnector]))],
        &[(Port::Vertical, Fault::Silence), (Port::Base, Fault::Noise(&[Preset::BitNoise]))],
        &[
            (Port::Horizontal, Fault::PowerCycle),
            (Port::Vertical, Fault::PowerCycle),
            (Port::Base, Fault::Unplug),
        ],
        &[(Port::Imu, Fault::Garbage), (Port::Horizontal, Fault::PowerCycle)],
        &[(Port::Imu, Fault::PowerCycle), (Port::Base, Fault::Silence)],
    ];
    let (mut table, mut wrong) = (String::new(), Vec::new());
    for pair in pairs {
        let mut all = Outcome::default();
        let has_unit = pair.iter().any(|(port, _)| *port == Port::Imu);
        let rig = rig_at(38_400);
        let rig = if has_unit { with_inertial_unit(rig, 115_200, 100) } else { rig };
        for seed in seeds(2, 1) {
            all.add(run(pair, &rig, seed));
        }
        let names: Vec<String> =
            pair.iter().map(|(port, fault)| format!("{port:?}: {}", fault.name())).collect();
        table += &all.row(&names.join("; "), "together, 38400 Bd");
        wrong.extend(all.wrong);
    }
    conclude(&table, &wrong);
}
