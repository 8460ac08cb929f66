//! What a model's surfaces are in a building: storeys, walls, floors, ceilings, doors and windows, as far as
//! geometry tells.
//!
//! For exports that draw buildings and not surfaces (DXF, IFC). z is up. Frame `map`, meters. Nothing is
//! invented: a floor that no laser saw is no part, a hole of any shape in a wall is no window.

mod elevation;
mod openings;
pub(crate) mod part;
pub(crate) mod plan;
pub(crate) mod section;
mod storeys;
#[cfg(test)]
pub(crate) mod tests;

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
}

impl Building {
    /// Reads a model. `known_floor_m` is the height of a floor that is known to be there, seen or not,
    /// meters.
    pub fn read(model: &Model, known_floor_m: Option<f64>) -> Self {
        let floors_m = storeys::find(model, known_floor_m);
        let mut parts: Vec<Part> = model.polygons.iter().map(|p| part::part(model, p, &floors_m)).collect();
        let openings = openings::find(model, &floors_m, &parts);
        let leaves = openings::leaves(model, &parts, &openings);
        for (polygon, opening) in &leaves {
            parts[*polygon] = Part { kind: Kind::Leaf, storey: openings[*opening].storey };
        }
        Self { floors_m, parts, openings, leaves }
    }
}
