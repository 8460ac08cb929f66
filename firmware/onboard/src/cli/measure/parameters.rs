//! `parameters`: what `--set` can change.

use std::fmt::Write;

use biplane_matcher::{Parameter, TrackerParams};

/// Lists the parameters of the matchers: name, default, range, and what each trades.
///
/// `--set NAME=VALUE` on `record` and `replay` changes one. Those of `gradient.` belong to `--matcher
/// gradient`, those of `map.` and `align.` to the default.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane-onboard parameters")]
pub(crate) struct Args {
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> u8 {
    crate::cli::print_result(&if args.json { json() } else { text() });
    0
}

/// Letters a line, where the terminal's width is not asked for.
const WIDTH: usize = 100;

fn text() -> String {
    let mut text = String::new();
    for parameter in TrackerParams::parameters() {
        let Parameter { name, minimum, maximum, .. } = parameter;
        let _ = writeln!(text, "{name} = {}   ({minimum} to {maximum})", default(parameter));
        text.push_str(&biplane_cli::paragraph(parameter.meaning, WIDTH, "    "));
    }
    text
}

fn json() -> String {
    let list: Vec<_> = TrackerParams::parameters()
        .map(|parameter| {
            serde_json::json!({
                "name": parameter.name, "default": default(parameter), "least": parameter.minimum,
                "most": parameter.maximum, "whole": parameter.whole, "meaning": parameter.meaning,
            })
        })
        .collect();
    format!("{:#}\n", serde_json::Value::from(list))
}

fn default(parameter: &Parameter) -> f64 {
    TrackerParams::default().get(parameter.name).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_stands_in_both_lists_with_its_default_and_meaning() {
        let list: serde_json::Value = serde_json::from_str(&json()).unwrap();
        let text = text();
        for (parameter, entry) in TrackerParams::parameters().zip(list.as_array().unwrap()) {
            assert_eq!(entry["name"], parameter.name);
            assert_eq!(entry["default"], default(parameter));
            assert!(text.contains(&format!("\n{} = ", parameter.name)) || text.starts_with(parameter.name));
        }
        assert!(text.contains("\nmap.cell_m = 0.05   (0.005 to 1)\n    Side of a cell, meters:"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH + 4), "{text}");
    }
}
