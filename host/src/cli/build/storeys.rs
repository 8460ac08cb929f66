//! On which floor each recording was driven (`--floor-z`), and the poses of all, storey by storey.

use std::path::PathBuf;

use super::drive_args::DriveArgs;
use super::notes;
use super::posed::Posed;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::stages::Stages;
use crate::formats::output::OutputFolder;
use crate::recordings::run::Run;

/// Floors are at least this far apart, meters: lower storeys are none.
const MIN_APART_M: f64 = 2.0;
/// Floors that are farther from all others are pointed out, meters: heights in centimeters look so.
const FAR_APART_M: f64 = 30.0;
/// No floor is further up or down than this, meters.
const MAX_Z_M: f64 = 1000.0;

/// The height of the floor of one recording.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FloorOf {
    recording: PathBuf,
    z_m: f64,
}

/// Reads `RUN.mcap=3.1`.
pub(super) fn floor_of(text: &str) -> Result<FloorOf, String> {
    let expected = || "expected RUN.mcap=HEIGHT, the height in meters".to_owned();
    let (recording, height) = text.rsplit_once('=').ok_or_else(expected)?;
    match height.parse::<f64>() {
        Ok(z_m) if z_m.abs() <= MAX_Z_M && !recording.is_empty() => {
            Ok(FloorOf { recording: recording.into(), z_m })
        }
        _ => Err(expected()),
    }
}

/// Recordings by the floor on which they were driven, from below, with the height of each floor, meters.
/// What is named nowhere was driven at height 0.
///
/// # Errors
/// When a floor is that of no recording, or floors are too near to each other.
pub(super) fn sorted(mut runs: Vec<Run>, floors: &[FloorOf]) -> Result<(Vec<Run>, Vec<f64>), String> {
    let is_of = |run: &Run, floor: &FloorOf| {
        run.path() == floor.recording || run.recording().paths().any(|path| path == floor.recording)
    };
    if let Some(lost) = floors.iter().find(|floor| !runs.iter().any(|run| is_of(run, floor))) {
        let names: Vec<String> = runs.iter().map(|run| run.path().display().to_string()).collect();
        return Err(format!(
            "--floor-z names {}, which is none of the recordings: {}",
            lost.recording.display(),
            names.join(", ")
        ));
    }
    let height_m = |run: &Run| floors.iter().rfind(|floor| is_of(run, floor)).map_or(0.0, |floor| floor.z_m);
    runs.sort_by(|a, b| height_m(a).total_cmp(&height_m(b)));
    let floors_m: Vec<f64> = runs.iter().map(height_m).collect();
    let near = floors_m.windows(2).find(|pair| pair[0] != pair[1] && pair[1] - pair[0] < MIN_APART_M);
    if let Some(pair) = near {
        return Err(format!("floors at {} m and {} m are less than {MIN_APART_M} m apart", pair[0], pair[1]));
    }
    Ok((runs, floors_m))
}

/// What to say of floors, from below, that are so far apart that their heights are hardly meters.
pub(super) fn far_apart(floors_m: &[f64]) -> Vec<String> {
    let far = floors_m.windows(2).filter(|pair| pair[1] - pair[0] > FAR_APART_M);
    far.map(|pair| {
        format!(
            "no floor lies between those at {} m and {} m; --floor-z takes meters: are these centimeters?",
            pair[0], pair[1]
        )
    })
    .collect()
}

/// Somebody else's poses, the optimized ones, or those of the recording.
pub(crate) fn poses<'a>(
    args: &DriveArgs,
    runs: &'a [Run],
    floors_m: &[f64],
    folder: &OutputFolder,
    stages: &mut Stages<'_>,
    console: &Console,
) -> anyhow::Result<Posed<'a>> {
    match &args.poses {
        Some(path) => {
            let posed = Posed::foreign(runs, path, console)?;
            console.report_wild_poses(path, posed.wild_poses);
            Ok(posed)
        }
        None if args.no_optimize => {
            let of_storey = |runs, floor_m| Ok(Posed::recorded(runs, console)?.raised(floor_m));
            by_storey(runs, floors_m, of_storey)
        }
        None => {
            let is_one = floors_m.iter().all(|floor_m| *floor_m == floors_m[0]);
            let of_storey = |runs, floor_m| {
                let posed = Posed::optimized(runs, &folder.searches(), console)?;
                let posed = if args.planar || !is_one { posed } else { posed.in_six_directions(console)? };
                Ok(posed.raised(floor_m))
            };
            let posed = stages.time("optimize", || {
                let posed = by_storey(runs, floors_m, of_storey)?;
                let loops = posed.loops.unwrap_or(0);
                anyhow::Ok((posed, loops))
            })?;
            notes::report_poses(&posed, console);
            Ok(posed)
        }
    }
}

/// The poses of all recordings, storey by storey; `floors_m` has the floor of each, equal ones beside each
/// other.
fn by_storey<'a>(
    runs: &'a [Run],
    floors_m: &[f64],
    of_storey: impl Fn(&'a [Run], f64) -> anyhow::Result<Posed<'a>>,
) -> anyhow::Result<Posed<'a>> {
    let (mut storeys, mut rest) = (Vec::new(), runs);
    for floors_m in floors_m.chunk_by(|a, b| a == b) {
        let (own, others) = rest.split_at(floors_m.len());
        storeys.push(of_storey(own, floors_m[0])?);
        rest = others;
    }
    match storeys.pop() {
        Some(only) if storeys.is_empty() => Ok(only),
        last => Ok(Posed::together(storeys.into_iter().chain(last).collect())),
    }
}

#[cfg(test)]
mod tests {
    use super::{FloorOf, far_apart, floor_of};

    #[test]
    fn floors_in_centimeters_are_pointed_out() {
        assert_eq!(far_apart(&[0.0, 0.0, 3.1, 30.0]), [""; 0]);
        let words =
            "no floor lies between those at 3.1 m and 310 m; --floor-z takes meters: are these centimeters?";
        assert_eq!(far_apart(&[0.0, 3.1, 310.0]), [words]);
    }

    #[test]
    fn a_floor_is_a_recording_and_a_height() {
        let floor = |name: &str, z_m: f64| Ok(FloorOf { recording: name.into(), z_m });
        assert_eq!(floor_of("up.mcap=3.1"), floor("up.mcap", 3.1));
        assert_eq!(floor_of("a=b.mcap=-2"), floor("a=b.mcap", -2.0));
        for wrong in ["up.mcap", "up.mcap=", "=3", "up.mcap=nan", "up.mcap=inf", "up.mcap=3.1m"] {
            assert!(floor_of(wrong).is_err(), "{wrong}");
        }
    }
}
