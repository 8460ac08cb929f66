//! What a scan costs at worst: scans that nobody would send, one kind after the other.
//!
//! Every kind begins with an ordinary drive through a room, so that there is a map to search.

use biplane_clock::thread_cpu_ns;
use biplane_geometry::PortableMath;
use biplane_matcher::{Beam, Method, Pose2, Scan, Tracker, TrackerParams};
use serde::Serialize;

use super::Spread;

/// Scans of each kind that are timed: enough for a 99th percentile.
const SCANS: usize = 400;
/// Ordinary scans before them, which make the map.
const BEFORE: usize = 200;

/// What one kind of scan costs.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct WorstCase {
    /// The matcher.
    pub matcher: &'static str,
    /// What the scans look like.
    pub scans: &'static str,
    /// Whether odometry comes with them.
    pub with_odometry: bool,
    /// Processor time of the thread, microseconds a scan.
    pub cpu_us: Spread,
}

/// The range of a beam: the base in the room, the beam's angle, and random numbers.
type Kind = fn(&Pose2, f64, &mut Noise) -> f32;

const KINDS: [(&str, Kind); 6] = [
    ("a room", |base, angle_rad, noise| room_m(base, angle_rad) + 0.02 * noise.next()),
    ("random ranges", |_, _, noise| 10.0 + 9.9 * noise.next()),
    ("all at the longest range", |_, _, _| 39.9),
    ("nothing comes back", |_, _, _| f32::INFINITY),
    ("a circle about the laser", |_, _, _| 1.0),
    // Another place with every scan: the map contradicts, the surroundings are searched each time.
    ("the room, jumping", |base, angle_rad, noise| {
        let (x_m, y_m) = (f64::from(noise.held()), f64::from(noise.held()));
        room_m(&(*base * Pose2::new(x_m, y_m, 3.0 * x_m)), angle_rad)
    }),
];

/// Times every kind of scan of so many beams, with both methods, with odometry and without.
pub(crate) fn worst_cases(beams: usize) -> Vec<WorstCase> {
    let cases = Method::ALL.into_iter().flat_map(|method| [true, false].map(|odometry| (method, odometry)));
    let time = |(method, with_odometry): (Method, bool)| {
        KINDS.map(|(scans, kind)| WorstCase {
            matcher: method.name(),
            scans,
            with_odometry,
            cpu_us: run(method, beams, with_odometry, kind),
        })
    };
    cases.flat_map(time).collect()
}

fn run(method: Method, count: usize, with_odometry: bool, kind: Kind) -> Spread {
    let mut tracker = Tracker::new(TrackerParams::for_method(method));
    let mut noise = Noise { state: 1, held: [0.0; 2], turn: 0 };
    let mut times_ns = Vec::new();
    for index in 0..BEFORE + SCANS {
        let at = index as f64 * 0.01;
        let base = Pose2::new(2.0 * at.portable_sin(), 1.0 - at.portable_cos(), at);
        noise.hold();
        let beams = scan(&base, count, if index < BEFORE { KINDS[0].1 } else { kind }, &mut noise);
        let stamp_ns = index as i64 * 13_320_000;
        let scan = Scan { stamp_ns, laser_in_base_m: [0.0; 2], beams: &beams, twist_in_base: [0.0; 3] };
        let before_ns = thread_cpu_ns();
        tracker.track(&scan, with_odometry.then_some(base));
        if index >= BEFORE {
            times_ns.push(thread_cpu_ns() - before_ns);
        }
    }
    Spread::of_ns(&mut times_ns)
}

/// Beams over half a turn.
fn scan(base: &Pose2, count: usize, kind: Kind, noise: &mut Noise) -> Vec<Beam> {
    let beam = |index: usize| {
        let angle_rad = (index as f64 / (count as f64 - 1.0) - 0.5) * std::f64::consts::PI;
        let direction_in_base = [angle_rad.portable_cos() as f32, angle_rad.portable_sin() as f32];
        Beam { direction_in_base, range_m: kind(base, angle_rad, noise), delay_s: 0.0 }
    };
    (0..count).map(beam).collect()
}

/// The range from inside a rectangle 8 by 6 m about the origin, meters.
fn room_m(base: &Pose2, angle_rad: f64) -> f32 {
    let (sin, cos) = (base.theta_rad + angle_rad).portable_sin_cos();
    let to_x = if cos > 0.0 { (4.0 - base.x_m) / cos } else { (-4.0 - base.x_m) / cos };
    let to_y = if sin > 0.0 { (3.0 - base.y_m) / sin } else { (-3.0 - base.y_m) / sin };
    to_x.abs().min(to_y.abs()) as f32
}

/// Numbers that look random, the same in every run.
struct Noise {
    state: u64,
    held: [f32; 2],
    turn: usize,
}

impl Noise {
    /// The next one, -1 to 1.
    fn next(&mut self) -> f32 {
        self.state =
            self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.state >> 40) as f32 / f64::from(1 << 23) as f32 - 1.0
    }

    /// New numbers to hold for a scan.
    fn hold(&mut self) {
        self.held = [self.next(), self.next()];
    }

    /// The two numbers that are held, in turn.
    fn held(&mut self) -> f32 {
        self.turn += 1;
        self.held[self.turn % 2]
    }
}
