//! `--matcher` and `--set`: how scans are matched.

use biplane_matcher::{Method, ParameterError, TrackerParams};

/// The method and its parameters.
#[derive(Debug, clap::Args)]
pub(crate) struct MatcherArgs {
    /// How scans are matched; `gradient` is the paper's.
    #[arg(long, default_value_t)]
    matcher: Method,
    /// Sets a parameter of the matcher, for example align.outlier_m=0.1; may be given several times, the last
    /// one counts. `biplane-onboard parameters` lists them.
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    set: Vec<Setting>,
    /// Memory that the map may come to use, megabytes; it takes only what it needs. When it is full, places
    /// that were not seen for the longest time are forgotten. [default: 116, for 46,000 m2 of floor]
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u32).range(4..=360))]
    map_memory: Option<u32>,
}

/// A parameter's name and a value that it takes.
#[derive(Clone, PartialEq, Debug)]
struct Setting {
    name: String,
    value: f64,
}

impl MatcherArgs {
    /// The parameters in force.
    pub(crate) fn params(&self) -> TrackerParams {
        let mut params = TrackerParams::for_method(self.matcher);
        if let Some(megabytes) = self.map_memory {
            params.map = params.map.within_bytes(megabytes as usize * 1_000_000);
        }
        for Setting { name, value } in &self.set {
            // What does not go was refused with the words.
            let _ = params.set(name, *value);
        }
        params
    }
}

fn setting(text: &str) -> Result<Setting, String> {
    let (name, number) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let value = number.trim().parse().map_err(|_| format!("expected a number, found \"{number}\""))?;
    let name = name.trim().to_owned();
    match TrackerParams::default().set(&name, value) {
        Ok(()) => Ok(Setting { name, value }),
        Err(error @ ParameterError::Unknown { .. }) => {
            Err(format!("{error} (`biplane-onboard parameters` lists all)"))
        }
        Err(error) => Err(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_is_a_known_name_and_a_value_it_takes() {
        let half = Setting { name: "map.cell_m".to_owned(), value: 0.025 };
        assert_eq!(setting("map.cell_m=0.025"), Ok(half));
        for (text, error) in [
            ("map.cell_m", "expected NAME=VALUE"),
            ("map.cell_m=wide", "expected a number, found \"wide\""),
            ("map.cell_m=-1", "map.cell_m is from 0.005 to 1, found -1"),
            (
                "map.cel_m=0.1",
                "no parameter of the matcher is called \"map.cel_m\"; there is map.cell_m (`biplane-onboard parameters` lists all)",
            ),
        ] {
            assert_eq!(setting(text), Err(error.to_owned()), "{text}");
        }
    }

    #[test]
    fn of_two_settings_of_one_parameter_the_last_one_counts() {
        let set = ["map.cell_m=0.1", "map.tiles=9", "map.cell_m=0.2"].map(|text| setting(text).unwrap());
        let args = MatcherArgs { matcher: Method::Gradient, set: set.to_vec(), map_memory: None };
        let params = args.params();
        assert_eq!((params.method, params.map.cell_m, params.map.tiles), (Method::Gradient, 0.2, 9));
    }
}
