//! `biplane import bag`: bags of ROS 1 and ROS 2.

use std::path::PathBuf;

use biplane_recording::WriterOptions;
use biplane_recording::mcap::write::active_path;
use biplane_recording::rig::Mount;
use clap::error::ErrorKind;

use crate::cli::args::refuse;
use crate::cli::terminal::console::{Console, say};
use crate::cli::terminal::json::print_json;
use crate::formats::output::unfinished::Unfinished;
use crate::formats::output::{check_free, check_not_input};
use crate::recordings::import::bag;
use crate::recordings::import::bag::{
    BagError, BagOptions, BagReport, Echo, LaserOptions, Stamps, TopicChoice, parse_mount,
};
use biplane_cli::{Outcome, counted};

const US_PER_S: f64 = 1e6;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane import bag drive.bag -o drive.mcap\n  \
    biplane import bag first.bag second.bag -o drive.mcap")]
pub(super) struct Args {
    /// The bags of one drive
    #[arg(required = true)]
    bags: Vec<PathBuf>,
    /// The recording to write
    #[arg(long, short, value_name = "FILE.mcap")]
    output: PathBuf,
    /// Replace the output if it exists
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    horizontal: HorizontalArgs,
    #[command(flatten)]
    vertical: VerticalArgs,
    /// Odometry: a topic of nav_msgs/Odometry, `/tf`, or `none`
    #[arg(long, value_name = "TOPIC")]
    odom: Option<TopicChoice>,
    /// Inertial unit: a topic of sensor_msgs/Imu, or `none`
    #[arg(long, value_name = "TOPIC")]
    imu: Option<TopicChoice>,
    /// The frame that becomes base_link [default: base_footprint, or the odometry's, or base_link]
    #[arg(long, value_name = "FRAME")]
    base_frame: Option<String>,
    /// Which echo of a beam that came back several times: first, last or strongest
    #[arg(long, value_name = "ECHO", default_value = "first")]
    echo: Echo,
    /// Stamps of the messages' headers, or of their receipt: header or receipt
    #[arg(long, value_name = "WHICH", default_value = "header")]
    stamps: Stamps,
}

/// Of the laser that localizes.
#[derive(Debug, clap::Args)]
struct HorizontalArgs {
    /// Scans of the laser that localizes; TOPIC@FRAME where several lasers share a topic
    #[arg(long, value_name = "TOPIC")]
    horizontal: Option<TopicChoice>,
    /// Where the horizontal laser sits, in m and degrees (yaw, then pitch, then roll)
    #[arg(long, value_name = "X,Y,Z,ROLL,PITCH,YAW", value_parser = parse_mount, allow_hyphen_values = true)]
    mount_horizontal: Option<Mount>,
    /// Time from a beam to the next of the horizontal laser, microseconds; 0: all beams at once
    #[arg(long, value_name = "US", value_parser = microseconds)]
    time_increment_us: Option<f64>,
    /// Added to the horizontal laser's stamps, milliseconds: a stamp should be the first beam's
    #[arg(long, value_name = "MS", default_value_t, value_parser = milliseconds, allow_hyphen_values = true)]
    delay_ms: f64,
}

/// Of the laser that sees the building.
#[derive(Debug, clap::Args)]
struct VerticalArgs {
    /// Scans of the laser that sees the building, or `none`
    #[arg(long, value_name = "TOPIC")]
    vertical: Option<TopicChoice>,
    /// Where the vertical laser sits, in m and degrees (yaw, then pitch, then roll)
    #[arg(long, value_name = "X,Y,Z,ROLL,PITCH,YAW", value_parser = parse_mount, allow_hyphen_values = true)]
    mount_vertical: Option<Mount>,
    /// Time from a beam to the next of the vertical laser, microseconds; 0: all beams at once
    #[arg(long, value_name = "US", value_parser = microseconds)]
    vertical_time_increment_us: Option<f64>,
    /// Added to the vertical laser's stamps, milliseconds
    #[arg(long, value_name = "MS", default_value_t, value_parser = milliseconds, allow_hyphen_values = true)]
    vertical_delay_ms: f64,
}

fn microseconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (0.0..=1e5).contains(number));
    number.ok_or_else(|| format!("expected a number from 0 to 100000, found {text:?}"))
}

fn milliseconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (-1e6..=1e6).contains(number));
    number.ok_or_else(|| format!("expected a number from -1000000 to 1000000, found {text:?}"))
}

impl Args {
    fn options(&self) -> BagOptions {
        let laser = |topic: &Option<TopicChoice>, mount, delay_ms, increment_us: Option<f64>| LaserOptions {
            topic: topic.clone().unwrap_or_default(),
            mount,
            delay_ms,
            time_increment_s: increment_us.map(|time_us| time_us / US_PER_S),
        };
        let (h, v) = (&self.horizontal, &self.vertical);
        BagOptions {
            horizontal: laser(&h.horizontal, h.mount_horizontal, h.delay_ms, h.time_increment_us),
            vertical: laser(&v.vertical, v.mount_vertical, v.vertical_delay_ms, v.vertical_time_increment_us),
            odometry: self.odom.clone().unwrap_or_default(),
            imu: self.imu.clone().unwrap_or_default(),
            base_frame: self.base_frame.clone(),
            echo: self.echo,
            stamps: self.stamps,
            writer: WriterOptions {
                overwrite: self.force,
                inputs: self.bags.clone(),
                ..WriterOptions::default()
            },
        }
    }
}

/// Runs the command.
pub(super) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    for bag in &args.bags {
        check_not_input(&args.output, ".active", bag)?;
    }
    check_free(&args.output, args.force)?;
    let spinner = console.spinner(format!("reading {}", args.bags[0].display()));
    let begun = active_path(&args.output);
    let _begun = (!begun.exists()).then(|| Unfinished::new(&begun));
    let imported = bag::import(&args.bags, &args.output, &args.options());
    drop(spinner);
    match imported {
        Ok(report) => print_result(&report, args, console),
        Err(BagError::Choice(why)) => refuse("import bag", ErrorKind::InvalidValue, why),
        Err(error) => Err(error.into()),
    }
}

fn print_result(report: &BagReport, args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let losses = &report.losses;
    let outcome = if losses.count == 0 { Outcome::Done } else { Outcome::Lossy };
    if args.json {
        print_json(report)?;
        return Ok(outcome);
    }
    for loss in &losses.first {
        say(&format!("biplane: {loss}"));
    }
    if losses.count > losses.first.len() {
        say(&format!("biplane: {} places in all that could not be read", losses.count));
    }
    for note in &report.notes {
        console.note(note);
    }
    for (topic, (type_name, count)) in &report.others {
        console.note(format!("{topic}: {count} {type_name} are not taken"));
    }
    let odd = [
        (report.duplicates, "messages that came twice"),
        (report.unusable_scans, "scans without beams"),
        (report.unusable_poses, "poses or transforms that are no numbers"),
        (report.backward_stamps, "stamps that step back"),
    ];
    for (count, what) in odd.into_iter().filter(|(count, _)| *count > 0) {
        console.note(format!("{count} {what}"));
    }
    let duration_s = report.stamps_ns.map_or(0.0, |[first_ns, last_ns]| (last_ns - first_ns) as f64 / 1e9);
    let [horizontal, vertical] = report.scans;
    console.note(format!(
        "{}: {} horizontal and {} in {duration_s:.1} s, {}, {} of an inertial unit",
        args.output.display(),
        horizontal,
        counted(vertical, "vertical scan"),
        counted(report.odometry, "odometry message"),
        report.imu
    ));
    Ok(outcome)
}
