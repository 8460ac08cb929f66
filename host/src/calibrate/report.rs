//! What a calibration says: a row for each parameter, with what was observed and what was not.
//!
//! A parameter counts as observed when its standard deviation is half of what is promised (1 cm, 0.3 degrees,
//! 5 ms) or less. The covariance behind it is that of all parameters together, so that two which only show in
//! their sum are both unknown; its eigenvectors say which go together.

use biplane_geometry::PortableMath;
use biplane_recording::Rig;
use serde::Serialize;

use super::corrected::{self, Observed};
use super::odometry::{Known, Scales};
use super::placement::{PARAMETERS, Placement, Step};
use super::readings::Readings;
use super::solve::{PRIOR, Solution, directions};

/// The largest standard deviations that count as observed: meters, degrees, milliseconds, shares.
const OBSERVED: [f64; PARAMETERS] = [0.005, 0.005, 0.005, 0.15, 0.15, 0.15, 2.5];
const OBSERVED_SCALE: f64 = 0.003;
/// A scale known no better than this is not known.
const UNTOLD: f64 = 0.3;
const OBSERVED_DRIFT_RAD_PER_M: f64 = 0.002;
/// From meters, radians and seconds to the units of rows.
const PER_UNIT: [f64; PARAMETERS] = [1.0, 1.0, 1.0, DEG, DEG, DEG, 1e3];
const DEG: f64 = 180.0 / std::f64::consts::PI;
/// What no number of measurements takes away: meters, degrees, milliseconds, shares.
const MINIMUM: [f64; PARAMETERS] = [0.0005, 0.0005, 0.0005, 0.02, 0.02, 0.02, 0.5];
const MIN_SCALE: f64 = 0.0005;
/// Distances are this large where surfaces are what they are taken for, meters; what they are larger is not
/// noise that more driving takes away, and this share of it may be in the result; a turn has it over so many
/// meters, a delay over so many meters a second.
const NOISE_M: f64 = 0.010;
const SYSTEMATIC: f64 = 0.3;
const ARM_M: f64 = 3.0;
const SWEEP_M_PER_S: f64 = 1.5;
/// A parameter shares a direction that nothing tells when its part is larger.
const PART: f64 = 0.3;

/// What is known and off by more is no refinement of what the rig says, but another place, or observations
/// that do not belong together: meters, radians, seconds.
const FARTHEST: [f64; PARAMETERS] = [0.15, 0.15, 0.15, 0.14, 0.14, 0.14, 0.15];
const TOO_FAR: &str = "farther off than can be refined (15 cm, 8 degrees, 150 ms): look at the rig first";
/// No base counts so wrong, in shares.
const FARTHEST_SCALE: f64 = 0.1;

/// A correction within its standard deviation is left out of the rig.
const AS_IT_WAS: &str = "as the rig has it";

/// What the base's driver has no key for, as a Pioneer has none for turns.
const NO_KEY: &str = "not written: a rig with this base has no key for it";

/// Begins the note of such a row.
const INSEPARABLE: &str = "not told apart from";

const NAMES: [&str; PARAMETERS] = ["x", "y", "z", "about_x", "about_y", "about_z", "delay_ms"];
const UNITS: [&str; PARAMETERS] = ["m", "m", "m", "deg", "deg", "deg", "ms"];

/// One parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Its name: `x`, `y`, `z` of the vertical laser, its turn about the base's axes `about_x` (leans),
    /// `about_y` (nods), `about_z` (looks aside), `delay_ms`; of the odometry `way_scale`, `turn_scale`,
    /// `turn_per_m`.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The rig's value; zero for turns, one for scales.
    pub before: f64,
    /// What was found, less that.
    pub correction: f64,
    /// What was found.
    pub refined: f64,
    /// Its standard deviation; `None` when nothing measured depends on it.
    pub sigma: Option<f64>,
    /// Whether it is known well enough to be changed.
    pub observed: bool,
    /// Whether the corrected rig has it.
    pub written: bool,
    /// Why not, or with what it goes together.
    pub note: String,
}

impl Row {
    /// Whether it shows only together with another one: then its value and its standard deviation hold as far
    /// as the other one's.
    pub fn is_inseparable(&self) -> bool {
        !self.observed && self.note.starts_with(INSEPARABLE)
    }
}

/// How well one kind of agreement fits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// `walls of the horizontal laser`, `surfaces seen again`, `ceilings seen again`, `floor`.
    pub of: &'static str,
    /// How many strips of scans.
    pub strips: usize,
    /// Root mean square of their distances, meters.
    pub rms_m: f64,
}

/// The result.
#[derive(Clone, Debug, Serialize)]
pub struct Calibration {
    /// A row a parameter.
    pub rows: Vec<Row>,
    /// How well it fits.
    pub fits: Vec<Fit>,
    /// Vertical scans looked at.
    pub vertical_scans: usize,
    /// Segments of odometry compared with poses.
    #[serde(rename = "odometry_stretches")]
    pub odometry_segments: usize,
    /// What could not be looked at, and why.
    pub missing: Vec<String>,
    /// The rig as recorded.
    #[serde(skip)]
    pub rig: Rig,
    /// The rig with what was observed put in.
    #[serde(skip)]
    pub corrected: Rig,
}

impl Calibration {
    /// Whether anything was observed.
    pub fn observed(&self) -> bool {
        self.rows.iter().any(|row| row.observed)
    }
}

/// Puts it together.
pub(super) fn of(
    readings: Readings,
    found: Option<(Placement, (Placement, Solution))>,
    scales: Option<Scales>,
) -> Calibration {
    let metres_per_tick = readings.metres_per_tick;
    let mut out = Calibration {
        rows: Vec::new(),
        fits: Vec::new(),
        vertical_scans: readings.vertical_scans,
        odometry_segments: scales.map_or(0, |scales| scales.segments),
        missing: Vec::new(),
        corrected: readings.rig.clone(),
        rig: readings.rig,
    };
    if !readings.flaws.is_empty() {
        out.missing = readings.flaws;
        return out;
    }
    match found {
        Some((start, (at, solution))) => place(&mut out, &start, &at, &solution),
        None if out.rig.vertical.is_none() => out.missing.push("the rig has no vertical laser".to_owned()),
        None => out
            .missing
            .push("the vertical or the horizontal laser saw nothing while the robot moved".to_owned()),
    }
    match scales {
        Some(scales) => odometry(&mut out, &scales, metres_per_tick),
        None => {
            out.missing.push("too little odometry while the robot moved: four meters are needed".to_owned());
        }
    }
    out
}

fn place(out: &mut Calibration, start: &Placement, at: &Placement, solution: &Solution) {
    let laser = out.rig.vertical.as_ref().map(|laser| (laser.mount, laser.delay_ms)).unwrap_or_default();
    let before = [laser.0.x, laser.0.y, laser.0.z, 0.0, 0.0, 0.0, laser.1];
    let step = at.since(start);
    let systematic = systematic(solution);
    let sigma_si = |i: usize| solution.covariance[(i, i)].max(0.0).sqrt();
    let sigma = |i: usize| (sigma_si(i) * PER_UNIT[i]).portable_hypot(systematic[i]);
    // A standard deviation near the prior's is the prior's.
    let reported = |i: usize| sigma_si(i) < 0.7 * PRIOR[i];
    let known = |i: usize| reported(i) && sigma(i) <= OBSERVED[i];
    let is_near = (0..PARAMETERS).all(|i| !known(i) || step[i].abs() <= FARTHEST[i]);
    let mut kept = Step::zeros();
    for i in 0..PARAMETERS {
        let (sigma, reported, observed) = (sigma(i), reported(i), is_near && known(i));
        let moved = step[i].abs() * PER_UNIT[i] > sigma;
        kept[i] = if observed && moved { step[i] } else { 0.0 };
        let correction = if reported { step[i] * PER_UNIT[i] } else { 0.0 };
        out.rows.push(Row {
            name: NAMES[i],
            unit: UNITS[i],
            before: before[i],
            correction,
            refined: before[i] + correction,
            sigma: reported.then_some(sigma),
            observed,
            written: observed && moved,
            note: match (observed, moved) {
                (true, true) => String::new(),
                (true, false) => AS_IT_WAS.to_owned(),
                (false, _) if !is_near => TOO_FAR.to_owned(),
                (false, _) => partners(solution, i),
            },
        });
    }
    corrected::with_placement(&mut out.corrected, start, &kept, &std::array::from_fn(sigma));
    let of = ["walls of the horizontal laser", "surfaces seen again", "ceilings seen again", "floor"];
    out.fits = std::array::from_fn::<Fit, 4, _>(|i| Fit {
        of: of[i],
        strips: solution.fits[i].1,
        rms_m: solution.fits[i].0,
    })
    .to_vec();
}

/// What is in the result whatever the number of measurements: ranges are good to a millimeter or so, and
/// surfaces are not quite what they are taken for.
fn systematic(solution: &Solution) -> [f64; PARAMETERS] {
    let excess = |fits: &[(f64, usize)]| {
        let rms_m = fits.iter().map(|(rms_m, _)| *rms_m).fold(0.0, f64::max);
        SYSTEMATIC * (rms_m * rms_m - NOISE_M * NOISE_M).max(0.0).sqrt()
    };
    // Walls say nothing of the height.
    let (walls_m, floor_m) = (excess(&solution.fits[..2]), excess(&solution.fits[3..]));
    let turn_deg = (walls_m / ARM_M).to_degrees();
    let parts = [walls_m, walls_m, floor_m, turn_deg, turn_deg, turn_deg, walls_m / SWEEP_M_PER_S * 1e3];
    std::array::from_fn(|i| MINIMUM[i].portable_hypot(parts[i]))
}

/// With which others a parameter moves unseen: the worst known direction in which it has a part.
fn partners(solution: &Solution, parameter: usize) -> String {
    let units: [f64; PARAMETERS] = std::array::from_fn(|i| OBSERVED[i] / PER_UNIT[i]);
    let directions = directions(&solution.covariance, &units);
    let Some((_, direction)) =
        directions.iter().find(|(sigma, direction)| *sigma > 1.0 && direction[parameter].abs() > PART)
    else {
        return "surfaces and poses disagree too much".to_owned();
    };
    let others: Vec<&str> =
        (0..PARAMETERS).filter(|&i| i != parameter && direction[i].abs() > PART).map(|i| NAMES[i]).collect();
    if others.is_empty() {
        "the drive does not tell".to_owned()
    } else {
        format!("{INSEPARABLE} {}", others.join(", "))
    }
}

fn odometry(out: &mut Calibration, scales: &Scales, metres_per_tick: Option<f64>) {
    let row = |name, unit, before: f64, known: Known, minimum: f64, largest: f64| {
        let sigma = known.sigma.portable_hypot(minimum);
        let reported = sigma < UNTOLD;
        let is_near = before == 0.0 || (known.value - before).abs() <= FARTHEST_SCALE;
        let observed = is_near && sigma <= largest;
        let note = match (observed, is_near) {
            (true, _) => "",
            (false, true) => "too little of it in the drive",
            (false, false) => "no base counts so wrong: look at the rig first",
        };
        Row {
            name,
            unit,
            before,
            correction: if reported { known.value - before } else { 0.0 },
            refined: if reported { known.value } else { before },
            sigma: reported.then_some(sigma),
            observed,
            written: false,
            note: note.to_owned(),
        }
    };
    let mut rows = [
        row("way_scale", "", 1.0, scales.way, MIN_SCALE, OBSERVED_SCALE),
        row("turn_scale", "", 1.0, scales.turn, MIN_SCALE, OBSERVED_SCALE),
        row("turn_per_m", "rad/m", 0.0, scales.drift_rad_per_m, 0.0, OBSERVED_DRIFT_RAD_PER_M),
    ];
    let sigma = |row: &Row| row.sigma.filter(|_| row.observed);
    let observed = Observed { way: sigma(&rows[0]), turn: sigma(&rows[1]), drift: sigma(&rows[2]) };
    if observed.way.is_some() {
        // What the base itself has said stands in both rigs, so that the correction can be seen.
        corrected::with_ticks(&mut out.rig, metres_per_tick);
        corrected::with_ticks(&mut out.corrected, metres_per_tick);
    }
    let takes = corrected::with_scales(&mut out.corrected, scales, observed);
    for (row, takes) in rows.iter_mut().zip(takes) {
        row.written = row.observed && takes;
        if row.observed && !takes {
            let by_hand = (row.name == "way_scale")
                .then(|| corrected::way_by_hand(&out.rig, row.refined, row.sigma.unwrap_or_default()));
            row.note = by_hand.flatten().unwrap_or_else(|| NO_KEY.to_owned());
        }
    }
    out.rows.extend(rows);
}
