//! What a model's surfaces are in a building: storeys, walls, floors, ceilings, doors and windows, as far as
//! geometry tells.
//!
//! For exports that draw buildings and not surfaces (DXF, IFC). z is up. Frame `map`, meters. There are two
//! ways. Of any model [`Building::read`] tells what its polygons are; nothing is invented: a floor that no
//! laser saw is no part, a hole of any shape in a wall is no window. Of a drive, whose rays, path and floor
//! map are known, [`rooms`] finds rooms, walls with their thickness, doors and windows ([`spaces`],
//! [`walls`]).

pub(crate) mod elements;
pub(crate) mod elevation;
mod openings;
pub(crate) mod part;
pub(crate) mod plan;
pub(crate) mod section;
pub(crate) mod spaces;
mod storeys;
pub(crate) mod surfaces;
#[cfg(test)]
pub(crate) mod tests;
pub(crate) mod walls;

use std::collections::BTreeMap;

use self::elements::{Elements, Storey, Use, storey_name};
use self::spaces::Plan;
use self::spaces::evidence::Evidence;
use crate::model::Model;

pub use openings::{Opening, OpeningKind};
pub use part::{Kind, Part};

/// A model read as a building.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Building {
    /// Heights of the storeys' floors, meters, from below; empty when no floor was found.
    pub floors_m: Vec<f64>,
    /// The part of each polygon of the model.
    pub parts: Vec<Part>,
    /// Doors and windows.
    pub openings: Vec<Opening>,
    /// Leaves of closed doors: index of the polygon, index of the opening.
    pub leaves: Vec<(usize, usize)>,
    /// Rooms, walls and their openings, when the drive is known.
    pub(crate) elements: Elements,
}

/// Heights that differ by less are one floor, meters.
const SAME_FLOOR_M: f64 = 0.5;

/// Cells of the floor that are looked at at most: 200 m by 200 m, some 400 MB.
const MAX_CELLS: usize = 16_000_000;

/// Finds rooms, walls, doors and windows of a drive; nothing where it is too large.
pub(crate) fn rooms(evidence: &Evidence<'_>) -> Elements {
    if evidence.area.grid.len() > MAX_CELLS {
        return Elements::default();
    }
    let plan = Plan::find(evidence);
    let walls = walls::find(evidence, &plan);
    elements::assemble::elements(evidence, &plan, walls)
}

impl Building {
    /// Rooms and walls of the storey with a floor at this height, where a drive told of them.
    pub(crate) fn elements_at(&self, floor_m: f64) -> Option<Elements> {
        let is_here = |storey: &&Storey| (storey.floor_z_m - floor_m).abs() < SAME_FLOOR_M;
        let storey = self.elements.storeys.iter().find(is_here)?;
        Some(self.elements.of_storey(storey)).filter(|elements| !elements.is_empty())
    }

    /// The name of each opening of a model without rooms, counted storey by storey as those of rooms are:
    /// `S1-D01` a door, `S1-P01` a passage, `S1-N01` a window.
    pub(crate) fn opening_names(&self) -> Vec<String> {
        let mut counts: BTreeMap<usize, [usize; 3]> = BTreeMap::new();
        let mut name = |opening: &Opening| {
            let kind = Use::from(opening.kind);
            let number = &mut counts.entry(opening.storey).or_default()[kind as usize];
            *number += 1;
            kind.name(&storey_name(opening.storey + 1), *number)
        };
        self.openings.iter().map(&mut name).collect()
    }

    /// Reads a model. `known_floor_m` is the height of a floor that is known to be there, seen or not,
    /// meters.
    pub fn read(model: &Model, known_floor_m: Option<f64>) -> Self {
        Self::read_on(model, known_floor_m.as_slice())
    }

    /// Reads a model of which the heights of some floors are known, from below, meters.
    pub(crate) fn read_on(model: &Model, known_floors_m: &[f64]) -> Self {
        let floors_m = storeys::find(model, known_floors_m);
        let mut parts: Vec<Part> = model.polygons.iter().map(|p| part::part(model, p, &floors_m)).collect();
        let openings = openings::find(model, &floors_m, &parts);
        let leaves = openings::leaves(model, &parts, &openings);
        for (polygon, opening) in &leaves {
            parts[*polygon] = Part { kind: Kind::Leaf, storey: openings[*opening].storey };
        }
        Self { floors_m, parts, openings, leaves, elements: Elements::default() }
    }
}
