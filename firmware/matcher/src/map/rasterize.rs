//! What the cells around a surface know of it: painted when it comes, handed to the next nearest when it
//! goes.
//!
//! Frame: map. Units: cells. A row of cells is looked up once a tile, not once a cell. When a surface goes,
//! only the cells that it leaves behind look for another one, so that people who walk through a map cost
//! little.

use crate::lanes::{InLanes, widest};
use crate::map::grid::{BLOCK, Cell, TILE};
use crate::map::pools::Pools;

/// The most cells that a surface reaches each way.
pub(crate) const MAX_REACH: i32 = 15;
/// The most blocks in a row that hold surfaces which may reach a cell that one reached.
const MAX_BLOCKS: usize = (4 * MAX_REACH / BLOCK + 2) as usize;

/// The cells within reach of one cell, and what is at hand while they change hands.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stamp {
    /// How many cells a surface reaches each way.
    reach: i32,
    /// Half width of the disk in each row, from the lowest to the highest.
    half_widths: Vec<i32>,
    left: Left,
    /// Surfaces around, with their cells as seen from the one that goes.
    around: Vec<(u32, [i16; 2])>,
}

/// Cells that have lost their surface: a column a quantity.
#[derive(Clone, Debug, Default)]
struct Left {
    /// As seen from the cell of the surface.
    x: Vec<i16>,
    y: Vec<i16>,
    /// How far the next surface is, squared, and which one of those around.
    squared: Vec<i16>,
    next: Vec<u16>,
}

impl Left {
    /// With all the memory it will ever have.
    fn with_capacity(cells: usize) -> Self {
        let (x, y, squared) =
            (Vec::with_capacity(cells), Vec::with_capacity(cells), Vec::with_capacity(cells));
        Self { x, y, squared, next: Vec::with_capacity(cells) }
    }

    fn clear(&mut self) {
        self.x.clear();
        self.y.clear();
    }

    fn push(&mut self, [x, y]: [i32; 2]) {
        self.x.push(x as i16);
        self.y.push(y as i16);
    }

    /// Finds the nearest of the surfaces around for each cell; of equals the first.
    #[inline(always)]
    fn find_next(&mut self, around: &[(u32, [i16; 2])]) {
        let Self { x, y, squared, next } = self;
        squared.clear();
        squared.resize(x.len(), i16::MAX);
        next.clear();
        next.resize(x.len(), 0);
        for ((_, [at_x, at_y]), number) in around.iter().zip(0_u16..) {
            let nearest = squared.iter_mut().zip(&mut *next);
            for ((x, y), (squared, next)) in x.iter().zip(&*y).zip(nearest) {
                let (dx, dy) = (x.wrapping_sub(*at_x), y.wrapping_sub(*at_y));
                let from_this = dx.wrapping_mul(dx).wrapping_add(dy.wrapping_mul(dy));
                let is_nearer = from_this < *squared;
                *squared = if is_nearer { from_this } else { *squared };
                *next = if is_nearer { number } else { *next };
            }
        }
    }
}

impl Stamp {
    /// For surfaces that reach this far, with all the memory it will ever have.
    pub(crate) fn new(reach: i32) -> Self {
        let half_width = |y: i32| (0..=reach).rev().find(|x| x * x + y * y <= reach * reach).unwrap_or(0);
        let half_widths: Vec<i32> = (-reach..=reach).map(half_width).collect();
        let cells: i32 = half_widths.iter().map(|half| 2 * half + 1).sum();
        let side = 4 * reach + 1 + 2 * BLOCK;
        Self {
            reach,
            half_widths,
            left: Left::with_capacity(cells as usize),
            around: Vec::with_capacity((side * side) as usize),
        }
    }

    /// The rows of the disk about a cell, cut where tiles end: first and last x, y.
    #[inline(always)]
    fn pieces(&self, [home_x, home_y]: [i32; 2]) -> impl Iterator<Item = (i32, i32, i32)> {
        self.half_widths.iter().zip(home_y - self.reach..).flat_map(move |(&half, y)| {
            let (first, last) = (home_x - half, home_x + half);
            let edge = first | (TILE - 1);
            let rest = (edge < last).then_some((edge + 1, last, y));
            std::iter::once((first, last.min(edge), y)).chain(rest)
        })
    }

    /// Tells the cells within reach of a surface that it is there.
    #[inline(never)]
    pub(crate) fn rasterize(&self, pools: &mut Pools, index: u32) {
        let home = pools.surfels[index as usize].home.map(i32::from);
        for (first, last, y) in self.pieces(home) {
            if !pools.claim(first, y) {
                continue;
            }
            for (cell, x) in pools.grid.row_mut(first, last, y).iter_mut().zip(first..) {
                let squared = squared(home, [x, y]);
                if cell.surfel().is_none() || squared < i32::from(cell.squared()) {
                    *cell = Cell::near(index, squared as u8);
                }
            }
        }
    }

    /// Takes a surface out of the map; cells that named it find their next nearest.
    #[inline(never)]
    pub(crate) fn remove(&mut self, pools: &mut Pools, index: u32) {
        widest(Remove { stamp: self, pools, index });
    }

    #[inline(always)]
    fn take_out(&mut self, pools: &mut Pools, index: u32) {
        let home = pools.surfels[index as usize].home.map(i32::from);
        let mut left = std::mem::take(&mut self.left);
        left.clear();
        for (first, last, y) in self.pieces(home) {
            for (cell, x) in pools.grid.row_mut(first, last, y).iter_mut().zip(first..) {
                if cell.surfel() == Some(index) {
                    *cell = Cell::default();
                    left.push([x - home[0], y - home[1]]);
                }
            }
        }
        pools.grid.set_own(home[0], home[1], false);
        pools.free(index);
        self.look_around(pools, home);
        left.find_next(&self.around);
        self.hand_on(pools, home, &left);
        self.left = left;
    }

    /// Collects the surfaces that may reach a cell which this one reached, row by row.
    #[inline(always)]
    fn look_around(&mut self, pools: &Pools, home: [i32; 2]) {
        let far = 2 * self.reach;
        self.around.clear();
        let [columns, rows] = home.map(|at| (at - far).div_euclid(BLOCK)..=(at + far).div_euclid(BLOCK));
        for row in rows {
            let mut own = [0; MAX_BLOCKS];
            let blocks = own.iter_mut().zip(columns.clone());
            blocks.for_each(|(own, column)| *own = pools.grid.own_cells([column, row]));
            if own == [0; MAX_BLOCKS] {
                continue;
            }
            for y in 0..BLOCK {
                for (own, column) in own.iter().zip(columns.clone()) {
                    let mut in_row = own >> (y * BLOCK) & ((1 << BLOCK) - 1);
                    while in_row != 0 {
                        let x = in_row.trailing_zeros() as i32;
                        in_row &= in_row - 1;
                        self.note(pools, home, [column * BLOCK + x, row * BLOCK + y]);
                    }
                }
            }
        }
    }

    /// Takes note of the surface in a cell, unless it is so far that it reaches nothing that is left.
    #[inline(always)]
    fn note(&mut self, pools: &Pools, home: [i32; 2], cell: [i32; 2]) {
        if squared(home, cell) <= 4 * self.reach * self.reach
            && let Some(index) = pools.grid.cell(cell[0], cell[1]).own()
        {
            self.around.push((index, [0, 1].map(|axis| (cell[axis] - home[axis]) as i16)));
        }
    }

    /// Tells cells that are left of the surface that is the next one.
    #[inline(always)]
    fn hand_on(&self, pools: &mut Pools, home: [i32; 2], left: &Left) {
        let reach_squared = (self.reach * self.reach) as i16;
        for ((x, y), (squared, next)) in left.x.iter().zip(&left.y).zip(left.squared.iter().zip(&left.next)) {
            if *squared <= reach_squared
                && let Some((index, _)) = self.around.get(usize::from(*next))
                && let Some(place) = pools.grid.cell_mut(home[0] + i32::from(*x), home[1] + i32::from(*y))
            {
                *place = Cell::near(*index, *squared as u8);
            }
        }
    }
}

/// A surface to be taken out of the map.
struct Remove<'a> {
    stamp: &'a mut Stamp,
    pools: &'a mut Pools,
    index: u32,
}

impl InLanes for Remove<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        self.stamp.take_out(self.pools, self.index);
    }
}

/// Squared distance of two cells.
#[inline(always)]
fn squared(a: [i32; 2], b: [i32; 2]) -> i32 {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    x * x + y * y
}
