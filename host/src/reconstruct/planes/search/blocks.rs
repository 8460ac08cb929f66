//! Large clouds in blocks: planes grow in squares of the floor, each with a margin of the squares round it.
//!
//! A block is searched by itself, so blocks may be searched one after the other, on many threads or on many
//! machines: what comes out is the same. Parts of one plane in several blocks are united afterwards, as parts
//! of a plane are that a cabinet divides. Frame `map`, meters.

use crate::model::Cloud;
use crate::reconstruct::planes::params::PlaneParams;

/// Points of a square of the floor with those round it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Block {
    /// Column and row of the square.
    pub place: [u32; 2],
    /// The square: the smallest and the largest x and y, meters.
    pub box_m: [[f64; 2]; 2],
    /// The points in the square and its margin, ascending.
    pub points: Vec<u32>,
    /// Which of them are in the square.
    pub is_own: Vec<bool>,
}

/// A cloud's points in blocks, in the order of rows and columns; one block for a small cloud.
pub(crate) fn divide(params: &PlaneParams, cloud: &Cloud) -> Vec<Block> {
    let squares = Squares::of(params, &cloud.points_m);
    if cloud.len() < params.min_points_to_divide || !(2..=MAX_SQUARES).contains(&squares.count()) {
        let points = (0..cloud.len() as u32).collect();
        return vec![Block {
            place: [0; 2],
            box_m: squares.all_m(),
            points,
            is_own: vec![true; cloud.len()],
        }];
    }
    let mut blocks = vec![Block::default(); squares.count()];
    for (point, p) in (0..).zip(&cloud.points_m) {
        let Some(own) = squares.own(p) else { continue };
        for square in squares.near(p) {
            blocks[square].points.push(point);
            blocks[square].is_own.push(square == own);
        }
    }
    for (square, block) in blocks.iter_mut().enumerate() {
        (block.place, block.box_m) = (squares.place(square), squares.box_m(square));
    }
    blocks.retain(|block| block.is_own.contains(&true));
    blocks
}

impl Block {
    /// Its points as a cloud, without where they were seen from.
    pub(crate) fn cloud(&self, cloud: &Cloud) -> Cloud {
        let of = |point: &u32| *point as usize;
        Cloud {
            points_m: self.points.iter().map(|point| cloud.points_m[of(point)]).collect(),
            scan: self.points.iter().filter_map(|point| cloud.scan.get(of(point)).copied()).collect(),
            beam: self.points.iter().filter_map(|point| cloud.beam.get(of(point)).copied()).collect(),
            beams_per_scan: cloud.beams_per_scan,
            ..Cloud::default()
        }
    }
}

/// The floor in squares.
struct Squares {
    first_m: [f64; 2],
    side_m: f64,
    margin_m: f64,
    counts: [usize; 2],
}

impl Squares {
    /// Squares over all points.
    fn of(params: &PlaneParams, points_m: &[[f32; 3]]) -> Self {
        let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for p in points_m {
            for (bounds, v) in bounds.iter_mut().zip(p).filter(|(_, v)| v.is_finite()) {
                *bounds = [bounds[0].min(f64::from(*v)), bounds[1].max(f64::from(*v))];
            }
        }
        let counts =
            bounds.map(|[low, high]| (((high - low) / params.block_m).floor() as usize).saturating_add(1));
        let first_m = bounds.map(|[low, _]| if low.is_finite() { low } else { 0.0 });
        Self { first_m, side_m: params.block_m, margin_m: params.halo_m, counts }
    }

    /// The smallest and the largest x and y of some squares, from one to another.
    fn span_m(&self, from: [u32; 2], to: [u32; 2]) -> [[f64; 2]; 2] {
        let at = |place: [u32; 2]| [0, 1].map(|k| self.first_m[k] + f64::from(place[k]) * self.side_m);
        [at(from), at(to.map(|v| v + 1))]
    }

    fn box_m(&self, square: usize) -> [[f64; 2]; 2] {
        self.span_m(self.place(square), self.place(square))
    }

    fn all_m(&self) -> [[f64; 2]; 2] {
        self.span_m([0; 2], self.counts.map(|count| count.saturating_sub(1).min(MAX_SQUARES) as u32))
    }

    fn count(&self) -> usize {
        self.counts[0].saturating_mul(self.counts[1])
    }

    fn place(&self, square: usize) -> [u32; 2] {
        [(square % self.counts[0]) as u32, (square / self.counts[0]) as u32]
    }

    /// Column or row of a coordinate.
    fn along(&self, axis: usize, v: f64) -> usize {
        (((v - self.first_m[axis]) / self.side_m).max(0.0) as usize).min(self.counts[axis] - 1)
    }

    fn own(&self, p: &[f32; 3]) -> Option<usize> {
        let [x, y] = [p[0], p[1]].map(f64::from);
        (x.is_finite() && y.is_finite()).then(|| self.along(1, y) * self.counts[0] + self.along(0, x))
    }

    /// The squares whose margins hold a point, its own included, ascending.
    fn near(&self, p: &[f32; 3]) -> impl Iterator<Item = usize> {
        let range = |axis: usize| {
            let v = f64::from(p[axis]);
            self.along(axis, v - self.margin_m)..=self.along(axis, v + self.margin_m)
        };
        let (columns, across) = (range(0), self.counts[0]);
        range(1).flat_map(move |row| columns.clone().map(move |column| row * across + column))
    }
}

/// More squares than this are not made: points lie absurdly far apart.
const MAX_SQUARES: usize = 1 << 20;

#[cfg(test)]
mod tests {
    use super::divide;
    use crate::model::Cloud;
    use crate::reconstruct::planes::params::PlaneParams;

    /// A point each half meter of a floor of 50 m by 30 m.
    fn floor() -> Cloud {
        let points = (0..100u16).flat_map(|x| (0..60u16).map(move |y| [f32::from(x), f32::from(y), 0.0]));
        Cloud { points_m: points.map(|p| p.map(|v| 0.5 * v - 7.0)).collect(), ..Cloud::default() }
    }

    fn params(min_points_to_divide: usize) -> PlaneParams {
        PlaneParams { min_points_to_divide, ..PlaneParams::default() }
    }

    #[test]
    fn every_point_has_one_square_and_is_in_the_margins_of_those_within_reach() {
        let cloud = floor();
        let blocks = divide(&params(1000), &cloud);
        let places: Vec<[u32; 2]> = blocks.iter().map(|block| block.place).collect();
        assert_eq!(places, [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]);
        let mut owners = vec![0; cloud.len()];
        for block in &blocks {
            for (point, is_own) in block.points.iter().zip(&block.is_own) {
                owners[*point as usize] += usize::from(*is_own);
            }
            let [low, high] = block.box_m;
            let reach =
                |k: usize, v: f32, by_m: f64| (low[k] - by_m..=high[k] + by_m).contains(&f64::from(v));
            let near = |p: &[f32; 3], by_m: f64| reach(0, p[0], by_m) && reach(1, p[1], by_m);
            assert!(block.points.iter().all(|k| near(&cloud.points_m[*k as usize], 1.0)));
            let inside = cloud.points_m.iter().filter(|p| near(p, 0.9)).count();
            assert!(block.points.len() >= inside, "{inside} of {}", block.points.len());
            assert!(block.points.is_sorted());
        }
        assert!(owners.iter().all(|owners| *owners == 1));
    }

    #[test]
    fn small_clouds_and_those_without_a_place_are_one_block() {
        let cloud = floor();
        assert_eq!(divide(&params(cloud.len() + 1), &cloud).len(), 1);
        assert_eq!(divide(&params(1), &Cloud::default()).len(), 1);
        let nowhere = Cloud { points_m: vec![[f32::NAN; 3]; 9], ..Cloud::default() };
        assert_eq!(divide(&params(1), &nowhere).len(), 1);
        let apart = Cloud { points_m: vec![[-1e9; 3], [1e9; 3]], ..Cloud::default() };
        assert_eq!(divide(&params(1), &apart).len(), 1);
    }
}
