//! Rooms, doors and windows: a plan with their names, and lists of their sizes. What is a guess has another
//! shade.

use std::fmt::Write;

use crate::building::elements::{CLOSED_LEAF, Elements, Room, Use, Wall, WallOpening};
use crate::model::turn::Turn;
use crate::pipeline::storey_fit;
use crate::view::markup::escaped;
use crate::view::report::text::turned_words;

/// Space around the plan, meters.
const MARGIN_M: f64 = 0.6;
/// Space below the plan for its scale, meters, and the share of the plan's height that it has at least.
const FOOT_M: f64 = 0.6;
const FOOT_SHARE: f64 = 0.06;
/// Lengths that a scale may have, meters.
const SCALES_M: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
/// A scale is at most this share of the plan's width.
const SCALE_SHARE: f64 = 0.25;

/// What has which color in the plan.
const KEY: [(&str, &str); 8] = [
    (ROOM, "room"),
    (OPEN_ROOM, "room that is partly a guess"),
    (KNOWN_WALL, "wall seen from both sides"),
    (WALL, "wall seen from one side, its depth assumed"),
    (DOOR, "door or passage"),
    (SHUT_DOOR, "shut door"),
    (NARROW_DOOR, "narrow door, perhaps none"),
    (WINDOW, "window"),
];
const ROOM: &str = "#e6edf5";
const OPEN_ROOM: &str = "#f3efe4";
const KNOWN_WALL: &str = "#555d66";
const WALL: &str = "#c3c9d0";
const DOOR: &str = "#4f9d5b";
const SHUT_DOOR: &str = "#9a6b3f";
const NARROW_DOOR: &str = "#b4dcb9";
const WINDOW: &str = "#4f8fd0";

/// Names above their openings, and left of them.
const OVER: &str = "opening over";
const LEFT: &str = "opening left";
/// Width and height of a wall's name, rem.
const NAME_REM: [f64; 2] = [2.9, 0.95];
/// A plan is drawn no wider than this so that names stand apart, rem: those of walls that lie in one place
/// touch at any width.
const WIDEST_REM: f64 = 100.0;

/// The section; empty where no room was found. The plan's unit is a meter, y points down in it. Names are
/// text over the plan: they keep their size on a small screen, where the plan shrinks. The plan is turned, so
/// that walls lie along the page.
pub(crate) fn section(elements: &Elements, turn: &Turn) -> String {
    if elements.is_empty() {
        return String::new();
    }
    let mut html = String::from(
        "<section id=\"rooms\"><h2>Rooms, doors and windows</h2>\
         <input type=\"checkbox\" id=\"wall-names\"> <label for=\"wall-names\">Names of walls</label>",
    );
    for storey in &elements.storeys {
        if elements.storeys.len() > 1 {
            let _ = write!(html, "<h3>{}: floor at {:.2} m</h3>", escaped(&storey.id), storey.floor_z_m);
        }
        plan(&mut html, &elements.of_storey(storey).turned(turn));
    }
    for words in storey_fit::contradictions(elements) {
        let _ = write!(html, "<p class=\"note\">{}.</p>", escaped(&words));
    }
    html.push_str("<p class=\"note key\">");
    for (color, words) in KEY {
        let _ = write!(html, "<span><i style=\"background:{color}\"></i>{words}</span> ");
    }
    html.push_str(
        "<span><i class=\"guess\"></i>wall of which less than 30 % was seen</span></p>\
         <p class=\"note\">Floors are inferred: no laser sees them.",
    );
    html.extend(turned_words(turn));
    html.push_str("</p>");
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
    let mut low = [0, 1].map(|axis| fold(f64::min, f64::INFINITY, axis) - MARGIN_M);
    let high = [0, 1].map(|axis| fold(f64::max, f64::NEG_INFINITY, axis) + MARGIN_M);
    low[1] -= FOOT_M.max(FOOT_SHARE * (high[1] - low[1]));
    let sheet = Sheet { low, high };
    let [width, height] = sheet.size();
    let _ = write!(
        html,
        "<div class=\"scroll\"><figure class=\"plan\" style=\"aspect-ratio:{width:.2}/{height:.2};max-width:calc(70vh*{:.3});--names-apart:{:.1}rem\">\
         <svg viewBox=\"{:.2} {:.2} {width:.2} {height:.2}\" role=\"img\" aria-label=\"Plan of the rooms\">",
        width / height,
        names_apart_rem(elements, width),
        low[0],
        -high[1],
    );
    for room in &elements.rooms {
        let fill = if room.inferred { OPEN_ROOM } else { ROOM };
        let rings = std::iter::once(&room.outline_m).chain(&room.holes_m);
        let ways: String = rings.map(|ring| way(ring)).collect();
        let _ = write!(html, "<path d=\"{ways}\" fill=\"{fill}\" fill-rule=\"evenodd\" stroke=\"none\"/>");
    }
    for wall in &elements.walls {
        let fill = if wall.thickness_m.is_some() { KNOWN_WALL } else { WALL };
        let way = way(&wall.outline_m);
        let look = match wall.is_hardly_seen() {
            true => "class=\"guess\" vector-effect=\"non-scaling-stroke\"".to_owned(),
            false => format!("fill=\"{fill}\""),
        };
        let _ = write!(html, "<path {look} d=\"{way}\"><title>{}</title></path>", escaped(&wall.id));
    }
    for opening in &elements.openings {
        let Some(wall) = elements.wall(&opening.wall) else { continue };
        let (kind, fill) = kind_of(opening);
        // Its border covers the dashes of a wall that was hardly seen.
        let _ = write!(
            html,
            "<path class=\"opening\" vector-effect=\"non-scaling-stroke\" d=\"{}\" fill=\"{fill}\" stroke=\"{fill}\">\
             <title>{}, {kind}: {:.2} x {:.2} m</title></path>",
            way(&foot(opening, wall)),
            escaped(&opening.id),
            opening.width_m,
            opening.height_m
        );
    }
    let scale_m = scale_m(width);
    let [x, y] = [low[0] + MARGIN_M, -low[1] - MARGIN_M / 2.0];
    let _ = write!(
        html,
        "<path class=\"scale\" vector-effect=\"non-scaling-stroke\" d=\"M{x:.2} {y:.2}h{scale_m}\"/></svg>"
    );
    for opening in &elements.openings {
        let Some(wall) = elements.wall(&opening.wall) else { continue };
        let side = sheet.side_of(opening, wall);
        let tag = sheet.tag(side, name_place_m(opening, wall, side));
        let _ = write!(html, "{tag}{}</span>", escaped(&opening.id));
    }
    for wall in &elements.walls {
        let tag = sheet.tag("wall", wall_name_place_m(wall, &elements.openings));
        let _ = write!(html, "{tag}{}</span>", escaped(&wall.id));
    }
    for room in &elements.rooms {
        let tag = sheet.tag("room", room.label_place_m());
        let _ = write!(html, "{tag}{}<small>{:.1} m²</small></span>", escaped(&room.id), room.area_m2);
    }
    let _ = write!(html, "{}{scale_m} m</span></figure></div>", sheet.tag("length", [x + scale_m, -y]));
}

/// Where the name of an opening stands: at the edge of its wall, however thick it is.
fn name_place_m(opening: &WallOpening, wall: &Wall, side: &str) -> [f64; 2] {
    let [x, y, _] = opening.center_m;
    let half_m = |part: f64| 0.5 * wall.drawn_thickness_m * part.abs();
    let [along_x, along_y] = wall.along_at(wall.place_m(opening));
    match side {
        OVER => [x, y + half_m(along_x)],
        LEFT => [x - half_m(along_y), y],
        _ => [x + half_m(along_y), y],
    }
}

fn wall_name_place_m(wall: &Wall, openings: &[WallOpening]) -> [f64; 2] {
    wall.point(free_place_m(wall, openings), 0.0)
}

/// How wide a plan has to be drawn so that names of walls do not touch, rem. On a small screen it is moved
/// sideways then.
fn names_apart_rem(elements: &Elements, width_m: f64) -> f64 {
    let places: Vec<[f64; 2]> =
        elements.walls.iter().map(|wall| wall_name_place_m(wall, &elements.openings)).collect();
    let apart = |one: &[f64; 2], other: &[f64; 2]| {
        let [x, y] = [0, 1].map(|axis| NAME_REM[axis] / (one[axis] - other[axis]).abs());
        x.min(y)
    };
    let pairs = places.iter().enumerate();
    let pairs = pairs.flat_map(|(number, one)| places[..number].iter().map(move |other| (one, other)));
    let widths_rem = pairs.map(|(one, other)| width_m * apart(one, other));
    widths_rem.filter(|width_rem| *width_rem <= WIDEST_REM).fold(0.0, f64::max)
}

/// The middle of the longest piece of a wall that has no opening, meters from its beginning: there its name
/// hides none of theirs.
fn free_place_m(wall: &Wall, openings: &[WallOpening]) -> f64 {
    let own = openings.iter().filter(|opening| opening.wall == wall.id);
    let mut taken: Vec<[f64; 2]> = own
        .map(|opening| [-1.0, 1.0].map(|side| wall.place_m(opening) + 0.5 * side * opening.width_m))
        .collect();
    taken.sort_by(|one, other| one[0].total_cmp(&other[0]));
    let (mut from_m, mut longest) = (0.0_f64, [0.0, 0.0]);
    for [begin_m, end_m] in taken.into_iter().chain([[wall.length_m(); 2]]) {
        if begin_m - from_m > longest[1] - longest[0] {
            longest = [from_m, begin_m];
        }
        from_m = from_m.max(end_m);
    }
    0.5 * (longest[0] + longest[1])
}

/// The part of a storey that a plan shows.
struct Sheet {
    low: [f64; 2],
    high: [f64; 2],
}

impl Sheet {
    fn size(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.high[axis] - self.low[axis])
    }

    /// On which side of an opening its name stands, so that it hides nothing of it and stays on the sheet.
    fn side_of(&self, opening: &WallOpening, wall: &Wall) -> &'static str {
        let [along_x, along_y] = wall.along_at(wall.place_m(opening));
        let is_right = opening.center_m[0] > (self.low[0] + self.high[0]) / 2.0;
        match (along_x.abs() > along_y.abs(), is_right) {
            (true, _) => OVER,
            (false, true) => LEFT,
            (false, false) => "opening right",
        }
    }

    /// The beginning of a text at a place.
    fn tag(&self, class: &str, [x, y]: [f64; 2]) -> String {
        let [width, height] = self.size();
        format!(
            "<span class=\"tag {class}\" style=\"left:{:.2}%;top:{:.2}%\">",
            100.0 * (x - self.low[0]) / width,
            100.0 * (self.high[1] - y) / height
        )
    }
}

/// The longest scale that goes with a plan of this width.
fn scale_m(width_m: f64) -> f64 {
    let fits = |scale_m: &f64| *scale_m <= SCALE_SHARE * width_m;
    SCALES_M.into_iter().rfind(fits).unwrap_or(SCALES_M[0])
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

/// What an opening is called, and its color.
fn kind_of(opening: &WallOpening) -> (&'static str, &'static str) {
    match opening.kind {
        Use::Door if opening.is_narrow() && opening.inferred => ("narrow door", NARROW_DOOR),
        Use::Door if opening.evidence == CLOSED_LEAF => ("shut door", SHUT_DOOR),
        Use::Window => (opening.kind.word(), WINDOW),
        Use::Door | Use::Passage => (opening.kind.word(), DOOR),
    }
}

fn rooms(html: &mut String, rooms: &[Room]) {
    html.push_str(
        "<div class=\"scroll\"><table class=\"figures\"><thead><tr><th scope=\"col\">room</th><th scope=\"col\">area, m²</th>\
         <th scope=\"col\">of it seen, m²</th><th scope=\"col\">height, m</th>\
         <th scope=\"col\">wall seen around it</th></tr></thead><tbody>",
    );
    for room in rooms {
        let seen = room.seen_area_m2.map_or_else(|| "-".to_owned(), |seen_m2| format!("{seen_m2:.2}"));
        let _ = write!(
            html,
            "<tr><th scope=\"row\">{}</th><td>{:.2}</td><td>{seen}</td><td>{:.2}</td><td>{:.0} %</td></tr>",
            name(&room.id),
            room.area_m2,
            room.ceiling_z_m - room.floor_z_m,
            100.0 * room.walled_share
        );
    }
    html.push_str("</tbody></table></div>");
    if rooms.iter().any(|room| room.guessed_m2().is_some()) {
        html.push_str(
            "<p class=\"note\">Rooms that are not closed go on as far as the lines of walls do: what of their area \
             was not seen is a guess, and they may be larger.</p>",
        );
    }
}

fn openings(html: &mut String, openings: &[WallOpening]) {
    if openings.is_empty() {
        return;
    }
    html.push_str(
        "<div class=\"scroll\"><table class=\"figures openings\"><thead><tr><th scope=\"col\">opening</th><th scope=\"col\">kind</th>\
         <th scope=\"col\">width, m</th><th scope=\"col\">height, m</th><th scope=\"col\">sill, m</th>\
         <th scope=\"col\">in wall</th><th scope=\"col\">rooms</th><th scope=\"col\">shown by</th></tr></thead><tbody>",
    );
    let of_kind = |kind: Use| openings.iter().filter(move |opening| opening.kind == kind);
    for opening in Use::LISTED.into_iter().flat_map(of_kind) {
        let kind = kind_of(opening).0;
        let _ = write!(
            html,
            "<tr><th scope=\"row\">{}</th><td>{kind}</td><td>{:.2}</td><td>{:.2}</td><td>{:.2}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            name(&opening.id),
            opening.width_m,
            opening.height_m,
            opening.sill_m,
            name(&opening.wall),
            opening.rooms.iter().map(|room| name(room)).collect::<Vec<_>>().join(", "),
            escaped(&opening.evidence)
        );
    }
    html.push_str("</tbody></table></div>");
    if openings.iter().any(|opening| opening.is_narrow() && opening.inferred) {
        html.push_str(
            "<p class=\"note\">Narrow doors are narrower than doors of buildings are: each may be a gap beside a cupboard, \
             or a part of a door.</p>",
        );
    }
}

/// A name that is never broken into two lines.
fn name(id: &str) -> String {
    format!("<span class=\"name\">{}</span>", escaped(id))
}

#[cfg(test)]
mod tests {
    use super::{LEFT, NARROW_DOOR, OVER, SHUT_DOOR, name_place_m, names_apart_rem, scale_m, section};
    use crate::building::elements::{Elements, Wall};
    use crate::model::turn::Turn;

    /// A corridor around a block, with a gap of 0.5 m.
    const RING: &str = r#"{"storeys": [{"id": "S1", "floor_z_m": 0, "ceiling_z_m": 2.5, "floor_inferred": true}],
        "rooms": [{"id": "S1-R01", "storey": "S1", "outline_m": [[0, 0], [12, 0], [12, 8], [0, 8]],
        "holes_m": [[[2, 2], [2, 6], [9, 6], [9, 2]]], "floor_z_m": 0, "ceiling_z_m": 2.5, "area_m2": 68, "seen_area_m2": 66.5,
        "closed": true, "walled_share": 1, "inferred": false}], "walls": [
        {"id": "S1-W01", "storey": "S1", "axis_m": [[0, 0], [12, 0]], "outline_m": [[0, 0], [12, 0], [12, -0.2], [0, -0.2]],
        "thickness_m": null, "thickness_from": "unknown", "drawn_thickness_m": 0.2, "seen_left": true, "height_m": 2.5,
        "rooms": ["S1-R01"], "seen_share": 1, "inferred": true}], "openings": [{"id": "S1-D01", "kind": "door", "wall": "S1-W01", "center_m": [6, 0, 1], "width_m": 0.5,
        "height_m": 2, "sill_m": 0, "rooms": ["S1-R01"], "evidence": "seen through", "inferred": true}]}"#;

    #[test]
    fn names_stand_where_there_is_room_and_a_scale_below() {
        let elements: Elements = serde_json::from_str(RING).unwrap();
        let html = section(&elements, &Turn::default());
        // The plan goes from -0.6 to 12.6 m; the widest leg of the ring is at its right.
        let left = html.split("<span class=\"tag room\" style=\"left:").nth(1).unwrap();
        let left: f64 = left.split('%').next().unwrap().parse().unwrap();
        assert!((left / 100.0 * 13.2 - 0.6) > 9.2, "{left} % from the left");
        assert!(
            html.contains(">S1-D01</span>")
                && html.contains(">2 m</span>")
                && html.contains("class=\"scale\"")
        );
        assert!(html.contains("class=\"tag opening over\""), "{html}");
        assert!(html.contains("<td>narrow door</td>") && html.contains("a gap beside a cupboard"), "{html}");
        let wall = "<td><span class=\"name\">S1-W01</span></td><td><span class=\"name\">S1-R01</span></td>";
        assert!(html.contains(wall) && html.contains(">in wall</th>"), "{html}");
        assert_eq!(html.matches("<i style=\"background:#").count(), 8, "a key of the colors");
        // A wall that a list names can be found: its name is on it, and in the middle of what is left of it
        // before its door, 2.875 of 12 m.
        assert!(html.contains("<span class=\"tag wall\" style=\"left:26.33%;"), "{html}");
        assert!(html.contains("<title>S1-W01</title>") && html.contains("id=\"wall-names\""), "{html}");
        let narrow = format!("fill=\"{NARROW_DOOR}\" stroke=\"{NARROW_DOOR}\"><title>S1-D01, narrow door: ");
        assert!(html.contains(&narrow), "{html}");
        assert!(html.contains("<td>68.00</td><td>66.50</td>") && !html.contains("path class=\"guess\""));
        assert!(html.contains("<i class=\"guess\"></i>wall of which less than 30 %"), "{html}");
    }

    #[test]
    fn a_wall_that_was_hardly_seen_is_dashed_and_a_leaf_makes_a_shut_door() {
        let hardly = RING.replace("\"seen_share\": 1", "\"seen_share\": 0.29");
        let shut =
            hardly.replace("\"width_m\": 0.5", "\"width_m\": 0.9").replace("seen through", "closed leaf");
        let html = section(&serde_json::from_str(&shut).unwrap(), &Turn::default());
        assert_eq!(html.matches("<path class=\"guess\"").count(), 1, "{html}");
        assert!(html.contains(&format!("fill=\"{SHUT_DOOR}\"")), "{html}");
        assert!(html.contains("<td>shut door</td>") && html.contains("<td>closed leaf</td>"), "{html}");
        let open = RING.replace("\"closed\": true", "\"closed\": false");
        assert!(
            section(&serde_json::from_str(&open).unwrap(), &Turn::default())
                .contains("Rooms that are not closed go on")
        );
    }

    #[test]
    fn names_of_openings_stand_at_the_edges_of_walls_however_thick() {
        let elements: Elements = serde_json::from_str(RING).unwrap();
        let wall = |drawn_thickness_m: f64| Wall { drawn_thickness_m, ..elements.walls[0].clone() };
        let place = |thickness_m, side| name_place_m(&elements.openings[0], &wall(thickness_m), side);
        assert_eq!(place(0.2, OVER), [6.0, 0.1]);
        assert_eq!(place(1.0, OVER), [6.0, 0.5]);
        assert_eq!(place(1.0, LEFT), [6.0, 0.0], "the wall goes to the left");
    }

    #[test]
    fn a_plan_is_so_wide_that_names_of_walls_stand_apart() {
        let mut elements: Elements = serde_json::from_str(RING).unwrap();
        assert_eq!(names_apart_rem(&elements, 13.2), 0.0, "a name alone");
        let mut beside = |id: &str, x_m: f64, y_m: f64| {
            let mut wall = elements.walls[0].clone();
            wall.id = id.to_owned();
            wall.axis_m = [[x_m, y_m], [x_m + 12.0, y_m]];
            elements.walls.push(wall);
            names_apart_rem(&elements, 13.2)
        };
        // The name of the first one stands at 2.875 m, theirs at 6 m after their beginnings.
        let far = beside("S1-W02", 0.0, 8.0);
        assert!((far - 13.2 * 0.95 / 8.0).abs() < 1e-9, "one above the other: {far}");
        let near = beside("S1-W03", 1.0, 8.0);
        assert!((near - 13.2 * 2.9).abs() < 1e-9, "a meter apart: {near}");
        assert_eq!(beside("S1-W04", 1.0, 8.0), near, "in one place");
    }

    #[test]
    fn an_askew_building_lies_along_the_page() {
        let elements: Elements = serde_json::from_str(RING).unwrap();
        let askew = elements.clone().turned(&Turn { angle_rad: 0.3 });
        let plan = |html: &str| html.split_once("</svg>").unwrap().0.replace("-0.000", "0.000");
        let straight = section(&elements, &Turn::default());
        let turned_back = section(&askew, &Turn { angle_rad: -0.3 });
        assert_eq!(plan(&turned_back), plan(&straight));
        assert!(turned_back.contains("turned by 17.2 degrees clockwise") && !straight.contains("turned by"));
    }

    #[test]
    fn a_scale_is_a_round_length_of_a_quarter_of_the_plan_at_most() {
        assert_eq!([1.0, 9.0, 41.0, 90.0].map(scale_m), [1.0, 2.0, 10.0, 20.0]);
    }
}
