//! Rigs that are not built as their file says, driven through simulated worlds: the onboard process says what
//! is wrong, in time, and says nothing of a rig that is right. Truth is the rig that the simulator drove.
//!
//! `BIPLANE_SEEDS=10 cargo test --release -p biplane-tests --test suite mounting:: -- --nocapture` prints the
//! full table.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use biplane_mock::simulate::{self, SimulateOptions};
use biplane_onboard::{ReplayOptions, replay};
use biplane_recording::rig::{BaseProtocol, Mount};
use biplane_recording::{AnyMessage, Reader, Rig, Topic};

use crate::accuracy::recorded::folder;
use crate::rig::seeds;

/// What is wrong with a rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mistake {
    None,
    Swapped,
    UpsideDown,
    Backwards,
    ToTheLeft,
    CountsBackwards,
    VerticalTurnedRound,
    VerticalAlong,
    VerticalDown,
    VerticalLevel,
}

use Mistake::{
    Backwards, CountsBackwards, None as Right, Swapped, ToTheLeft, UpsideDown, VerticalAlong, VerticalDown,
    VerticalLevel, VerticalTurnedRound,
};

impl Mistake {
    /// The rig as it is built, where its file says `told`.
    fn built(self, configured: &Rig) -> Rig {
        let mut rig = configured.clone();
        let vertical = rig.vertical.as_mut().unwrap();
        let mount = &mut rig.horizontal.mount;
        match self {
            // As its file says, up to what a tape measure is off by.
            Right => *mount = Mount { yaw: 1.5, x: mount.x + 0.02, ..*mount },
            Swapped => std::mem::swap(mount, &mut vertical.mount),
            UpsideDown => mount.roll = 180.0,
            Backwards => mount.yaw = 180.0,
            ToTheLeft => mount.yaw = 90.0,
            CountsBackwards => {}
            VerticalTurnedRound => vertical.mount.yaw = 180.0,
            VerticalAlong => vertical.mount.yaw = 90.0,
            VerticalDown => vertical.mount.pitch = 90.0,
            VerticalLevel => vertical.mount.pitch = 0.0,
        }
        rig
    }

    /// The rig's file.
    fn configured(self) -> Rig {
        let text = include_str!("../../../hil-fixtures/rigs/paper.toml");
        let mut rig = Rig::parse(text).unwrap();
        if self == CountsBackwards {
            rig.base.protocol = rflex(1.0);
        }
        rig
    }

    /// The file with which the drive is replayed.
    fn file(self) -> Rig {
        let mut rig = self.configured();
        if self == CountsBackwards {
            rig.base.protocol = rflex(-1.0);
        }
        rig
    }

    /// What may be said of the horizontal laser, and of the vertical one.
    fn reported(self) -> [&'static [&'static str]; 2] {
        let swapped = &["looks swapped with the other laser", "its scans do not move with the base"];
        match self {
            Right => [&[], &[]],
            Swapped => [swapped, &[]],
            UpsideDown => [&["its scans turn against the odometry"], &[]],
            Backwards | CountsBackwards => [&["its scans drive against the odometry"], &[]],
            ToTheLeft => [&["its scans drive across the odometry"], &[]],
            VerticalTurnedRound => [&[], &["left and right look exchanged"]],
            VerticalAlong => [&[], &["looks turned by a quarter"]],
            VerticalDown => [&[], &["looks down, not up"]],
            VerticalLevel => [&[], &["its scans move as those of a level laser"]],
        }
    }
}

/// An rFLEX base whose counts run this way.
fn rflex(sign: f64) -> BaseProtocol {
    BaseProtocol::Rflex { counts_per_m: sign * 10_000.0, counts_per_rad: 5_000.0 }
}

/// What the states of a run tell of a laser.
#[derive(Debug, Default)]
struct Configured {
    /// What was suspected, in order.
    suspected: Vec<String>,
    /// The last word.
    last: String,
    /// The first suspicion came so long after the start, seconds.
    after_s: f64,
}

fn configured(recording: &Path, laser: &str) -> Configured {
    let mut configured = Configured::default();
    let mut start_ns = None;
    for entry in Reader::open(recording).unwrap().messages() {
        let entry = entry.unwrap();
        if entry.topic != Some(Topic::Diagnostics) {
            continue;
        }
        let AnyMessage::Diagnostics(state) = entry.decode().unwrap() else { continue };
        let start_ns = *start_ns.get_or_insert(state.stamp_ns);
        let Some(status) = state.status.iter().find(|status| status.hardware_id == laser) else { continue };
        let word = status.values.iter().find(|value| value.key == "mounting").unwrap().value.clone();
        let is_mount_fault = !["fits", "not known yet"].contains(&word.as_str());
        assert_eq!(status.message.contains(&word), is_mount_fault, "{}", status.message);
        if is_mount_fault && configured.suspected.last() != Some(&word) {
            if configured.suspected.is_empty() {
                configured.after_s = (state.stamp_ns - start_ns) as f64 * 1e-9;
            }
            configured.suspected.push(word.clone());
        }
        configured.last = word;
    }
    configured
}

/// Drives the rig as it is built and replays it by its file: what is told of both lasers.
fn driven(mistake: Mistake, world: &str, seed: u64) -> [Configured; 2] {
    let work = folder(&format!("mounting-{mistake:?}-{world}-{seed}"));
    let built = work.join("built.toml");
    std::fs::write(&built, mistake.built(&mistake.configured()).to_toml()).unwrap();
    simulate::run(&SimulateOptions {
        world: world.to_owned(),
        seed,
        rig: Some(built),
        output: work.join("capture.mcap"),
        ..SimulateOptions::default()
    })
    .unwrap();
    let options = ReplayOptions {
        rig: Some(mistake.file()),
        ..ReplayOptions::new(work.join("capture.mcap"), work.join("run.mcap"))
    };
    replay(&options, &AtomicBool::new(false)).unwrap();
    let configured = ["laser_horizontal", "laser_vertical"].map(|laser| configured(&options.output, laser));
    std::fs::remove_dir_all(work).unwrap();
    configured
}

/// All drives of a mistake in these worlds; whether it is said by the end, and nothing else ever.
#[track_caller]
fn check(mistake: Mistake, worlds: &[&str]) {
    let mut wrong = Vec::new();
    for world in worlds {
        for seed in seeds(1, 1) {
            let configured = driven(mistake, world, seed);
            println!("| {mistake:?} | {world} | {seed} | {configured:?} |");
            let is_right = configured.iter().zip(mistake.reported()).all(|(configured, may)| {
                let is_reported = may.is_empty() || may.contains(&configured.last.as_str());
                is_reported && configured.suspected.iter().all(|word| may.contains(&word.as_str()))
            });
            if !is_right {
                wrong.push((world, seed, configured));
            }
        }
    }
    assert!(wrong.is_empty(), "{mistake:?}: {wrong:#?}");
}

#[test]
fn nothing_is_said_of_a_rig_that_is_nearly_as_its_file_says() {
    check(Right, &["corridor", "office"]);
}

#[test]
fn two_lasers_that_are_swapped_are_noticed() {
    check(Swapped, &["corridor", "office"]);
}

#[test]
fn a_laser_that_hangs_upside_down_is_noticed() {
    check(UpsideDown, &["corridor"]);
}

#[test]
fn a_laser_that_looks_backwards_or_aside_is_noticed() {
    check(Backwards, &["corridor"]);
    check(ToTheLeft, &["corridor"]);
}

#[test]
fn a_base_that_counts_its_way_backwards_is_noticed() {
    check(CountsBackwards, &["corridor"]);
}

#[test]
fn a_vertical_laser_that_is_turned_round_or_along_the_way_is_noticed() {
    check(VerticalTurnedRound, &["corridor"]);
    check(VerticalAlong, &["office"]);
}

#[test]
fn a_vertical_laser_that_looks_down_or_lies_level_is_noticed() {
    check(VerticalDown, &["corridor"]);
    check(VerticalLevel, &["office"]);
}
