//! What every IFC file has: owner, units, contexts, and the tree of project, site, building and storeys.

use super::step::{Id, Ids, Reals, Step, Text, global_id};
use crate::building::Building;
use crate::building::elements::{Storey as BuildingStorey, storey_name};
use crate::formats::text::number::Number;
use crate::formats::{Shapes, description, generator};
use crate::model::turn::Turn;
use biplane_geometry::PortableMath;

/// The entities that elements refer to.
pub(crate) struct Project {
    /// Owner of everything.
    pub(crate) owner: Id,
    /// Context of surfaces.
    pub(crate) body: Id,
    /// Context of the lines in the middle of walls.
    pub(crate) axis: Id,
    /// Context of outlines of rooms.
    pub(crate) footprint: Id,
    /// Where everything local is: origin, z up.
    pub(crate) axes: Id,
    /// The storeys from below; one when no floor is known.
    pub(crate) storeys: Vec<Storey>,
}

/// A storey's entities.
pub(crate) struct Storey {
    /// The storey.
    pub(crate) id: Id,
    /// Its place.
    pub(crate) place: Id,
    /// Height of its floor, meters; points are relative to it.
    pub(crate) floor_m: f64,
}

impl Project {
    /// Adds all of it.
    pub(crate) fn new(step: &mut Step, shapes: &Shapes<'_>, building: &Building) -> Self {
        let owner = owner(step);
        let origin = axes(step, [0.0; 3]);
        let context =
            step.add(format_args!("IFCGEOMETRICREPRESENTATIONCONTEXT($,'Model',3,1.E-5,{origin},$)"));
        let mut part = |name: &str| {
            step.add(format_args!(
                "IFCGEOMETRICREPRESENTATIONSUBCONTEXT('{name}','Model',*,*,*,*,{context},$,.MODEL_VIEW.,$)"
            ))
        };
        let body = part("Body");
        let [axis, footprint] =
            if building.elements.is_empty() { [body, body] } else { ["Axis", "FootPrint"].map(&mut part) };
        let units = units(step);
        let about = description(shapes);
        let id = global_id(format_args!("project {about}"));
        let project = step.add(format_args!(
            "IFCPROJECT('{id}',{owner},'building model',{},$,$,$,({context}),{units})",
            Text(&about)
        ));
        add_turn(step, context, shapes);
        let far = site_axes(step, shapes);
        let site_place = step.add(format_args!("IFCLOCALPLACEMENT($,{far})"));
        let id = global_id(format_args!("site {about}"));
        let site =
            step.add(format_args!("IFCSITE('{id}',{owner},'site',$,$,{site_place},$,$,.ELEMENT.,$,$,$,$,$)"));
        let place = step.add(format_args!("IFCLOCALPLACEMENT({site_place},{origin})"));
        let id = global_id(format_args!("building {about}"));
        let house =
            step.add(format_args!("IFCBUILDING('{id}',{owner},'building',$,$,{place},$,$,.ELEMENT.,$,$,$)"));
        let storeys = storeys(step, building, owner, place);
        let ids: Vec<Id> = storeys.iter().map(|storey| storey.id).collect();
        for (whole, parts) in [(project, vec![site]), (site, vec![house]), (house, ids)] {
            let id = global_id(format_args!("parts of {whole} {about}"));
            step.add(format_args!("IFCRELAGGREGATES('{id}',{owner},$,$,{whole},{})", Ids(&parts)));
        }
        Self { owner, body, axis, footprint, axes: origin, storeys }
    }
}

fn owner(step: &mut Step) -> Id {
    let person = step.add(format_args!("IFCPERSON('operator',$,$,$,$,$,$,$)"));
    let organization = step.add(format_args!("IFCORGANIZATION($,'Biplane',$,$,$)"));
    let both = step.add(format_args!("IFCPERSONANDORGANIZATION({person},{organization},$)"));
    let program = generator();
    let (name, version) = program.split_once(' ').unwrap_or((&program, ""));
    let application =
        step.add(format_args!("IFCAPPLICATION({organization},{},{},'biplane')", Text(version), Text(name)));
    step.add(format_args!("IFCOWNERHISTORY({both},{application},$,$,$,$,$,0)"))
}

fn axes(step: &mut Step, at_m: [f64; 3]) -> Id {
    let point = step.add(format_args!("IFCCARTESIANPOINT({})", Reals(&at_m)));
    step.add(format_args!("IFCAXIS2PLACEMENT3D({point},$,$)"))
}

/// The site's place: at the model's far offset, turned with it.
fn site_axes(step: &mut Step, shapes: &Shapes<'_>) -> Id {
    if shapes.turn.is_none() {
        return axes(step, shapes.shift_m);
    }
    let (sin, cos) = shapes.turn.angle_rad.portable_sin_cos();
    let point = step.add(format_args!("IFCCARTESIANPOINT({})", Reals(&shapes.shift_m)));
    let up = step.add(format_args!("IFCDIRECTION((0.,0.,1.))"));
    // Twelve decimals: four would move a wall by a centimeter over 200 m.
    let x_axis = step.add(format_args!("IFCDIRECTION(({cos:.12},{sin:.12},0.))"));
    step.add(format_args!("IFCAXIS2PLACEMENT3D({point},{up},{x_axis})"))
}

/// Says how a turned file lies in the frame `map`: where `map`'s own coordinates are wanted, programs find
/// them by this.
fn add_turn(step: &mut Step, context: Id, shapes: &Shapes<'_>) {
    if shapes.turn.is_none() {
        return;
    }
    let back = Turn { angle_rad: -shapes.turn.angle_rad };
    let (sin, cos) = back.angle_rad.portable_sin_cos();
    let turned = back.apply(shapes.shift_m);
    let [east, north] = [0, 1].map(|axis| shapes.shift_m[axis] - turned[axis]);
    let map = step.add(format_args!("IFCPROJECTEDCRS('map','frame map of the recording',$,$,$,$,$)"));
    step.add(format_args!("IFCMAPCONVERSION({context},{map},{east:.6},{north:.6},0.,{cos:.12},{sin:.12},$)"));
}

fn units(step: &mut Step) -> Id {
    let units = [
        ("LENGTHUNIT", "METRE"),
        ("AREAUNIT", "SQUARE_METRE"),
        ("VOLUMEUNIT", "CUBIC_METRE"),
        ("PLANEANGLEUNIT", "RADIAN"),
    ];
    let ids = units.map(|(kind, name)| step.add(format_args!("IFCSIUNIT(*,.{kind}.,$,.{name}.)")));
    step.add(format_args!("IFCUNITASSIGNMENT({})", Ids(&ids)))
}

/// The index of the floor that is nearest to a height; 0 when there is none.
pub(super) fn nearest(floors_m: impl Iterator<Item = f64>, floor_m: f64) -> usize {
    let away_m = floors_m.map(|other_m| (other_m - floor_m).abs()).enumerate();
    away_m.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(index, _)| index)
}

/// The name and the long name of a storey: those of `building.json` where rooms were found on it. Where some
/// storeys have rooms, their names are taken, so the others have a long one alone.
fn storey_names(building: &Building, number: usize) -> [String; 2] {
    let is_this =
        |storey: &&BuildingStorey| nearest(building.floors_m.iter().copied(), storey.floor_z_m) == number;
    let known = building.elements.storeys.iter().find(is_this);
    let long_name = match building.floors_m.is_empty() {
        true => "no floor seen".to_owned(),
        false => format!("storey {}", number + 1),
    };
    let name = match known {
        Some(storey) => storey.id.clone(),
        None if building.elements.is_empty() && !building.floors_m.is_empty() => storey_name(number + 1),
        None => long_name.clone(),
    };
    [name, long_name]
}

fn storeys(step: &mut Step, building: &Building, owner: Id, place: Id) -> Vec<Storey> {
    let known = building.floors_m.iter().copied().map(Some);
    let unknown = building.floors_m.is_empty().then_some(None);
    let mut storeys = Vec::new();
    for (number, floor_m) in known.chain(unknown).enumerate() {
        let at = axes(step, [0.0, 0.0, floor_m.unwrap_or(0.0)]);
        let place = step.add(format_args!("IFCLOCALPLACEMENT({place},{at})"));
        let id = global_id(format_args!("storey {number} {floor_m:?}"));
        let elevation = floor_m.map_or("$".to_owned(), |floor_m| Number(floor_m).to_string());
        let [name, long_name] = storey_names(building, number);
        let (name, long_name) = (Text(&name), Text(&long_name));
        let id = step.add(format_args!(
            "IFCBUILDINGSTOREY('{id}',{owner},{name},$,$,{place},$,{long_name},.ELEMENT.,{elevation})"
        ));
        storeys.push(Storey { id, place, floor_m: floor_m.unwrap_or(0.0) });
    }
    storeys
}
