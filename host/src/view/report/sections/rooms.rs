//! Rooms, doors and windows: a plan with their names, and lists of their sizes. What is a guess has another
//! shade.

use std::fmt::Write;

use crate::building::elements::{Elements, Room, Use, Wall, WallOpening};
use crate::view::markup::escaped;

/// Space around the plan, meters.
const MARGIN_M: f64 = 0.6;
/// Height of names in the plan, meters.
const TEXT_M: f64 = 0.28;

/// The section; empty where no room was found. The plan's unit is a meter, y points down in it.
pub(crate) fn section(elements: &Elements) -> String {
    if elements.is_empty() {
        return String::new();
    }
    let mut html = String::from("<section id=\"rooms\"><h2>Rooms, doors and windows</h2>");
    for storey in &elements.storeys {
        if elements.storeys.len() > 1 {
            let _ = write!(html, "<h3>{}: floor at {:.2} m</h3>", escaped(&storey.id), storey.floor_z_m);
        }
        plan(&mut html, &elements.of_storey(storey));
    }
    html.push_str(
        "<p class=\"note\">Dark walls: both faces were seen, so the thickness is known. Pale walls: one face was seen, their depth is \
         assumed. Green: doors and passages, blue: windows. Floors are inferred: no laser sees them.</p>",
    );
    rooms(&mut html, &elements.rooms);
    openings(&mut html, &elements.openings);
    html.push_str("</section>");
    html
}

fn plan(html: &mut String, elements: &Elements) {
    let corners = elements.walls.iter().flat_map(|wall| &wall.outline_m);
    let corners: Vec<[f64; 2]> =
        corners.chain(elements.rooms.iter().flat_map(|room| &room.outline_m)).copied().collect();
    let fold = |pick: fn(f64, f64) -> f64, start: f64, axis: usize| {
        corners.iter().fold(start, |best, p| pick(best, p[axis]))
    };
    let low = [0, 1].map(|axis| fold(f64::min, f64::INFINITY, axis) - MARGIN_M);
    let high = [0, 1].map(|axis| fold(f64::max, f64::NEG_INFINITY, axis) + MARGIN_M);
    let _ = write!(
        html,
        "<figure><svg viewBox=\"{:.2} {:.2} {:.2} {:.2}\" role=\"img\" aria-label=\"Plan of the rooms\" \
         style=\"width:100%;max-height:70vh\" font-size=\"{TEXT_M}\" text-anchor=\"middle\">",
        low[0],
        -high[1],
        high[0] - low[0],
        high[1] - low[1]
    );
    for room in &elements.rooms {
        let fill = if room.inferred { "#f3efe4" } else { "#e6edf5" };
        let rings = std::iter::once(&room.outline_m).chain(&room.holes_m);
        let ways: String = rings.map(|ring| way(ring)).collect();
        let _ = write!(html, "<path d=\"{ways}\" fill=\"{fill}\" fill-rule=\"evenodd\" stroke=\"none\"/>");
    }
    for wall in &elements.walls {
        let fill = if wall.thickness_m.is_some() { "#555d66" } else { "#c3c9d0" };
        let _ = write!(html, "<path d=\"{}\" fill=\"{fill}\"/>", way(&wall.outline_m));
    }
    for opening in &elements.openings {
        let Some(wall) = elements.wall(&opening.wall) else { continue };
        let fill = if opening.kind == Use::Window { "#4f8fd0" } else { "#4f9d5b" };
        let _ = write!(
            html,
            "<path d=\"{}\" fill=\"{fill}\"><title>{}: {:.2} x {:.2} m</title></path>",
            way(&foot(opening, wall)),
            escaped(&opening.id),
            opening.width_m,
            opening.height_m
        );
    }
    for room in &elements.rooms {
        let [x, y] = middle(&room.outline_m);
        let _ = write!(
            html,
            "<text x=\"{x:.2}\" y=\"{:.2}\">{}<tspan x=\"{x:.2}\" dy=\"1.2em\">{:.1} m²</tspan></text>",
            -y,
            escaped(&room.id),
            room.area_m2
        );
    }
    html.push_str("</svg></figure>");
}

fn way(ring: &[[f64; 2]]) -> String {
    let mut text = String::new();
    for (place, [x, y]) in ring.iter().enumerate() {
        let _ = write!(text, "{}{x:.3} {:.3}", if place == 0 { "M" } else { "L" }, -y);
    }
    text + "Z"
}

/// The corners of an opening in its wall.
fn foot(opening: &WallOpening, wall: &Wall) -> [[f64; 2]; 4] {
    let [x, y] = wall.along_at(wall.place_m(opening));
    let (half, deep) = (opening.width_m / 2.0, wall.drawn_thickness_m / 2.0);
    let [cx, cy, _] = opening.center_m;
    let place = |along: f64, aside: f64| [cx + along * x - aside * y, cy + along * y + aside * x];
    [place(-half, -deep), place(half, -deep), place(half, deep), place(-half, deep)]
}

/// The middle of a room's area.
fn middle(ring: &[[f64; 2]]) -> [f64; 2] {
    let ends = ring.iter().zip(ring.iter().cycle().skip(1));
    let (mut sum, mut double) = ([0.0; 2], 0.0);
    for (a, b) in ends {
        let cross = a[0] * b[1] - a[1] * b[0];
        double += cross;
        sum = [0, 1].map(|axis| sum[axis] + cross * (a[axis] + b[axis]));
    }
    sum.map(|value| value / (3.0 * double))
}

fn rooms(html: &mut String, rooms: &[Room]) {
    html.push_str(
        "<table class=\"figures\"><thead><tr><th scope=\"col\">room</th><th scope=\"col\">area, m²</th>\
         <th scope=\"col\">height, m</th><th scope=\"col\">wall seen around it</th></tr></thead><tbody>",
    );
    for room in rooms {
        let _ = write!(
            html,
            "<tr><th scope=\"row\">{}</th><td>{:.2}</td><td>{:.2}</td><td>{:.0} %</td></tr>",
            escaped(&room.id),
            room.area_m2,
            room.ceiling_z_m - room.floor_z_m,
            100.0 * room.walled_share
        );
    }
    html.push_str("</tbody></table>");
}

fn openings(html: &mut String, openings: &[WallOpening]) {
    if openings.is_empty() {
        return;
    }
    html.push_str(
        "<table class=\"figures\"><thead><tr><th scope=\"col\">opening</th><th scope=\"col\">kind</th>\
         <th scope=\"col\">width, m</th><th scope=\"col\">height, m</th><th scope=\"col\">sill, m</th>\
         <th scope=\"col\">rooms</th><th scope=\"col\">shown by</th></tr></thead><tbody>",
    );
    for opening in openings {
        let kind = match opening.kind {
            Use::Door => "door",
            Use::Window => "window",
            Use::Passage => "passage",
        };
        let _ = write!(
            html,
            "<tr><th scope=\"row\">{}</th><td>{kind}</td><td>{:.2}</td><td>{:.2}</td><td>{:.2}</td><td>{}</td><td>{}</td></tr>",
            escaped(&opening.id),
            opening.width_m,
            opening.height_m,
            opening.sill_m,
            escaped(&opening.rooms.join(", ")),
            escaped(&opening.evidence)
        );
    }
    html.push_str("</tbody></table>");
}
