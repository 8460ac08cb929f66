//! What `build` and `compact` have in common: how planes become a model, and which files it goes to.

use biplane::budget;
use biplane::model::Model;
use biplane::params::BuildParams;
use biplane::pipeline::BuildOutput;
use biplane::polygons::Merging;

#[cfg(feature = "demo")]
use crate::build::formats::Format;
use crate::build::formats::{self, Formats};
use crate::console::say;
#[cfg(feature = "simplify")]
use crate::planes::length;

/// Words that both share.
#[derive(Clone, Debug, clap::Args)]
pub struct Shaping {
    /// Files to write of the model, separated by commas: glb, ply, obj, cityjson, dxf (floor plan, 3D faces), ifc (storeys, walls,
    /// doors), lod (model.glb in two coarser levels), las and laz (points with plane and time), or all
    #[arg(long, value_delimiter = ',', value_parser = formats::parse, default_value = "glb,ply,obj,cityjson", hide_possible_values = true)]
    pub formats: Vec<Formats>,
    /// Which polygons of one plane become one: `holes` all that hang together, `paper` those that share exactly one sequence of edges, so
    /// that none has a hole
    #[arg(long, value_name = "RULE", value_parser = merging, default_value = "holes")]
    merging: Merging,
    /// Simplify the triangles on no plane; none of their vertices is then further than this from the model, metres
    #[cfg(feature = "simplify")]
    #[arg(long, value_name = "M", value_parser = length)]
    simplify_leftovers: Option<f64>,
    /// Bound on the model's triangles: borders become coarser, loose and small pieces go, until it fits
    #[arg(long, value_name = "N")]
    pub max_triangles: Option<usize>,
    /// Write no report.html: it takes a part of the time, and a few megabytes
    #[arg(long)]
    pub no_report: bool,
}

impl Shaping {
    /// As when nothing is said.
    #[cfg(feature = "demo")]
    pub fn unsaid() -> Self {
        Self {
            formats: vec![Format::USUAL],
            merging: Merging::default(),
            #[cfg(feature = "simplify")]
            simplify_leftovers: None,
            max_triangles: None,
            no_report: false,
        }
    }

    /// The parameters, with this noise of the points, metres.
    pub fn parameters(&self, sigma_m: Option<f64>) -> BuildParams {
        let mut build = BuildParams::default();
        build.planes.sigma_m = sigma_m;
        build.polygons.merging = self.merging;
        #[cfg(feature = "simplify")]
        {
            build.leftovers.tolerance_m = self.simplify_leftovers.map(|tolerance_m| tolerance_m as f32);
        }
        build
    }

    /// Makes the model fit the bound, and says what that cost.
    pub fn bound(&self, output: &mut BuildOutput) {
        let Some(most) = self.max_triangles else { return };
        let bounded = budget::bound(&mut output.model, most);
        output.counts.recount(&output.model);
        tell_bounded(bounded, &output.model, most);
    }
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
fn tell_bounded(bounded: Option<budget::Bounded>, model: &Model, most_triangles: usize) {
    let Some(cost) = bounded else { return };
    say(&format!(
        "biplane: to keep within {most_triangles} triangles borders are straightened by up to {:.0} cm, {} polygons and {} triangles of \
        fine structure are left out",
        100.0 * cost.tolerance_m,
        cost.polygons,
        cost.leftover_triangles
    ));
    if cost.forced {
        say(&format!(
            "biplane: {most_triangles} triangles are too few for this model: large surfaces are left out too"
        ));
    }
    if model.polygons.is_empty() && model.leftovers.triangles.is_empty() {
        say(&format!("biplane: nothing of the model fits into {most_triangles} triangles"));
    }
}
