//! Bags of ROS 1 and ROS 2 as unposed recordings: scans of one or two lasers, odometry, an inertial unit.
//!
//! The bags are read twice: once to learn what they hold ([`survey`](mod@survey)) and to decide what is taken
//! as what ([`plan`](mod@plan)), once to write. Stamps are those of the messages' headers; messages are
//! written in their order.

mod container;
mod convert;
mod error;
mod frames;
mod messages;
mod options;
mod plan;
mod reorder;
mod report;
mod survey;

pub use container::Losses;
pub use error::BagError;
pub use options::{BagOptions, Echo, LaserOptions, Stamps, TopicChoice, parse_mount};
pub use report::BagReport;

use std::path::{Path, PathBuf};

use biplane_recording::mcap::read::RIG_ASSUMED;
use biplane_recording::rig::{InertialUnit, Laser, Mount};
use biplane_recording::{Reader, Rig, Writer};

use self::container::{BagFile, files_of};
use self::convert::Conversion;
use self::messages::scans::stated_increment_s;
use self::plan::{LaserPlan, Plan};
use self::survey::{LaserSeen, Survey};

/// So long, by receipt, one bag may go on when the next has begun, ns.
const OVERLAP_NS: i64 = 1_000_000_000;
/// Topics that are named where no scan was found.
const TOPICS_NAMED: usize = 12;
/// Settings of an LMS 2xx, in degrees: field of view and resolution.
const LMS_SETTINGS: [(u16, f64); 6] =
    [(180, 1.0), (180, 0.5), (100, 1.0), (100, 0.5), (100, 0.25), (90, 0.5)];

/// A bag: its files, and when its first and last messages were received, ns.
struct Bag {
    path: PathBuf,
    files: Vec<BagFile>,
    span_ns: [i64; 2],
}

/// Imports bags of one drive into a new recording.
///
/// # Errors
/// When a bag cannot be read or holds no scan, when more than one choice makes sense
/// ([`BagError::Choice`]), and when the recording cannot be written. Files that are damaged are read as far
/// as they go: what is lost stands in the report.
pub fn import(paths: &[PathBuf], output: &Path, options: &BagOptions) -> Result<BagReport, BagError> {
    let spool = match output.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let (mut survey, mut losses, mut notes) = (Survey::default(), Losses::default(), Vec::new());
    for path in paths.iter().filter(|path| is_ours(path)) {
        survey.is_ours = true;
        notes.push(format!(
            "{} is a recording of Biplane already: every command takes it as it is; its poses are not imported",
            path.display()
        ));
    }
    let bags = open(paths, spool, &mut survey, &mut losses, &mut notes)?;
    if survey.lasers.values().all(|laser| laser.scans == 0) {
        let path = paths.first().map_or(output, PathBuf::as_path).to_owned();
        return Err(BagError::NoScans { path, found: holdings(&survey, &losses) });
    }
    let plan = plan::plan(&survey, options)?;
    let mut writer = Writer::create(output, &options.writer)?;
    describe(&mut writer, &bags, &plan, &survey, options)?;
    let mut conversion = Conversion::new(writer, &plan, options);
    for file in bags.iter().flat_map(|bag| &bag.files) {
        conversion.read(file, spool)?;
    }
    let mut report = conversion.finish()?;
    notes.extend(remarks(&plan, &survey, options));
    report.notes = notes;
    report.losses = losses;
    report.unusable_poses += survey.frames.refused;
    let others = survey.others.into_iter().map(|(topic, seen)| (topic, (seen.type_name, seen.count)));
    report.others = others.collect();
    Ok(report)
}

/// Whether Biplane wrote a file. One that cannot be read as a recording is some bag.
fn is_ours(path: &Path) -> bool {
    Reader::open(path).and_then(|reader| reader.metadata()).is_ok_and(|words| words.contains_key("biplane"))
}

/// Opens and surveys all bags, and puts them in the order of their beginnings.
fn open(
    paths: &[PathBuf],
    spool: &Path,
    survey: &mut Survey,
    losses: &mut Losses,
    notes: &mut Vec<String>,
) -> Result<Vec<Bag>, BagError> {
    let mut bags = Vec::new();
    for path in paths {
        let files = files_of(path, losses)?;
        let span = survey::survey(&files, spool, losses, survey)?;
        // A bag without messages stands nowhere in time.
        if let Some(span_ns) = span {
            bags.push(Bag { path: path.clone(), files, span_ns });
        }
    }
    if !bags.is_sorted_by_key(|bag| bag.span_ns[0]) {
        bags.sort_by_key(|bag| bag.span_ns[0]);
        notes.push("the bags were taken in the order of their beginnings, not as given".to_owned());
    }
    for pair in bags.windows(2) {
        let overlap_ns = pair[0].span_ns[1].saturating_sub(pair[1].span_ns[0]);
        if overlap_ns > OVERLAP_NS {
            return Err(BagError::Overlap {
                first: pair[0].path.clone(),
                second: pair[1].path.clone(),
                overlap_s: overlap_ns as f64 / 1e9,
            });
        }
    }
    Ok(bags)
}

/// What bags without a scan hold, for an error.
fn holdings(survey: &Survey, losses: &Losses) -> String {
    let mut words: Vec<String> = survey
        .lasers
        .values()
        .map(|laser| format!("{} scans without beams on {}", laser.empty + laser.odd, laser.topic))
        .collect();
    words.extend(survey.others.iter().take(TOPICS_NAMED).map(|(topic, seen)| match &seen.refused {
        Some(why) => format!("{} {} on {topic} ({why})", seen.count, seen.type_name),
        None => format!("{} {} on {topic}", seen.count, seen.type_name),
    }));
    words.extend(survey.odometry.values().map(|seen| format!("{} odometry on {}", seen.count, seen.topic)));
    let found = match words.is_empty() {
        true => "there is no message".to_owned(),
        false => format!("there are {}", words.join(", ")),
    };
    match losses.first.first() {
        Some(loss) => format!("{found} ({loss})"),
        None => found,
    }
}

fn seen_of<'a>(laser: &LaserPlan, survey: &'a Survey) -> Option<&'a LaserSeen> {
    survey.lasers.get(&(laser.topic.clone(), laser.frame.clone()))
}

/// What a person should know of the choices that were made.
fn remarks(plan: &Plan, survey: &Survey, options: &BagOptions) -> Vec<String> {
    let mut notes = plan.notes.clone();
    for laser in std::iter::once(&plan.horizontal).chain(&plan.vertical) {
        let Some(seen) = seen_of(laser, survey) else { continue };
        if let Some(several) = seen.several_echoes {
            let text = format!(
                "{}: the {} echo of each beam is taken ({several} beams had several; --echo first, last or strongest)",
                seen.topic, options.echo
            );
            notes.push(text);
        }
        if let Some((lms, true)) = lms_of(laser, seen).map(|lms| (lms.clone(), lms.turns() > 1)) {
            let [fov, resolution] = [f64::from(lms.fov_deg), lms.resolution_deg];
            notes.push(format!(
                "{}: scans as an LMS 2xx makes them at {fov} degrees by {resolution}: {} turns of its mirror, interlaced",
                seen.topic,
                lms.turns()
            ));
        }
    }
    notes
}

/// The settings of an LMS 2xx whose scans look so, to the time of each beam.
fn lms_of(laser: &LaserPlan, seen: &LaserSeen) -> Option<Laser> {
    let first = seen.first.as_ref()?;
    let stated_s = laser.times.map(|times| times.time_increment_s).or(stated_increment_s(first))?;
    let step_deg = f64::from(first.angle_increment_rad).to_degrees();
    let settings = LMS_SETTINGS.into_iter().map(|(fov_deg, resolution_deg)| Laser {
        fov_deg,
        resolution_deg,
        mount: laser.mount,
        ..Laser::horizontal()
    });
    let is_like = |lms: &Laser| {
        lms.beam_count() == laser.beams
            && (step_deg - lms.resolution_deg).abs() < 1e-3
            && (f64::from(stated_s) - lms.time_increment_s()).abs() < 1e-7
    };
    settings.into_iter().find(is_like)
}

/// The rig as far as it is known: mounts, and settings where they are those of an LMS 2xx.
fn rig(plan: &Plan, survey: &Survey) -> Rig {
    let laser = |laser: &LaserPlan, template: Laser| {
        let seen = seen_of(laser, survey);
        match seen.and_then(|seen| lms_of(laser, seen)) {
            Some(lms) => Laser { port: template.port, ..lms },
            None => Laser { mount: laser.mount, ..template },
        }
    };
    Rig {
        horizontal: laser(&plan.horizontal, Laser::horizontal()),
        vertical: plan.vertical.as_ref().map(|vertical| laser(vertical, Laser::vertical())),
        imu: imu(plan),
        ..Rig::default()
    }
}

/// Where the inertial unit sits, if that is known and not in the base itself.
fn imu(plan: &Plan) -> Option<InertialUnit> {
    let mount = plan.imu.as_ref()?.1.filter(|mount| *mount != Mount::default())?;
    Some(InertialUnit { mount, ..InertialUnit::default() })
}

fn describe(
    writer: &mut Writer,
    bags: &[Bag],
    plan: &Plan,
    survey: &Survey,
    options: &BagOptions,
) -> Result<(), BagError> {
    writer.attach("rig.toml", "application/toml", rig(plan, survey).to_toml().as_bytes())?;
    let name = |bag: &Bag| bag.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let names: Vec<String> = bags.iter().map(name).collect();
    let topic = |laser: &LaserPlan| format!("{} ({})", laser.topic, laser.frame);
    let values = [
        ("program", format!("biplane {}", env!("CARGO_PKG_VERSION"))),
        ("source", format!("ROS bag {}", names.join(", "))),
        ("horizontal", topic(&plan.horizontal)),
        ("vertical", plan.vertical.as_ref().map_or_else(|| "none".to_owned(), topic)),
        ("echo", options.echo.to_string()),
        (
            RIG_ASSUMED,
            "mounts are from the bag or from flags; ports, rates and the base are assumed".to_owned(),
        ),
    ];
    writer.metadata("biplane", &values.map(|(key, value)| (key.to_owned(), value)).into())?;
    Ok(())
}
