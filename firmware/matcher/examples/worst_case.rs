//! What a scan costs at worst: scans that nobody would send, one kind after the other, and the longest time of one scan.
//!
//! `cargo run --release -p biplane-matcher --example worst_case [-- BEAMS]` prints, for both methods, processor time a scan in
//! microseconds. Every kind begins with an ordinary drive through a room, so that there is a map to search.

use biplane_clock::thread_cpu_ns;
use biplane_matcher::{Beam, Method, Pose2, Scan, Tracker, TrackerParams};

/// Scans of each kind, and ordinary ones before them.
const SCANS: usize = 400;
const BEFORE: usize = 200;

/// A kind of scan.
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

fn main() {
    let beams = std::env::args().nth(1).and_then(|word| word.parse().ok()).unwrap_or(181);
    println!("{beams} beams, us a scan         {:>10} {:>10} {:>10}", "p50", "p99", "max");
    for method in Method::ALL {
        for with_odometry in [true, false] {
            for (name, kind) in KINDS {
                let [p50, p99, max] = run(method, beams, with_odometry, kind);
                let odometry = if with_odometry { "" } else { ", no odometry" };
                println!("{:42} {p50:10.0} {p99:10.0} {max:10.0}", format!("{method}: {name}{odometry}"));
            }
        }
    }
}

fn run(method: Method, count: usize, with_odometry: bool, kind: Kind) -> [f64; 3] {
    let mut tracker = Tracker::new(TrackerParams::for_method(method));
    let mut noise = Noise { state: 1, held: [0.0; 2], turn: 0 };
    let mut times_ns = Vec::new();
    for index in 0..BEFORE + SCANS {
        let at = index as f64 * 0.01;
        let base = Pose2::new(2.0 * at.sin(), 1.0 - at.cos(), at);
        noise.hold();
        let kind = if index < BEFORE { KINDS[0].1 } else { kind };
        let beams: Vec<Beam> = (0..count)
            .map(|beam| {
                let angle_rad = (beam as f64 / (count as f64 - 1.0) - 0.5) * std::f64::consts::PI;
                let direction_in_base = [angle_rad.cos() as f32, angle_rad.sin() as f32];
                Beam { direction_in_base, range_m: kind(&base, angle_rad, &mut noise), delay_s: 0.0 }
            })
            .collect();
        let stamp_ns = index as i64 * 13_320_000;
        let scan = Scan { stamp_ns, laser_in_base_m: [0.0; 2], beams: &beams, twist_in_base: [0.0; 3] };
        let before_ns = thread_cpu_ns();
        tracker.track(&scan, with_odometry.then_some(base));
        if index >= BEFORE {
            times_ns.push(thread_cpu_ns() - before_ns);
        }
    }
    times_ns.sort_unstable();
    [0.5, 0.99, 1.0].map(|share| times_ns[((share * SCANS as f64) as usize).min(SCANS - 1)] as f64 * 1e-3)
}

/// The range from inside a rectangle 8 by 6 m about the origin, metres.
fn room_m(base: &Pose2, angle_rad: f64) -> f32 {
    let (sin, cos) = (base.theta_rad + angle_rad).sin_cos();
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
