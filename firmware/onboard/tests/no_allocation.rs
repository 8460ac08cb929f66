//! After start-up, the loop (sessions, stamps, matcher, publishing into the queue) allocates nothing, nor do
//! the threads that read the ports: a counting allocator watches them, in a run of the engine alone and in a
//! live run on pseudo-terminals, which somebody watches.

#[allow(dead_code)] // The tests in `live` use the rest.
#[path = "live/mock.rs"]
mod mock;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use biplane_matcher::TrackerParams;
use biplane_onboard::{
    BaseSession, BaseSettings, Engine, EngineOptions, Feed, Health, Input, Output, RecordOptions, Session,
    Sink, record,
};
use biplane_recording::rig::{InertialUnit, Mount};
use biplane_recording::{Port, Rig, Rotation, Topic};
use biplane_wire::lms::{MIRROR_TURN_NS, Scan, Status, Unit};
use biplane_wire::p2os::Sip;
use biplane_wire::roboclaw::{self, Answer, Question};
use biplane_wire::{Text, rflex, xsens};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// Whether the threads of a live run are watched now.
static WATCHING: AtomicBool = AtomicBool::new(false);
/// Allocations of the watched threads: the loop, and those that read ports.
static LIVE: [AtomicU64; 2] = [AtomicU64::new(0), AtomicU64::new(0)];

fn count() {
    ALLOCATIONS.with(|count| count.set(count.get() + 1));
    if WATCHING.load(Ordering::Relaxed) {
        count_live();
    }
}

/// Asks the kernel for the thread's name: that allocates nothing.
fn count_live() {
    let mut name = [0_u8; 16];
    // SAFETY: PR_GET_NAME writes at most 16 bytes with a zero at the end; `name` has room for them.
    unsafe { libc::prctl(libc::PR_GET_NAME, name.as_mut_ptr()) };
    for (begin, count) in [b"loop".as_slice(), b"read "].into_iter().zip(&LIVE) {
        count.fetch_add(u64::from(name.starts_with(begin)), Ordering::Relaxed);
    }
}

// SAFETY: everything is handed to the system's allocator; only a counter is added.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller keeps the contract of `alloc`, which is passed on as it is.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above, for `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as above, for `realloc`.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Takes everything and keeps nothing but a count.
struct Counter(u64);

impl Sink for Counter {
    fn message(&mut self, _: Topic, _: i64, _: i64, _: &[u8]) {
        self.0 += 1;
    }

    fn health(&mut self, _: i64, _: &Health) {}

    fn dropped(&self) -> u64 {
        0
    }
}

/// The walls of a room 10 x 5 m around the base, seen from `x_m` in it.
fn scan(x_m: f64) -> Vec<u8> {
    let values = (0..181).map(|beam| {
        let (sin, cos) = f64::from(beam - 90).to_radians().sin_cos();
        let to_x = if cos > 1e-9 { (7.0 - x_m) / cos } else { f64::INFINITY };
        let to_y = if sin.abs() < 1e-9 { f64::INFINITY } else { (if sin > 0.0 { 3.0 } else { -2.0 }) / sin };
        (to_x.min(to_y) * 100.0).round() as u16
    });
    let scan = Scan { unit: Unit::Cm, values: values.collect(), status: Status::OK, ..Scan::default() };
    let mut bytes = vec![0; scan.encoded_len()];
    scan.emit(0x80, &mut bytes).expect("it fits");
    bytes
}

fn report(x_m: f64) -> Vec<u8> {
    let sip = Sip { x_raw: (x_m * 1000.0) as u16, ..Sip::default() };
    let mut bytes = vec![0; sip.encoded_len()];
    sip.emit(&mut bytes).expect("it fits");
    bytes
}

/// A sample of an inertial unit, at this round, which takes 106.6 ms.
fn inertial_sample(round: usize, out: &mut [u8]) -> usize {
    let sample = xsens::Sample {
        packet_counter: Some(round as u16),
        time_fine: Some((round as u32).wrapping_mul(1066)),
        acceleration_m_s2: Some([0.0, 0.0, 9.8]),
        turn_rad_s: Some([0.0; 3]),
        ..xsens::Sample::default()
    };
    let mut items = xsens::ItemsWriter::default();
    sample.write(xsens::Precision::Float32, &mut items).expect("there is room");
    let report = xsens::Report::Data(xsens::Items::parse(items.bytes()).expect("whole items"));
    report.emit(out).expect("it fits")
}

#[test]
fn two_thousand_scans_of_both_lasers_are_matched_and_published_without_an_allocation() {
    let flat = Mount::default();
    let mut rig = Rig::default();
    rig.horizontal.mount = flat;
    rig.imu = Some(InertialUnit::xsens("imu"));
    let options = EngineOptions { rig, matcher: TrackerParams::default(), feed: Feed::Recorded, raw: true };
    let mut engine = Engine::new(&options, Counter(0), 0);
    // To and fro over three meters, in telegrams made beforehand.
    let places: Vec<f64> = (0..60).map(|i| f64::from(30 - (i - 30_i32).abs()) * 0.1).collect();
    let scans: Vec<_> = places.iter().map(|&x_m| scan(x_m)).collect();
    let reports: Vec<_> = places.iter().map(|&x_m| report(x_m)).collect();
    let period_ns = 8 * MIRROR_TURN_NS;
    let mut drive = |rounds: std::ops::Range<usize>| {
        for round in rounds {
            let place = round % places.len();
            let now_ns = round as i64 * period_ns;
            engine.bytes(now_ns, Port::Base, &reports[place]);
            let mut sample = [0; 64];
            let length = inertial_sample(round, &mut sample);
            engine.bytes(now_ns, Port::Imu, &sample[..length]);
            for (index, piece) in scans[place].chunks(100).enumerate() {
                engine.bytes(now_ns + index as i64 * 10_000_000, Port::Horizontal, piece);
                engine.bytes(now_ns + index as i64 * 10_000_000, Port::Vertical, piece);
            }
            while engine.next_event().is_some() || engine.next_command().is_some() {}
        }
    };
    drive(0..200);
    let before = ALLOCATIONS.with(Cell::get);
    assert!(before > 0, "the counter counts");
    drive(200..2200);
    let allocations = ALLOCATIONS.with(Cell::get) - before;
    assert_eq!(allocations, 0);
    let (account, sink) = engine.finish(2200 * period_ns);
    assert_eq!(
        (account.recorded.poses, account.recorded.poses_vertical, account.losses.lost),
        (2200, 2200, 0)
    );
    assert_eq!(account.recorded.inertial, 2200);
    assert!(sink.0 > 10_000);
}

/// What a base answers to what it was sent, into `out`: encoders, version and battery of a RoboClaw; both
/// axes of an rFLEX base, asked or not.
fn base_answer(sent: Option<&[u8]>, count: i32, out: &mut [u8]) -> usize {
    let Some(sent) = sent else {
        let report = |axis, position| {
            rflex::Report::Motion(rflex::MotionReport { axis, position, ..rflex::MotionReport::default() })
        };
        let length = report(rflex::TRANSLATION, count).emit(1, out).unwrap();
        return length + report(rflex::ROTATION, -count).emit(2, &mut out[length..]).unwrap();
    };
    let Ok(request) = roboclaw::Request::parse(sent) else { return 0 };
    let answer = match request.question {
        Question::Encoders => Answer::Encoders { m1_counts: count, m2_counts: count + 7 },
        Question::MainBattery => Answer::MainBattery { decivolts: 123 },
        Question::Firmware => Answer::Firmware(Text(b"RoboClaw v4\n")),
        Question::Status(width) => Answer::Status(roboclaw::StatusBits { width, bits: 1 }),
        _ => return 0,
    };
    answer.emit(request, out).unwrap()
}

#[test]
fn sessions_of_bases_that_count_allocate_nothing() {
    let rig = |base: &str| {
        Rig::parse(&format!("[horizontal]\nport = \"a\"\n[base]\nport = \"b\"\nprotocol = \"{base}\"\n"))
            .unwrap()
    };
    for (rig, asked) in [(rig("roboclaw"), true), (rig("rflex"), false)] {
        let before = ALLOCATIONS.with(Cell::get);
        let mut session = BaseSession::streaming(BaseSettings::from(&rig.base), 0);
        let (mut bytes, mut reports) = ([0; 128], 0);
        for round in 0..5000_i32 {
            let now_ns = i64::from(round) * 10_000_000;
            session.handle(now_ns, Input::Time);
            let mut length = if asked { 0 } else { base_answer(None, round * 9, &mut bytes) };
            loop {
                match session.poll() {
                    Output::Write(sent) if asked => length = base_answer(Some(&sent), round * 9, &mut bytes),
                    Output::Odometry(_) => reports += 1,
                    Output::WaitUntil(_) => break,
                    _ => {}
                }
            }
            // Now and then a byte is lost, and what follows from it is no allocation either.
            let lost = usize::from(round % 100 == 99).min(length);
            session.handle(now_ns + 3_000_000, Input::Bytes(&bytes[lost..length]));
        }
        assert_eq!(ALLOCATIONS.with(Cell::get) - before, 0);
        assert!(reports > 2000, "{reports} reports");
    }
}

/// The same with a live view, and a viewer that looks at all of it, by hand: a frame of a request has a mask,
/// here of zeros.
#[cfg(feature = "live")]
fn watched(options: RecordOptions) -> (RecordOptions, thread::JoinHandle<()>) {
    use std::io::{Read, Write};
    use std::net::{TcpListener, TcpStream};
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let viewer = thread::Builder::new().name("viewer".to_owned()).spawn(move || {
        let connected = (0..100).find_map(|_| {
            thread::sleep(Duration::from_millis(50));
            TcpStream::connect(address).ok()
        });
        let mut stream = connected.expect("there is a live view");
        let hello = "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                     Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n";
        let mut all = [0; 1 << 14];
        stream.write_all(hello.as_bytes()).unwrap();
        assert!(stream.read(&mut all).unwrap() > 0);
        let wishes: Vec<_> = (1..=10).map(|id| format!(r#"{{"id":{id},"channelId":{id}}}"#)).collect();
        let text = format!(r#"{{"op":"subscribe","subscriptions":[{}]}}"#, wishes.join(","));
        let mut frame = vec![0x81, 0x80 | 126];
        frame.extend((text.len() as u16).to_be_bytes());
        frame.extend([0; 4]);
        frame.extend(text.as_bytes());
        stream.write_all(&frame).unwrap();
        while stream.read(&mut all).is_ok_and(|count| count > 0) {}
    });
    (RecordOptions { live: Some(address.to_string().parse().unwrap()), ..options }, viewer.unwrap())
}

#[cfg(not(feature = "live"))]
fn watched(options: RecordOptions) -> (RecordOptions, thread::JoinHandle<()>) {
    (options, thread::spawn(|| {}))
}

#[test]
fn a_live_run_allocates_nothing_in_its_loop_and_in_the_threads_that_read_once_it_streams() {
    let mock = mock::Mock::start("alloc", |_| {});
    let options = RecordOptions {
        // The writing thread begins new parts meanwhile, and may allocate for them.
        rotation: Rotation { span_ns: Some(1_000_000_000), bytes: None },
        duration: None,
        journal: Some(mock.folder.join("journal.csv")),
        ..mock.options(mock.rig(), 60.0)
    };
    let (options, viewer) = watched(options);
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    let run = thread::Builder::new().name("loop".to_owned()).spawn(move || record(&options, &flag)).unwrap();
    thread::sleep(Duration::from_millis(3500));
    WATCHING.store(true, Ordering::Relaxed);
    thread::sleep(Duration::from_secs(4));
    WATCHING.store(false, Ordering::Relaxed);
    let counts = LIVE.each_ref().map(|count| count.load(Ordering::Relaxed));
    WATCHING.store(true, Ordering::Relaxed);
    stop.store(true, Ordering::Relaxed);
    let report = run.join().unwrap().unwrap();
    viewer.join().unwrap();
    if let Some(live) = report.live {
        assert!(live.viewers == 1 && live.sent > 100 && live.missed == 0, "{live:?}");
    }
    assert_eq!(counts, [0, 0], "allocations of the loop and of the reading threads");
    assert!(LIVE[0].load(Ordering::Relaxed) > 0, "the watch watches: the end of a run allocates");
    assert!(
        report.recorded.scans_horizontal > 40 && report.parts.len() > 3 && report.losses.lost == 0,
        "{report:?}"
    );
    let journal = std::fs::read_to_string(mock.folder.join("journal.csv")).unwrap();
    let matches = journal.lines().filter(|line| line.split(',').nth(1) == Some("0")).count() as u64;
    assert!(
        matches + 1 >= report.recorded.scans_horizontal,
        "{matches} of {} matches",
        report.recorded.scans_horizontal
    );
}
