//! A served world, spoken to over its pseudo-terminals.

use crate::client::{Client, hex};
use crate::{folder, serving};
use biplane_mock::faults::device::power_cycle::PowerCycleParams;
use biplane_mock::faults::episodes::EpisodeParams;
use biplane_mock::faults::{Faults, Preset};
use biplane_mock::rig::simulated::SimulationParams;
use biplane_mock::serve::{ServeOptions, Source};
use biplane_mock::world::World;
use biplane_recording::Rig;
use std::path::Path;

const DONE: &str = "06 02 80 03 00 a0 00 10 16 0a";
const STOP: &str = "02 00 02 00 20 25 35 08";

fn corridor(links: &Path) -> ServeOptions {
    let world = World::open("corridor").expect("built in");
    let path = world.path(None).expect("it has one").clone();
    let (rig, params) = (Box::new(Rig::default()), SimulationParams::default());
    let source = Source::World { world: Box::new(world), path: Box::new(path), rig, params };
    ServeOptions::new(source, links.join("links"))
}

fn open_base(link: &Path) -> Client {
    let base = Client::open(link, 9600);
    base.ask("fa fb 03 00 00 00", "fa fb 03 00 00 00");
    base.ask("fa fb 03 01 00 01", "fa fb 03 01 00 01");
    base.ask("fa fb 03 02 00 02", "fa fb 1c 02 4d 6f 63 6b 42 61 73 65 00");
    base.write(&hex("fa fb 06 01 3b 01 00 02 3b"));
    base
}

#[test]
fn a_laser_is_deaf_and_garbled_at_a_wrong_rate_and_answers_at_its_own() {
    let options = corridor(&folder("rates"));
    let report = serving(&options, |links| {
        let laser = Client::open(&links.join("lms-horizontal"), 38_400);
        laser.write(&hex(STOP));
        assert_eq!(laser.read_until(200, |_| false), [0_u8; 0]);
        laser.set_baud(9600);
        laser.ask(STOP, DONE);
        laser.write(&hex(STOP));
        // The ACK is not heard before the mock has read the request at 9600.
        let received = laser.read_until(5000, |received| !received.is_empty());
        assert_eq!(received[0], 6);
        laser.set_baud(19_200);
        let received = laser.read_until(300, |received| received.len() >= 16);
        assert!(
            !received.is_empty() && !received.windows(4).any(|window| window == hex("02 80 03 00")),
            "{received:02x?}"
        );
    })
    .expect("served");
    assert_eq!(report.ports[0].device.noise_bytes, 8);
    assert_eq!(report.ports[0].device.requests, 2);
}

#[test]
fn a_plug_that_is_pulled_hangs_up_on_its_client_and_comes_back_behind_the_same_link() {
    let mut options = corridor(&folder("unplug"));
    options.faults.unplugs = vec!["horizontal:0.6:0.8".parse().expect("it is one")];
    serving(&options, |links| {
        let link = links.join("lms-horizontal");
        let becomes = |wanted: bool| {
            let looks = (0..1000).take_while(|_| link.exists() != wanted);
            looks.for_each(|_| biplane_clock::sleep_ns(5_000_000));
            link.exists() == wanted
        };
        let first = std::fs::read_link(&link).expect("a link");
        Client::open(&link, 9600).ask(STOP, DONE);
        assert!(becomes(false), "the plug stays in");
        assert!(links.join("lms-vertical").exists(), "another one is pulled");
        assert!(becomes(true), "it does not come back");
        assert!(std::fs::read_link(&link).expect("a link").exists(), "{first:?}");
        Client::open(&link, 9600).ask(STOP, DONE);
    })
    .expect("served");
}

#[test]
fn the_drive_begins_when_all_devices_stream_and_its_truth_is_written() {
    let folder = folder("truth");
    let mut options = corridor(&folder);
    options.truth = Some(folder.join("truth"));
    options.speed = 10.0;
    options.laser.baud = 500_000;
    let report = serving(&options, |links| {
        let lasers = ["lms-horizontal", "lms-vertical"].map(|name| Client::open(&links.join(name), 500_000));
        for laser in &lasers {
            laser.ask("02 00 02 00 20 24 34 08", DONE);
        }
        let base = open_base(&links.join("base"));
        // A packet that says "moving": the drive has begun.
        let moved = |received: &[u8]| received.windows(4).any(|window| window == hex("fa fb 22 33"));
        assert!(moved(&base.read_until(10_000, moved)));
        let scans = lasers[0].read_until(3000, |received| received.len() > 20 * 732);
        assert!(scans.windows(7).filter(|window| *window == hex("02 80 d6 02 b0 69 01")).count() >= 10);
    })
    .expect("served");
    assert!(report.ports.iter().all(|port| port.device.telegrams > 5));
    for file in ["surfaces.ply", "trajectory.tum", "poses.tum", "poses_vertical.tum", "scans_horizontal.txt"]
    {
        let length = std::fs::metadata(folder.join("truth").join(file)).map(|file| file.len());
        assert!(length.is_ok_and(|length| length > 100), "{file}");
    }
    let now_s = biplane_clock::utc_ns() as f64 * 1e-9;
    let poses = std::fs::read_to_string(folder.join("truth/poses.tum")).expect("poses");
    let last_s: f64 =
        poses.lines().last().and_then(|line| line.split(' ').next()?.parse().ok()).expect("a stamp");
    assert!((now_s - last_s).abs() < 20.0, "{last_s} against {now_s}");
    assert!(!options.links.join("base").is_symlink());
    // Another mock does not replace this truth unasked.
    assert!(serving_error(&options).contains("exists already"));
}

#[test]
fn a_speed_of_zero_and_a_folder_that_cannot_be_made_are_refused() {
    let folder = folder("refused");
    let options = ServeOptions { speed: 0.0, ..corridor(&folder) };
    let error = serving_error(&options);
    assert_eq!(error, "speed 0: must be a number above 0");
    std::fs::write(folder.join("links"), "a file").expect("a file");
    assert!(serving_error(&corridor(&folder)).contains("links: cannot make this folder"));
}

fn serving_error(options: &ServeOptions) -> String {
    let stop = std::sync::atomic::AtomicBool::new(true);
    biplane_mock::serve::serve(options, &stop, |_| {}).expect_err("refused").to_string()
}

#[test]
fn the_links_of_a_living_mock_are_left_alone_and_those_of_a_dead_one_replaced() {
    let folder = folder("taken");
    let options = corridor(&folder);
    let base = options.links.join("base");
    std::fs::create_dir_all(&options.links).expect("a folder");
    std::os::unix::fs::symlink(folder.join("gone"), &base).expect("a link left behind");
    std::fs::write(options.links.join(".serve.lock"), "").expect("a lock file left behind");
    serving(&options, |_| {
        let target = std::fs::read_link(&base).expect("a link");
        assert_ne!(target, folder.join("gone"));
        assert!(serving_error(&options).contains("another mock serves in this folder"));
        assert_eq!(std::fs::read_link(&base).ok(), Some(target));
    })
    .expect("served");
    assert_eq!(std::fs::read_dir(&options.links).expect("a folder").count(), 0, "links and lock are gone");
}

#[test]
fn devices_left_streaming_are_heard_unasked_and_a_power_cycle_ends_that() {
    let folder = folder("power");
    let mut options = corridor(&folder);
    options.faults = Faults::new(&[Preset::LeftStreaming, Preset::PowerCycle], 1);
    let dark = EpisodeParams { shortest_pause_s: 2.5, mean_pause_s: 0.0, shortest_s: 0.3, longest_s: 0.3 };
    options.faults.params.power_cycle = PowerCycleParams { dark };
    options.laser.boot_ns = 100_000_000;
    let report = serving(&options, |links| {
        let laser = Client::open(&links.join("lms-horizontal"), 38_400);
        let scan = hex("02 80 d6 02 b0 69 01");
        let received = laser.read_until(2000, |received| received.windows(7).any(|window| window == scan));
        assert!(received.windows(7).any(|window| window == scan), "{} bytes", received.len());
        let base = Client::open(&links.join("base"), 9600);
        assert!(!base.read_until(500, |received| received.len() > 40).is_empty());
        // At the wrong rate the power-on telegram would be noise.
        laser.set_baud(9600);
        let power_on = hex("02 80 14 00 90 4c 4d 53");
        let received =
            laser.read_until(6000, |received| received.windows(8).any(|window| window == power_on));
        assert!(received.windows(8).any(|window| window == power_on), "{received:02x?}");
    })
    .expect("served");
    assert!(report.ports.iter().all(|port| port.device.power_cycles >= 1));
}

#[test]
fn a_fault_that_a_mock_on_ports_cannot_have_is_refused_before_anything_is_made() {
    let folder = folder("refused");
    let mut options = corridor(&folder);
    options.faults = Faults::new(&[Preset::ClockStep], 1);
    let stop = std::sync::atomic::AtomicBool::new(true);
    let error = biplane_mock::serve::serve(&options, &stop, |_| ()).expect_err("refused").to_string();
    assert!(error.contains("clock-step") && error.contains("simulate"), "{error}");
    assert!(!options.links.exists());
}
