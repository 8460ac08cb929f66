//! Lines through runs of end points: total least squares from running sums, many at a time.
//!
//! Units: meters. The fits of many runs are done side by side in lanes, since each waits long for its square
//! roots; one by one or together, the numbers are the same.

/// Running sums over points.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct RunningSums {
    n: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl RunningSums {
    /// Points that were added.
    #[inline(always)]
    pub(crate) fn count(&self) -> f64 {
        self.n
    }

    /// Takes one more point.
    #[inline(always)]
    pub(crate) fn add(&mut self, [x, y]: [f64; 2]) {
        self.n += 1.0;
        self.x += x;
        self.y += y;
        self.xx += x * x;
        self.xy += x * y;
        self.yy += y * y;
    }

    /// The sums over what has come since `before`.
    #[inline(always)]
    pub(crate) fn minus(&self, before: &Self) -> Self {
        Self {
            n: self.n - before.n,
            x: self.x - before.x,
            y: self.y - before.y,
            xx: self.xx - before.xx,
            xy: self.xy - before.xy,
            yy: self.yy - before.yy,
        }
    }

    /// Squared length of the direction before it is made a unit vector, mean squared distance, unit normal.
    #[inline(always)]
    fn solve(&self) -> [f64; 4] {
        let per_point = 1.0 / self.n;
        let (mean_x, mean_y) = (self.x * per_point, self.y * per_point);
        let xx = self.xx - self.x * mean_x;
        let xy = self.xy - self.x * mean_y;
        let yy = self.yy - self.y * mean_y;
        // The direction of the larger eigenvalue of [xx xy; xy yy], by the half angle.
        let half_difference = 0.5 * (xx - yy);
        let root = (half_difference * half_difference + xy * xy).sqrt();
        let (sum, difference) = (half_difference + root, root - half_difference);
        let is_flat = half_difference >= 0.0;
        let along = [if is_flat { sum } else { xy }, if is_flat { xy } else { difference }];
        let squared = along[0] * along[0] + along[1] * along[1];
        let spread = (0.5 * (xx + yy) - root).max(0.0) * per_point;
        let per_length = 1.0 / squared.sqrt();
        [squared, spread, -along[1] * per_length, along[0] * per_length]
    }
}

/// Points whose direction is shorter than this, squared, coincide.
const COINCIDE: f64 = 1e-18;

/// Runs of points, and the lines through them: a column a quantity.
#[derive(Clone, Debug)]
pub(crate) struct Lines {
    /// Running sums.
    sums: [[f64; Self::MANY]; 6],
    /// Where the run begins and ends, and the end point that it is for, meters.
    ends: [[f32; Self::MANY]; 4],
    here: [[f32; Self::MANY]; 2],
    /// What the end point lies on.
    shapes: [Shape; Self::MANY],
    normals: [[f32; Self::MANY]; 2],
    len: usize,
}

/// What decides whether a run of points is a line.
#[derive(Copy, Clone, Debug)]
pub(crate) struct LineLimits {
    /// The run is at least this long, squared, square meters.
    pub length_squared: f32,
    /// The points are no farther than this from the line in the mean, squared, square meters.
    pub spread_squared: f64,
    /// The beam strikes the line no flatter than this: the sine of the angle, squared.
    pub sine_squared: f32,
    /// The laser, meters.
    pub laser_m: [f32; 2],
}

/// What a run of points is.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(crate) enum Shape {
    /// A line.
    Line,
    /// Too far from one line.
    Scattered,
    /// Too few points, too short, or struck too flatly.
    Unsure,
}

impl Default for Lines {
    fn default() -> Self {
        Self {
            sums: [[1.0; Self::MANY]; 6],
            ends: [[0.0; Self::MANY]; 4],
            here: [[0.0; Self::MANY]; 2],
            shapes: [Shape::Unsure; Self::MANY],
            normals: [[0.0; Self::MANY]; 2],
            len: 0,
        }
    }
}

impl Lines {
    /// So many at a time.
    pub(crate) const MANY: usize = 32;

    /// Begins anew.
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    /// Takes one more run, the sums over it, its first and last point and the point that it is for; at most
    /// [`Lines::MANY`].
    #[inline(always)]
    pub(crate) fn push(&mut self, run: &RunningSums, [first_m, last_m, here_m]: [[f32; 2]; 3]) {
        let place = self.len % Self::MANY;
        let RunningSums { n, x, y, xx, xy, yy } = *run;
        for (row, value) in self.sums.iter_mut().zip([n, x, y, xx, xy, yy]) {
            row[place] = value;
        }
        for (row, value) in self.ends.iter_mut().zip([first_m[0], first_m[1], last_m[0], last_m[1]]) {
            row[place] = value;
        }
        [self.here[0][place], self.here[1][place]] = here_m;
        self.len += 1;
    }

    /// Fits a line through each and judges it.
    #[inline(always)]
    pub(crate) fn fit(&mut self, limits: &LineLimits) {
        let [ns, xs, ys, xxs, xys, yys] = &self.sums;
        let zeros = [0.0; Self::MANY];
        let [mut squared, mut spread, mut normal_x, mut normal_y] = [zeros; 4];
        for i in 0..Self::MANY {
            let sums = RunningSums { n: ns[i], x: xs[i], y: ys[i], xx: xxs[i], xy: xys[i], yy: yys[i] };
            [squared[i], spread[i], normal_x[i], normal_y[i]] = sums.solve();
        }
        let ([first_x, first_y, last_x, last_y], [here_x, here_y]) = (&self.ends, &self.here);
        let [laser_x, laser_y] = limits.laser_m;
        for i in 0..Self::MANY {
            let (along_x, along_y) = (first_x[i] - last_x[i], first_y[i] - last_y[i]);
            let length_squared = along_x * along_x + along_y * along_y;
            let is_long = (length_squared >= limits.length_squared) | length_squared.is_nan();
            let is_run = (ns[i] >= 3.0) & is_long & (squared[i] > COINCIDE);
            let is_wide = spread[i] > limits.spread_squared;
            let normal = [normal_x[i] as f32, normal_y[i] as f32];
            let (to_x, to_y) = (laser_x - here_x[i], laser_y - here_y[i]);
            let facing = normal[0] * to_x + normal[1] * to_y;
            let is_flat = facing * facing < limits.sine_squared * (to_x * to_x + to_y * to_y);
            let away = facing < 0.0;
            self.normals[0][i] = if away { -normal[0] } else { normal[0] };
            self.normals[1][i] = if away { -normal[1] } else { normal[1] };
            self.shapes[i] = if !is_run {
                Shape::Unsure
            } else if is_wide {
                Shape::Scattered
            } else if is_flat {
                Shape::Unsure
            } else {
                Shape::Line
            };
        }
    }

    /// What a run is, and the normal towards the laser if it is a line.
    #[inline(always)]
    pub(crate) fn get(&self, place: usize) -> (Shape, [f32; 2]) {
        let place = place % Self::MANY;
        (self.shapes[place], [self.normals[0][place], self.normals[1][place]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums(points: &[[f64; 2]]) -> RunningSums {
        let mut sums = RunningSums::default();
        points.iter().for_each(|point| sums.add(*point));
        sums
    }

    #[test]
    fn a_line_is_found_worked_out_by_hand_whichever_way_it_lies() {
        // Two points a meter apart along the line at each end, 0.1 m off it to either side.
        for angle in [0.0_f64, 0.6, 1.5, 2.4, 3.0] {
            let (sin, cos) = angle.sin_cos();
            let place = |along: f64, across: f64| {
                [5.0 + along * cos - across * sin, -3.0 + along * sin + across * cos]
            };
            let run = sums(&[place(0.0, 0.1), place(0.0, -0.1), place(1.0, 0.1), place(1.0, -0.1)]);
            let [squared, spread_squared, normal_x, normal_y] = run.solve();
            assert!(squared > COINCIDE);
            assert!((spread_squared - 0.01).abs() < 1e-9, "{angle}: {spread_squared}");
            let along = normal_x * cos + normal_y * sin;
            assert!(along.abs() < 1e-6 && (normal_x.hypot(normal_y) - 1.0).abs() < 1e-6, "{angle}");
        }
        assert!(sums(&[[2.0, 3.0]; 5]).solve()[0] <= COINCIDE);
    }

    /// What a run is, from the definition.
    fn by_definition(run: &RunningSums, [first, last, here]: [[f32; 2]; 3], limits: &LineLimits) -> Shape {
        let [squared, spread, x, y] = run.solve();
        let length_squared = (first[0] - last[0]).powi(2) + (first[1] - last[1]).powi(2);
        if run.count() < 3.0 || length_squared < limits.length_squared || squared <= COINCIDE {
            return Shape::Unsure;
        }
        if spread > limits.spread_squared {
            return Shape::Scattered;
        }
        let to_laser = [limits.laser_m[0] - here[0], limits.laser_m[1] - here[1]];
        let facing = x as f32 * to_laser[0] + y as f32 * to_laser[1];
        let is_flat = facing.powi(2) < limits.sine_squared * (to_laser[0].powi(2) + to_laser[1].powi(2));
        if is_flat { Shape::Unsure } else { Shape::Line }
    }

    #[test]
    fn many_runs_at_a_time_are_what_each_is_and_lines_face_the_laser() {
        let limits = LineLimits {
            length_squared: 0.0036,
            spread_squared: 4e-4,
            sine_squared: 0.01,
            laser_m: [0.2, -0.1],
        };
        let (mut lines, mut expected) = (Lines::default(), Vec::new());
        for i in 0..Lines::MANY {
            // About a line through a place off the laser, with noise from none to 5 cm; some of two points or
            // of one place.
            let noise = |k: usize| ((i * 7919 + k * 104_729) % 1009) as f64 / 504.5 - 1.0;
            let (angle, spread) = (3.0 * noise(1), 0.05 * noise(2).max(0.0));
            let count = if i % 7 == 3 { 2 } else { 6 };
            let step = if i % 11 == 5 { 0.0 } else { 0.1 };
            let points: Vec<[f64; 2]> = (0..count)
                .map(|k| {
                    let (along, across) = (step * k as f64, spread * noise(3 + k));
                    let (sin, cos) = angle.sin_cos();
                    [2.0 * noise(20) + along * cos - across * sin, 1.5 + along * sin + across * cos]
                })
                .collect();
            let ends = [0, points.len() - 1, 1].map(|k| points[k].map(|value| value as f32));
            let run = sums(&points);
            lines.push(&run, ends);
            expected.push((by_definition(&run, ends, &limits), ends[2]));
        }
        lines.fit(&limits);
        for (i, (shape, here)) in expected.iter().enumerate() {
            let (found, normal) = lines.get(i);
            assert_eq!(found, *shape, "{i}");
            let facing =
                normal[0] * (limits.laser_m[0] - here[0]) + normal[1] * (limits.laser_m[1] - here[1]);
            assert!(*shape != Shape::Line || facing > 0.0, "{i}");
        }
        for shape in [Shape::Line, Shape::Scattered, Shape::Unsure] {
            assert!(expected.iter().any(|(other, _)| *other == shape), "{shape:?}");
        }
    }
}
