//! Doors and windows of a model without rooms, such as a building seen from outside: what its surfaces alone
//! show.

use std::fmt::Write;

use crate::building::Building;
use crate::building::elements::Use;
use crate::view::markup::escaped;

/// The section; empty where no opening was found. Names are those in DXF and IFC.
pub(crate) fn section(building: &Building) -> String {
    if building.openings.is_empty() {
        return String::new();
    }
    let mut html = String::from(
        "<section id=\"openings\"><h2>Doors and windows</h2><div class=\"scroll\"><table class=\"figures openings\"><thead><tr>\
         <th scope=\"col\">opening</th><th scope=\"col\">kind</th><th scope=\"col\">width, m</th><th scope=\"col\">height, m</th>\
         <th scope=\"col\">sill, m</th><th scope=\"col\">in wall</th></tr></thead><tbody>",
    );
    let names = building.opening_names();
    let named = || building.openings.iter().zip(&names);
    for kind in Use::LISTED {
        for (opening, name) in named().filter(|(opening, _)| Use::from(opening.kind) == kind) {
            let floor_m = building.floors_m.get(opening.storey).copied().unwrap_or(opening.bottom_m);
            let _ = write!(
                html,
                "<tr><th scope=\"row\"><span class=\"name\">{}</span></th><td>{}</td><td>{:.2}</td><td>{:.2}</td><td>{:.2}</td>\
                 <td><span class=\"name\">surface {}</span></td></tr>",
                escaped(name),
                kind.word(),
                opening.width_m(),
                opening.height_m(),
                opening.bottom_m - floor_m,
                opening.polygon
            );
        }
    }
    html.push_str(
        "</tbody></table></div><p class=\"note\">No room was found, so surfaces alone show these: plumb gaps in a wall that goes on \
         over them, and rectangular holes. The shadow of something plumb before a wall may look the same. What reaches below \
         what the laser saw counts as reaching the floor. Sills are heights over the floor of the storey; of a building that was seen \
         from outside that is the ground.</p></section>",
    );
    html
}

#[cfg(test)]
mod tests {
    use super::section;
    use crate::building::Building;
    use crate::model::{Model, sample};

    #[test]
    fn windows_and_doors_of_surfaces_have_their_sizes_their_sill_and_their_wall() {
        let mut model = sample::model();
        // A door of 0.9 m by 2.1 m is a bay of the wall's border.
        model.polygons[0]
            .outer_m
            .splice(1..1, [[2.5, 2.0, 0.0], [2.5, 2.0, 2.1], [3.4, 2.0, 2.1], [3.4, 2.0, 0.0]]);
        // All of it stands 3 m up: sills are over the floor.
        model.planes[1].offset_m = 3.0;
        for polygon in &mut model.polygons {
            let corners = polygon.outer_m.iter_mut().chain(polygon.holes_m.iter_mut().flatten());
            corners.for_each(|corner| corner[2] += 3.0);
        }
        let html = section(&Building::read(&model, None));
        let row = |cells: &str| assert!(html.contains(cells), "{cells} is not in {html}");
        row("S1-D01</span></th><td>door</td><td>0.90</td><td>2.10</td><td>0.00</td>");
        row("S1-N01</span></th><td>window</td><td>1.00</td><td>1.00</td><td>1.00</td>");
        assert_eq!(html.matches("<td><span class=\"name\">surface 0</span></td>").count(), 2, "{html}");
        assert!(html.find("S1-D01") < html.find("S1-N01"), "doors come first: {html}");
    }

    #[test]
    fn without_openings_there_is_no_section() {
        let mut model = sample::model();
        model.polygons[0].holes_m.clear();
        assert_eq!(section(&Building::read(&model, None)), "");
        assert_eq!(section(&Building::read(&Model::default(), None)), "");
    }
}
