//! Sessions with mock lasers of every kind, in simulated time.

use biplane_mock::devices::device::Device;
use biplane_mock::devices::lms::LmsParams;
use biplane_mock::devices::lms::model::Model;
use biplane_mock::devices::lms::settings::{ConfigBlock, Variant};
use biplane_wire::lms::Unit;

use crate::session::lms::setup::settings::LaserSettings;
use crate::session::lms::tests::HALF;
use crate::session::lms::tests::bench::{Bench, MS};

fn of_type(name: &str) -> LmsParams {
    LmsParams::of_type(Model::text_of_name(name))
}

#[test]
fn every_type_of_the_family_comes_up_from_the_factory_in_every_variant_and_unit() {
    for name in ["LMS200", "LMS211", "LMS220", "LMS221", "LMS291"] {
        for (fov_deg, resolution_cdeg, beams) in
            [(180, 100, 181), (180, 50, 361), (100, 100, 101), (100, 50, 201), (100, 25, 401)]
        {
            for unit in [Unit::Cm, Unit::Mm] {
                let settings = LaserSettings { fov_deg, resolution_cdeg, unit, ..HALF };
                let mut bench = Bench::new(of_type(name), settings);
                let took_ms = bench.first_scan_ms(3000);
                let writes = bench.device.eeprom_writes();
                let differs = of_type(name).config.is_mm() != (unit == Unit::Mm);
                assert_eq!(writes, u64::from(differs), "{name} {unit:?}: written only when different");
                let scan = &bench.scans[0];
                assert_eq!(
                    (scan.ranges_m.len(), scan.geometry.fov_deg()),
                    (beams, fov_deg),
                    "{name} {took_ms}"
                );
                let step_m = unit.meters() as f32;
                assert!((scan.ranges_m[7] - 3.0 - 7.0 * step_m).abs() < 1e-5, "{name} {unit:?}");
                assert_eq!(bench.session.health().rejected, 0);
            }
        }
    }
}

#[test]
fn an_s14_streams_its_own_fan_with_and_without_remission_and_is_not_asked_for_another() {
    let s14 = LaserSettings { fov_deg: 90, ..HALF };
    for (settings, with_remission) in [(s14, false), (LaserSettings { remission: true, ..s14 }, true)] {
        let mut bench = Bench::new(of_type("S14"), settings);
        bench.first_scan_ms(3000);
        let scan = &bench.scans[0];
        assert_eq!((scan.geometry.first_cdeg, scan.geometry.step_cdeg, scan.geometry.turns), (-4500, 50, 1));
        assert_eq!(scan.intensities.len(), if with_remission { 181 } else { 0 });
        assert_eq!((bench.device.counts().refused, bench.device.eeprom_writes()), (0, 0));
        assert_eq!(bench.times_reported("not what is configured"), 0, "{:?}", bench.reported);
    }
    // A rig that does not know: the device keeps its own, and that is said.
    let mut bench = Bench::new(of_type("S14"), HALF);
    bench.first_scan_ms(3000);
    assert_eq!(bench.scans[0].geometry.fov_deg(), 90);
    assert_eq!(bench.times_reported("keeps 90 degrees in steps of 0.50"), 1);
    let mut bench = Bench::new(of_type("LMS291"), s14);
    bench.first_scan_ms(3000);
    assert_eq!(bench.times_reported("keeps 180 degrees in steps of 0.50"), 1);
}

#[test]
fn remission_of_an_lms_comes_as_pairs_over_the_whole_fan() {
    for (resolution_cdeg, beams) in [(100, 181), (50, 361)] {
        let settings = LaserSettings { remission: true, resolution_cdeg, baud: 500_000, ..HALF };
        let mut bench = Bench::new(of_type("LMS291"), settings);
        bench.first_scan_ms(3000);
        bench.run(500);
        let scan = &bench.scans[3];
        assert_eq!((scan.ranges_m.len(), scan.intensities.len()), (beams, beams));
        assert_eq!(scan.geometry.turns, if resolution_cdeg == 100 { 1 } else { 2 });
        // The mock's remission: 13000 / (1 + range / 1 m).
        assert_eq!((scan.intensities[0], scan.intensities[100]), (3250, 2600));
        assert_eq!(bench.device.eeprom_writes(), 1, "the measuring mode that remission needs");
        assert_eq!((bench.session.not_kept(), bench.session.health().rejected), (0, 0));
    }
}

#[test]
fn index_bytes_count_what_a_slow_line_leaves_out_and_what_a_bad_one_loses() {
    let settings = LaserSettings { index_bytes: Some(true), ..HALF };
    let mut bench = Bench::new(of_type("LMS291"), settings);
    bench.first_scan_ms(3000);
    bench.run(10_000);
    let health = *bench.session.health();
    let telegrams = bench.scans.len() as u64;
    // Every 8th scan at 38400 Bd and half a degree.
    assert_eq!((health.lost_telegrams, health.left_out_scans), (0, 7 * (telegrams - 1)), "{telegrams}");
    assert_eq!(bench.device.eeprom_writes(), 1);
    bench.is_unplugged = true;
    bench.run(500);
    bench.is_unplugged = false;
    bench.run(3000);
    let lost = bench.session.health().lost_telegrams;
    assert!((2..=4).contains(&lost), "{lost} telegrams of 213 ms in half a second");
    assert_eq!(bench.times_reported("silent"), 0);
}

#[test]
fn what_is_asked_of_the_configuration_is_written_at_once_and_never_again() {
    let settings = LaserSettings {
        unit: Unit::Mm,
        range_max_m: Some(16),
        index_bytes: Some(true),
        dazzle_tolerant: Some(true),
        ..HALF
    };
    let mut bench = Bench::new(of_type("LMS291"), settings);
    bench.first_scan_ms(3000);
    assert_eq!(bench.device.eeprom_writes(), 1);
    assert_eq!(bench.device.config().0[4..7], [0x03, 0x04, 0x01]);
    bench.stop();
    assert_eq!((bench.device.baud(), bench.times_reported("left idle at 38400 Bd")), (38400, 1));
    let kept = LmsParams { baud: 38400, config: *bench.device.config(), ..of_type("LMS291") };
    let mut again = Bench::new(kept, settings);
    again.first_scan_ms(1000);
    assert_eq!(again.device.eeprom_writes(), 0);
}

#[test]
fn an_old_firmware_s_configuration_of_32_bytes_is_written_as_32_bytes() {
    let params = LmsParams { config_bytes: 32, ..of_type("LMS200") };
    let mut bench = Bench::new(params, HALF);
    bench.first_scan_ms(3000);
    assert_eq!(bench.device.eeprom_writes(), 1);
    let length = bench.session.info().config.as_ref().map(|config| config.as_bytes().len());
    assert_eq!((length, bench.session.health().differs), (Some(32), false));
}

#[test]
fn faults_of_the_list_are_said_once_over_restarts() {
    let params = LmsParams { errors: vec![(3, 12), (0x82, 7)], baud: 38400, ..of_type("LMS291") };
    let mut bench = Bench::new(params, HALF);
    bench.first_scan_ms(3000);
    bench.is_unplugged = true;
    bench.run(2000);
    bench.is_unplugged = false;
    bench.first_scan_ms(2000);
    assert_eq!(bench.times_reported("reports error 12, warning 7 (over)"), 1, "{:#?}", bench.reported);
    assert_eq!(bench.times_reported("streams"), 2);
}

#[test]
fn a_cable_that_comes_back_is_noticed_within_two_seconds_whenever_it_does() {
    for dark_ms in (100..6000).step_by(271) {
        let mut bench = Bench::new(LmsParams { baud: 38400, ..of_type("LMS291") }, HALF);
        bench.first_scan_ms(3000);
        bench.run(731);
        bench.is_unplugged = true;
        let from_ms = bench.now_ns / MS;
        bench.run(dark_ms);
        bench.is_unplugged = false;
        let back_ms = bench.first_scan_ms(2000);
        if let Some((at_ms, _)) = bench.reported.iter().find(|(_, reported)| reported.starts_with("silent")) {
            assert!(at_ms - from_ms <= 1000, "noticed after {} ms", at_ms - from_ms);
        } else {
            assert!(dark_ms < 1000, "{dark_ms} ms were not noticed");
        }
        assert!(bench.times_reported("no answer yet") <= 1, "{back_ms}: {:#?}", bench.reported);
    }
}

#[test]
fn a_laser_that_is_switched_on_anew_streams_within_two_seconds_of_its_first_word() {
    for (boot_ms, baud) in (200..9000).step_by(613).zip([38400, 500_000, 9600].into_iter().cycle()) {
        let params = LmsParams { baud, boot_ns: boot_ms * MS, ..of_type("LMS291") };
        let mut bench = Bench::new(params, LaserSettings { baud, ..HALF });
        bench.first_scan_ms(3000);
        bench.run(700);
        bench.is_dark = true;
        bench.run(1500);
        bench.is_dark = false;
        bench.device.power_on(bench.now_ns);
        bench.run(boot_ms);
        let limit_ms = if baud == 9600 { 3000 } else { 2000 };
        let took_ms = bench.first_scan_ms(limit_ms);
        assert!(took_ms > 0 && bench.times_reported("no answer yet") <= 1, "{:#?}", bench.reported);
    }
}

#[test]
fn a_slow_line_with_damaged_telegrams_is_not_taken_for_a_lost_one() {
    let settings = LaserSettings { baud: 9600, ..HALF };
    let mut bench = Bench::new(of_type("LMS291"), settings);
    bench.first_scan_ms(3000);
    // One telegram in two loses some bytes in its middle.
    for _ in 0..10 {
        bench.run(400);
        bench.is_unplugged = true;
        bench.run(5);
        bench.is_unplugged = false;
        bench.run(1140);
    }
    assert_eq!(bench.times_reported("starting again"), 0, "{:#?}", bench.reported);
    bench.run(2000);
    bench.is_dark = true;
    let is_reported = bench.run_until(1000, |bench| bench.times_reported("starting again") == 1);
    assert!(is_reported, "{:#?}", bench.reported);
}

#[test]
fn a_device_idle_or_left_streaming_at_any_rate_and_in_any_variant_is_up_within_three_seconds() {
    println!("| rig's rate | worst ms where the device has it | where it has another |");
    for rig_baud in [9600, 19_200, 38_400, 500_000] {
        let mut worst_ms = [0, 0];
        for baud in [9600, 19_200, 38_400, 500_000] {
            for left_streaming in [false, true] {
                for variant in Variant::ALL {
                    let params = LmsParams { baud, left_streaming, variant, ..of_type("LMS291") };
                    let mut bench = Bench::new(params, LaserSettings { baud: rig_baud, ..HALF });
                    let worst_ms = &mut worst_ms[usize::from(baud != rig_baud)];
                    *worst_ms = bench.first_scan_ms(3000).max(*worst_ms);
                }
            }
        }
        println!("| {rig_baud} | {} | {} |", worst_ms[0], worst_ms[1]);
        assert!(worst_ms[0] <= 2000);
    }
}

#[test]
fn a_device_in_another_measuring_mode_is_read_in_it() {
    let config = ConfigBlock::default().with_units(true, 6);
    let params = LmsParams { config, ..of_type("LMS200") };
    let mut bench = Bench::new(params, LaserSettings { unit: Unit::Mm, ..HALF });
    bench.first_scan_ms(3000);
    let scan = &bench.scans[0];
    assert!((scan.range_max_m - 32.758).abs() < 1e-4 && (scan.ranges_m[10] - 3.10).abs() < 1e-5);
    assert_eq!(bench.device.eeprom_writes(), 0);
    assert!(bench.session.is_streaming());
}
