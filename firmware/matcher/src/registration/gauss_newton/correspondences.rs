//! What the end points of a scan meet in the map, kept from one pose to the next.
//!
//! The poses of an alignment lie closer and closer together, so that most end points stay in their cells. One
//! that does meets the same surface, and nothing is looked up for it; one that has left its cell is looked up
//! anew. The arithmetic runs in lanes over columns; the numbers are those of looking up each end point for
//! itself. Frame: map. Units: meters.

use crate::map::LocalMap;
use crate::map::grid::{floor_in_lanes as floor, whole};
use crate::map::surfel::Surfel;
use crate::placement::Placement;
use crate::registration::normal_equations::{BATCH, Batch};
use crate::registration::surface_map::OTHER_FACE_COSINE;
use crate::scan::end_points::{EndPoint, Kind};

/// No surface is met.
const NOTHING: u32 = u32::MAX;

/// Numbers of many end points side by side.
pub(crate) type Column = [f32; BATCH];

/// What an end point meets.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Met {
    /// Nothing.
    Nothing,
    /// A line.
    Line,
    /// A surface that is no line.
    Spot,
}

/// What all end points of a scan meet.
#[derive(Clone, Debug)]
pub(crate) struct Correspondences {
    parts: Vec<Part>,
    used: usize,
    /// Where the end points were placed last.
    placement: Option<Placement>,
    placed: Placed,
    batch: Batch,
}

impl Correspondences {
    /// Memory for so many end points.
    pub(crate) fn with_capacity(points: usize) -> Self {
        Self {
            parts: vec![Part::default(); points.div_ceil(BATCH)],
            used: 0,
            placement: None,
            placed: Placed::default(),
            batch: Batch::default(),
        }
    }

    /// Takes over the end points of a scan, or the same ones after the map has changed: nothing is known of
    /// what they meet.
    pub(crate) fn begin(&mut self, points: &[EndPoint]) {
        self.placement = None;
        self.used = points.len().div_ceil(BATCH).min(self.parts.len());
        for (part, points) in self.parts.iter_mut().zip(points.chunks(BATCH)) {
            part.begin(points);
        }
    }

    /// Lays the end points on the map, part by part: see [`Correspondences::part`].
    #[inline(always)]
    pub(crate) fn lay(&mut self, placement: &Placement) -> Laying {
        let is_new = self.placement.replace(*placement) != Some(*placement);
        Laying { placement: *placement, is_new, parts: self.used }
    }

    /// What the end points of a part meet when they are placed like this and how they lie there; and a batch
    /// to gather them in.
    #[inline(always)]
    pub(crate) fn part(
        &mut self,
        map: &LocalMap,
        Laying { placement, is_new, .. }: &Laying,
        number: usize,
    ) -> (&Part, &Placed, &mut Batch) {
        let part = &mut self.parts[number];
        self.placed.turn(&part.at, placement);
        if *is_new {
            part.refresh(map, placement.at_m, &self.placed.arm);
        }
        self.placed.place(part, placement);
        (part, &self.placed, &mut self.batch)
    }
}

/// End points about to be laid on the map.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Laying {
    placement: Placement,
    is_new: bool,
    parts: usize,
}

impl Laying {
    /// The numbers of all parts; each has to be laid.
    #[inline(always)]
    pub(crate) fn numbers(&self) -> std::ops::Range<usize> {
        0..self.parts
    }
}

/// How the end points of a part lie to what they meet: a column a quantity.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    /// From the base to the end point, in the map's axes, meters.
    pub arm: [Column; 2],
    /// From the surface's mean to the end point, meters.
    pub offset: [Column; 2],
    /// Squared length of the surface's mean normal.
    pub strength: Column,
    /// The end point lies on another face of a line, or on a wall that turns away: all bits or none.
    pub is_other_face: [u32; BATCH],
}

impl Default for Placed {
    fn default() -> Self {
        let zeros = [[0.0; BATCH]; 2];
        Self { arm: zeros, offset: zeros, strength: [1.0; BATCH], is_other_face: [0; BATCH] }
    }
}

impl Placed {
    #[inline(always)]
    fn turn(&mut self, [x, y]: &[Column; 2], placement: &Placement) {
        let Placement { sin, cos, .. } = *placement;
        let [arm_x, arm_y] = &mut self.arm;
        for i in 0..BATCH {
            arm_x[i] = cos * x[i] - sin * y[i];
            arm_y[i] = sin * x[i] + cos * y[i];
        }
    }

    #[inline(always)]
    fn place(&mut self, part: &Part, placement: &Placement) {
        let Placement { sin, cos, at_m: [left, low] } = *placement;
        let ([arm_x, arm_y], [own_x, own_y]) = (&self.arm, &part.own_normal);
        let ([mean_x, mean_y], [normal_x, normal_y]) = (&part.mean, &part.normal);
        let [offset_x, offset_y] = &mut self.offset;
        for i in 0..BATCH {
            offset_x[i] = (arm_x[i] + left) - mean_x[i];
            offset_y[i] = (arm_y[i] + low) - mean_y[i];
            let facing = (cos * own_x[i] - sin * own_y[i]) * normal_x[i]
                + (sin * own_x[i] + cos * own_y[i]) * normal_y[i];
            let strength = normal_x[i] * normal_x[i] + normal_y[i] * normal_y[i];
            let has_normal = own_x[i] * own_x[i] + own_y[i] * own_y[i] > 0.5;
            self.is_other_face[i] = all_bits(has_normal) & all_bits(facing < OTHER_FACE_COSINE * strength);
            self.strength[i] = strength;
        }
    }
}

/// Some end points and what they meet: a column a quantity. Columns of surfaces hold numbers of no meaning,
/// but finite ones, where none is met.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// End points in use.
    pub len: usize,
    /// Place in the base's frame, meters.
    pub at: [Column; 2],
    /// Normal in the base's frame; zero where it is not known.
    own_normal: [Column; 2],
    /// Weight.
    pub weight: Column,
    /// What the end points seem to lie on.
    pub kind: [Kind; BATCH],
    /// The cells that the end points lie in; not a number where that is not known yet.
    cell: [Column; 2],
    /// The surface that each meets.
    index: [u32; BATCH],
    /// What that is.
    pub met: [Met; BATCH],
    /// Mean of the surface, meters.
    pub mean: [Column; 2],
    /// The surface's mean normal, not of unit length.
    pub normal: [Column; 2],
    /// End points that the surface has taken.
    pub hits: Column,
    /// The submap of the surface.
    pub submap: [u8; BATCH],
    /// What an end point counts before its residual is known.
    pub sureness: Column,
    lists: Lists,
}

/// The end points of a part by what they meet.
#[derive(Clone, Debug, Default)]
struct Lists {
    lines: List,
    /// Those that stand out from their neighbors alone.
    spots: List,
    nothings: List,
}

/// Some of the end points of a part, in their order.
#[derive(Clone, Debug)]
struct List {
    indices: [u8; BATCH],
    len: usize,
}

impl List {
    /// Takes an end point or not, without a branch: which it is cannot be foreseen.
    #[inline(always)]
    fn push_if(&mut self, is_so: bool, index: u8) {
        self.indices[self.len % BATCH] = index;
        self.len += usize::from(is_so);
    }

    #[inline(always)]
    fn iter(&self) -> impl Iterator<Item = usize> {
        self.indices[..self.len].iter().map(|index| usize::from(*index) % BATCH)
    }
}

impl Default for List {
    fn default() -> Self {
        Self { indices: [0; BATCH], len: 0 }
    }
}

impl Default for Part {
    fn default() -> Self {
        let zeros = [[0.0; BATCH]; 2];
        Self {
            len: 0,
            at: zeros,
            own_normal: zeros,
            weight: [0.0; BATCH],
            kind: [Kind::Unsure; BATCH],
            cell: [[f32::NAN; BATCH]; 2],
            index: [NOTHING; BATCH],
            met: [Met::Nothing; BATCH],
            mean: zeros,
            normal: [[1.0; BATCH]; 2],
            hits: [1.0; BATCH],
            submap: [0; BATCH],
            sureness: [0.0; BATCH],
            lists: Lists::default(),
        }
    }
}

impl Part {
    fn begin(&mut self, points: &[EndPoint]) {
        self.len = points.len();
        for (index, point) in points.iter().enumerate() {
            for axis in 0..2 {
                self.at[axis][index] = point.at_m[axis];
                self.own_normal[axis][index] = point.normal[axis];
            }
            self.weight[index] = point.weight;
            self.kind[index] = point.kind;
        }
        self.cell = [[f32::NAN; BATCH]; 2];
        self.index = [NOTHING; BATCH];
        self.met = [Met::Nothing; BATCH];
        self.list();
    }

    /// The end points that stand out from their neighbors and meet surfaces which are no lines, in their
    /// order.
    #[inline(always)]
    pub(crate) fn spots(&self) -> impl Iterator<Item = usize> {
        self.lists.spots.iter()
    }

    /// The end points that meet nothing.
    #[inline(always)]
    pub(crate) fn nothings(&self) -> impl Iterator<Item = usize> {
        self.lists.nothings.iter()
    }

    /// Looks up what has left its cell.
    #[inline(always)]
    fn refresh(&mut self, map: &LocalMap, from_m: [f32; 2], arm: &[Column; 2]) {
        let (moved, count) = self.leave_cells(map.cells_per_m(), from_m, arm);
        let (mut others, mut other_count) = ([0_u8; BATCH], 0);
        // All cells first, then all surfaces: so many end points wait for them together.
        for &index in &moved[..count] {
            let at = usize::from(index) % BATCH;
            let met = map.index_in([whole(self.cell[0][at]), whole(self.cell[1][at])]).unwrap_or(NOTHING);
            others[other_count % BATCH] = index;
            other_count += usize::from(met != self.index[at]);
            self.index[at] = met;
        }
        let mut has_changed = false;
        for &index in &others[..other_count] {
            has_changed |= self.meet(map, usize::from(index) % BATCH);
        }
        if has_changed {
            self.list();
        }
    }

    /// Finds the cells of all end points, and which have changed.
    #[inline(always)]
    fn leave_cells(
        &mut self,
        cells_per_m: f32,
        [left, low]: [f32; 2],
        [arm_x, arm_y]: &[Column; 2],
    ) -> ([u8; BATCH], usize) {
        let mut has_moved = [0_u8; BATCH];
        let [column, row] = &mut self.cell;
        for i in 0..BATCH {
            let new_column = floor((arm_x[i] + left) * cells_per_m);
            let new_row = floor((arm_y[i] + low) * cells_per_m);
            has_moved[i] = u8::from((new_column != column[i]) | (new_row != row[i]));
            (column[i], row[i]) = (new_column, new_row);
        }
        let (mut moved, mut count) = ([0; BATCH], 0);
        has_moved[self.len..].fill(0);
        for (some, first) in has_moved.as_chunks::<8>().0.iter().zip((0_u8..).step_by(8)) {
            if *some == [0; 8] {
                continue;
            }
            for (index, has_moved) in (first..).zip(some) {
                moved[count % BATCH] = index;
                count += usize::from(*has_moved);
            }
        }
        (moved, count)
    }

    /// An end point meets another surface than before: whether it is of another kind.
    #[inline(always)]
    fn meet(&mut self, map: &LocalMap, at: usize) -> bool {
        let met = match map.surfels().get(self.index[at] as usize) {
            Some(surfel) => {
                let Surfel { at_m, normal, hits, submap, .. } = *surfel;
                [self.mean[0][at], self.mean[1][at]] = at_m;
                [self.normal[0][at], self.normal[1][at]] = normal;
                self.hits[at] = hits;
                self.submap[at] = submap;
                // The mean of n end points is off by 1 / n of an end point's variance: the residual has
                // 1 + 1 / n of it.
                self.sureness[at] = self.weight[at] * hits / (1.0 + hits);
                if map.is_line(surfel) { Met::Line } else { Met::Spot }
            }
            None => Met::Nothing,
        };
        std::mem::replace(&mut self.met[at], met) != met
    }

    /// Lists what meets lines, spots and nothing anew.
    #[inline(always)]
    fn list(&mut self) {
        let Lists { lines, spots, nothings } = &mut self.lists;
        [lines.len, spots.len, nothings.len] = [0; 3];
        for (index, (met, kind)) in (0_u8..).zip(self.met[..self.len].iter().zip(&self.kind)) {
            lines.push_if(*met == Met::Line, index);
            spots.push_if((*met == Met::Spot) & (*kind == Kind::Point), index);
            nothings.push_if(*met == Met::Nothing, index);
        }
    }

    /// Fills a batch with the end points on lines. One on another face has no weight.
    #[inline(always)]
    pub(crate) fn gather_lines(&self, placed: &Placed, batch: &mut Batch) {
        for (entry, index) in self.lists.lines.iter().enumerate() {
            let entry = entry % BATCH;
            for axis in 0..2 {
                batch.arm[axis][entry] = placed.arm[axis][index];
                batch.offset[axis][entry] = placed.offset[axis][index];
                batch.normal[axis][entry] = self.normal[axis][index];
            }
            let sureness = self.sureness[index].to_bits() & !placed.is_other_face[index];
            batch.weight[entry] = f32::from_bits(sureness);
        }
        batch.len = self.lists.lines.len;
    }
}

/// All bits set, or none: what lanes choose by.
#[inline(always)]
pub(crate) fn all_bits(is_so: bool) -> u32 {
    u32::from(is_so).wrapping_neg()
}
