//! The engine on a robot in a rectangular room (`synthetic.rs`): counts, stamps, poses, order, and inputs
//! that are not as they should be.

use biplane_recording::messages::{
    AnyMessage, LaserScan, Message, Odometry, PoseWithCovarianceStamped, TfMessage,
};

use super::*;
use crate::engine::options::Feed;
use crate::engine::out::health::Health;
use crate::engine::out::outbox::QUEUE_CAPACITY;
use crate::engine::synthetic::{Read, START_NS, drive, driven_m, rig, scan_times_ns};
use crate::session::testing::noise::Noise;
use biplane_geometry::pose3::heading_of_quaternion_rad;
use biplane_matcher::{Pose2, TrackerParams};
use biplane_recording::Topic;

const MS: i64 = 1_000_000;

/// Keeps everything; of messages topic, log time, publish time and CDR.
#[derive(Debug, Default)]
pub(crate) struct MemorySink {
    pub messages: Vec<(Topic, i64, i64, Vec<u8>)>,
    healths: Vec<(i64, Health)>,
}

impl Sink for MemorySink {
    fn message(&mut self, topic: Topic, log_time_ns: i64, publish_time_ns: i64, cdr: &[u8]) {
        self.messages.push((topic, log_time_ns, publish_time_ns, cdr.to_vec()));
    }

    fn health(&mut self, now_ns: i64, health: &Health) {
        self.healths.push((now_ns, *health));
    }

    fn dropped(&self) -> u64 {
        0
    }
}

impl MemorySink {
    fn all<M: Message>(&self, topic: Topic) -> Vec<M> {
        let of_topic = self.messages.iter().filter(|(other, ..)| *other == topic);
        of_topic.map(|(.., bytes)| M::decode(bytes).unwrap()).collect()
    }
}

fn engine(start_ns: i64) -> Engine<MemorySink> {
    let options =
        EngineOptions { rig: rig(), matcher: TrackerParams::default(), feed: Feed::Recorded, raw: false };
    Engine::new(&options, MemorySink::default(), start_ns)
}

pub(super) fn run(reads: &[Read]) -> (RunReport, MemorySink) {
    let mut engine = engine(START_NS);
    for read in reads {
        engine.bytes(read.time_ns, read.port, &read.bytes);
    }
    engine.finish(reads.last().map_or(START_NS, |read| read.time_ns))
}

fn is_near(found_ns: &[i64], wanted_ns: &[i64], within_ns: i64) -> bool {
    found_ns.len() == wanted_ns.len()
        && found_ns.iter().zip(wanted_ns).all(|(found, wanted)| (found - wanted).abs() <= within_ns)
}

#[test]
fn every_scan_is_recorded_stamped_and_posed() {
    let seconds = 8;
    let (report, sink) = run(&drive(seconds, 60));
    let arrival = &report.arrival;
    assert_eq!((report.losses.lost, arrival.damaged), (0, 0));
    assert_eq!((arrival.skipped_bytes, arrival.backward_stamps), (0, 0));
    for (topic, poses, phase_ns) in
        [(Topic::ScanHorizontal, Topic::Pose, 20 * MS), (Topic::ScanVertical, Topic::PoseVertical, 51 * MS)]
    {
        let truth: Vec<_> = scan_times_ns(phase_ns, seconds).map(|t| START_NS + t).collect();
        let scans: Vec<LaserScan> = sink.all(topic);
        let stamps: Vec<_> = scans.iter().map(|scan| scan.stamp_ns).collect();
        assert!(is_near(&stamps, &truth, MS / 3), "{topic:?}");
        let poses: Vec<PoseWithCovarianceStamped> = sink.all(poses);
        assert_eq!(poses.iter().map(|pose| pose.stamp_ns).collect::<Vec<_>>(), stamps, "{topic:?}");
        for pose in &poses {
            let error_m = pose.position_m[0] - driven_m(pose.stamp_ns - START_NS);
            assert!(error_m.abs() < 0.03, "{topic:?} at {}: {error_m} m", pose.stamp_ns);
        }
    }
    assert_eq!(report.recorded.scans_horizontal, report.recorded.poses);
    assert_eq!(report.recorded.scans_vertical, report.recorded.poses_vertical);
    assert_eq!(report.recorded.odometry, 10 * seconds as u64);
}

#[test]
fn a_recorded_scan_is_as_the_interface_says() {
    let (_, sink) = run(&drive(2, 100));
    let scan = &sink.all::<LaserScan>(Topic::ScanHorizontal)[0];
    assert_eq!((scan.frame_id.as_str(), scan.ranges_m.len()), ("laser_horizontal", 181));
    assert!((scan.angle_min_rad + std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    assert!((scan.angle_max_rad - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    assert!((scan.time_increment_s - 37.0e-6).abs() < 1e-9 && (scan.scan_time_s - 0.01332).abs() < 1e-7);
    assert_eq!([scan.ranges_m[0], scan.ranges_m[90], scan.ranges_m[180]], [2.0, 7.0, 3.0]);
    let odometry = &sink.all::<Odometry>(Topic::Odom)[15];
    assert_eq!((odometry.frame_id.as_str(), odometry.child_frame_id.as_str()), ("odom", "base_link"));
    let (topic, ..) = &sink.messages[0];
    assert_eq!(*topic, Topic::TfStatic, "the mounts come first");
    assert_eq!(sink.all::<TfMessage>(Topic::TfStatic)[0].transforms.len(), 2);
}

#[test]
fn an_s14_s_scan_is_recorded_with_its_fan_its_one_turn_and_its_remissions() {
    let mut rig = rig();
    rig.horizontal.fov_deg = 90;
    rig.horizontal.resolution_deg = 0.5;
    let options = EngineOptions { rig, matcher: TrackerParams::default(), feed: Feed::Recorded, raw: false };
    let mut engine = Engine::new(&options, MemorySink::default(), START_NS);
    let scan = biplane_wire::lms::S14Scan {
        unit: biplane_wire::lms::Unit::Cm,
        values: (0..181).map(|i| 200 + i).collect(),
        span: biplane_wire::lms::Span { first: 1, last: 181 },
        remissions: (0..181).map(|i| 255 - i as u8).collect(),
        index: None,
        status: biplane_wire::lms::Status(0x90),
    };
    let mut bytes = vec![0; scan.encoded_len()];
    scan.emit(0x80, &mut bytes).unwrap();
    engine.bytes(START_NS, Port::Horizontal, &bytes);
    let (report, mut sink) = engine.finish(START_NS + MS);
    assert_eq!((report.losses.lost, report.arrival.polluted_scans), (0, 1));
    let scan = sink.all::<LaserScan>(Topic::ScanHorizontal).remove(0);
    assert!((scan.angle_min_rad + std::f32::consts::FRAC_PI_4).abs() < 1e-6);
    assert!((scan.angle_max_rad - std::f32::consts::FRAC_PI_4).abs() < 1e-6);
    assert!((scan.time_increment_s - 18.5e-6).abs() < 1e-9 && (scan.scan_time_s - 0.01332).abs() < 1e-7);
    assert_eq!((scan.ranges_m.len(), scan.ranges_m[180]), (181, 3.8));
    assert_eq!((scan.intensities.len(), scan.intensities[0], scan.intensities[180]), (181, 255.0, 75.0));
    let (_, health) = sink.healths.pop().unwrap();
    let diagnostics = crate::output::diagnostics::message(0, &health);
    let laser = &diagnostics.status[0];
    assert!(laser.message.ends_with("; complains of front window polluted"), "{}", laser.message);
    let value = |key: &str| laser.values.iter().find(|value| value.key == key).unwrap().value.as_str();
    assert_eq!((value("status"), value("polluted_scans")), ("ok, front window polluted", "1"));
}

#[test]
fn the_two_moving_frames_compose_to_the_pose() {
    let (_, sink) = run(&drive(6, 100));
    let poses: Vec<PoseWithCovarianceStamped> = sink.all(Topic::Pose);
    let frames: Vec<TfMessage> = sink.all(Topic::Tf);
    assert_eq!(poses.len(), frames.len());
    for (pose, tf) in poses.iter().zip(&frames) {
        let [map_from_odom, odom_from_base] = &tf.transforms[..] else { panic!("two transforms") };
        assert_eq!((map_from_odom.frame_id.as_str(), map_from_odom.child_frame_id.as_str()), ("map", "odom"));
        assert_eq!(odom_from_base.child_frame_id, "base_link");
        let planar = |transform: &biplane_recording::messages::TransformStamped| {
            let [x_m, y_m, _] = transform.translation_m;
            Pose2::new(x_m, y_m, heading_of_quaternion_rad(transform.rotation_xyzw))
        };
        let composed = planar(map_from_odom) * planar(odom_from_base);
        assert!((composed.x_m - pose.position_m[0]).abs() < 1e-9, "{composed:?} {pose:?}");
        assert!((composed.theta_rad - heading_of_quaternion_rad(pose.orientation_xyzw)).abs() < 1e-9);
    }
}

#[test]
fn the_same_input_gives_the_same_messages_in_the_same_order() {
    let reads = drive(3, 77);
    let (first, second) = (run(&reads), run(&reads));
    assert_eq!(first.0, second.0);
    assert!(first.1.messages == second.1.messages && first.1.healths == second.1.healths);
}

#[test]
fn how_the_bytes_were_cut_into_reads_changes_no_scan_and_stamps_by_less_than_the_delays() {
    let ranges = |sink: &MemorySink| -> Vec<Vec<f32>> {
        sink.all::<LaserScan>(Topic::ScanHorizontal).into_iter().map(|scan| scan.ranges_m).collect()
    };
    let stamps = |sink: &MemorySink| -> Vec<i64> {
        sink.all::<LaserScan>(Topic::ScanHorizontal).iter().map(|scan| scan.stamp_ns).collect()
    };
    let (_, reference) = run(&drive(3, 1));
    for chunk in [7, 372, 5000] {
        let (_, sink) = run(&drive(3, chunk));
        assert!(ranges(&sink) == ranges(&reference), "{chunk} bytes a read");
        assert!(is_near(&stamps(&sink), &stamps(&reference), MS / 3), "{chunk} bytes a read");
    }
}

#[test]
fn log_times_never_step_back_and_the_state_comes_once_a_second() {
    let (_, sink) = run(&drive(5, 50));
    let logs: Vec<_> = sink.messages.iter().map(|(_, log_ns, ..)| *log_ns).collect();
    assert!(logs.is_sorted());
    let healths: Vec<_> = sink.healths.iter().map(|(at_ns, _)| (at_ns - START_NS) / MS).collect();
    assert_eq!(healths[..4], [1000, 2000, 3000, 4000]);
    let (_, health) = sink.healths[2];
    assert!(
        (health.horizontal.rate_hz - 9.4).abs() < 1.0 && (health.base.rate_hz - 10.0).abs() < 1.1,
        "{health:?}"
    );
}

#[test]
fn a_hole_in_time_is_not_filled_with_states() {
    let mut reads = drive(2, 100);
    let hole_ns = 1_000_000 * 1_000_000_000;
    let later: Vec<_> =
        drive(2, 100).into_iter().map(|read| Read { time_ns: read.time_ns + hole_ns, ..read }).collect();
    reads.extend(later);
    let (report, sink) = run(&reads);
    assert_eq!(report.recorded.scans_horizontal, 2 * 19);
    assert!(sink.healths.len() < 10, "{} states", sink.healths.len());
}

#[test]
fn without_a_base_scans_are_posed_all_the_same() {
    let reads: Vec<_> = drive(4, 60).into_iter().filter(|read| read.port != Port::Base).collect();
    let (report, _) = run(&reads);
    assert_eq!((report.recorded.odometry, report.recorded.scans_horizontal), (0, report.recorded.poses));
    assert_eq!(report.recorded.scans_vertical, report.recorded.poses_vertical);
}

#[test]
fn a_base_that_falls_silent_holds_no_scan_up_for_long() {
    let silent_ns = START_NS + 2_000 * MS;
    let is_there = |read: &Read| read.port != Port::Base || read.time_ns < silent_ns;
    let reads: Vec<_> = drive(5, 60).into_iter().filter(is_there).collect();
    let (_, sink) = run(&reads);
    let late = sink.messages.iter().filter(|(topic, ..)| *topic == Topic::Pose);
    let longest_ns = late.map(|(_, log_ns, stamp_ns, _)| log_ns - stamp_ns).max().unwrap();
    assert!(longest_ns < 520 * MS, "{} ms", longest_ns / MS);
}

#[test]
fn a_base_is_told_to_stand_before_it_hears_of_a_process_that_stood_still() {
    let options =
        EngineOptions { rig: rig(), matcher: TrackerParams::default(), feed: Feed::Live, raw: false };
    let mut engine = Engine::new(&options, MemorySink::default(), START_NS);
    let sync = |step: u8| vec![0xFA, 0xFB, 3, step, 0, step];
    let (stop, pulse) = (vec![0xFA, 0xFB, 3, 0x1D, 0, 0x1D], sync(0));
    // `Bob` of `Pioneer` as `p3dx-sh`.
    let identity = b"\xFA\xFB\x17\x02Bob\0Pioneer\0p3dx-sh\0\xCE\xA3".to_vec();
    let mut sent = |now_ms: i64, received: Option<&[u8]>| {
        match received {
            Some(bytes) => engine.bytes(START_NS + now_ms * MS, Port::Base, bytes),
            None => engine.advance(START_NS + now_ms * MS),
        }
        let commands = std::iter::from_fn(|| engine.next_command());
        let to_base = commands.filter_map(|(port, command)| match command {
            Command::Write(bytes) if port == Port::Base => Some(bytes.to_vec()),
            _ => None,
        });
        to_base.collect::<Vec<_>>()
    };
    assert_eq!(sent(1, None), Vec::<Vec<u8>>::new());
    assert_eq!(sent(250, None), [sync(0)]);
    assert_eq!(sent(260, Some(&sync(0))), [sync(1)]);
    assert_eq!(sent(270, Some(&sync(1))), [sync(2)]);
    // OPEN has the bytes of SYNC1.
    assert_eq!(sent(280, Some(&identity)), [sync(1), pulse.clone()]);
    let sip = biplane_wire::p2os::Sip::default();
    let mut packet = vec![0; 64];
    let length = biplane_wire::p2os::Report::Sip(sip).emit(&mut packet).unwrap();
    for k in 0..8 {
        assert_eq!(sent(350 + 100 * k, Some(&packet[..length])), Vec::<Vec<u8>>::new());
    }
    let late = sent(1150 + 2500, Some(&packet[..length]));
    assert_eq!(late[0], stop, "{late:X?}");
}

#[test]
fn scans_of_a_capture_cut_at_both_ends_are_kept_but_for_the_cut_ones() {
    let reads = drive(2, 100);
    let (report, _) = run(&reads[5..reads.len() - 3]);
    assert_eq!(report.losses.lost, 0);
    assert!(report.recorded.scans_horizontal >= 17 && report.recorded.scans_horizontal < 19, "{report:?}");
    assert_eq!(report.exit_code(), 0);
}

#[test]
fn bytes_of_a_laser_that_the_rig_does_not_have_are_told_as_lost() {
    let rig = Rig { vertical: None, ..rig() };
    let options = EngineOptions { rig, matcher: TrackerParams::default(), feed: Feed::Recorded, raw: false };
    let mut engine = Engine::new(&options, MemorySink::default(), START_NS);
    for read in &drive(1, 400) {
        engine.bytes(read.time_ns, read.port, &read.bytes);
    }
    let (report, _) = engine.finish(START_NS);
    assert_eq!((report.losses.reads_without_laser, report.exit_code()), (9, 3), "{report:?}");
}

fn decoded_scan(stamp_ms: i64) -> LaserScan {
    LaserScan {
        stamp_ns: START_NS + stamp_ms * MS,
        frame_id: "laser_horizontal".to_owned(),
        angle_min_rad: -1.5,
        angle_increment_rad: 0.1,
        range_max_m: 80.0,
        ranges_m: vec![2.0; 31],
        ..LaserScan::default()
    }
}

#[test]
fn decoded_scans_whose_stamps_step_back_are_all_kept_in_order_and_unchanged() {
    let stamps_ms = [0, 200, 150, 400, 390, 390, 600];
    let mut engine = engine(START_NS);
    let mut log_ns = START_NS;
    for ms in stamps_ms {
        log_ns = log_ns.max(START_NS + ms * MS);
        let (_, sink) = run(&drive(1, 400));
        let odometry =
            Odometry { stamp_ns: START_NS + ms * MS, ..sink.all::<Odometry>(Topic::Odom)[0].clone() };
        engine.decoded_odometry(log_ns, &odometry);
        engine.decoded_scan(log_ns, Port::Horizontal, &decoded_scan(ms));
    }
    let (report, sink) = engine.finish(log_ns);
    assert_eq!((report.recorded.scans_horizontal, report.recorded.poses), (7, 7));
    assert_eq!((report.arrival.backward_stamps, report.losses.lost), (2, 0));
    let scans: Vec<LaserScan> = sink.all(Topic::ScanHorizontal);
    assert!(scans == stamps_ms.map(decoded_scan), "as they came");
    let poses: Vec<PoseWithCovarianceStamped> = sink.all(Topic::Pose);
    let posed_ms: Vec<_> = poses.iter().map(|pose| (pose.stamp_ns - START_NS) / MS).collect();
    assert_eq!(posed_ms, stamps_ms);
}

#[test]
fn random_bytes_at_random_times_never_panic() {
    let mut noise = Noise::new(3);
    for feed in [Feed::Recorded, Feed::Live] {
        let options = EngineOptions { rig: rig(), matcher: TrackerParams::default(), feed, raw: true };
        let mut engine = Engine::new(&options, MemorySink::default(), 0);
        for round in 0..300_i64 {
            let time_ns = match noise.below(50) {
                0 => i64::MAX,
                1 => i64::MIN,
                _ => round * 10 * MS,
            };
            let time_ns = if round < 200 { time_ns.clamp(0, 100_000 * MS) } else { time_ns };
            let pool = [0x02, 0x80, 0x03, 0x00, 0xA0, 0xB0, 0xFA, 0xFB, noise.byte()];
            let bytes: Vec<u8> =
                (0..noise.below(900)).map(|_| pool[noise.below(pool.len() as u32)]).collect();
            engine.bytes(time_ns, Port::ALL[noise.below(3)], &bytes);
            while engine.next_command().is_some() || engine.next_event().is_some() {}
        }
        let (_, sink) = engine.finish(0);
        for (topic, _, _, bytes) in &sink.messages {
            assert!(AnyMessage::decode(topic.type_name(), bytes).is_ok());
        }
    }
}

#[test]
fn commands_that_nobody_fetches_are_counted_as_dropped_and_events_as_untold() {
    let options =
        EngineOptions { rig: rig(), matcher: TrackerParams::default(), feed: Feed::Live, raw: false };
    let mut engine = Engine::new(&options, MemorySink::default(), 0);
    engine.advance(60_000 * MS);
    let commands = std::iter::from_fn(|| engine.next_command()).count();
    for _ in 0..QUEUE_CAPACITY {
        engine.port_lost(60_000 * MS, Port::Base);
    }
    // The searches have said that nobody answers: so many more events than fit.
    let events = std::iter::from_fn(|| engine.next_event()).count();
    engine.advance(62_000 * MS);
    let (report, sink) = engine.finish(62_000 * MS);
    assert_eq!((commands, events), (QUEUE_CAPACITY, QUEUE_CAPACITY));
    let losses = &report.losses;
    assert!(losses.dropped > 0 && losses.lost == losses.dropped && losses.unreported > 0, "{report:?}");
    let (_, health) = sink.healths.last().unwrap();
    assert_eq!((health.dropped, health.unreported), (report.losses.dropped, report.losses.unreported));
}

#[test]
fn nobody_is_called_late_before_what_the_line_held_by_then_was_read() {
    let options =
        EngineOptions { rig: rig(), matcher: TrackerParams::default(), feed: Feed::Live, raw: false };
    let mut engine = Engine::new(&options, MemorySink::default(), START_NS);
    let done = |engine: &mut Engine<MemorySink>| {
        let commands = std::iter::from_fn(|| engine.next_command()).count();
        (commands, std::iter::from_fn(|| engine.next_event()).count())
    };
    let received = |engine: &mut Engine<MemorySink>, port, up_to_ns| engine.read_watermark(port, up_to_ns);
    Port::ALL.into_iter().for_each(|port| received(&mut engine, port, START_NS));
    assert_ne!(done(&mut engine).0, 0, "the first questions");
    engine.advance(START_NS + 5_000 * MS);
    assert_eq!(done(&mut engine), (0, 0));
    received(&mut engine, Port::Base, START_NS + 5_000 * MS);
    engine.advance(START_NS + 5_001 * MS);
    while let Some((port, _)) = engine.next_command() {
        assert_eq!(port, Port::Base);
    }
    received(&mut engine, Port::Horizontal, START_NS + 5_000 * MS);
    engine.advance(START_NS + 5_002 * MS);
    assert!(std::iter::from_fn(|| engine.next_command()).any(|(port, _)| port == Port::Horizontal));
}

#[test]
fn an_engine_is_small_enough_to_be_moved_about_on_the_stack_of_a_thread() {
    let bytes = size_of::<Engine<MemorySink>>();
    assert!(bytes <= 32 << 10, "{bytes}");
}
