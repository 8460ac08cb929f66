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

/// A line.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub(crate) struct Fitted {
    /// Mean squared distance of the points from it, square meters.
    pub spread_squared: f64,
    /// Its unit normal.
    pub normal: [f32; 2],
}

impl RunningSums {
    /// Points that were added.
    pub(crate) fn count(&self) -> f64 {
        self.n
    }

    /// Takes one more point.
    pub(crate) fn add(&mut self, [x, y]: [f64; 2]) {
        self.n += 1.0;
        self.x += x;
        self.y += y;
        self.xx += x * x;
        self.xy += x * y;
        self.yy += y * y;
    }

    /// The sums over what has come since `before`.
    #[inline]
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

    /// The best line; `None` when all points coincide.
    pub(crate) fn fit(&self) -> Option<Fitted> {
        let [squared, spread_squared, x, y] = self.solve();
        (squared > COINCIDE).then_some(Fitted { spread_squared, normal: [x as f32, y as f32] })
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

/// Runs of points, and the lines through them.
#[derive(Clone, Debug)]
pub(crate) struct Lines {
    ends: [(usize, usize); Self::MANY],
    /// Running sums, a row a sum.
    sums: [[f64; Self::MANY]; 6],
    /// As [`RunningSums::solve`] gives them, a row a number.
    fits: [[f64; Self::MANY]; 4],
    len: usize,
}

impl Default for Lines {
    fn default() -> Self {
        Self {
            ends: [(0, 0); Self::MANY],
            sums: [[1.0; Self::MANY]; 6],
            fits: [[0.0; Self::MANY]; 4],
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

    /// Takes one more run, its first and last point and the sums over it; at most [`Lines::MANY`].
    #[inline]
    pub(crate) fn push(&mut self, ends: (usize, usize), run: &RunningSums) {
        let place = self.len;
        let RunningSums { n, x, y, xx, xy, yy } = *run;
        self.ends[place] = ends;
        for (row, value) in self.sums.iter_mut().zip([n, x, y, xx, xy, yy]) {
            row[place] = value;
        }
        self.len += 1;
    }

    /// Fits a line through each.
    pub(crate) fn fit(&mut self) {
        let [ns, xs, ys, xxs, xys, yys] = &self.sums;
        let [squared, spread, normal_x, normal_y] = &mut self.fits;
        for i in 0..Self::MANY {
            let sums = RunningSums { n: ns[i], x: xs[i], y: ys[i], xx: xxs[i], xy: xys[i], yy: yys[i] };
            [squared[i], spread[i], normal_x[i], normal_y[i]] = sums.solve();
        }
    }

    /// A run's first and last point, and the line through it; `None` when its points coincide.
    #[inline]
    pub(crate) fn get(&self, place: usize) -> ((usize, usize), Option<Fitted>) {
        let [squared, spread_squared, x, y] = [0, 1, 2, 3].map(|row: usize| self.fits[row][place]);
        let normal = [x as f32, y as f32];
        (self.ends[place], (squared > COINCIDE).then_some(Fitted { spread_squared, normal }))
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
            let Fitted { spread_squared, normal } = run.fit().unwrap();
            assert!((spread_squared - 0.01).abs() < 1e-9, "{angle}: {spread_squared}");
            let along = f64::from(normal[0]) * cos + f64::from(normal[1]) * sin;
            assert!(along.abs() < 1e-6 && (normal[0].hypot(normal[1]) - 1.0).abs() < 1e-6, "{angle}");
        }
        assert_eq!(sums(&[[2.0, 3.0]; 5]).fit(), None);
    }

    #[test]
    fn many_lines_at_a_time_are_the_same_as_one_by_one() {
        let mut lines = Lines::default();
        let runs: Vec<RunningSums> = (0..Lines::MANY)
            .map(|i| {
                let at =
                    |k: usize| ((i * 7919 + k * 104_729) % 1009) as f64 * if i == 5 { 0.0 } else { 0.01 };
                sums(&[[at(1), at(2)], [at(3), at(4)], [at(5), at(6)]])
            })
            .collect();
        runs.iter().enumerate().for_each(|(i, run)| lines.push((i, i + 2), run));
        lines.fit();
        for (i, run) in runs.iter().enumerate() {
            assert_eq!(lines.get(i), ((i, i + 2), run.fit()));
        }
        assert_eq!(lines.get(5).1, None);
    }
}
