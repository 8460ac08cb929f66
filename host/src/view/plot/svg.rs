//! A drawing as SVG. It paints its own paper, light or dark as the reader's screen asks, so it is readable on
//! any page.

use std::fmt::Write;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use super::drawing::{AREA_OPACITY, Anchor, CELL_GRAY, CURVES, Cells, Drawing, Ink, Item};
use crate::model::palette::Rgb;
use crate::view::markup::escaped;

/// Writes the drawing as an SVG document. Numbers have one decimal: the same drawing gives the same bytes
/// everywhere.
pub(crate) fn to_svg(drawing: &Drawing) -> String {
    let [width, height] = drawing.size;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" height=\"{height:.0}\" \
         font-family=\"system-ui, sans-serif\">\n<style>\n{}@media (prefers-color-scheme: dark) {{\n{}}}\n</style>\n\
         <rect width=\"100%\" height=\"100%\" rx=\"6\" class=\"{}\"/>\n",
        colors(Ink::on_light),
        colors(Ink::on_dark),
        class(Ink::Paper),
    );
    for item in &drawing.items {
        svg.push_str(&element(item));
        svg.push('\n');
    }
    svg.push_str("</svg>\n");
    svg
}

fn class(ink: Ink) -> String {
    match ink {
        Ink::Paper => "paper".to_owned(),
        Ink::Text => "text".to_owned(),
        Ink::Faint => "faint".to_owned(),
        Ink::Grid => "grid".to_owned(),
        Ink::Curve(index) => format!("c{}", index % CURVES),
    }
}

/// A rule for each ink: `fill` for words and areas, `stroke` for lines.
fn colors(of: fn(Ink) -> Rgb) -> String {
    let mut rules = String::new();
    let inks = [Ink::Paper, Ink::Text, Ink::Faint, Ink::Grid].into_iter();
    for ink in inks.chain((0..CURVES).map(Ink::Curve)) {
        let ([r, g, b], class) = (of(ink), class(ink));
        let _ = writeln!(
            rules,
            ".{class} {{ fill: #{r:02x}{g:02x}{b:02x} }} .{class}l {{ stroke: #{r:02x}{g:02x}{b:02x}; fill: none }}"
        );
    }
    rules
}

fn element(item: &Item) -> String {
    match item {
        Item::Line { points, width, ink } => format!(
            "<polyline class=\"{}l\" stroke-width=\"{width}\" stroke-linejoin=\"round\" points=\"{}\"/>",
            class(*ink),
            places(points)
        ),
        Item::Area { corners, ink } => format!(
            "<polygon class=\"{}\" fill-opacity=\"{AREA_OPACITY}\" points=\"{}\"/>",
            class(*ink),
            places(corners)
        ),
        Item::Dot { at: [x, y], radius, ink } => {
            format!("<circle class=\"{}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"/>", class(*ink))
        }
        Item::Cells { at: [x, y], size: [width, height], cells } => format!(
            "<image x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" \
             preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>",
            BASE64.encode(cells_png(cells))
        ),
        Item::Words { at: [x, y], anchor, size, ink, text } => {
            let anchor = match anchor {
                Anchor::Left => "start",
                Anchor::Middle => "middle",
                Anchor::Right => "end",
            };
            let (class, text) = (class(*ink), escaped(text));
            format!(
                "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\">{text}</text>"
            )
        }
    }
}

/// Cells as PNG, a pixel each; empty where there are none.
fn cells_png(cells: &Cells) -> Vec<u8> {
    let pixels: Vec<u8> = cells.shades.iter().flat_map(|shade| [CELL_GRAY, *shade]).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, cells.columns as u32, cells.rows() as u32);
    encoder.set_color(png::ColorType::GrayscaleAlpha);
    encoder.set_depth(png::BitDepth::Eight);
    // Only an image without pixels is refused: writing into memory does not fail.
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(&pixels)?;
        writer.finish()
    });
    if written.is_err() {
        bytes.clear();
    }
    bytes
}

fn places(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use base64::Engine as _;

    use super::to_svg;
    use std::sync::Arc;

    use crate::view::plot::drawing::{Anchor, Cells, Drawing, Ink, Item};

    #[test]
    fn cells_are_an_image_of_a_pixel_each() {
        let cells = Arc::new(Cells { columns: 2, shades: vec![0, 255, 30, 0, 7, 9] });
        let mut drawing = Drawing { size: [20.0, 30.0], ..Drawing::default() };
        drawing.items.push(Item::Cells { at: [1.0, 2.0], size: [10.0, 15.0], cells });
        let svg = to_svg(&drawing);
        let (_, image) = svg.split_once("<image x=\"1.0\" y=\"2.0\" width=\"10.0\" height=\"15.0\"").unwrap();
        let (_, bytes) = image.split_once("base64,").unwrap();
        let bytes = super::BASE64.decode(bytes.split('"').next().unwrap()).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!([info.width, info.height], [2, 3]);
        assert_eq!(pixels.chunks(2).map(|pixel| pixel[1]).collect::<Vec<_>>(), [0, 255, 30, 0, 7, 9]);
        // An image without pixels is none.
        assert!(super::cells_png(&Cells::default()).is_empty());
    }

    #[test]
    fn a_drawing_is_written_item_by_item_with_both_looks() {
        let mut drawing = Drawing { size: [200.0, 100.0], ..Drawing::default() };
        drawing.line(vec![[1.0, 2.0], [3.25, 4.0]], 1.5, Ink::Curve(7));
        drawing.words("a < b & c", [10.0, 20.0], Anchor::Right, 12.0, Ink::Text);
        let svg = to_svg(&drawing);
        assert!(
            svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 200 100\""),
            "{svg}"
        );
        assert!(
            svg.contains("prefers-color-scheme: dark") && svg.contains(".paper { fill: #0d1117 }"),
            "{svg}"
        );
        let lines: Vec<&str> = svg.lines().rev().take(3).collect();
        assert_eq!(
            lines,
            [
                "</svg>",
                "<text class=\"text\" x=\"10.0\" y=\"20.0\" font-size=\"12\" text-anchor=\"end\">a &lt; b &amp; c</text>",
                "<polyline class=\"c1l\" stroke-width=\"1.5\" stroke-linejoin=\"round\" points=\"1.0,2.0 3.2,4.0\"/>",
            ]
        );
    }
}
