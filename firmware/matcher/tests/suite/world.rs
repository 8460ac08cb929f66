//! Walls as segments, and a laser of 181 beams that looks at them. Meters and radians.

use biplane_matcher::{Beam, Pose2, Scan, Tracked, Tracker};

/// A wall from one point to another.
pub(crate) type Wall = [[f64; 2]; 2];

pub(crate) struct World {
    walls: Vec<Wall>,
}

impl World {
    pub(crate) fn new(walls: Vec<Wall>) -> Self {
        Self { walls }
    }

    /// The four walls of a rectangle.
    pub(crate) fn rectangle(low: [f64; 2], high: [f64; 2]) -> Vec<Wall> {
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
        (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]).collect()
    }

    /// An 8 by 6 m room with a cupboard and a pillar; the origin lies well inside.
    pub(crate) fn room() -> Self {
        let mut walls = Self::rectangle([-3.0, -2.5], [5.0, 3.5]);
        walls.extend(Self::rectangle([1.0, 2.9], [2.2, 3.5]));
        walls.extend(Self::rectangle([3.5, -1.5], [3.9, -1.1]));
        Self::new(walls)
    }

    /// A corridor 2.2 m wide whose ends are out of the laser's sight.
    pub(crate) fn corridor() -> Self {
        Self::new(Self::rectangle([-200.0, -1.1], [200.0, 1.1]))
    }

    /// The distance to the first wall from a point in a direction; infinite when there is none.
    pub(crate) fn range_m(&self, from: [f64; 2], angle_rad: f64) -> f64 {
        let d = [angle_rad.cos(), angle_rad.sin()];
        let mut nearest = f64::INFINITY;
        for [a, b] in &self.walls {
            let w = [b[0] - a[0], b[1] - a[1]];
            let q = [a[0] - from[0], a[1] - from[1]];
            let cross = d[0] * w[1] - d[1] * w[0];
            if cross.abs() < 1e-12 {
                continue;
            }
            let t = (q[0] * w[1] - q[1] * w[0]) / cross;
            let u = (q[0] * d[1] - q[1] * d[0]) / cross;
            if t > 1e-6 && (0.0..=1.0).contains(&u) {
                nearest = nearest.min(t);
            }
        }
        nearest
    }
}

/// Normal deviates from a seed (SplitMix64, sum of twelve uniforms).
pub(crate) struct Noise(pub u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Evenly spread over -1 to 1.
    pub(crate) fn even(&mut self) -> f64 {
        2.0 * self.uniform() - 1.0
    }

    pub(crate) fn normal(&mut self, sigma: f64) -> f64 {
        sigma * ((0..12).map(|_| self.uniform()).sum::<f64>() - 6.0)
    }
}

/// The scan at a pose: 181 beams from right to left, ranges in whole centimeters, nothing beyond 30 m.
pub(crate) fn look(world: &World, map_from_base: &Pose2, noise: &mut Noise) -> Vec<Beam> {
    (0..181)
        .map(|i| {
            let angle_rad = f64::from(i - 90).to_radians();
            let range_m =
                world.range_m([map_from_base.x_m, map_from_base.y_m], map_from_base.theta_rad + angle_rad);
            let measured_m = ((range_m + noise.normal(0.015)) * 100.0).round() / 100.0;
            Beam {
                direction_in_base: [angle_rad.cos() as f32, angle_rad.sin() as f32],
                range_m: if range_m < 30.0 { measured_m as f32 } else { f32::INFINITY },
                delay_s: 0.0,
            }
        })
        .collect()
}

/// Gives the tracker one scan taken at once.
pub(crate) fn track(
    tracker: &mut Tracker,
    stamp_ns: i64,
    beams: &[Beam],
    odom_from_base: Option<Pose2>,
) -> Tracked {
    let scan = Scan { stamp_ns, laser_in_base_m: [0.0, 0.0], beams, twist_in_base: [0.0; 3] };
    tracker.track(&scan, odom_from_base)
}

/// Distance in meters and angle in degrees between two poses.
pub(crate) fn error(found: &Pose2, truth: &Pose2) -> (f64, f64) {
    let difference = truth.between(found);
    (difference.distance_m(), difference.theta_rad.abs().to_degrees())
}

/// Odometry that sees each true step a little long and turned to one side.
pub(crate) struct Drift {
    pub scale: f64,
    pub turn_rad_per_m: f64,
    pub odom_from_base: Pose2,
}

impl Drift {
    pub(crate) fn new(scale: f64, turn_rad_per_m: f64) -> Self {
        Self { scale, turn_rad_per_m, odom_from_base: Pose2::new(10.0, -4.0, 1.0) }
    }

    pub(crate) fn step(&mut self, from: &Pose2, to: &Pose2) -> Pose2 {
        let step = from.between(to);
        let turn_rad = step.theta_rad + self.turn_rad_per_m * step.distance_m();
        self.odom_from_base =
            self.odom_from_base * Pose2::new(step.x_m * self.scale, step.y_m * self.scale, turn_rad);
        self.odom_from_base
    }
}
