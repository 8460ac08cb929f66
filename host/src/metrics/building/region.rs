//! Areas of the plane with holes, and how far two of them cover each other, by rows of 1 cm. Meters.

/// x and y.
pub(crate) type Point = [f64; 2];

/// From where to where along a row.
pub(crate) type Span = [f64; 2];

/// Distance of the rows: areas of rooms come out within 0.01 %.
const ROW_M: f64 = 0.01;

/// Rings; a point is inside when an odd number of them is around it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Region {
    rings: Vec<Vec<Point>>,
    low: Point,
    high: Point,
}

impl Region {
    /// Of an outline and its holes.
    pub(crate) fn new(outline: &[Point], holes: &[Vec<Point>]) -> Self {
        let rings: Vec<Vec<Point>> =
            std::iter::once(outline.to_vec()).chain(holes.iter().cloned()).filter(|r| r.len() > 2).collect();
        let bound = |pick: fn(f64, f64) -> f64, start: f64| {
            [0, 1].map(|axis| rings.iter().flatten().fold(start, |best, point| pick(best, point[axis])))
        };
        let (low, high) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
        Self { rings, low, high }
    }

    /// Whether a point is inside.
    pub(crate) fn contains(&self, [x, y]: Point) -> bool {
        self.row(y).iter().any(|span| span[0] <= x && x <= span[1])
    }

    /// Where it is along a row.
    fn row(&self, y: f64) -> Vec<Span> {
        if !(self.low[1]..=self.high[1]).contains(&y) {
            return Vec::new();
        }
        let edges = self.rings.iter().flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)));
        let passed = edges.filter(|(a, b)| (a[1] <= y) != (b[1] <= y));
        let mut passed: Vec<f64> =
            passed.map(|(a, b)| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])).collect();
        passed.sort_by(f64::total_cmp);
        passed.as_chunks().0.to_vec()
    }
}

/// Several regions together: where any of them is.
pub(crate) fn union_row(regions: &[&Region], y: f64) -> Vec<Span> {
    let mut spans: Vec<Span> = regions.iter().flat_map(|region| region.row(y)).collect();
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut joined: Vec<Span> = Vec::new();
    for span in spans {
        match joined.last_mut() {
            Some(last) if span[0] <= last[1] => last[1] = last[1].max(span[1]),
            _ => joined.push(span),
        }
    }
    joined
}

/// Areas of two unions and of what they share, square meters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Overlap {
    /// Of the first.
    pub first_m2: f64,
    /// Of the second.
    pub second_m2: f64,
    /// Of what both cover.
    pub both_m2: f64,
}

impl Overlap {
    /// Measures it.
    pub(crate) fn of(first: &[&Region], second: &[&Region]) -> Self {
        let all = || first.iter().chain(second);
        let low = all().fold(f64::INFINITY, |m, region| m.min(region.low[1]));
        let high = all().fold(f64::NEG_INFINITY, |m, region| m.max(region.high[1]));
        let rows = ((high - low) / ROW_M).ceil().clamp(0.0, 1e6) as usize;
        let length = |spans: &[Span]| spans.iter().map(|span| span[1] - span[0]).sum::<f64>();
        let mut sum = Self::default();
        for row in 0..rows {
            let y = low + (row as f64 + 0.5) * (high - low) / rows as f64;
            let (a, b) = (union_row(first, y), union_row(second, y));
            let shared = a.iter().flat_map(|p| b.iter().map(move |q| p[1].min(q[1]) - p[0].max(q[0])));
            sum.first_m2 += length(&a);
            sum.second_m2 += length(&b);
            sum.both_m2 += shared.filter(|length| *length > 0.0).sum::<f64>();
        }
        let height = if rows > 0 { (high - low) / rows as f64 } else { 0.0 };
        Self {
            first_m2: sum.first_m2 * height,
            second_m2: sum.second_m2 * height,
            both_m2: sum.both_m2 * height,
        }
    }

    /// Area of what both cover over the area of what any covers.
    pub(crate) fn iou(&self) -> f64 {
        let any_m2 = self.first_m2 + self.second_m2 - self.both_m2;
        if any_m2 > 0.0 { self.both_m2 / any_m2 } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::{Overlap, Region};

    fn square(x: f64, y: f64, side: f64) -> Region {
        Region::new(&[[x, y], [x + side, y], [x + side, y + side], [x, y + side]], &[])
    }

    #[test]
    fn overlaps_of_squares_are_those_of_arithmetic() {
        let (a, b) = (square(0.0, 0.0, 2.0), square(1.0, 1.0, 2.0));
        let found = Overlap::of(&[&a], &[&b]);
        assert!((found.first_m2 - 4.0).abs() < 1e-9 && (found.both_m2 - 1.0).abs() < 1e-9, "{found:?}");
        assert!((found.iou() - 1.0 / 7.0).abs() < 1e-9);
        let both = Overlap::of(&[&a, &b], &[&b]);
        assert!((both.first_m2 - 7.0).abs() < 1e-9, "a union counts once what both cover: {both:?}");
    }

    #[test]
    fn a_hole_is_no_area_and_nothing_is_in_it() {
        let hole = vec![[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]];
        let region = Region::new(&[[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]], &[hole]);
        assert!((Overlap::of(&[&region], &[]).first_m2 - 8.0).abs() < 1e-9);
        assert!(region.contains([0.5, 1.5]) && !region.contains([1.5, 1.5]) && !region.contains([3.5, 1.5]));
    }
}
