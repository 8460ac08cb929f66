//! IFC4: storeys with walls, slabs, doors and windows as surfaces, for BIM programs (Revit, ArchiCAD,
//! BlenderBIM, FreeCAD, BIMvision).
//!
//! Of a drive rooms, walls with thickness, doors and windows are known (`architecture`); furniture and other
//! surfaces are then proxies in a group of their own. Of any other model only surfaces are known, so elements
//! are open face sets with their openings cut out, and no thickness is
//! invented. Openings are therefore without a shape, which programs would cut once more: their place and
//! quantities tell where and how large they are. Site at the model's far offset, storeys at their floors;
//! meters, frame `map`, z up. Identifiers follow from the content, dates are zero: the same model gives the
//! same bytes. Source: IFC4 ADD2 TC1 (ISO 16739-1:2018).

mod architecture;
mod elements;
mod frame;
mod project;
mod round;
mod solids;
mod step;
mod styles;

use std::io::{self, Write};

use self::architecture::Architecture;
use self::elements::Elements;
use self::project::Project;
use self::step::{Id, Step, Text};
use super::{Shapes, description, generator};
use crate::building::Building;

/// Writes the model as IFC.
///
/// # Errors
/// When writing fails.
pub fn write(out: &mut impl Write, shapes: &Shapes<'_>, building: &Building) -> io::Result<()> {
    let mut step = Step::default();
    let project = Project::new(&mut step, shapes, building);
    let of_storeys = building.elements.storeys.iter().map(|storey| building.elements.of_storey(storey));
    let architecture: Vec<(usize, Vec<Id>)> = of_storeys
        .filter(|elements| !elements.is_empty())
        .map(|elements| Architecture::new(&mut step, &project, &elements, shapes).add_all())
        .collect();
    Elements::new(&mut step, shapes, building, &project).add_all(architecture);
    round::add_all(&mut step, shapes, &project, &building.elements.walls);
    let (about, program) = (description(shapes), generator());
    writeln!(out, "ISO-10303-21;\nHEADER;")?;
    writeln!(out, "FILE_DESCRIPTION(('ViewDefinition [ReferenceView]',{}),'2;1');", Text(&about))?;
    // The standard wants a time; ours is always the same, so that files are.
    writeln!(
        out,
        "FILE_NAME('model.ifc','1970-01-01T00:00:00',(''),(''),{0},{0},'');\nFILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA;",
        Text(&program)
    )?;
    out.write_all(step.into_text().as_bytes())?;
    writeln!(out, "ENDSEC;\nEND-ISO-10303-21;")
}

#[cfg(test)]
mod tests {
    use super::write;
    use crate::building::Building;
    use crate::building::tests::{add_room, room};
    use crate::formats::Shapes;
    use crate::model::sample;
    use crate::model::{Mesh, Model};

    fn written(model: &Model) -> String {
        let mut bytes = Vec::new();
        let shapes = Shapes { source: "it's.mcap".to_owned(), ..Shapes::new(model) };
        write(&mut bytes, &shapes, &Building::read(model, None)).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    fn count(text: &str, entity: &str) -> usize {
        text.matches(&format!("={entity}(")).count()
    }

    #[test]
    fn two_rooms_above_each_other_are_two_storeys_of_walls_slabs_doors_and_windows() {
        let mut model = room();
        add_room(&mut model, 3.0);
        let text = written(&model);
        let expected = [
            ("IFCBUILDINGSTOREY", 2),
            ("IFCWALL", 8),
            ("IFCSLAB", 2),
            ("IFCCOVERING", 2),
            ("IFCBUILDINGELEMENTPROXY", 2),
            ("IFCOPENINGELEMENT", 4),
            ("IFCRELVOIDSELEMENT", 4),
            ("IFCRELFILLSELEMENT", 4),
            ("IFCDOOR", 2),
            ("IFCWINDOW", 2),
            ("IFCINDEXEDPOLYGONALFACEWITHVOIDS", 2),
            ("IFCELEMENTQUANTITY", 4),
        ];
        for (entity, number) in expected {
            assert_eq!(count(&text, entity), number, "{entity}");
        }
        assert!(text.contains("from it''s.mcap"));
        assert!(text.contains(",.ELEMENT.,3.0000)"), "the upper storey's elevation");
        assert!(text.contains(",2.0000,0.9000,.DOOR."), "the door's height and width");
        let openings = text.lines().filter(|line| line.contains("=IFCOPENINGELEMENT("));
        openings.for_each(|line| {
            assert_eq!(line.split(',').nth(6), Some("$"), "a shape would be cut again: {line}");
        });
        // Storeys and openings have the names that those of rooms have. A surface says the plane that it has
        // in other files.
        assert!(text.contains(",'S2',$,$,") && text.contains(",'storey 2',.ELEMENT.,3.0000)"));
        for name in ["'S1-D01'", "'S2-D01'", "'S1-N01'", "'S2-N01'", "'opening S2-N01'"] {
            assert_eq!(text.matches(name).count(), 1, "{name}");
        }
        assert!(text.contains("'surface 0','part of plane "), "{text}");
        // Corners are counted from their storey's floor.
        assert!(!text.contains("5.6000"));
    }

    #[test]
    fn every_identifier_is_there_once_and_every_number_that_is_named() {
        let text = written(&room());
        let mut ids: Vec<&str> = text
            .lines()
            .filter_map(|line| line.split_once("('"))
            .filter(|(head, _)| head.starts_with('#'))
            .map(|(_, rest)| rest.split('\'').next().unwrap())
            .filter(|id| id.len() == 22)
            .collect();
        let all = ids.len();
        ids.sort_unstable();
        ids.dedup();
        assert!(all > 20 && ids.len() == all);
        let lines = text.lines().filter(|line| line.starts_with('#')).count();
        let named = text
            .split('#')
            .skip(1)
            .map(|rest| rest.split(|c: char| !c.is_ascii_digit()).next().unwrap().parse::<usize>().unwrap());
        assert_eq!(named.max(), Some(lines));
    }

    #[test]
    fn a_wall_with_a_ragged_edge_is_triangles_and_one_with_few_corners_a_face() {
        let mut model = Model { leftovers: Mesh::default(), ..sample::model() };
        // Teeth of 5 cm along the upper edge, 4 m long at 3 m.
        let tooth = |at: i32| [f64::from(at) * 0.05, 2.0, if at % 2 == 0 { 3.0 } else { 2.95 }];
        model.polygons[0].outer_m.truncate(2);
        model.polygons[0].outer_m.extend((0..=80).rev().map(tooth));
        let text = written(&model);
        assert_eq!((count(&text, "IFCWALL"), count(&text, "IFCSLAB")), (1, 1));
        assert_eq!(count(&text, "IFCTRIANGULATEDFACESET"), 1);
        assert_eq!(count(&text, "IFCINDEXEDPOLYGONALFACEWITHVOIDS"), 0);
        // A ring of n corners with one hole makes n triangles, counted with the hole's corners: 83 + 4.
        let mesh = text.lines().find(|line| line.contains("IFCTRIANGULATEDFACESET")).unwrap();
        assert_eq!(mesh.matches("),(").count() + 1, 87);
    }

    #[test]
    fn without_a_floor_there_is_one_storey_whose_height_nobody_knows() {
        let model = Model { polygons: sample::model().polygons[..1].to_vec(), ..sample::model() };
        let text = written(&model);
        assert_eq!((count(&text, "IFCBUILDINGSTOREY"), count(&text, "IFCWALL")), (1, 1));
        assert_eq!(count(&text, "IFCTRIANGULATEDFACESET"), 1);
        assert!(text.contains(",.ELEMENT.,$)"));
        assert_eq!(count(&written(&Model::default()), "IFCBUILDINGSTOREY"), 1);
    }
}
