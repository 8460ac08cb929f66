//! What `build` and `compact` have in common: how planes become a model, and which files it goes to.

use crate::model::Model;
use crate::pipeline::params::BuildParams;
use crate::pipeline::{BuildOutput, Counts};
use crate::reconstruct::decimate;
use crate::reconstruct::polygons::params::Merging;

use crate::cli::models::formats;
#[cfg(feature = "demo")]
use crate::cli::models::formats::Format;
use crate::cli::models::formats::Formats;
use crate::cli::terminal::console::{Console, say};
use crate::cli::terminal::values::length;
use anyhow::bail;

/// Words that both share.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ModelArgs {
    /// Files to write of the model, separated by commas: glb, ply, obj, cityjson, dxf, ifc, lod, las, laz,
    /// all of these, mcap, 3dtiles or none. dxf holds a floor plan and 3D faces, ifc storeys, walls and
    /// doors. lod is model.glb in two coarser levels. las and laz hold points with plane and time. mcap is
    /// for Foxglove and RViz: model, points, map and way. 3dtiles is for web viewers (tileset.json and
    /// tiles/*.glb). `biplane export` writes them later
    #[arg(long, value_delimiter = ',', value_parser = formats::parse, default_value = "glb,ply,obj,cityjson", hide_possible_values = true)]
    pub formats: Vec<Formats>,
    /// Which polygons of one plane become one: `holes` all that hang together, `paper` those that share
    /// exactly one sequence of edges, so that none has a hole
    #[arg(long, value_name = "RULE", value_parser = merging, default_value = "holes")]
    pub merging: Merging,
    /// Simplify the triangles on no plane; none of their vertices is then further than this from the model,
    /// meters
    #[arg(long, value_name = "M", value_parser = length)]
    simplify_leftovers: Option<f64>,
    /// Look for no round things: columns, pipes and curved walls stay strips of planes
    #[arg(long)]
    no_shapes: bool,
    /// Bound on the model's triangles: borders become coarser, loose and small pieces go, until it fits
    #[arg(long, value_name = "N", value_parser = triangles)]
    pub max_triangles: Option<usize>,
    /// Write no report.html: it takes a part of the time, and a few megabytes
    #[arg(long)]
    pub no_report: bool,
}

impl ModelArgs {
    /// As when nothing is said.
    #[cfg(feature = "demo")]
    pub(crate) fn unsaid() -> Self {
        Self {
            formats: vec![Format::USUAL],
            merging: Merging::default(),
            simplify_leftovers: None,
            no_shapes: false,
            max_triangles: None,
            no_report: false,
        }
    }

    /// The parameters, with this noise of the points, meters.
    pub(crate) fn parameters(&self, sigma_m: Option<f64>) -> BuildParams {
        let mut build = BuildParams::default();
        build.planes.sigma_m = sigma_m;
        build.shapes.enabled = !self.no_shapes;
        build.polygons.merging = self.merging;
        build.leftovers.tolerance_m = self.simplify_leftovers.map(|tolerance_m| tolerance_m as f32);
        build
    }

    /// Makes the model fit the bound, and says what that cost.
    ///
    /// # Errors
    /// When nothing of the model fits.
    pub(crate) fn bound(&self, output: &mut BuildOutput) -> anyhow::Result<()> {
        let Some(maximum) = self.max_triangles else { return Ok(()) };
        let was_empty = is_empty(&output.model);
        let before = output.model.polygons.len();
        let bounded = decimate::bound(&mut output.model, maximum);
        output.counts.recount(&output.model);
        output.counts.polygons_left_out = before - output.counts.polygons.min(before);
        if is_empty(&output.model) && !was_empty {
            bail!("nothing of the model fits into --max-triangles {maximum}: allow more");
        }
        report_bounded(bounded, maximum);
        Ok(())
    }
}

/// A bound that something can fit into.
fn triangles(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number: &usize| *number > 0);
    number.ok_or_else(|| "expected a whole number of triangles, 1 or more".to_owned())
}

/// A rule of merging by its name.
fn merging(name: &str) -> Result<Merging, String> {
    match name {
        "holes" => Ok(Merging::Holes),
        "paper" => Ok(Merging::Paper),
        _ => Err("the rules are: holes, paper".to_owned()),
    }
}

/// What `--max-triangles` cost, where there was a cost.
fn report_bounded(bounded: Option<decimate::Bounded>, max_triangles: usize) {
    let Some(cost) = bounded else { return };
    say(&format!(
        "biplane: to keep within {max_triangles} triangles borders are straightened by up to {:.0} cm, {} polygons and {} triangles of \
        fine structure are left out",
        100.0 * cost.tolerance_m,
        cost.polygons,
        cost.leftover_triangles
    ));
    if cost.forced {
        say(&format!(
            "biplane: {max_triangles} triangles are too few for this model: large surfaces are left out too"
        ));
    }
}

fn is_empty(model: &Model) -> bool {
    model.polygons.is_empty() && model.leftovers.triangles.is_empty()
}

/// Noise that is larger was hardly meant in meters: no laser that maps buildings has so much.
const USUAL_SIGMA_M: f64 = 0.25;

/// Asks whether a noise was typed in centimeters, also when quiet: planes are then hardly found.
pub(crate) fn report_sigma(sigma_m: Option<f64>, console: &Console) {
    sigma_words(sigma_m).into_iter().for_each(|words| console.warn(format!("biplane: {words}")));
}

fn sigma_words(sigma_m: Option<f64>) -> Option<String> {
    let sigma_m = sigma_m.filter(|sigma_m| *sigma_m > USUAL_SIGMA_M)?;
    let (centimeters, millimeters) = (sigma_m / 100.0, sigma_m / 1000.0);
    Some(format!(
        "--sigma {sigma_m} is taken as meters, and no laser is as noisy: if centimeters were meant, it is \
         --sigma {centimeters}, if millimeters {millimeters}"
    ))
}

/// Which noise the planes were searched with.
pub(crate) fn report_noise(counts: &Counts, console: &Console) {
    console.note(format!("noise {:.1} cm ({})", 100.0 * counts.sigma_m, counts.sigma_source.words()));
}

#[cfg(test)]
mod tests {
    use super::{sigma_words, triangles};

    #[test]
    fn a_noise_in_centimeters_is_pointed_out() {
        assert_eq!(sigma_words(None), None);
        assert_eq!(sigma_words(Some(0.25)), None);
        let words = sigma_words(Some(1.5)).unwrap();
        assert!(words.contains("if centimeters were meant, it is --sigma 0.015"), "{words}");
    }

    #[test]
    fn a_bound_that_nothing_fits_into_is_refused() {
        assert_eq!(triangles("1"), Ok(1));
        for text in ["0", "-1", "", "many", "1.5"] {
            assert!(triangles(text).is_err(), "{text}");
        }
    }
}
