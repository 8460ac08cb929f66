//! The building of a drive as architects' programs expect it: spaces, walls as swept solids with openings,
//! doors and windows that fill them, floors and ceilings.
//!
//! Whatever no laser saw says so in the property set `Biplane_Evidence`: a wall of which one face was seen
//! has a body of a stated, assumed depth and no material layers, so that nobody reads a thickness from it.

mod evidence;
mod openings;
mod spaces;
mod walls;

use std::collections::BTreeMap;

use super::project::{self, Project};
use super::solids;
use super::step::{Id, Ids, Step, global_id};
use super::styles::Styles;
use crate::building::elements::Elements;
use crate::formats::Shapes;
use crate::formats::text::number::Number;
use crate::model::inferred::InferredSurface;

/// Adds rooms, walls, floors, ceilings, doors and windows.
pub(super) struct Architecture<'a> {
    step: &'a mut Step,
    project: &'a Project,
    elements: &'a Elements,
    /// Surfaces of the model that nobody measured.
    inferred: &'a [InferredSurface],
    /// What the model was made of: part of every identifier.
    source: &'a str,
    /// Index of the storey that all of it is on.
    storey: usize,
    /// Walls, doors, windows and slabs by name.
    added: BTreeMap<String, Id>,
    /// Elements of the storey.
    contained: Vec<Id>,
    styles: Styles,
}

/// A quantity of an element: the kind and the name of IFC, and its value.
pub(super) type Quantity<'a> = (&'a str, &'a str, f64);

impl<'a> Architecture<'a> {
    /// Nothing yet.
    pub(super) fn new(
        step: &'a mut Step,
        project: &'a Project,
        elements: &'a Elements,
        shapes: &'a Shapes<'_>,
    ) -> Self {
        let (inferred, source) = (shapes.model.inferred.as_slice(), shapes.source.as_str());
        let floor_m = elements.storeys.first().map_or(0.0, |storey| storey.floor_z_m);
        let storey = project::nearest(project.storeys.iter().map(|storey| storey.floor_m), floor_m);
        let (added, contained, styles) = (BTreeMap::new(), Vec::new(), Styles::default());
        Self { step, project, elements, inferred, source, storey, added, contained, styles }
    }

    /// Adds everything; returns the storey that all of it is on, and what that holds.
    pub(super) fn add_all(mut self) -> (usize, Vec<Id>) {
        for wall in &self.elements.walls {
            self.wall(wall);
        }
        for opening in &self.elements.openings {
            self.opening(opening);
        }
        self.joints();
        self.spaces();
        (self.storey, self.contained)
    }

    /// The name of the storey.
    fn storey_name(&self) -> &'a str {
        self.elements.storeys.first().map_or("S1", |storey| &storey.id)
    }

    /// The identifier of a thing of this building.
    fn id(&self, what: std::fmt::Arguments<'_>) -> String {
        global_id(format_args!("{} {what}", self.source))
    }

    /// Gives an element a set of quantities.
    fn quantities(&mut self, element: Id, name: &str, set: &str, quantities: &[Quantity<'_>]) {
        let values: Vec<Id> = quantities
            .iter()
            .map(|(kind, quantity, value)| {
                self.step.add(format_args!("IFCQUANTITY{kind}('{quantity}',$,$,{},$)", Number(*value)))
            })
            .collect();
        let owner = self.project.owner;
        let [own, has] =
            ["quantities of", "has quantities"].map(|word| self.id(format_args!("{word} {name}")));
        let set =
            self.step.add(format_args!("IFCELEMENTQUANTITY('{own}',{owner},'{set}',$,$,{})", Ids(&values)));
        self.step.add(format_args!("IFCRELDEFINESBYPROPERTIES('{has}',{owner},$,$,({element}),{set})"));
    }

    /// A placement in the storey's, its origin at a place over the floor, x along a direction.
    fn place(&mut self, [x, y]: [f64; 2], up_m: f64, along: [f64; 2]) -> Id {
        let storey = self.project.storeys[self.storey].place;
        let axes = solids::axes(self.step, [x, y, up_m], along);
        self.step.add(format_args!("IFCLOCALPLACEMENT({storey},{axes})"))
    }

    /// A body of solids, painted.
    fn body(&mut self, items: &[Id], color: [u8; 3]) -> Id {
        for item in items {
            self.styles.paint(self.step, *item, color);
        }
        let context = self.project.body;
        self.step.add(format_args!("IFCSHAPEREPRESENTATION({context},'Body','SweptSolid',{})", Ids(items)))
    }

    /// The shape of an element from its representations.
    fn shape(&mut self, representations: &[Id]) -> Id {
        self.step.add(format_args!("IFCPRODUCTDEFINITIONSHAPE($,$,{})", Ids(representations)))
    }
}
