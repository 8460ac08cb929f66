//! What the cells around a surface know of it: painted when it comes, handed to the next nearest when it
//! goes.
//!
//! Frame: map. Units: cells. A row of cells is looked up once a tile, not once a cell. When a surface goes,
//! only the cells that it leaves behind look for another one, so that people who walk through a map cost
//! little.

use crate::map::grid::{BLOCK, Cell, TILE};
use crate::map::pools::Pools;

/// The cells within reach of one cell, and what is at hand while they change hands.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stamp {
    /// How many cells a surface reaches each way.
    reach: i32,
    /// Half width of the disk in each row, from the lowest to the highest.
    half_widths: Vec<i32>,
    /// Cells that have lost their surface.
    left: Vec<[i32; 2]>,
    /// Surfaces around, with their cells.
    around: Vec<(u32, [i32; 2])>,
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
            left: Vec::with_capacity(cells as usize),
            around: Vec::with_capacity((side * side) as usize),
        }
    }

    /// The rows of the disk about a cell, cut where tiles end: first and last x, y.
    fn pieces(&self, [home_x, home_y]: [i32; 2]) -> impl Iterator<Item = (i32, i32, i32)> {
        self.half_widths.iter().zip(home_y - self.reach..).flat_map(move |(&half, y)| {
            let (first, last) = (home_x - half, home_x + half);
            let edge = first | (TILE - 1);
            let rest = (edge < last).then_some((edge + 1, last, y));
            std::iter::once((first, last.min(edge), y)).chain(rest)
        })
    }

    /// Tells the cells within reach of a surface that it is there.
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
    pub(crate) fn remove(&mut self, pools: &mut Pools, index: u32) {
        let home = pools.surfels[index as usize].home.map(i32::from);
        let mut left = std::mem::take(&mut self.left);
        left.clear();
        for (first, last, y) in self.pieces(home) {
            for (cell, x) in pools.grid.row_mut(first, last, y).iter_mut().zip(first..) {
                if cell.surfel() == Some(index) {
                    *cell = Cell::default();
                    left.push([x, y]);
                }
            }
        }
        pools.grid.set_own(home[0], home[1], false);
        pools.free(index);
        self.look_around(pools, home);
        for &cell in &left {
            self.find_next(pools, cell);
        }
        self.left = left;
    }

    /// Collects the surfaces that may reach a cell which this one reached.
    fn look_around(&mut self, pools: &Pools, home: [i32; 2]) {
        let far = 2 * self.reach;
        self.around.clear();
        let [columns, rows] = home.map(|at| (at - far).div_euclid(BLOCK)..=(at + far).div_euclid(BLOCK));
        for row in rows {
            for column in columns.clone() {
                if pools.grid.own_cells([column, row]) == 0 {
                    continue;
                }
                let [left, low] = [column * BLOCK, row * BLOCK];
                for y in low..low + BLOCK {
                    for (cell, x) in pools.grid.row(left, left + BLOCK - 1, y).iter().zip(left..) {
                        if let Some(index) = cell.own() {
                            self.around.push((index, [x, y]));
                        }
                    }
                }
            }
        }
    }

    /// The nearest of the surfaces around, for a cell that has none; of equals the first, row by row.
    fn find_next(&self, pools: &mut Pools, cell: [i32; 2]) {
        let key = |&(_, home): &(u32, [i32; 2])| (squared(cell, home), home[1], home[0]);
        if let Some(&(index, home)) = self.around.iter().min_by_key(|next| key(next))
            && squared(cell, home) <= self.reach * self.reach
            && let Some(place) = pools.grid.cell_mut(cell[0], cell[1])
        {
            *place = Cell::near(index, squared(cell, home) as u8);
        }
    }
}

/// Squared distance of two cells.
fn squared(a: [i32; 2], b: [i32; 2]) -> i32 {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    x * x + y * y
}
