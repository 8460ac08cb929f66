//! What a SICK LMS 2xx measures while it moves through a scene.
//!
//! Time model of a scan of k mirror turns, turn T = 13.32 ms: beam i is taken at t0 + (i mod k) T + (i *
//! resolution / 360 deg) T (neighboring beams of a 0.5 degree scan are a turn apart). A beam is a narrow
//! cone: where it meets two surfaces, the range lies between them when they are close together, else it is
//! mostly the nearer one's. Accuracy and spot sizes: SICK technical description 8008970, LMS 200. Angles in
//! the laser's frame: x along the middle beam, first beam on the right.

use crate::rig::fan::Fan;
use crate::rig::source::ScanWords;
use crate::rng::Rng;
use crate::world::mesh::NO_PLANE;
use crate::world::pose::Pose;
use crate::world::scene::{RayHit, Scene};
use crate::world::vec3::{Vec3, add, scale, unit};

mod variant;

pub use variant::Variant;

/// One turn of the mirror.
pub const TURN_NS: i64 = 13_320_000;
/// Value word of a beam without an echo (13 bits).
pub const NO_ECHO: u16 = 8191;
/// Value word of an echo from beyond the largest value (13 bits).
pub const BEYOND_RANGE: u16 = 8183;
/// Value word of a beam that could not be read (13 bits).
pub const READ_ERROR: u16 = 8186;
/// The largest range value in 13 bits.
pub const LARGEST_VALUE: u16 = 8182;

/// How well the laser measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScannerParams {
    /// Standard deviation of a range. Larger: rougher walls.
    pub sigma_m: f64,
    /// Constant error of all ranges. Larger: everything appears farther away.
    pub bias_m: f64,
    /// Farthest wall that gives an echo when hit head on; an echo weakens with the square of the distance and
    /// the cosine of incidence. Larger: floors and walls are seen at flatter angles.
    pub reach_m: f64,
    /// Diameter of the beam where it leaves the laser.
    pub spot_m: f64,
    /// Growth of that diameter per meter. Larger: more mixed ranges at edges.
    pub divergence_rad: f64,
    /// Two surfaces closer than this give a range between them.
    pub blend_m: f64,
}

impl Default for ScannerParams {
    fn default() -> Self {
        Self {
            sigma_m: 0.015,
            bias_m: 0.0,
            reach_m: 40.0,
            spot_m: 0.012,
            divergence_rad: 0.0044,
            blend_m: 1.0,
        }
    }
}

/// A laser on a moving base in a scene.
pub struct Scanner<'a> {
    /// Around it.
    pub scene: &'a Scene,
    /// `base_link` in `map` at a time in nanoseconds.
    pub map_from_base: &'a dyn Fn(i64) -> Pose,
    /// Where it is mounted.
    pub base_from_laser: Pose,
    /// How well it measures.
    pub params: ScannerParams,
}

impl Scanner<'_> {
    /// The value words of the scan whose first beam is at `t0_ns`.
    #[must_use]
    pub fn scan(&self, t0_ns: i64, variant: Variant, mm: bool, rng: &mut Rng) -> ScanWords {
        let beams = 0..variant.beam_count();
        let beams = beams.map(|beam| (t0_ns + variant.beam_delay_ns(beam), variant.beam_angle_rad(beam)));
        self.beams(beams, mm, rng)
    }

    /// The value words of one turn that begins at `t0_ns`, over 180 degrees, `quarter` quarters of a degree
    /// behind the whole ones.
    #[must_use]
    pub fn turn(&self, t0_ns: i64, quarter: u8, mm: bool, rng: &mut Rng) -> ScanWords {
        let count = if quarter == 0 { 181 } else { 180 };
        let quarters = (0..count).map(|beam: i64| 4 * beam + i64::from(quarter));
        let beams = quarters.map(|quarters| {
            let angle_rad = (quarters as f64 / 4.0 - 90.0).to_radians();
            (t0_ns + quarters * TURN_NS / (4 * 360), angle_rad)
        });
        self.beams(beams, mm, rng)
    }

    /// Beams by their times and angles.
    fn beams(&self, beams: impl Iterator<Item = (i64, f64)>, mm: bool, rng: &mut Rng) -> ScanWords {
        let unit_m = if mm { 0.001 } else { 0.01 };
        let mut words = ScanWords::new();
        for (time_ns, angle_rad) in beams {
            let map_from_laser = (self.map_from_base)(time_ns).then(&self.base_from_laser);
            let range_m = self.echo(&map_from_laser, angle_rad, rng);
            // A word for each beam of a variant fits: 401 is the largest count.
            let _ = words.push(self.word(range_m, unit_m, rng));
        }
        words
    }

    /// Ranges of a fan in millimeters; 0 where there is no echo. What is nearer than 16 mm is 16 mm away:
    /// smaller values say something else.
    #[must_use]
    pub fn fan_mm(&self, fan: &Fan, rng: &mut Rng) -> Vec<u16> {
        let range_mm = |(time_ns, angle_rad): (i64, f64)| {
            let map_from_laser = (self.map_from_base)(time_ns).then(&self.base_from_laser);
            let range_m = self.echo(&map_from_laser, angle_rad, rng);
            let noise_m = self.params.bias_m + self.params.sigma_m * rng.normal();
            range_m.map_or(0, |range_m| ((range_m + noise_m) * 1e3).round().clamp(16.0, 65_535.0) as u16)
        };
        fan.beams().map(range_mm).collect()
    }

    fn word(&self, range_m: Option<f64>, unit_m: f64, rng: &mut Rng) -> u16 {
        // The noise is drawn with or without an echo, so that one beam's fate does not shift its neighbors'
        // noise.
        let noise_m = self.params.bias_m + self.params.sigma_m * rng.normal();
        let Some(range_m) = range_m else { return NO_ECHO };
        let steps = ((range_m + noise_m) / unit_m).round();
        if steps > f64::from(LARGEST_VALUE) { BEYOND_RANGE } else { steps.max(1.0) as u16 }
    }

    /// The range without noise.
    fn echo(&self, map_from_laser: &Pose, angle_rad: f64, rng: &mut Rng) -> Option<f64> {
        let choice = rng.unit();
        let (sin, cos) = angle_rad.sin_cos();
        let spot = Spot {
            origin: map_from_laser.translation_m,
            along: map_from_laser.rotate([cos, sin, 0.0]),
            across: map_from_laser.rotate([-sin, cos, 0.0]),
            up: map_from_laser.rotate([0.0, 0.0, 1.0]),
            params: self.params,
        };
        let center = spot.look(self.scene, [0.0, 0.0]);
        let rim = RIM.map(|at| spot.look(self.scene, at));
        if let Some(hit) = center
            && hit.plane != NO_PLANE
            && rim.iter().all(|other| other.is_some_and(|other| other.plane == hit.plane))
        {
            return (strength(hit, self.params.reach_m) >= 1.0).then_some(hit.range_m);
        }
        let mut ray_hits: Vec<Option<RayHit>> = vec![center];
        ray_hits.extend(rim);
        ray_hits.extend(INNER.map(|at| spot.look(self.scene, at)));
        blend(&ray_hits, self.params, choice)
    }
}

/// Rays of a spot, in half diameters across and up: first those that decide whether it lies on one plane.
const RIM: [[f64; 2]; 4] = [[0.95, 0.0], [-0.95, 0.0], [0.0, 0.95], [0.0, -0.95]];
const INNER: [[f64; 2]; 8] = [
    [0.65, 0.65],
    [-0.65, 0.65],
    [-0.65, -0.65],
    [0.65, -0.65],
    [0.45, 0.0],
    [-0.45, 0.0],
    [0.0, 0.45],
    [0.0, -0.45],
];

struct Spot {
    origin: Vec3,
    along: Vec3,
    across: Vec3,
    up: Vec3,
    params: ScannerParams,
}

impl Spot {
    /// One ray of the cone, `at` in half diameters from its middle.
    fn look(&self, scene: &Scene, at: [f64; 2]) -> Option<RayHit> {
        let offset = |half: f64| add(scale(self.across, at[0] * half), scale(self.up, at[1] * half));
        let origin = add(self.origin, offset(0.5 * self.params.spot_m));
        let direction = unit(add(self.along, offset(0.5 * self.params.divergence_rad)));
        scene.look(origin, direction, 10.0 * self.params.reach_m)
    }
}

/// Echo of a surface that fills the spot, against the weakest that is noticed.
fn strength(hit: RayHit, reach_m: f64) -> f64 {
    let relative = reach_m / hit.range_m.max(0.01);
    hit.cosine * relative * relative
}

/// The range of a spot on several surfaces; `choice` in [0, 1) decides whether a sliver of a near surface is
/// noticed.
fn blend(ray_hits: &[Option<RayHit>], params: ScannerParams, choice: f64) -> Option<f64> {
    let mut hits: Vec<RayHit> = ray_hits.iter().flatten().copied().collect();
    hits.sort_by(|a, b| a.range_m.total_cmp(&b.range_m));
    let nearest = hits.first()?.range_m;
    let near = hits.iter().take_while(|hit| hit.range_m < nearest + params.blend_m).count();
    let share = near as f64 / ray_hits.len() as f64;
    let seen = if choice < 4.0 * share || near == hits.len() { &hits[..near] } else { &hits[near..] };
    let echo = |hit: &RayHit| strength(*hit, params.reach_m) / ray_hits.len() as f64;
    let total: f64 = seen.iter().map(echo).sum();
    let mean = seen.iter().map(|hit| echo(hit) * hit.range_m).sum::<f64>() / total;
    (total >= 1.0).then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::{NO_ECHO, Scanner, ScannerParams, Variant};
    use crate::rng::Rng;
    use crate::world::built_in::builder::{Builder, Facing};
    use crate::world::pose::{Pose, along};
    use crate::world::scene::Scene;

    const EXACT: ScannerParams = ScannerParams {
        sigma_m: 0.0,
        bias_m: 0.0,
        reach_m: 40.0,
        spot_m: 0.0,
        divergence_rad: 0.0,
        blend_m: 1.0,
    };

    fn variant(fov_deg: u16, resolution_cdeg: u16) -> Variant {
        Variant::new(fov_deg, resolution_cdeg).expect("a variant")
    }

    /// A wall at x = 3 that looks at the origin.
    fn wall() -> Scene {
        let mut builder = Builder::default();
        builder.rect(Facing::Back, 3.0, [-20.0, 20.0], [-20.0, 20.0], &[]);
        Scene::new(builder.finish())
    }

    fn still(scene: &Scene, params: ScannerParams) -> Scanner<'_> {
        Scanner { scene, map_from_base: &|_| Pose::default(), base_from_laser: Pose::default(), params }
    }

    #[test]
    fn ranges_have_the_bias_the_deviation_and_the_steps_asked_for() {
        let scene = wall();
        let params = ScannerParams { sigma_m: 0.02, bias_m: 0.05, ..ScannerParams::default() };
        for mm in [true, false] {
            let unit_m = if mm { 0.001 } else { 0.01 };
            let mut errors = Vec::new();
            for number in 0..400 {
                let words = still(&scene, params).scan(0, variant(100, 100), mm, &mut Rng::new(9, 0, number));
                let middle = f64::from(words[50]) * unit_m;
                errors.push(middle - 3.0);
            }
            let n = errors.len() as f64;
            let mean = errors.iter().sum::<f64>() / n;
            let sigma = (errors.iter().map(|e| (e - mean) * (e - mean)).sum::<f64>() / n).sqrt();
            // Rounding to centimeters adds a variance of (1 cm)^2 / 12.
            let expected = (0.02_f64.powi(2) + unit_m * unit_m / 12.0).sqrt();
            assert!((mean - 0.05).abs() < 0.003, "{mean}");
            assert!((sigma - expected).abs() < 0.002, "{sigma} {expected}");
        }
    }

    #[test]
    fn exact_ranges_rebuild_the_wall_to_half_a_step() {
        let scene = wall();
        let mut scanner = still(&scene, EXACT);
        scanner.base_from_laser = Pose::from_angles([0.4, -0.3, 0.5], [0.1, -0.2, 0.3]);
        let words = scanner.scan(0, variant(100, 50), true, &mut Rng::new(1, 0, 0));
        for (beam, word) in (0u16..).zip(&words) {
            let (sin, cos) = variant(100, 50).beam_angle_rad(beam).sin_cos();
            let at =
                scanner.base_from_laser.apply(along([0.0; 3], [cos, sin, 0.0], f64::from(*word) * 0.001));
            assert!((at[0] - 3.0).abs() < 0.00051, "beam {beam}: {at:?}");
        }
    }

    #[test]
    fn beams_of_a_moving_laser_are_taken_where_it_is_then() {
        // 1 m/s towards the wall: the last beam of a scan is taken 6.66 mm nearer than the first.
        let scene = wall();
        let forward = |time_ns: i64| Pose::planar(time_ns as f64 * 1e-9, 0.0, 0.0);
        let scanner = Scanner { map_from_base: &forward, ..still(&scene, EXACT) };
        let words = scanner.scan(1_000_000_000, variant(100, 50), true, &mut Rng::new(1, 0, 0));
        for (beam, time_s) in [(98u16, 1.001_813), (99, 1.015_151_5), (100, 1.001_85), (101, 1.015_188_5)] {
            let angle: f64 = (f64::from(beam) - 100.0) * 0.5;
            let expected = (3.0 - time_s) / angle.to_radians().cos() * 1000.0;
            assert!((f64::from(words[usize::from(beam)]) - expected).abs() < 0.51, "{beam}: {expected}");
        }
    }

    #[test]
    fn nothing_and_grazing_walls_give_no_echo() {
        let scene = wall();
        let behind = Scanner { base_from_laser: Pose::planar(0.0, 0.0, 3.0), ..still(&scene, EXACT) };
        let words = behind.scan(0, variant(100, 100), false, &mut Rng::new(1, 0, 0));
        assert!(words.iter().all(|word| *word == NO_ECHO));
        // The echo weakens with the cosine and the square of the distance: head on it reaches 40 m, so a wall
        // at 3 m is seen up to cos^3 >= (3 / 40)^2, which is 79.8 degrees off its normal.
        let sideways = still(&scene, EXACT).scan(0, variant(180, 100), false, &mut Rng::new(1, 0, 0));
        assert_eq!((sideways[90], sideways[90 + 79], sideways[90 + 80]), (300, 1572, NO_ECHO));
    }

    #[test]
    fn the_turns_of_a_scan_are_its_beams_taken_at_their_own_times() {
        let scene = wall();
        // Drives along x at 10 m/s: a turn later everything is 13 cm nearer.
        let drives = |t_ns: i64| Pose::from_angles([t_ns as f64 * 1e-8, 0.0, 0.0], [0.0; 3]);
        let scanner = Scanner {
            scene: &scene,
            map_from_base: &drives,
            base_from_laser: Pose::default(),
            params: EXACT,
        };
        let whole = scanner.scan(0, variant(180, 50), true, &mut Rng::new(1, 0, 0));
        for (turn, quarter) in [(0, 0_u8), (1, 2)] {
            let words = scanner.turn(turn * super::TURN_NS, quarter, true, &mut Rng::new(1, 0, 0));
            let expected: Vec<u16> = whole.iter().skip(turn as usize).step_by(2).copied().collect();
            assert_eq!(words[..], expected[..]);
        }
        let quarter = scanner.turn(0, 1, true, &mut Rng::new(1, 0, 0));
        assert_eq!(quarter.len(), 180);
        let angle = 30.25_f64.to_radians();
        let expected = (3.0 - 10.0 * 120.25 * 37e-6) / angle.cos();
        assert!((f64::from(quarter[120]) * 0.001 - expected).abs() < 1e-3, "{} {expected}", quarter[120]);
    }

    #[test]
    fn an_edge_too_far_away_gives_no_echo_either() {
        let edge = |near_m: f64| {
            let mut builder = Builder::default();
            builder.rect(Facing::Back, near_m, [0.0, 9.0], [-9.0, 9.0], &[]);
            builder.rect(Facing::Back, near_m + 0.4, [-9.0, 9.0], [-9.0, 9.0], &[]);
            let scene = Scene::new(builder.finish());
            let params = ScannerParams { sigma_m: 0.0, ..ScannerParams::default() };
            still(&scene, params).scan(0, variant(100, 100), false, &mut Rng::new(1, 0, 0))[50]
        };
        assert!((3900..3960).contains(&edge(39.0)), "{}", edge(39.0));
        assert_eq!(edge(41.0), NO_ECHO);
    }

    #[test]
    fn a_sliver_of_a_near_surface_is_noticed_now_and_then() {
        // At 3 m the spot is 25 mm wide; a surface that covers its outermost tenth holds one of thirteen
        // rays.
        let mut builder = Builder::default();
        builder.rect(Facing::Back, 3.0, [0.0106, 9.0], [-9.0, 9.0], &[]);
        builder.rect(Facing::Back, 8.0, [-9.0, 9.0], [-9.0, 9.0], &[]);
        let scene = Scene::new(builder.finish());
        let near = (0..1000)
            .map(|number| {
                still(&scene, ScannerParams::default()).scan(
                    0,
                    variant(100, 100),
                    false,
                    &mut Rng::new(1, 0, number),
                )
            })
            .filter(|words| words[50] < 400)
            .count();
        assert!((260..360).contains(&near), "4 in 13 expected: {near} of 1000");
    }

    #[test]
    fn a_beam_on_an_edge_lies_between_near_surfaces_but_not_between_far_ones() {
        for (gap_m, mixed) in [(0.4, true), (6.0, false)] {
            let mut builder = Builder::default();
            builder.rect(Facing::Back, 3.0, [0.0, 9.0], [-9.0, 9.0], &[]);
            builder.rect(Facing::Back, 3.0 + gap_m, [-9.0, 9.0], [-9.0, 9.0], &[]);
            let scene = Scene::new(builder.finish());
            let params = ScannerParams { sigma_m: 0.0, ..ScannerParams::default() };
            let mut between = 0;
            for number in 0..50 {
                let words =
                    still(&scene, params).scan(0, variant(100, 100), true, &mut Rng::new(1, 0, number));
                let range = f64::from(words[50]) * 0.001;
                between += usize::from(range > 3.05 && range < 3.0 + gap_m - 0.05);
                assert!(range < 3.0 + gap_m + 0.01);
            }
            assert_eq!(between == 50, mixed, "{gap_m}: {between}");
        }
    }

    #[test]
    fn a_scan_depends_on_its_seed_and_number_only() {
        let scene = wall();
        let scan = |seed, number| {
            still(&scene, ScannerParams::default()).scan(
                0,
                variant(180, 50),
                false,
                &mut Rng::new(seed, 0, number),
            )
        };
        assert_eq!(scan(1, 5), scan(1, 5));
        assert!(scan(1, 5) != scan(2, 5) && scan(1, 5) != scan(1, 6));
    }
}
