//! Round things: columns and pipes as swept disks, curved walls as the surface that was seen.

use std::fmt::Write as _;

use super::project::Project;
use super::step::{Id, Ids, Reals, Step, global_id};
use crate::building::elements::Wall;
use crate::formats::Shapes;
use crate::formats::text::number::Number;
use crate::model::cylinder::{Cylinder, CylinderKind};
use crate::model::palette;
use biplane_geometry::vec3::{plus, scaled};

/// A face is no further from where its wall has it, meters.
const FACE_M: f64 = 0.05;

/// Adds the round things of a model to their storeys, but for the faces of walls that have a body already.
pub(crate) fn add_all(step: &mut Step, shapes: &Shapes<'_>, project: &Project, walls: &[Wall]) {
    let cylinders = shapes.model.cylinders.iter().enumerate();
    let cylinders: Vec<(usize, &Cylinder)> =
        cylinders.filter(|(_, one)| !walls.iter().any(|wall| is_face_of(one, wall))).collect();
    if cylinders.is_empty() {
        return;
    }
    let [r, g, b] = palette::ROUND.map(|value| f64::from(value) / 255.0);
    let color = step.add(format_args!("IFCCOLOURRGB($,{},{},{})", Number(r), Number(g), Number(b)));
    let shading = step.add(format_args!("IFCSURFACESTYLESHADING({color},$)"));
    let style = step.add(format_args!("IFCSURFACESTYLE($,.BOTH.,({shading}))"));
    let mut contained = vec![Vec::new(); project.storeys.len()];
    for (index, one) in cylinders {
        let storey = storey_of(one, project);
        contained[storey].push(element(step, project, (index, one), (storey, style)));
    }
    for (storey, elements) in project.storeys.iter().zip(&contained) {
        if !elements.is_empty() {
            let id = global_id(format_args!("round things of {} {}", storey.id, elements.len()));
            step.add(format_args!(
                "IFCRELCONTAINEDINSPATIALSTRUCTURE('{id}',{},$,$,{},{})",
                project.owner,
                Ids(elements),
                storey.id
            ));
        }
    }
}

/// Whether a curved surface is a face of a curved wall.
fn is_face_of(one: &Cylinder, wall: &Wall) -> bool {
    let middle_rad = (one.seen_arc_deg[0] + one.seen_arc_deg[1]).to_radians() / 2.0;
    let [x, y, _] = one.corner_m(middle_rad, 0);
    let [at_m, left_m] = wall.place_of([x, y]);
    one.kind == CylinderKind::Wall
        && !wall.is_straight()
        && (0.0..=wall.length_m()).contains(&at_m)
        && left_m.abs() <= wall.drawn_thickness_m / 2.0 + FACE_M
}

/// The highest storey whose floor is below the middle.
fn storey_of(one: &Cylinder, project: &Project) -> usize {
    let middle = plus(one.axis_point_m, scaled(one.axis_direction, 0.5 * (one.from_m + one.to_m)));
    let below = project.storeys.iter().enumerate().filter(|(_, storey)| storey.floor_m <= middle[2]);
    below.max_by(|a, b| a.1.floor_m.total_cmp(&b.1.floor_m)).map_or(0, |(index, _)| index)
}

/// One thing as the element that it is.
fn element(
    step: &mut Step,
    project: &Project,
    (index, one): (usize, &Cylinder),
    (storey, style): (usize, Id),
) -> Id {
    let floor_m = project.storeys[storey].floor_m;
    let (item, kind) = if one.kind != CylinderKind::Wall && one.is_whole() {
        (swept(step, one, floor_m), "SweptSolid")
    } else {
        (surface(step, one, floor_m), "Tessellation")
    };
    step.add(format_args!("IFCSTYLEDITEM({item},({style}),$)"));
    let representation =
        step.add(format_args!("IFCSHAPEREPRESENTATION({},'Body','{kind}',({item}))", project.body));
    let shape = step.add(format_args!("IFCPRODUCTDEFINITIONSHAPE($,$,({representation}))"));
    let place =
        step.add(format_args!("IFCLOCALPLACEMENT({},{})", project.storeys[storey].place, project.axes));
    let (entity, class) = match one.kind {
        CylinderKind::Column => ("IFCCOLUMN", "COLUMN"),
        CylinderKind::Pipe => ("IFCPIPESEGMENT", "RIGIDSEGMENT"),
        CylinderKind::Pole => ("IFCBUILDINGELEMENTPROXY", "NOTDEFINED"),
        CylinderKind::Wall => ("IFCWALL", "NOTDEFINED"),
    };
    let (name, owner) = (one.kind.name(), project.owner);
    let id = global_id(format_args!("{name} {index} {:?} {}", one.axis_point_m, one.radius_m));
    let element = step.add(format_args!(
        "{entity}('{id}',{owner},'{name} {index}',$,$,{place},{shape},'round {index}',.{class}.)"
    ));
    properties(step, project, &id, (element, one));
    element
}

/// A disk swept along the axis.
fn swept(step: &mut Step, one: &Cylinder, floor_m: f64) -> Id {
    let [x, y, z] = plus(one.axis_point_m, scaled(one.axis_direction, one.from_m));
    let foot = step.add(format_args!("IFCCARTESIANPOINT({})", Reals(&[x, y, z - floor_m])));
    let [along, zero, up] = [one.axis_direction, one.zero(), [0.0, 0.0, 1.0]]
        .map(|to| step.add(format_args!("IFCDIRECTION({})", Reals(&to))));
    let axes = step.add(format_args!("IFCAXIS2PLACEMENT3D({foot},{along},{zero})"));
    let disk = step.add(format_args!("IFCCIRCLEPROFILEDEF(.AREA.,$,$,{})", Number(one.radius_m)));
    let length = Number(one.to_m - one.from_m);
    step.add(format_args!("IFCEXTRUDEDAREASOLID({disk},{axes},{up},{length})"))
}

/// The surface as triangles within the chord error.
fn surface(step: &mut Step, one: &Cylinder, floor_m: f64) -> Id {
    let mesh = one.mesh();
    let mut points = String::new();
    for (place, point) in mesh.vertices_m.iter().enumerate() {
        let [x, y, z] = point.map(f64::from);
        let _ = write!(points, "{}{}", if place > 0 { "," } else { "" }, Reals(&[x, y, z - floor_m]));
    }
    let points = step.add(format_args!("IFCCARTESIANPOINTLIST3D(({points}))"));
    let mut list = String::new();
    for (place, [a, b, c]) in mesh.triangles.iter().enumerate() {
        let _ = write!(list, "{}({},{},{})", if place > 0 { "," } else { "" }, a + 1, b + 1, c + 1);
    }
    step.add(format_args!("IFCTRIANGULATEDFACESET({points},$,.F.,({list}),$)"))
}

/// Radius and how well it is known.
fn properties(step: &mut Step, project: &Project, id: &str, (element, one): (Id, &Cylinder)) {
    let values = [
        ("Radius", format!("IFCPOSITIVELENGTHMEASURE({})", Number(one.radius_m))),
        ("RootMeanSquareError", format!("IFCLENGTHMEASURE({:.6})", one.rms_m)),
        ("PointsOfSurface", format!("IFCINTEGER({})", one.points)),
    ];
    let values =
        values.map(|(name, value)| step.add(format_args!("IFCPROPERTYSINGLEVALUE('{name}',$,{value},$)")));
    let owner = project.owner;
    let [own, has] = ["round", "is round"].map(|word| global_id(format_args!("{word} {id}")));
    let set = step.add(format_args!("IFCPROPERTYSET('{own}',{owner},'Biplane_Round',$,{})", Ids(&values)));
    step.add(format_args!("IFCRELDEFINESBYPROPERTIES('{has}',{owner},$,$,({element}),{set})"));
}

#[cfg(test)]
mod tests {
    use crate::building::Building;
    use crate::formats::{Shapes, ifc};
    use crate::model::cylinder::{Cylinder, CylinderKind};
    use crate::model::{Model, sample};

    #[test]
    fn a_column_and_a_pipe_are_swept_and_an_apse_is_a_curved_wall() {
        let pipe = Cylinder { kind: CylinderKind::Pipe, axis_direction: [1.0, 0.0, 0.0], ..sample::column() };
        let model = Model { cylinders: vec![sample::column(), pipe, sample::apse()], ..sample::model() };
        let mut bytes = Vec::new();
        ifc::write(&mut bytes, &Shapes::new(&model), &Building::read(&model, None)).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let count = |entity: &str| text.matches(&format!("={entity}(")).count();
        let found = ["IFCCOLUMN", "IFCPIPESEGMENT", "IFCCIRCLEPROFILEDEF"].map(count);
        assert_eq!(found, [1, 1, 2]);
        // Frames of doors and windows are swept rectangles.
        assert_eq!(count("IFCEXTRUDEDAREASOLID") - count("IFCRECTANGLEPROFILEDEF"), 2);
        assert!(text.contains("'wall 2',$,$"), "the apse");
    }
}
