//! A simulated drive over each base's protocol, through session and mock device, in simulated time: with a
//! power cycle, a silent line and a line of garbage. The truth is the source's own way and heading,
//! integrated in steps of a millisecond.
//!
//! `cargo test -p biplane-onboard --test bases -- --nocapture` prints the errors.

use biplane_mock::devices::base::counters::{CountScale, SourceCounts};
use biplane_mock::devices::base::feed::CycleFeed;
use biplane_mock::devices::base::rflex::{RflexDevice, RflexParams};
use biplane_mock::devices::base::roboclaw::{RoboClawDevice, RoboClawParams};
use biplane_mock::devices::base::{BaseDevice, BaseParams};
use biplane_mock::devices::device::Device;
use biplane_mock::devices::lms::scans::feed::Timeline;
use biplane_mock::faults::device::power_cycle::PowerCycle;
use biplane_mock::faults::episodes::Episode;
use biplane_mock::faults::{Faults, Preset};
use biplane_mock::line::Channel;
use biplane_mock::rig::source::{OdometrySample, OdometrySource};
use biplane_mock::rng::Rng;
use biplane_onboard::{BaseSession, BaseSettings, Event, Input, MAX_INPUT_BYTES, Output, Session};
use biplane_recording::rig::BaseProtocol;

const MS: i64 = 1_000_000;
const S: i64 = 1_000 * MS;
const END_NS: i64 = 50 * S;
/// The robot stands before and after this, and between 20 and 28 s.
const DRIVE_S: (f64, f64) = (5.0, 46.0);

/// How the robot goes at a time: meters and radians a second.
type Speeds = fn(f64) -> (f64, f64);

/// 1 m/s with gentle turns to both sides; standing while the power is gone.
fn with_a_rest(time_s: f64) -> (f64, f64) {
    if !(DRIVE_S.0..DRIVE_S.1).contains(&time_s) || (20.0..28.0).contains(&time_s) {
        (0.0, 0.0)
    } else {
        (1.0, 0.25 * (0.5 * time_s).sin())
    }
}

/// 1 m/s straight on to the end.
fn straight(time_s: f64) -> (f64, f64) {
    (f64::from(time_s >= DRIVE_S.0), 0.0)
}

/// The same in a circle of 25 m.
fn in_a_circle(time_s: f64) -> (f64, f64) {
    (f64::from(time_s >= DRIVE_S.0), if time_s >= DRIVE_S.0 { 0.04 } else { 0.0 })
}

/// Way, heading, x and y, one a millisecond.
fn drive(speeds: Speeds) -> Vec<[f64; 4]> {
    let mut at = [0.0_f64; 4];
    let mut states = vec![at];
    for ms in 0..END_NS / MS {
        let (speed, turn) = speeds(ms as f64 * 1e-3);
        let middle = at[1] + turn * 0.5e-3;
        at = [
            at[0] + speed * 1e-3,
            at[1] + turn * 1e-3,
            at[2] + speed * 1e-3 * middle.cos(),
            at[3] + speed * 1e-3 * middle.sin(),
        ];
        states.push(at);
    }
    states
}

struct Driven {
    states: Vec<[f64; 4]>,
}

impl Driven {
    fn at(&self, time_ns: i64) -> [f64; 4] {
        let last = self.states.len() - 1;
        self.states[((time_ns / MS).max(0) as usize).min(last)]
    }
}

impl OdometrySource for Driven {
    fn sample(&mut self, time_ns: i64) -> OdometrySample {
        let [path_m, heading_rad, x_m, y_m] = self.at(time_ns);
        let units = (heading_rad / std::f64::consts::TAU * 4096.0).round() as i64;
        OdometrySample {
            x_raw: ((x_m * 1e3).round() as i64 & 0x7FFF) as u16,
            y_raw: ((y_m * 1e3).round() as i64 & 0x7FFF) as u16,
            theta_raw: ((units + 2048).rem_euclid(4096) - 2048) as i16,
            path_um: (path_m * 1e6).round() as i64,
            heading_urad: (heading_rad * 1e6).round() as i64,
            ..OdometrySample::default()
        }
    }
}

struct Same;

impl Timeline for Same {
    fn world_ns(&self, device_ns: i64) -> i64 {
        device_ns
    }
}

const P2OS: BaseSettings =
    BaseSettings { baud: 9600, protocol: BaseProtocol::P2os { metres_per_tick: None } };
const ROBOCLAW: BaseSettings = BaseSettings {
    baud: 38_400,
    protocol: BaseProtocol::RoboClaw {
        address: 0x83,
        wheel_base_m: 0.42,
        metres_per_count_left: 1.1e-4,
        metres_per_count_right: -1.2e-4,
    },
};
const RFLEX: BaseSettings = BaseSettings {
    baud: 115_200,
    protocol: BaseProtocol::Rflex { counts_per_m: 101_230.0, counts_per_rad: 35_343.888 },
};
const ALL: [(&str, BaseSettings); 3] = [("p2os", P2OS), ("roboclaw", ROBOCLAW), ("rflex", RFLEX)];

/// From power-on until a base answers.
const BOOT_NS: i64 = S;

/// Just below the border of the counters.
const AT_THE_BORDER: [i32; 2] = [i32::MAX - 1000, i32::MIN + 1000];

/// A base that drives so, its counters beginning here.
fn device(settings: &BaseSettings, speeds: Speeds, first_counts: [i32; 2]) -> Box<dyn Device> {
    let source = Box::new(Driven { states: drive(speeds) });
    let counted = |source| {
        let scale = CountScale::of(&settings.protocol).expect("it counts");
        Box::new(SourceCounts::new(source, Box::new(Same), scale))
    };
    match settings.protocol {
        BaseProtocol::None => panic!("a base"),
        BaseProtocol::P2os { .. } => {
            let feed = CycleFeed::new(source, Box::new(Same), 100 * MS);
            let params = BaseParams { boot_ns: BOOT_NS, ..BaseParams::default() };
            Box::new(BaseDevice::new(params, Box::new(feed)))
        }
        BaseProtocol::RoboClaw { address, .. } => {
            let params =
                RoboClawParams { address, first_counts, boot_ns: BOOT_NS, ..RoboClawParams::default() };
            Box::new(RoboClawDevice::new(params, counted(source)))
        }
        BaseProtocol::Rflex { .. } => {
            let params = RflexParams { first_counts, boot_ns: BOOT_NS, ..RflexParams::default() };
            Box::new(RflexDevice::new(params, counted(source)))
        }
    }
}

/// What goes wrong while the base is driven.
#[derive(Copy, Clone, Debug, PartialEq)]
enum Trouble {
    None,
    /// Power gone, standing.
    Reset(Episode),
    /// No byte comes through in either direction.
    Silence(Episode),
    /// Random bytes come instead of the base's, and none reaches it.
    Garbage(Episode),
    /// One of the mock's faults of lines, from the start to the end.
    Preset(Preset),
}

impl Trouble {
    fn episode(self) -> Option<Episode> {
        match self {
            Self::None | Self::Preset(_) => None,
            Self::Reset(episode) | Self::Silence(episode) | Self::Garbage(episode) => Some(episode),
        }
    }
}

/// What came of a drive.
#[derive(Default)]
struct Account {
    /// When, what: x, y, heading.
    poses: Vec<(i64, [f64; 3])>,
    events: Vec<(i64, Event)>,
}

/// Session and device on a line.
struct Bench {
    session: BaseSession,
    device: Box<dyn Device>,
    trouble: Trouble,
    rng: Rng,
    account: Account,
    /// Bytes under way to the device.
    sent: Vec<(i64, Vec<u8>)>,
    /// What the line makes of the bytes, from the device and to it.
    lines: [Channel; 2],
    noise_ns: i64,
}

impl Bench {
    fn new(settings: BaseSettings, trouble: Trouble, seed: u64) -> Self {
        let device = device(&settings, with_a_rest, AT_THE_BORDER);
        Self::of(device, settings, trouble, seed)
    }

    fn of(device: Box<dyn Device>, settings: BaseSettings, trouble: Trouble, seed: u64) -> Self {
        let device = match trouble {
            Trouble::Reset(episode) => Box::new(PowerCycle::given(device, &[episode])),
            _ => device,
        };
        Self {
            session: BaseSession::streaming(settings, 0),
            device,
            trouble,
            rng: Rng::new(seed, 0xBA5E, 0),
            account: Account::default(),
            sent: Vec::new(),
            lines: [0, 1].map(|stream| match trouble {
                Trouble::Preset(preset) => Faults::new(&[preset], seed).channel(stream),
                _ => Channel::default(),
            }),
            noise_ns: 0,
        }
    }

    fn cut(&self, now_ns: i64) -> bool {
        match self.trouble {
            Trouble::Silence(episode) | Trouble::Garbage(episode) => {
                (episode.from_ns..episode.to_ns).contains(&now_ns)
            }
            _ => false,
        }
    }

    /// Polls the session dry; until when it can wait.
    fn drain(&mut self, now_ns: i64) -> i64 {
        loop {
            match self.session.poll() {
                Output::WaitUntil(wait_ns) => return wait_ns,
                Output::Write(bytes) => {
                    let busy_ns = bytes.len() as i64 * 10 * S / i64::from(self.device.baud());
                    self.sent.push((now_ns + busy_ns, bytes.to_vec()));
                }
                Output::Event(event) => self.account.events.push((now_ns, event)),
                Output::Odometry(reading) => {
                    let pose = reading.odom_from_base;
                    self.account.poses.push((now_ns, [pose.x_m, pose.y_m, pose.theta_rad]));
                }
                _ => {}
            }
        }
    }

    fn hear(&mut self, now_ns: i64, bytes: &[u8]) {
        for piece in bytes.chunks(MAX_INPUT_BYTES) {
            self.session.handle(now_ns, Input::Bytes(piece));
            self.drain(now_ns);
        }
    }

    fn run(mut self) -> Account {
        let mut now_ns = 0;
        while now_ns < END_NS {
            let due = self.sent.extract_if(.., |(at_ns, _)| *at_ns <= now_ns).collect::<Vec<_>>();
            due.into_iter().for_each(|(_, bytes)| self.lines[1].push(now_ns, &bytes));
            let mut commands = Vec::new();
            self.lines[1].take(now_ns, &mut commands);
            if !self.cut(now_ns) && !commands.is_empty() {
                self.device.handle(now_ns, &commands);
            }
            let mut left = Vec::new();
            let device_ns = self.device.poll(now_ns, &mut left);
            self.lines[0].push(now_ns, &left);
            let mut out = Vec::new();
            self.lines[0].take(now_ns, &mut out);
            if self.cut(now_ns) {
                out.clear();
                if matches!(self.trouble, Trouble::Garbage(_)) && now_ns >= self.noise_ns {
                    out = (0..20).map(|_| (self.rng.unit() * 256.0) as u8).collect();
                    self.noise_ns = now_ns + 20 * MS;
                }
            }
            if !out.is_empty() {
                self.hear(now_ns, &out);
            }
            if self.drain(now_ns) <= now_ns {
                self.session.handle(now_ns, Input::Time);
            }
            let wait_ns = self.drain(now_ns);
            let sent_ns = self.sent.iter().map(|(at_ns, _)| *at_ns).min().unwrap_or(i64::MAX);
            let line_ns = self.lines.iter().filter_map(Channel::next_due_ns).min().unwrap_or(i64::MAX);
            let next_ns = device_ns.min(wait_ns).min(sent_ns).min(line_ns).min(now_ns + 5 * MS);
            now_ns = next_ns.max(now_ns + 50_000);
        }
        self.account
    }
}

/// Distance and heading between where the base believes to be at its last report and where it is when that
/// has come.
fn error(account: &Account, driven: &Driven) -> (f64, f64) {
    let (at_ns, [x_m, y_m, heading_rad]) = *account.poses.last().expect("odometry");
    let [_, true_rad, true_x_m, true_y_m] = driven.at(at_ns);
    let turn_rad = (heading_rad - true_rad).sin().atan2((heading_rad - true_rad).cos());
    ((x_m - true_x_m).hypot(y_m - true_y_m), turn_rad.abs())
}

fn first_after(account: &Account, after_ns: i64, is: impl Fn(&Event) -> bool) -> Option<i64> {
    account.events.iter().find(|(at_ns, event)| *at_ns >= after_ns && is(event)).map(|(at_ns, _)| *at_ns)
}

fn lost(event: &Event) -> bool {
    matches!(event, Event::Silent { .. } | Event::Garbled { .. })
}

/// Drives with this trouble; the error at the end, said and checked against what is allowed.
fn check(name: &str, settings: BaseSettings, trouble: Trouble, seed: u64, allowed: (f64, f64)) -> Account {
    let driven = Driven { states: drive(with_a_rest) };
    let account = Bench::new(settings, trouble, seed).run();
    let (off_m, off_rad) = error(&account, &driven);
    let count = account.poses.len();
    println!("{name:8} {trouble:?} seed {seed}: {count} reports, off by {off_m:.4} m, {off_rad:.5} rad");
    assert!(off_m <= allowed.0 && off_rad <= allowed.1, "{name} {trouble:?}: {off_m} m, {off_rad} rad");
    let Some(episode) = trouble.episode() else { return account };
    let noticed_ns = first_after(&account, episode.from_ns, lost).expect("the trouble is noticed");
    assert!(noticed_ns - episode.from_ns <= S, "{name} {trouble:?}: noticed at {noticed_ns}");
    let back_ns = account.poses.iter().map(|(at_ns, _)| *at_ns).find(|at_ns| *at_ns >= episode.to_ns);
    // A base that was switched on boots first.
    let boot_ns = if matches!(trouble, Trouble::Reset(_)) { BOOT_NS } else { 0 };
    let took_ns = back_ns.expect("odometry flows again") - episode.to_ns - boot_ns;
    assert!(took_ns <= 2 * S, "{name} {trouble:?}: back after {took_ns} ns");
    account
}

#[test]
fn a_drive_comes_out_as_it_was_over_every_protocol() {
    for (name, settings) in ALL {
        let account = check(name, settings, Trouble::None, 1, (0.01, 0.002));
        let lost = account.events.iter().filter(|(_, event)| lost(event)).count();
        assert_eq!(lost, 0, "{name}: {:?}", account.events);
        let wanted = if name == "roboclaw" { 2000 } else { 460 };
        assert!(account.poses.len() > wanted, "{name}: {} reports", account.poses.len());
    }
}

#[test]
fn a_base_that_was_switched_off_and_on_goes_on_where_it_was() {
    for (name, settings) in ALL {
        let dark = Episode { from_ns: 21 * S, to_ns: 23 * S };
        let account = check(name, settings, Trouble::Reset(dark), 1, (0.02, 0.004));
        let restarted = first_after(&account, dark.to_ns, |event| *event == Event::OdometryRestarted);
        assert!(restarted.is_some(), "{name}: {:?}", account.events);
    }
}

#[test]
fn a_silent_line_loses_no_way() {
    for (name, settings) in ALL {
        for (seed, from_ns) in [10 * S, 30 * S + 137 * MS, 40 * S + 11 * MS].into_iter().enumerate() {
            let silence = Episode { from_ns, to_ns: from_ns + 1_500 * MS };
            // Way and turn go on in the base's counters; where they are not a pose, the path between them is
            // taken as one arc. For turns that change by 0.125 rad/s2 for t seconds at 1 m/s that is off by
            // 0.125 t^3 / 12, here about 0.06 m.
            check(name, settings, Trouble::Silence(silence), seed as u64, (0.06, 0.004));
        }
    }
}

/// The furthest that two reports behind each other are apart, meters, and by how much that is further than
/// the robot went meanwhile.
fn leaps(account: &Account, driven: &Driven) -> (f64, f64) {
    let leap = |pair: &[(i64, [f64; 3])]| {
        let [(a_ns, [ax, ay, _]), (b_ns, [bx, by, _])] = [pair[0], pair[1]];
        let leap_m = (bx - ax).hypot(by - ay);
        (leap_m, leap_m - (driven.at(b_ns)[0] - driven.at(a_ns)[0]))
    };
    let furthest = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1.max(b.1));
    account.poses.windows(2).map(leap).fold((0.0, f64::MIN), furthest)
}

#[test]
fn a_base_that_is_reset_or_not_heard_while_it_drives_never_leaps_further_than_it_drove() {
    for (name, settings) in ALL {
        for speeds in [straight as Speeds, in_a_circle] {
            let driven = Driven { states: drive(speeds) };
            for origin_m in [0.5, 1.0, 2.0, 5.0, 8.0, 12.0, 16.4, 20.0] {
                let from_ns = 5 * S + (origin_m * 1e9) as i64;
                let episode = Episode { from_ns, to_ns: from_ns + 2 * S };
                for trouble in [Trouble::Reset(episode), Trouble::Silence(episode)] {
                    let device = device(&settings, speeds, [0, 0]);
                    let account = Bench::of(device, settings, trouble, 1).run();
                    let (leap_m, too_far_m) = leaps(&account, &driven);
                    let what = format!("{name} {trouble:?} at {origin_m} m");
                    assert!(
                        too_far_m <= 0.15,
                        "{what}: leaps by {leap_m} m, {too_far_m} m further than it went"
                    );
                    let restarts =
                        account.events.iter().filter(|(_, event)| *event == Event::OdometryRestarted).count();
                    let reset = matches!(trouble, Trouble::Reset(_));
                    // Within a meter of zero counts alone do not tell.
                    let minimum = usize::from(reset && (name == "p2os" || origin_m > 1.0));
                    assert!(
                        (minimum..=usize::from(reset)).contains(&restarts),
                        "{what}: {restarts} restarts"
                    );
                    let (off_m, off_rad) = error(&account, &driven);
                    // What went unseen until the base was back is lost, and so is the turn on it.
                    let unseen_m = if reset { 3.1 } else { 0.0 };
                    let unseen = (0.06 + unseen_m * (1.0 + 0.04 * 45.0), 0.004 + unseen_m * 0.04);
                    println!(
                        "{what}: leaps by {leap_m:.3} m, off by {off_m:.3} m, {off_rad:.4} rad, {restarts} restarts"
                    );
                    assert!(
                        off_m <= unseen.0 && off_rad <= unseen.1,
                        "{what}: off by {off_m} m, {off_rad} rad"
                    );
                }
            }
        }
    }
}

#[test]
fn garbage_on_the_line_is_told_and_moves_nothing() {
    for (name, settings) in ALL {
        for seed in 0..10 {
            let from_ns = 12 * S + seed * 311 * MS;
            let garbage = Episode { from_ns, to_ns: from_ns + 2 * S };
            // As with silence, for 2 s and the time to find the base again: about 0.16 m.
            let account = check(name, settings, Trouble::Garbage(garbage), seed as u64, (0.16, 0.004));
            let furthest_m = account.poses.windows(2).map(|pair| {
                let ([ax, ay, _], [bx, by, _]) = (pair[0].1, pair[1].1);
                (bx - ax).hypot(by - ay)
            });
            assert!(furthest_m.fold(0.0, f64::max) < 4.5, "{name} seed {seed}");
        }
    }
}

/// `BIPLANE_SEEDS` says how many drives; ten without it.
#[test]
fn faults_of_the_line_cost_reports_and_no_way() {
    let seeds = std::env::var("BIPLANE_SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(10);
    for (name, settings) in ALL {
        for (preset, minimum) in
            [(Preset::BitNoise, 0.95), (Preset::LooseConnector, 0.6), (Preset::UsbStall, 0.6)]
        {
            let whole = if name == "roboclaw" { 2500.0 } else { 490.0 };
            for seed in 0..seeds {
                let account = check(name, settings, Trouble::Preset(preset), seed, (0.03, 0.004));
                let kept = account.poses.len() as f64 / whole;
                assert!(kept >= minimum, "{name} {preset:?} seed {seed}: {kept:.2} of the reports");
                let restarts = account.events.iter().filter(|(_, event)| *event == Event::OdometryRestarted);
                assert_eq!(restarts.count(), 0, "{name} {preset:?} seed {seed}");
            }
        }
    }
}

/// A session with a Pioneer that drives straight on, for five seconds; `look` sees the base after each step.
fn five_seconds_with(
    params: BaseParams,
    mut look: impl FnMut(i64, &BaseDevice),
) -> (BaseSession, BaseDevice) {
    let feed = CycleFeed::new(Box::new(Driven { states: drive(straight) }), Box::new(Same), 100 * MS);
    let mut base = BaseDevice::new(params, Box::new(feed));
    let mut session = BaseSession::streaming(P2OS, 0);
    for ms in 0..5_000 {
        let now_ns = ms * MS;
        let mut left = Vec::new();
        base.poll(now_ns, &mut left);
        match left.is_empty() {
            true => session.handle(now_ns, Input::Time),
            false => session.handle(now_ns, Input::Bytes(&left)),
        }
        loop {
            match session.poll() {
                Output::WaitUntil(_) => break,
                Output::Write(bytes) => base.handle(now_ns, &bytes),
                _ => {}
            }
            look(ms, &base);
        }
    }
    (session, base)
}

#[test]
fn a_pioneer_that_a_crashed_client_left_driving_is_never_set_in_motion() {
    // Its watchdog has stopped it; any command but STOP would let it drive on.
    for strict in [false, true] {
        let params = BaseParams { left_open: true, left_mm_s: 250, strict, ..BaseParams::default() };
        let (session, base) =
            five_seconds_with(params, |ms, base| assert_eq!(base.driven_mm_s(), 0, "at {ms} ms"));
        assert!(session.is_streaming() && base.is_streaming());
    }
}

#[test]
fn a_base_that_takes_any_packet_before_sync0_for_a_wrong_sync_is_opened() {
    let mut opened_ms = None;
    let (session, base) =
        five_seconds_with(BaseParams { strict: true, ..BaseParams::default() }, |ms, base| {
            opened_ms = opened_ms.or(base.is_streaming().then_some(ms));
        });
    assert!(session.is_streaming());
    assert_eq!(base.counts().refused, 0);
    assert!(opened_ms.is_some_and(|ms| ms < 500), "{opened_ms:?}");
}
