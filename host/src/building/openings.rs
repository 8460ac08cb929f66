//! Doors and windows: plumb gaps of a wall with the wall going on over them.
//!
//! A gap at the height of the cut whose sides are plumb and that has wall over all of its width is an
//! opening: a door when nothing of the wall is under it, a window when there is. A shadow of furniture is
//! rarely plumb; one that is cannot be told from an opening. Over the cut a rectangular hole is a window:
//! those of the upper rows of a facade.

use super::elevation::{Elevation, Span, extent};
use crate::building::part::CUT_M;
use crate::building::part::Kind;
use crate::building::part::Part;
use crate::building::part::heights_m;
use crate::model::{Model, PlanarPolygon};
use biplane_geometry::PortableMath;
use biplane_geometry::polygon_area::ring_area_m2;

/// What an opening is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OpeningKind {
    /// One walks through it.
    Door,
    /// A passage too wide for a door.
    Passage,
    /// It has a sill.
    Window,
}

/// An opening of a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening {
    /// What it is for.
    pub kind: OpeningKind,
    /// Index of the storey.
    pub storey: usize,
    /// Index of the polygon over it.
    pub polygon: usize,
    /// Its two ends on the wall, x and y in `map`, meters: at the height of the cut, or in its middle when it
    /// lies over the cut.
    pub ends_m: [[f64; 2]; 2],
    /// Its lower edge, meters; the floor for a door.
    pub bottom_m: f64,
    /// Its upper edge, meters.
    pub top_m: f64,
}

impl Opening {
    /// Width, meters.
    pub fn width_m(&self) -> f64 {
        let [a, b] = self.ends_m;
        (b[0] - a[0]).portable_hypot(b[1] - a[1])
    }

    /// Height, meters.
    pub fn height_m(&self) -> f64 {
        self.top_m - self.bottom_m
    }

    /// Whether a plan of its storey, cut 1.2 m over this floor, shows it.
    pub(crate) fn is_cut(&self, floor_m: f64) -> bool {
        self.bottom_m <= floor_m + CUT_M
    }
}

/// Narrower gaps are slits and borders of shadows, meters.
const MIN_WIDTH_M: f64 = 0.5;
/// Wider ones are no doors, meters.
const WIDEST_DOOR_M: f64 = 2.5;
/// Wider gaps are two walls, meters.
const WIDEST_M: f64 = 8.0;
/// A door or passage is at least this high, meters.
const MIN_DOOR_M: f64 = 1.75;
/// Less of a window over the cut is a shadow's edge, meters.
const MIN_OVER_CUT_M: f64 = 0.15;
/// What begins lower over the floor has no sill, meters.
const SILL_M: f64 = 0.3;
/// Sides may be off plumb by this, and lintels off level, meters: borders of noisy walls are straight within
/// 3 to 10 cm.
const SKEW_M: f64 = 0.15;
/// Of a hole over the cut this much of the rectangle around it is open.
const RECTANGLE: f64 = 0.9;
/// Heights at which the sides are looked at.
const LOOKS: usize = 6;
/// Distance kept from upper and lower edge when looking, meters.
const EDGE_M: f64 = 0.1;
/// A surface so far before a window's wall, or a little behind it, covers the window, meters.
const BEFORE_M: f64 = 0.3;
/// See `BEFORE_M`: glass and shutters lie deeper.
const BEHIND_M: f64 = 0.04;
/// A leaf lies at most this far behind its wall, meters.
const REVEAL_M: f64 = 0.3;

/// The openings of all walls, storey by storey, plane by plane.
pub(crate) fn find(model: &Model, floors_m: &[f64], parts: &[Part]) -> Vec<Opening> {
    let mut walls: Vec<Vec<usize>> = vec![Vec::new(); model.planes.len()];
    for (index, (polygon, part)) in model.polygons.iter().zip(parts).enumerate() {
        if part.kind == Kind::Wall {
            walls[polygon.plane].push(index);
        }
    }
    let mut openings = Vec::new();
    for (storey, floor_m) in floors_m.iter().enumerate() {
        let ceiling_m = floors_m.get(storey + 1).copied().unwrap_or(f64::INFINITY);
        let heights = StoreyHeights { storey, floor_m: *floor_m, ceiling_m };
        for (plane, indices) in walls.iter().enumerate() {
            let Some(elevation) = Elevation::new(&model.planes[plane]) else { continue };
            let wall = Wall::new(elevation, model, indices, &heights);
            wall.openings(&mut openings);
        }
    }
    openings.retain(|opening| opening.kind != OpeningKind::Window || !is_covered(model, opening));
    openings
}

/// Whether a surface lies before a window, from the wall's own plane to a hand's breadth into the room: a
/// board, a cupboard on the wall.
fn is_covered(model: &Model, window: &Opening) -> bool {
    let [a, b] = window.ends_m;
    let middle = [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0, (window.bottom_m + window.top_m) / 2.0];
    let own = model.polygons[window.polygon].plane;
    model.polygons.iter().filter(|polygon| polygon.plane != own).any(|polygon| {
        let Some(plane) = model.planes.get(polygon.plane) else { return false };
        let (wall, Some(elevation)) = (&model.planes[own], Elevation::new(plane)) else { return false };
        let facing: f64 = (0..3).map(|k| plane.normal[k] * wall.normal[k]).sum();
        // How far the surface is before the wall.
        let before_m = -plane.distance_m(middle);
        let at = elevation.u([middle[0], middle[1]]);
        facing > 0.95
            && (-BEHIND_M..=BEFORE_M).contains(&before_m)
            && elevation.row(polygon, middle[2]).iter().any(|span| span[0] <= at && at <= span[1])
    })
}

/// Where a storey begins and ends.
struct StoreyHeights {
    /// Its index.
    storey: usize,
    floor_m: f64,
    /// Floor of the next storey, meters; infinite for the highest.
    ceiling_m: f64,
}

/// The wall polygons of one plane.
struct Wall<'a> {
    elevation: Elevation,
    indices: &'a [usize],
    polygons: Vec<&'a PlanarPolygon>,
    floor_m: f64,
    /// Floor of the next storey.
    ceiling_m: f64,
    storey: usize,
    low_m: f64,
}

impl<'a> Wall<'a> {
    fn new(elevation: Elevation, model: &'a Model, indices: &'a [usize], storey: &StoreyHeights) -> Self {
        let polygons: Vec<&PlanarPolygon> = indices.iter().map(|index| &model.polygons[*index]).collect();
        let low_m = polygons.iter().map(|p| heights_m(p).0).fold(f64::INFINITY, f64::min).max(storey.floor_m);
        let &StoreyHeights { storey, floor_m, ceiling_m } = storey;
        Self { elevation, indices, polygons, floor_m, ceiling_m, storey, low_m }
    }

    fn openings(&self, out: &mut Vec<Opening>) {
        let row = self.elevation.rows(&self.polygons, self.floor_m + CUT_M);
        for pair in row.windows(2) {
            let gap = [pair[0][1], pair[1][0]];
            out.extend(self.opening(gap));
        }
        out.extend(self.over_the_cut());
    }

    /// The rectangular holes over the height of the cut.
    fn over_the_cut(&self) -> impl Iterator<Item = Opening> + '_ {
        let walls = self.indices.iter().zip(&self.polygons);
        let holes = walls.flat_map(|(index, polygon)| polygon.holes_m.iter().map(|hole| (*index, hole)));
        holes.filter_map(|(index, hole)| self.high_window(index, hole))
    }

    /// The window that a hole of a polygon is, if it is one.
    fn high_window(&self, polygon: usize, hole: &[[f64; 3]]) -> Option<Opening> {
        let flat: Vec<[f64; 3]> = hole.iter().map(|p| [self.elevation.u([p[0], p[1]]), p[2], 0.0]).collect();
        let [[from, to], [bottom_m, top_m]] = [0, 1].map(|axis| extent(flat.iter().map(|p| p[axis])));
        let (width_m, height_m) = (to - from, top_m - bottom_m);
        let is_window = (MIN_WIDTH_M..=WIDEST_M).contains(&width_m)
            && height_m >= MIN_WIDTH_M
            && bottom_m > self.floor_m + CUT_M
            && top_m < self.ceiling_m
            && ring_area_m2(&flat) >= RECTANGLE * width_m * height_m;
        is_window.then(|| Opening {
            kind: OpeningKind::Window,
            storey: self.storey,
            polygon,
            ends_m: [from, to].map(|u| self.elevation.point(u, (bottom_m + top_m) / 2.0)),
            bottom_m,
            top_m,
        })
    }

    /// The opening that a gap at the height of the cut belongs to, if it is one.
    fn opening(&self, gap: Span) -> Option<Opening> {
        let width_m = gap[1] - gap[0];
        if !(MIN_WIDTH_M..=WIDEST_M).contains(&width_m) {
            return None;
        }
        let cut_m = self.floor_m + CUT_M;
        let looks: Vec<Looked> = [0.2, 0.5, 0.8]
            .iter()
            .map(|share| self.look(gap[0] + share * width_m, cut_m))
            .collect::<Option<_>>()?;
        let top_m = looks[1].over_m;
        if top_m >= self.ceiling_m || looks.iter().any(|look| (look.over_m - top_m).abs() > SKEW_M) {
            return None;
        }
        let sill_m = looks.iter().filter_map(|look| look.under_m).fold(f64::NEG_INFINITY, f64::max);
        let has_sill = sill_m > self.floor_m + SILL_M;
        let bottom_m = if has_sill { sill_m } else { self.floor_m };
        if !self.is_plumb(gap, if has_sill { sill_m } else { self.low_m }, top_m) {
            return None;
        }
        let kind = match (has_sill, width_m <= WIDEST_DOOR_M) {
            (true, _) => OpeningKind::Window,
            (false, true) => OpeningKind::Door,
            (false, false) => OpeningKind::Passage,
        };
        let min_top_m = if has_sill { CUT_M + MIN_OVER_CUT_M } else { MIN_DOOR_M };
        let polygon = self.over((gap[0] + gap[1]) / 2.0, top_m)?;
        if !self.spans(polygon, gap) {
            return None;
        }
        let ends_m = gap.map(|u| self.elevation.point(u, cut_m));
        (top_m >= self.floor_m + min_top_m).then_some(Opening {
            kind,
            storey: self.storey,
            polygon,
            ends_m,
            bottom_m,
            top_m,
        })
    }

    /// Up and down from the cut at one place of the gap: `None` when there is no wall over it.
    fn look(&self, u: f64, cut_m: f64) -> Option<Looked> {
        let column = self.elevation.column(&self.polygons, u);
        let over_m = column.iter().map(|span| span[0]).find(|low| *low >= cut_m)?;
        let under_m = column.iter().map(|span| span[1]).rfind(|high| *high <= cut_m && *high > self.floor_m);
        Some(Looked { over_m, under_m })
    }

    /// Whether the gap has its sides where it has them at the cut, from its lower to its upper edge.
    fn is_plumb(&self, gap: Span, bottom_m: f64, top_m: f64) -> bool {
        let middle = (gap[0] + gap[1]) / 2.0;
        let (low_m, high_m) = (bottom_m + EDGE_M, top_m - EDGE_M);
        (0..LOOKS).all(|look| {
            let z_m = low_m + (high_m - low_m) * look as f64 / (LOOKS - 1) as f64;
            let row = self.elevation.rows(&self.polygons, z_m);
            let before = row.iter().map(|span| span[1]).rfind(|end| *end <= middle);
            let after = row.iter().map(|span| span[0]).find(|start| *start > middle);
            let is_open = !row.iter().any(|span| span[0] <= middle && middle <= span[1]);
            let near = |side: Option<f64>, at: f64| side.is_some_and(|side| (side - at).abs() <= SKEW_M);
            is_open && near(before, gap[0]) && near(after, gap[1])
        })
    }

    /// Whether a polygon reaches from one side of the gap to the other: an opening lies in one wall.
    fn spans(&self, polygon: usize, gap: Span) -> bool {
        let own = self.indices.iter().zip(&self.polygons).filter(|(index, _)| **index == polygon);
        let along = own.flat_map(|(_, own)| own.outer_m.iter().map(|p| self.elevation.u([p[0], p[1]])));
        let [low, high] = extent(along);
        low <= gap[0] + SKEW_M && gap[1] - SKEW_M <= high
    }

    /// The polygon whose border is the upper edge.
    fn over(&self, u: f64, top_m: f64) -> Option<usize> {
        let starts = |polygon: &PlanarPolygon| {
            self.elevation.column(&[polygon], u).iter().any(|span| (span[0] - top_m).abs() < 1e-6)
        };
        self.indices.iter().zip(&self.polygons).find(|(_, polygon)| starts(polygon)).map(|(index, _)| *index)
    }
}

/// What is over and under a place of a gap.
struct Looked {
    over_m: f64,
    under_m: Option<f64>,
}

/// The polygons that close a door, and the door's index: parallel to its wall, close behind it, and no wider
/// or higher than it.
pub(crate) fn leaves(model: &Model, parts: &[Part], openings: &[Opening]) -> Vec<(usize, usize)> {
    let door_of = |index: usize| {
        let closed = |door: &Opening| {
            door.kind == OpeningKind::Door && door.polygon != index && closes(model, index, door)
        };
        openings.iter().position(closed).map(|door| (index, door))
    };
    let has_opening = |index: &usize| openings.iter().any(|opening| opening.polygon == *index);
    let upright = |index: &usize| matches!(parts[*index].kind, Kind::Wall | Kind::Other);
    (0..model.polygons.len())
        .filter(|index| upright(index) && !has_opening(index))
        .filter_map(door_of)
        .collect()
}

fn closes(model: &Model, index: usize, door: &Opening) -> bool {
    let (polygon, own) = (&model.polygons[index], model.polygons[door.polygon].plane);
    let (Some(plane), Some(wall)) = (model.planes.get(polygon.plane), model.planes.get(own)) else {
        return false;
    };
    let parallel: f64 = (0..3).map(|k| plane.normal[k] * wall.normal[k]).sum();
    let Some(elevation) = Elevation::new(wall) else { return false };
    let mut ends = door.ends_m.map(|end| elevation.u(end));
    ends.sort_by(f64::total_cmp);
    polygon.plane != own
        && parallel.abs() > 0.95
        && polygon.outer_m.iter().all(|p| {
            let u = elevation.u([p[0], p[1]]);
            (-REVEAL_M..=EDGE_M / 2.0).contains(&wall.distance_m(*p))
                && u >= ends[0] - SKEW_M
                && u <= ends[1] + SKEW_M
                && p[2] <= door.top_m + SKEW_M
                && p[2] >= door.bottom_m - SKEW_M
        })
}
