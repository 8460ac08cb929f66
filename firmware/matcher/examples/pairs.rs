//! The paper's figure 2 on real scans: pairs of scans with a known relative pose, matched from wrong starts.
//!
//! `cargo run --release -p biplane-matcher --example pairs -- intel.log intel_pairs.txt [--method gradient]
//! [--set NAME=VALUE]` prints, for each error of heading at the start, how many of four starts a pair (10 cm off along
//! both axes) end within 2 cm and 0.5 degrees of the known pose, and how many are grossly wrong (10 cm or 2 degrees).

use std::error::Error;

use biplane_clock::process_cpu_ns;
use biplane_matcher::{Beam, Pose2, Scan, Tracker, TrackerParams};

const OFFSET_M: f64 = 0.1;
const NO_RETURN_M: f32 = 49.9;

/// Scans with their stamps in seconds, in the log's order (stamps repeat and step back).
type Scans = Vec<(f64, Vec<Beam>)>;

fn main() -> Result<(), Box<dyn Error>> {
    let (paths, params) = parse_options()?;
    let scans: Scans = std::fs::read_to_string(&paths[0])?.lines().filter_map(parse_scan).collect();
    let pairs = read_pairs(&std::fs::read_to_string(&paths[1])?, &scans, params);
    println!("{} pairs", pairs.len());
    let (mut used_ns, mut sums) = (0, [0_usize; 3]);
    for degrees in (-30..=30).step_by(5) {
        let mut counts = [0_usize; 3];
        for pair in &pairs {
            for (dx, dy) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                let wrong = Pose2::new(dx * OFFSET_M, dy * OFFSET_M, f64::from(degrees).to_radians());
                let (metres, angle) = pair.error_from(wrong, params, &mut used_ns);
                counts[0] += 1;
                counts[1] += usize::from(metres < 0.02 && angle < 0.5);
                counts[2] += usize::from(metres > 0.1 || angle > 2.0);
            }
        }
        println!("{degrees:4} deg: {}", share(counts));
        (0..3).for_each(|i| sums[i] += counts[i]);
    }
    println!("   all: {}; {:.0} us CPU a match", share(sums), used_ns as f64 / 1e3 / sums[0].max(1) as f64);
    Ok(())
}

/// Two scans and the second's known pose seen from the first.
#[derive(Copy, Clone)]
struct Pair<'a> {
    a: &'a [Beam],
    b: &'a [Beam],
    truth: Pose2,
}

impl Pair<'_> {
    /// Metres and degrees between the known pose and the one found from a start that is off by `wrong` (x and y in
    /// the first scan's axes).
    fn error_from(&self, wrong: Pose2, params: TrackerParams, used_ns: &mut i64) -> (f64, f64) {
        let mut tracker = Tracker::new(params);
        track(&mut tracker, 0, self.a, Pose2::IDENTITY);
        let Pose2 { x_m, y_m, theta_rad } = self.truth;
        let start = Pose2::new(x_m + wrong.x_m, y_m + wrong.y_m, theta_rad + wrong.theta_rad);
        let before_ns = process_cpu_ns();
        let found = track(&mut tracker, 1_000_000_000, self.b, start);
        *used_ns += process_cpu_ns() - before_ns;
        let off = self.truth.between(&found);
        (off.distance_m(), off.theta_rad.abs().to_degrees())
    }
}

/// The pairs of the list. The stamps are good to 5 ms and several scans share one: of the scans that may be meant, the
/// two are taken that match best from the known pose.
fn read_pairs<'a>(text: &str, scans: &'a Scans, params: TrackerParams) -> Vec<Pair<'a>> {
    let near = |stamp_s: f64| scans.iter().filter(move |scan| (scan.0 - stamp_s).abs() < 0.006);
    let parse = |line: &str| {
        let numbers: Vec<f64> = line.split_ascii_whitespace().map_while(|word| word.parse().ok()).collect();
        let [stamp_a, stamp_b, x, y, theta] = numbers[..] else { return None };
        let truth = Pose2::new(x, y, theta);
        let all = near(stamp_a).flat_map(|a| near(stamp_b).map(move |b| Pair { a: &a.1, b: &b.1, truth }));
        let miss = |pair: &Pair| {
            let (metres, degrees) = pair.error_from(Pose2::IDENTITY, params, &mut 0);
            metres + 0.04 * degrees
        };
        all.map(|pair| (miss(&pair), pair)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, pair)| pair)
    };
    text.lines().filter_map(parse).collect()
}

fn share([all, good, gross]: [usize; 3]) -> String {
    let percent = |n: usize| 100.0 * n as f64 / all.max(1) as f64;
    format!("{:5.1} % within 2 cm and 0.5 deg, {:4.1} % gross, of {all}", percent(good), percent(gross))
}

fn parse_options() -> Result<(Vec<String>, TrackerParams), Box<dyn Error>> {
    let mut params = TrackerParams::default();
    let mut paths = Vec::new();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--method" => params = TrackerParams::for_method(value()?.parse()?),
            "--set" => {
                let setting = value()?;
                let (name, value) = setting.split_once('=').ok_or("--set needs NAME=VALUE")?;
                params.set(name, value.parse()?)?;
            }
            _ => paths.push(word),
        }
    }
    if paths.len() == 2 {
        Ok((paths, params))
    } else {
        Err("expected a CARMEN log and a list of pairs".into())
    }
}

fn parse_scan(line: &str) -> Option<(f64, Vec<Beam>)> {
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    let (&"FLASER", count) = (words.first()?, words.get(1)?.parse::<usize>().ok()?) else { return None };
    let stamp_s: f64 = words.get(count + 8)?.parse().ok()?;
    let step_deg = 180.0 / if count % 2 == 0 { count as f64 } else { count as f64 - 1.0 };
    let beam = |(i, word): (usize, &&str)| {
        let angle_rad = (-90.0 + i as f64 * step_deg).to_radians();
        let range_m: f32 = word.parse().unwrap_or(f32::NAN);
        Beam {
            direction_in_base: [angle_rad.cos() as f32, angle_rad.sin() as f32],
            range_m: if range_m >= NO_RETURN_M { f32::INFINITY } else { range_m },
            delay_s: 0.0,
        }
    };
    Some((stamp_s, words.get(2..count + 2)?.iter().enumerate().map(beam).collect()))
}

fn track(tracker: &mut Tracker, stamp_ns: i64, beams: &[Beam], odom_from_base: Pose2) -> Pose2 {
    let scan = Scan { stamp_ns, laser_in_base_m: [0.0, 0.0], beams, twist_in_base: [0.0; 3] };
    tracker.track(&scan, Some(odom_from_base)).map_from_base
}
