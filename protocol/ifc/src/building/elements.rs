//! The surfaces of the elements of a building, in meters, in the frame of the file.

use std::collections::BTreeMap;

use crate::building::plan::Storey;
use crate::building::relations::Relations;
use crate::geometry::bsp::difference;
use crate::geometry::curve::Curves;
use crate::geometry::item::{Cuts, Items, placed};
use crate::geometry::mesh::Triangle;
use crate::geometry::placement::local;
use crate::geometry::vector::scale;
use crate::step::parse::{IfcError, parse};
use crate::step::value::{Entity, Step, Value};

/// Products that have no surface that a laser sees.
const WITHOUT_SURFACE: [&str; 9] = [
    "IFCSPACE",
    "IFCOPENINGELEMENT",
    "IFCOPENINGSTANDARDCASE",
    "IFCANNOTATION",
    "IFCGRID",
    "IFCVIRTUALELEMENT",
    "IFCSITE",
    "IFCSPATIALZONE",
    "IFCPROXY",
];
/// Representations that are no bodies.
const NO_BODIES: [&str; 9] =
    ["Axis", "FootPrint", "Box", "Annotation", "Profile", "Plan", "CoG", "Reference", "Clearance"];
/// What openings are cut with when the file is not in meters: points this near to a plane lie on it.
const NEAR_M: f64 = 1e-5;

/// Items that are read for each instance of a file, at most: mapped ones are read as often as they are used.
const ITEMS_PER_ENTITY: usize = 16;

/// An element and its surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    /// Type in upper case, such as `IFCWALL`.
    pub kind: String,
    /// Its identifier in the file (`GlobalId`).
    pub id: String,
    /// Corners of its triangles, counter-clockwise seen from outside, meters.
    pub triangles_m: Vec<[[f64; 3]; 3]>,
}

/// A file that was read.
#[derive(Debug)]
pub struct Ifc {
    pub(crate) step: Step,
    pub(crate) relations: Relations,
    meter: f64,
    radian: f64,
}

impl Ifc {
    /// Reads a file.
    ///
    /// # Errors
    /// When the bytes are no STEP file, or one without storeys.
    pub fn read(bytes: &[u8]) -> Result<Self, IfcError> {
        let step = parse(bytes)?;
        if step.all(&["IFCBUILDINGSTOREY"]).next().is_none() {
            return Err(IfcError::NoStorey);
        }
        let relations = Relations::of(&step);
        let (meter, radian) = (unit(&step, "LENGTHUNIT"), unit(&step, "PLANEANGLEUNIT"));
        Ok(Self { step, relations, meter, radian })
    }

    /// The storeys, the lowest first.
    #[must_use]
    pub fn storeys(&self) -> Vec<Storey> {
        self.storey_ids().into_iter().map(|(_, storey)| storey).collect()
    }

    pub(crate) fn storey_ids(&self) -> Vec<(u64, Storey)> {
        let of = |(id, entity): (u64, &Entity)| {
            let elevation_m = entity.at(9).number().unwrap_or(0.0) * self.meter;
            (id, Storey { name: entity.at(2).text().unwrap_or_default().to_owned(), elevation_m })
        };
        let mut storeys: Vec<(u64, Storey)> = self.step.all(&["IFCBUILDINGSTOREY"]).map(of).collect();
        storeys.sort_by(|a, b| a.1.elevation_m.total_cmp(&b.1.elevation_m).then(a.0.cmp(&b.0)));
        storeys
    }

    /// The surfaces of all elements, with their openings cut out, by number in the file; and how often what
    /// kind of geometry was left out because it is not known here.
    #[must_use]
    pub fn elements(&self) -> (Vec<Element>, BTreeMap<String, usize>) {
        let mut items = self.items(Cuts::Made);
        let mut elements = Vec::new();
        for (id, entity) in &self.step.entities {
            if !self.is_product(entity) || WITHOUT_SURFACE.contains(&entity.kind.as_str()) {
                continue;
            }
            let mut triangles_m = self.body(&mut items, entity);
            for opening in self.relations.openings_of.get(id).into_iter().flatten() {
                let Some(opening) = self.step.get(*opening) else { continue };
                triangles_m = difference(&triangles_m, &self.body(&mut items, opening), NEAR_M);
            }
            if !triangles_m.is_empty() {
                let id = entity.at(0).text().unwrap_or_default().to_owned();
                elements.push(Element { kind: entity.kind.clone(), id, triangles_m });
            }
        }
        (elements, items.unknown)
    }

    pub(crate) fn items(&self, cuts: Cuts) -> Items<'_> {
        let curves = Curves { step: &self.step, radian: self.radian };
        let budget = ITEMS_PER_ENTITY * self.step.entities.len();
        Items { curves, meter: self.meter, cuts, budget, unknown: BTreeMap::new() }
    }

    /// Products are what has a placement and a shape.
    fn is_product(&self, entity: &Entity) -> bool {
        let kind = |index: usize| self.step.follow(entity.at(index)).map(|entity| entity.kind.as_str());
        kind(6) == Some("IFCPRODUCTDEFINITIONSHAPE")
    }

    /// The body of a product, meters.
    pub(crate) fn body(&self, items: &mut Items<'_>, product: &Entity) -> Vec<Triangle> {
        let Some(shape) = self.step.follow(product.at(6)) else { return Vec::new() };
        let mut body = Vec::new();
        for representation in shape.at(2).list().iter().filter_map(|value| self.step.follow(value)) {
            let name = representation.at(1).text().unwrap_or("Body");
            if !NO_BODIES.contains(&name) {
                let parts = representation.at(3).list();
                body.extend(parts.iter().flat_map(|part| items.triangles(part)));
            }
        }
        let placed = placed(&body, &local(&self.step, product.at(5)));
        placed.into_iter().map(|triangle| triangle.map(|corner| scale(corner, self.meter))).collect()
    }
}

/// The size of a unit of the file in meters or radians.
fn unit(step: &Step, kind: &str) -> f64 {
    let assigned = step.all(&["IFCUNITASSIGNMENT"]).next();
    let units = assigned.map(|(_, entity)| entity.at(0).list()).unwrap_or_default();
    let mut units = units.iter().filter_map(|value| step.follow(value));
    units.find(|unit| unit.at(1).is(kind)).map_or(1.0, |unit| size(step, unit))
}

fn size(step: &Step, unit: &Entity) -> f64 {
    match unit.kind.as_str() {
        "IFCSIUNIT" => match unit.at(2) {
            Value::Enum(prefix) => match prefix.as_str() {
                "MILLI" => 1e-3,
                "CENTI" => 1e-2,
                "DECI" => 1e-1,
                "KILO" => 1e3,
                "MICRO" => 1e-6,
                _ => 1.0,
            },
            _ => 1.0,
        },
        "IFCCONVERSIONBASEDUNIT" => {
            let Some(factor) = step.follow(unit.at(3)) else { return 1.0 };
            let inner = step.follow(factor.at(1)).filter(|unit| unit.kind == "IFCSIUNIT");
            factor.at(0).number().unwrap_or(1.0) * inner.map_or(1.0, |unit| size(step, unit))
        }
        _ => 1.0,
    }
}
