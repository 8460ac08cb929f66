//! Walls, slabs, coverings, openings with their doors and windows, and proxies for everything else.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::project::Project;
use super::step::{Id, Ids, Reals, Step, global_id};
use super::styles::Styles;
use super::{frame, solids};
use crate::building::Building;
use crate::building::Opening;
use crate::building::OpeningKind;
use crate::building::part::Kind;
use crate::formats::Shapes;
use crate::formats::obj::welded::WeldedVertices;
use crate::formats::text::number::Number;
use crate::model::palette;
use crate::model::{Mesh, PlanarPolygon};
use biplane_geometry::polygon_area::ring_area_m2;

/// Step of coordinates, meters.
const STEP_M: f64 = 1e-4;

/// Polygons with more corners than this, those of holes among them, are written as triangles. Fewer, and
/// walls with a few windows can no longer be edited by their corners; more, and readers that cut polygons
/// themselves get ragged ones wrong: ifcopenshell 0.9.0 made areas of some with 53 corners and more that were
/// up to 98 % off.
const MAX_CORNERS: usize = 32;

/// Adds the elements of a model.
pub(crate) struct Elements<'a> {
    step: &'a mut Step,
    shapes: &'a Shapes<'a>,
    building: &'a Building,
    project: &'a Project,
    styles: Styles,
    /// Elements of each storey.
    contained: Vec<Vec<Id>>,
}

impl<'a> Elements<'a> {
    /// None yet.
    pub(crate) fn new(
        step: &'a mut Step,
        shapes: &'a Shapes<'a>,
        building: &'a Building,
        project: &'a Project,
    ) -> Self {
        let contained = vec![Vec::new(); project.storeys.len()];
        Self { step, shapes, building, project, styles: Styles::default(), contained }
    }

    /// Adds everything; `architecture` are the elements of storeys that stand for their walls, floors and
    /// ceilings already.
    pub(crate) fn add_all(mut self, architecture: Vec<(usize, Vec<Id>)>) {
        if architecture.is_empty() {
            self.surfaces();
        } else {
            self.things(architecture);
        }
        let owner = self.project.owner;
        for (storey, elements) in self.project.storeys.iter().zip(&self.contained) {
            if !elements.is_empty() {
                let id = global_id(format_args!("content of {} {}", storey.id, elements.len()));
                self.step.add(format_args!(
                    "IFCRELCONTAINEDINSPATIALSTRUCTURE('{id}',{owner},$,$,{},{})",
                    Ids(elements),
                    storey.id
                ));
            }
        }
    }

    /// What is no part of the building itself, in a group.
    fn things(&mut self, architecture: Vec<(usize, Vec<Id>)>) {
        let mut things = Vec::new();
        for (index, part) in self.building.parts.iter().enumerate() {
            if part.kind == Kind::Other {
                things.extend(self.surface(index, part.kind, part.storey));
            }
        }
        let before = self.contained[0].len();
        self.leftovers();
        things.extend(self.contained[0].get(before..).unwrap_or_default());
        for (storey, known) in architecture {
            self.contained[storey].extend(known);
        }
        if things.is_empty() {
            return;
        }
        let owner = self.project.owner;
        let [own, has] = ["", "has "].map(|word| global_id(format_args!("{word}things {}", things.len())));
        let group =
            self.step.add(format_args!("IFCGROUP('{own}',{owner},'furniture and other surfaces',$,$)"));
        self.step.add(format_args!("IFCRELASSIGNSTOGROUP('{has}',{owner},$,$,{},$,{group})", Ids(&things)));
    }

    /// Every surface as the element that it is.
    fn surfaces(&mut self) {
        let parts = self.building.parts.iter().enumerate();
        let mut walls = BTreeMap::new();
        for (index, part) in parts.filter(|(_, part)| part.kind != Kind::Leaf) {
            if let Some(id) = self.surface(index, part.kind, part.storey) {
                walls.insert(index, id);
            }
        }
        let names = self.building.opening_names();
        for (index, (opening, name)) in self.building.openings.iter().zip(&names).enumerate() {
            if let Some(wall) = walls.get(&opening.polygon) {
                self.opening((index, name), opening, *wall);
            }
        }
        self.leftovers();
    }

    /// A polygon as the element that it is; `None` when nothing is left of it.
    fn surface(&mut self, index: usize, kind: Kind, storey: usize) -> Option<Id> {
        let polygon = &self.shapes.model.polygons[index];
        let item = self.polygon(index, storey)?;
        let plane = self.shapes.model.planes.get(polygon.plane)?;
        self.styles.paint(self.step, item, palette::plane_color(polygon.plane, plane));
        let part_of = palette::plane_name(polygon.plane, plane);
        let (entity, word, class) = match kind {
            Kind::Wall => ("IFCWALL", "wall", "NOTDEFINED"),
            Kind::Floor => ("IFCSLAB", "floor", "FLOOR"),
            Kind::Ceiling => ("IFCCOVERING", "ceiling", "CEILING"),
            Kind::Leaf | Kind::Other => ("IFCBUILDINGELEMENTPROXY", "surface", "NOTDEFINED"),
        };
        let shape = self.shape(self.project.body, "Body", "Tessellation", &[item]);
        let place = self.place(storey);
        let (owner, id) =
            (self.project.owner, global_id(format_args!("{word} {index} {:?}", polygon.outer_m)));
        let element = self.step.add(format_args!(
            "{entity}('{id}',{owner},'surface {index}','part of {part_of}',$,{place},{shape},'{index}',.{class}.)"
        ));
        self.contained[storey].push(element);
        self.properties(element, &id, polygon);
        Some(element)
    }

    /// A polygon of the model as one face, or as triangles where it has many corners.
    fn polygon(&mut self, index: usize, storey: usize) -> Option<Id> {
        let shapes = self.shapes;
        let polygon = &shapes.model.polygons[index];
        let corners = polygon.outer_m.len() + polygon.holes_m.iter().map(Vec::len).sum::<usize>();
        match shapes.faces.get(index) {
            Some(mesh) if corners > MAX_CORNERS && !mesh.triangles.is_empty() => {
                Some(self.triangles(mesh, storey))
            }
            _ => self.face_set(polygon, storey),
        }
    }

    /// A mesh as a set of triangles.
    fn triangles(&mut self, mesh: &Mesh, storey: usize) -> Id {
        let floor_m = self.project.storeys[storey].floor_m;
        let points = self
            .points(mesh.vertices_m.iter().map(|p| p.map(f64::from)).map(|[x, y, z]| [x, y, z - floor_m]));
        let mut list = String::new();
        for (place, [a, b, c]) in mesh.triangles.iter().enumerate() {
            let _ = write!(list, "{}({},{},{})", if place > 0 { "," } else { "" }, a + 1, b + 1, c + 1);
        }
        self.step.add(format_args!("IFCTRIANGULATEDFACESET({points},$,.F.,({list}),$)"))
    }

    /// A polygon as a set of one face with its holes.
    fn face_set(&mut self, polygon: &PlanarPolygon, storey: usize) -> Option<Id> {
        let floor_m = self.project.storeys[storey].floor_m;
        let mut vertices = WeldedVertices::new(STEP_M);
        let mut ring = |points: &[[f64; 3]]| {
            let moved: Vec<[f64; 3]> = points.iter().map(|[x, y, z]| [*x, *y, z - floor_m]).collect();
            vertices.ring(&moved)
        };
        let outer = ring(&polygon.outer_m);
        let holes: Vec<Vec<usize>> =
            polygon.holes_m.iter().map(|hole| ring(hole)).filter(|hole| !hole.is_empty()).collect();
        if outer.is_empty() {
            return None;
        }
        let points = self.points(vertices.positions_m());
        let face = if holes.is_empty() {
            self.step.add(format_args!("IFCINDEXEDPOLYGONALFACE({})", numbers(&outer)))
        } else {
            let holes: Vec<String> = holes.iter().map(|hole| numbers(hole)).collect();
            self.step.add(format_args!(
                "IFCINDEXEDPOLYGONALFACEWITHVOIDS({},({}))",
                numbers(&outer),
                holes.join(",")
            ))
        };
        Some(self.step.add(format_args!("IFCPOLYGONALFACESET({points},.F.,({face}),$)")))
    }

    fn points(&mut self, points_m: impl Iterator<Item = [f64; 3]>) -> Id {
        let mut list = String::new();
        for (place, point) in points_m.enumerate() {
            let _ = write!(list, "{}{}", if place > 0 { "," } else { "" }, Reals(&point));
        }
        self.step.add(format_args!("IFCCARTESIANPOINTLIST3D(({list}))"))
    }

    fn shape(&mut self, context: Id, name: &str, kind: &str, items: &[Id]) -> Id {
        let representation =
            self.step.add(format_args!("IFCSHAPEREPRESENTATION({context},'{name}','{kind}',{})", Ids(items)));
        self.step.add(format_args!("IFCPRODUCTDEFINITIONSHAPE($,$,({representation}))"))
    }

    fn place(&mut self, storey: usize) -> Id {
        let (place, axes) = (self.project.storeys[storey].place, self.project.axes);
        self.step.add(format_args!("IFCLOCALPLACEMENT({place},{axes})"))
    }

    fn properties(&mut self, element: Id, id: &str, polygon: &PlanarPolygon) {
        let Some(plane) = self.shapes.model.planes.get(polygon.plane) else { return };
        let holes_m2: f64 = polygon.holes_m.iter().map(|hole| ring_area_m2(hole)).sum();
        let values = [
            ("Area", format!("IFCAREAMEASURE({})", Number(ring_area_m2(&polygon.outer_m) - holes_m2))),
            ("RootMeanSquareError", format!("IFCLENGTHMEASURE({:.6})", plane.rms_m)),
            ("PointsOfPlane", format!("IFCINTEGER({})", plane.points)),
            ("Plane", format!("IFCINTEGER({})", polygon.plane)),
        ];
        let values = values
            .map(|(name, value)| self.step.add(format_args!("IFCPROPERTYSINGLEVALUE('{name}',$,{value},$)")));
        let owner = self.project.owner;
        let own = global_id(format_args!("properties {id}"));
        let set = self
            .step
            .add(format_args!("IFCPROPERTYSET('{own}',{owner},'Biplane_Surface',$,{})", Ids(&values)));
        let own = global_id(format_args!("has properties {id}"));
        self.step.add(format_args!("IFCRELDEFINESBYPROPERTIES('{own}',{owner},$,$,({element}),{set})"));
    }

    /// An opening, and the door or window that fills it.
    fn opening(&mut self, (index, name): (usize, &str), opening: &Opening, wall: Id) {
        let corners = (opening.ends_m, opening.bottom_m, opening.top_m);
        let (place, owner) = (self.foot(opening), self.project.owner);
        let [id, voids, fills, own] = ["opening", "voids", "fills", "filling"]
            .map(|word| global_id(format_args!("{word} {index} {corners:?}")));
        let hole = self.step.add(format_args!(
            "IFCOPENINGELEMENT('{id}',{owner},'opening {name}',$,$,{place},$,'{index}',.OPENING.)"
        ));
        self.quantities(hole, &id, opening);
        self.step.add(format_args!("IFCRELVOIDSELEMENT('{voids}',{owner},$,$,{wall},{hole})"));
        let (entity, class) = match opening.kind {
            OpeningKind::Door => ("IFCDOOR", "DOOR"),
            OpeningKind::Window => ("IFCWINDOW", "WINDOW"),
            OpeningKind::Passage => return,
        };
        let (place, shape) = match self.leaf(index, opening) {
            Some(shape) => (self.place(opening.storey), shape),
            None => (place, self.frame(opening)),
        };
        let (height, width) = (Number(opening.height_m()), Number(opening.width_m()));
        let filling = self.step.add(format_args!(
            "{entity}('{own}',{owner},'{name}',$,$,{place},{shape},'{index}',{height},{width},.{class}.,.NOTDEFINED.,$)"
        ));
        self.step.add(format_args!("IFCRELFILLSELEMENT('{fills}',{owner},$,$,{hole},{filling})"));
        self.contained[opening.storey].push(filling);
    }

    /// Where an opening is: the middle of its lower edge, x along its width, z up.
    fn foot(&mut self, opening: &Opening) -> Id {
        let storey = &self.project.storeys[opening.storey];
        let ([a, b], width_m) = (opening.ends_m, opening.width_m());
        let along = [(b[0] - a[0]) / width_m, (b[1] - a[1]) / width_m];
        let [x, y] = [0, 1].map(|axis| (a[axis] + b[axis]) / 2.0);
        let axes = solids::axes(self.step, [x, y, opening.bottom_m - storey.floor_m], along);
        self.step.add(format_args!("IFCLOCALPLACEMENT({},{axes})", storey.place))
    }

    /// The size of an opening. It has no shape: readers would cut it out of a surface that has the hole
    /// already.
    fn quantities(&mut self, hole: Id, id: &str, opening: &Opening) {
        let (width_m, height_m) = (opening.width_m(), opening.height_m());
        let quantities = [
            ("LENGTH", "Width", width_m),
            ("LENGTH", "Height", height_m),
            ("AREA", "Area", width_m * height_m),
        ]
        .map(|(kind, name, value)| {
            self.step.add(format_args!("IFCQUANTITY{kind}('{name}',$,$,{},$)", Number(value)))
        });
        let owner = self.project.owner;
        let [own, has] = ["quantities", "has quantities"].map(|word| global_id(format_args!("{word} {id}")));
        let set = self.step.add(format_args!(
            "IFCELEMENTQUANTITY('{own}',{owner},'Qto_OpeningElementBaseQuantities',$,$,{})",
            Ids(&quantities)
        ));
        self.step.add(format_args!("IFCRELDEFINESBYPROPERTIES('{has}',{owner},$,$,({hole}),{set})"));
    }

    /// The leaf of a closed door, where one was seen.
    fn leaf(&mut self, index: usize, opening: &Opening) -> Option<Id> {
        let leaves = self.building.leaves.iter().filter(|(_, of)| *of == index);
        let polygons: Vec<usize> = leaves.map(|(polygon, _)| *polygon).collect();
        let mut items = Vec::new();
        for polygon in polygons {
            items.extend(self.polygon(polygon, opening.storey));
        }
        (!items.is_empty()).then(|| self.shape(self.project.body, "Body", "Tessellation", &items))
    }

    /// A frame in the opening, with a pane in a window.
    fn frame(&mut self, opening: &Opening) -> Id {
        let is_window = opening.kind == OpeningKind::Window;
        let items = frame::frame(self.step, [opening.width_m(), opening.height_m()], is_window);
        for item in &items {
            self.styles.paint(self.step, *item, frame::color(is_window));
        }
        self.shape(self.project.body, "Body", "SweptSolid", &items)
    }

    /// Fine structure as one proxy of the lowest storey.
    fn leftovers(&mut self) {
        let mesh = &self.shapes.model.leftovers;
        if mesh.triangles.is_empty() {
            return;
        }
        let item = self.triangles(mesh, 0);
        self.styles.paint(self.step, item, palette::LEFTOVERS);
        let shape = self.shape(self.project.body, "Body", "Tessellation", &[item]);
        let place = self.place(0);
        let owner = self.project.owner;
        let id = global_id(format_args!("leftovers {}", self.shapes.source));
        let element = self.step.add(format_args!(
            "IFCBUILDINGELEMENTPROXY('{id}',{owner},'leftovers','fine structure that is on no plane',$,{place},{shape},$,.NOTDEFINED.)"
        ));
        self.contained[0].push(element);
    }
}

/// Numbers of vertices from 1, as a tuple.
fn numbers(ring: &[usize]) -> String {
    let words: Vec<String> = ring.iter().map(|vertex| (vertex + 1).to_string()).collect();
    format!("({})", words.join(","))
}
