//! `report.html`: one file that shows a build to people, offline: its figures beside the paper's, the floor
//! map, and raw mesh, simplification by others and model in a 3D view.
//!
//! The page fetches nothing (its own content policy forbids it). Its script and shaders are the files beside
//! this one, written into it as they are. Meshes travel as [`pack`]ed bytes in base64. Pictures by the
//! software renderer stand where there is no WebGL2, and on paper.

pub(crate) mod data;
mod drawn;
pub(crate) mod sections;
pub(crate) mod sources;
mod template;
#[cfg(test)]
mod tests;
mod text;

use std::io::{self, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::building::Building;
use crate::formats::Shapes;
use crate::model::turn::Turn;
use crate::pipeline::summary::Summary;
use crate::view::markup::escaped;
use crate::view::report::data::pack::Lattice;

pub(crate) use crate::view::report::sections::comparison::{Row, with_comparison};
pub(crate) use crate::view::report::sources::{Floor, Sources};

/// Triangles of the raw mesh that a page shows at most. More would make the file larger than 20 MB and
/// turning it jerky.
const MAX_RAW_TRIANGLES: usize = 1_500_000;
/// Triangles of no plane that a page shows at most, for the same reason.
const MAX_LEFTOVER_TRIANGLES: usize = 250_000;
/// Bytes of a block of packed data in the page; a browser decodes one without holding up the page.
const BLOCK_BYTES: usize = 3 << 18;

/// A page, but for the figures that are known only when all else is done.
#[derive(Clone, Debug)]
pub(crate) struct Page {
    title: String,
    /// By what plan and floor map are turned.
    turn: Turn,
    way: sections::figures::PathFigures,
    floor: String,
    rooms: String,
    view: Option<View>,
}

/// The 3D view: what its script reads, and the pictures that stand for it.
#[derive(Clone, Debug)]
struct View {
    contents: String,
    blocks: Vec<Block>,
    pictures: Vec<drawn::Picture>,
    /// A sentence, when the raw mesh had to be reduced.
    reduced: Option<String>,
    has_simple: bool,
    table: String,
}

/// Part of a packed mesh, in base64.
#[derive(Clone, Debug)]
struct Block {
    mesh: &'static str,
    base64: String,
}

impl Page {
    /// Packs the meshes and draws the pictures.
    ///
    /// # Errors
    /// When a picture cannot be encoded.
    pub(crate) fn new(sources: &Sources<'_>) -> io::Result<Self> {
        let Shapes { model, faces, .. } = sources.shapes;
        let turn = Turn::along_walls(model, faces).unwrap_or_default();
        let view = if sources.raw.triangles.is_empty() { None } else { Some(View::new(sources, &turn)?) };
        let floor = match sources.floor {
            Some(floor) => sections::floor::section(floor.map, floor.poses, &turn)?,
            None => String::new(),
        };
        Ok(Self {
            title: sources.title.to_owned(),
            turn,
            way: sections::figures::PathFigures::of(sources.poses),
            floor,
            rooms: String::new(),
            view,
        })
    }

    /// With a plan and lists of rooms, doors and windows; of a model without rooms with a list of what
    /// openings its surfaces show.
    pub(crate) fn with_building(self, building: &Building) -> Self {
        let rooms = match building.elements.is_empty() {
            true => sections::openings::section(building),
            false => sections::rooms::section(&building.elements, &self.turn),
        };
        Self { rooms, ..self }
    }

    /// Writes the page with links to `files`, the names of those beside it.
    ///
    /// # Errors
    /// When writing fails.
    pub(crate) fn write(&self, out: &mut impl Write, summary: &Summary, files: &[String]) -> io::Result<()> {
        template::fill(out, template::PAGE, |out, name| match name {
            "title" => out.write_all(escaped(&self.title).as_bytes()),
            "style" => out.write_all(template::STYLE.as_bytes()),
            "lead" => out.write_all(sections::figures::lead(summary, &self.way).as_bytes()),
            "view" => self.view.as_ref().map_or(Ok(()), |view| view.write_section(out)),
            "figures" => out.write_all(sections::figures::section(summary, &self.way).as_bytes()),
            "stages" => out.write_all(sections::stages::section(summary).as_bytes()),
            "downloads" => out.write_all(sections::downloads::section(files).as_bytes()),
            "floor" => out.write_all(self.floor.as_bytes()),
            "rooms" => out.write_all(self.rooms.as_bytes()),
            "planes" => self.view.as_ref().map_or(Ok(()), |view| out.write_all(view.table.as_bytes())),
            "parameters" => out.write_all(sections::figures::parameters(summary)?.as_bytes()),
            "version" => out.write_all(escaped(summary.version).as_bytes()),
            "comparison" => out.write_all(sections::comparison::PLACE.as_bytes()),
            "data" => self.view.as_ref().map_or(Ok(()), |view| view.write_data(out)),
            "script" => template::write_scripts(out, self.view.is_some()),
            _ => Err(io::Error::other(format!("the page's template names {name}"))),
        })
    }
}

impl View {
    fn new(sources: &Sources<'_>, turn: &Turn) -> io::Result<Self> {
        // Before anything else: their triangles take more memory than all that comes.
        let pictures = sections::pictures::draw(sources)?;
        let fitting = data::reduce::to_fit(sources.raw, MAX_RAW_TRIANGLES);
        let raw = fitting.as_ref().map_or(sources.raw, |(mesh, _)| mesh);
        let reduced = fitting.as_ref().map(|(mesh, cell_m)| {
            format!(
                "The raw mesh of {} triangles is shown here with {}: corners within {:.0} cm are one, so that this file stays small. \
                 raw.ply has all of them.",
                text::grouped(sources.raw.triangles.len()),
                text::grouped(mesh.triangles.len()),
                100.0 * cell_m
            )
        });
        let leftovers = &sources.shapes.model.leftovers;
        let fewer = data::reduce::to_fit(leftovers, MAX_LEFTOVER_TRIANGLES);
        let model =
            data::contents::model_mesh(sources.shapes, fewer.as_ref().map_or(leftovers, |(mesh, _)| mesh));
        let lattice = Lattice::around([Some(raw), sources.simple, Some(&model)].into_iter().flatten());
        let mut blocks = Vec::new();
        let mut packed = Vec::new();
        for (name, mesh) in [("model", Some(&model)), ("simple", sources.simple), ("raw", Some(raw))] {
            let Some(mesh) = mesh else { continue };
            let bytes = data::pack::pack(mesh, &lattice);
            blocks.extend(
                bytes
                    .bytes
                    .chunks(BLOCK_BYTES)
                    .map(|part| Block { mesh: name, base64: STANDARD.encode(part) }),
            );
            packed.push((name, bytes));
        }
        let contents = data::contents::json(sources, &lattice, &packed, &pictures, turn)?;
        let mut table = data::contents::table(sources.shapes);
        table.push_str(&data::contents::table_of_rounds(sources.shapes.model));
        Ok(Self {
            contents,
            blocks,
            pictures: pictures.pictures,
            reduced,
            has_simple: sources.simple.is_some(),
            table,
        })
    }

    fn write_section(&self, out: &mut dyn Write) -> io::Result<()> {
        template::fill(out, template::VIEW, |out, name| match name {
            "pictures" => self.pictures.iter().try_for_each(|picture| {
                write!(
                    out,
                    "<img src=\"data:image/png;base64,{}\" width=\"{}\" height=\"{}\" alt=\"{}\">",
                    picture.base64,
                    picture.size[0],
                    picture.size[1],
                    escaped(&picture.words)
                )
            }),
            "simple" => out.write_all(if self.has_simple { template::SIMPLE_PANE } else { "" }.as_bytes()),
            "simple_tab" => out.write_all(if self.has_simple { template::SIMPLE_TAB } else { "" }.as_bytes()),
            "simple_note" => {
                out.write_all(if self.has_simple { template::SIMPLE_NOTE } else { "" }.as_bytes())
            }
            "reduced" => {
                self.reduced.iter().try_for_each(|words| write!(out, "<p class=\"note\">{words}</p>"))
            }
            _ => Err(io::Error::other(format!("the view's template names {name}"))),
        })
    }

    fn write_data(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "<script type=\"application/json\" id=\"contents\">{}</script>", self.contents)?;
        for block in &self.blocks {
            writeln!(
                out,
                "<script type=\"text/plain\" data-mesh=\"{}\">{}</script>",
                block.mesh, block.base64
            )?;
        }
        Ok(())
    }
}
