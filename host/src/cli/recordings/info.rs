//! `biplane info`: what a file or a model's folder holds, as a table or as JSON.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::{health, model_info, poses, rig_text};
use crate::recordings::info;
use crate::recordings::info::{FileInfo, TopicInfo};
use crate::recordings::stamp_text::format_seconds;

use biplane_cli::{Outcome, counted, paragraph};
use biplane_clock::iso_8601;
use biplane_recording::mcap::read::RIG_ASSUMED;

/// Letters of a line beside its indentation: it then fits into a terminal of 80 columns.
const WIDTH: usize = 78;

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  biplane info office.mcap\n  biplane info run_0.mcap run_1.mcap --json\n  biplane info model        the rooms, doors and windows of a model"
)]
pub(crate) struct Args {
    /// A recording or capture; of one in parts all of them, in any order, or its name without the number.
    /// Or a folder that `biplane build` wrote
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let mut out = io::stdout().lock();
    if let [folder] = &args.files[..]
        && folder.is_dir()
    {
        model_info::print(&mut out, folder, args.json)?;
        return Ok(Outcome::Done);
    }
    if let [file] = &args.files[..] {
        check_file(file)?;
    }
    let info = info::read(&args.files)?;
    if args.json {
        serde_json::to_writer_pretty(&mut out, &info).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        print(&mut out, &info)?;
    }
    Ok(Outcome::Done)
}

/// Says of a file that is no recording what it is, and which command says more of it.
fn check_file(file: &Path) -> anyhow::Result<()> {
    let folder = file.parent().filter(|folder| folder.join(model_info::LIST).exists());
    let expected = match folder {
        Some(folder) => format!("`biplane info {}` lists the rooms of that model", folder.display()),
        None => "expected a recording or capture (MCAP), or a folder that `biplane build` wrote".to_owned(),
    };
    poses::check_recording(file, &expected)
}

fn print(out: &mut impl Write, info: &FileInfo) -> io::Result<()> {
    match &info.of_parts.parts[..] {
        [first, .., last] => writeln!(out, "{first} to {last}: {} parts", info.of_parts.parts.len())?,
        _ => writeln!(out, "{}", info.file)?,
    }
    for number in &info.of_parts.parts_missing {
        writeln!(out, "  part {number} is not among them")?;
    }
    for part in &info.of_parts.parts_unfinished {
        writeln!(out, "  {part} is not finished, and not among them (`biplane-onboard salvage`)")?;
    }
    writeln!(
        out,
        "  {}, profile {}, written by {}",
        counted(info.bytes, "byte"),
        info.profile,
        info.library
    )?;
    writeln!(out, "  {} in {:.3} s", counted(info.messages, "message"), info.duration_s)?;
    writeln!(out, "  from {}", time(info.start_ns))?;
    writeln!(out, "    to {}", time(info.end_ns))?;
    print_topics(out, &info.topics)?;
    health::print(out, &info.health)?;
    for (name, values) in &info.metadata {
        writeln!(out, "  metadata {name}")?;
        let others = values.iter().filter(|(key, _)| key.as_str() != RIG_ASSUMED);
        others.into_iter().try_for_each(|(key, value)| writeln!(out, "    {key} = {value}"))?;
    }
    if !info.attachments.is_empty() {
        writeln!(out, "  attachments: {}", info.attachments.join(", "))?;
    }
    match &info.rig {
        Some(rig) => {
            let assumed = info.metadata.get("biplane").and_then(|words| words.get(RIG_ASSUMED));
            match assumed {
                Some(assumed) => {
                    let heading = paragraph(&format!("rig ({assumed}):"), WIDTH, "  ");
                    out.write_all(heading.as_bytes())?;
                }
                None => writeln!(out, "  rig:")?,
            }
            rig_text::print(out, rig)
        }
        None => writeln!(out, "  no rig"),
    }
}

/// 1 January 1990. Earlier stamps count from the start of some clock, and are no dates.
const FIRST_DATE_NS: i64 = 631_152_000_000_000_000;

/// A stamp as a date where it can be one, and as seconds.
fn time(stamp_ns: i64) -> String {
    let seconds = format_seconds(stamp_ns);
    if stamp_ns < FIRST_DATE_NS {
        return format!("{seconds} s");
    }
    let date = iso_8601(stamp_ns);
    // Milliseconds: the seconds beside them have all digits.
    let to_milliseconds = date.get(..23).unwrap_or(&date).replace('T', " ");
    format!("{to_milliseconds} UTC ({seconds} s)")
}

/// Longer names stand out of their columns; other people's files may have names of any length.
const MAX_COLUMN: usize = 60;

fn print_topics(out: &mut impl Write, topics: &[TopicInfo]) -> io::Result<()> {
    let width = |text: fn(&TopicInfo) -> &str, minimum: usize| {
        topics.iter().map(|topic| text(topic).len()).max().unwrap_or(0).clamp(minimum, MAX_COLUMN)
    };
    let name = width(|topic| &topic.name, 5);
    let kind = width(short_type, 4);
    writeln!(
        out,
        "  {:name$}  {:kind$} {:>8} {:>7} {:>6} {:>9}",
        "topic", "type", "messages", "Hz", "gaps", "longest"
    )?;
    for topic in topics {
        // Bytes come as a port is read: what lies between two reads is no gap.
        let pauses = match topic.serial_bytes {
            Some(_) => format!("{:>6} {:>9}", "-", "-"),
            None => format!("{:>6} {:>7.3} s", topic.gaps, topic.longest_interval_s),
        };
        writeln!(
            out,
            "  {:name$}  {:kind$} {:>8} {:>7.2} {pauses}",
            topic.name,
            short_type(topic),
            topic.messages,
            topic.rate_hz
        )?;
        let odd = odd_figures(topic);
        if !odd.is_empty() {
            writeln!(out, "      {}", odd.join(", "))?;
        }
    }
    Ok(())
}

/// The type without its package: `LaserScan` of `sensor_msgs/msg/LaserScan`.
fn short_type(topic: &TopicInfo) -> &str {
    topic.type_name.rsplit('/').next().unwrap_or_default()
}

/// What most topics do not have.
fn odd_figures(topic: &TopicInfo) -> Vec<String> {
    let mut words = Vec::new();
    if topic.backward_stamps > 0 {
        words.push(format!("stamps step back {}", counted(topic.backward_stamps, "time")));
    }
    if topic.missing > 0 {
        words.push(format!("{} missing", topic.missing));
    }
    words.extend(topic.serial_bytes.map(|bytes| format!("{} on the line", counted(bytes, "byte"))));
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scans() -> TopicInfo {
        TopicInfo {
            name: "/scan/horizontal".to_owned(),
            type_name: "sensor_msgs/msg/LaserScan".to_owned(),
            messages: 1,
            bytes: 1,
            serial_bytes: None,
            first_ns: 0,
            last_ns: 0,
            rate_hz: 0.0,
            gaps: 7,
            longest_interval_s: 1.399,
            backward_stamps: 0,
            missing: 0,
        }
    }

    #[test]
    fn a_topic_of_any_length_is_printed() {
        let topic = TopicInfo { name: "x".repeat(70_000), type_name: "t".repeat(70_000), ..scans() };
        let mut out = Vec::new();
        print_topics(&mut out, &[topic]).unwrap();
        assert_eq!(String::from_utf8(out).unwrap().matches('x').count(), 70_000);
    }

    #[test]
    fn bytes_of_a_line_have_no_gaps() {
        let topic = TopicInfo { serial_bytes: Some(5), ..scans() };
        let mut out = Vec::new();
        print_topics(&mut out, &[topic, scans()]).unwrap();
        let text = String::from_utf8(out).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert!(lines[1].ends_with("      -         -") && lines[3].ends_with(" 7   1.399 s"), "{text}");
    }

    #[test]
    fn stamps_are_dates_where_they_can_be() {
        // From `date -u -d @976052857` of GNU coreutils.
        assert_eq!(time(976_052_857_337_532_000), "2000-12-05 21:47:37.337 UTC (976052857.337532000 s)");
        assert_eq!(time(70_289_900_000), "70.289900000 s");
    }

    #[test]
    fn a_table_of_our_own_topics_fits_into_80_columns() {
        let topic = |name: &str, type_name: &str| TopicInfo {
            name: name.to_owned(),
            type_name: type_name.to_owned(),
            messages: 1_234_567,
            bytes: 1,
            serial_bytes: Some(123_456_789),
            first_ns: 0,
            last_ns: 0,
            rate_hz: 75.0,
            gaps: 4045,
            longest_interval_s: 123.456,
            backward_stamps: 1251,
            missing: 3,
        };
        let pose = topic("/pose_incremental", "geometry_msgs/msg/PoseWithCovarianceStamped");
        let mut out = Vec::new();
        print_topics(&mut out, &[pose, topic("/scan/horizontal", "sensor_msgs/msg/LaserScan")]).unwrap();
        let text = String::from_utf8(out).unwrap();
        assert!(text.lines().all(|line| line.len() <= 80), "{text}");
        assert!(
            text.contains("stamps step back 1251 times, 3 missing, 123456789 bytes on the line"),
            "{text}"
        );
    }
}
