//! `biplane info`: what a file holds, as a table or as JSON.

use std::io::{self, Write};
use std::path::PathBuf;

use crate::recordings::info;
use crate::recordings::info::{FileInfo, TopicInfo};
use crate::recordings::stamp_text::format_seconds;

use biplane_cli::Outcome;

/// Words of the command.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// A recording or capture; of one in parts all of them, in any order, or its name without the number
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let info = info::read(&args.files)?;
    let mut out = io::stdout().lock();
    if args.json {
        serde_json::to_writer_pretty(&mut out, &info).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        print(&mut out, &info)?;
    }
    Ok(Outcome::Done)
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
    writeln!(out, "  {} bytes, profile {}, written by {}", info.bytes, info.profile, info.library)?;
    writeln!(
        out,
        "  {} messages in {:.3} s, {} to {}",
        info.messages,
        info.duration_s,
        format_seconds(info.start_ns),
        format_seconds(info.end_ns)
    )?;
    print_topics(out, &info.topics)?;
    for health in &info.health {
        let values: Vec<String> = health.values.iter().map(|(key, value)| format!("{key} {value}")).collect();
        writeln!(out, "  health of {}: {} ({})", health.name, health.message, values.join(", "))?;
    }
    for (name, values) in &info.metadata {
        let values: Vec<String> = values.iter().map(|(key, value)| format!("{key} = {value}")).collect();
        writeln!(out, "  metadata {name}: {}", values.join("; "))?;
    }
    if !info.attachments.is_empty() {
        writeln!(out, "  attachments: {}", info.attachments.join(", "))?;
    }
    match &info.rig {
        Some(rig) => {
            writeln!(out, "  rig:")?;
            rig.lines()
                .filter(|line| !line.trim().is_empty())
                .try_for_each(|line| writeln!(out, "    {line}"))
        }
        None => writeln!(out, "  no rig"),
    }
}

/// A longer name stands out of its column; other people's files may have names of any length.
const MAX_COLUMN: usize = 60;

fn print_topics(out: &mut impl Write, topics: &[TopicInfo]) -> io::Result<()> {
    let width = |text: fn(&TopicInfo) -> &str, minimum: usize| {
        topics.iter().map(|topic| text(topic).len()).max().unwrap_or(0).clamp(minimum, MAX_COLUMN)
    };
    let name = width(|topic| &topic.name, 5);
    let kind = width(|topic| &topic.type_name, 4);
    writeln!(
        out,
        "  {:name$}  {:kind$}  {:>9}  {:>8}  {:>5}  {:>9}  {:>8}  {:>7}  {:>12}",
        "topic", "type", "messages", "rate", "gaps", "longest", "backward", "missing", "line"
    )?;
    for topic in topics {
        let serial = topic.serial_bytes.map(|bytes| format!("{bytes} bytes")).unwrap_or_default();
        writeln!(
            out,
            "  {:name$}  {:kind$}  {:>9}  {:>5.2} Hz  {:>5}  {:>7.3} s  {:>8}  {:>7}  {serial:>12}",
            topic.name,
            topic.type_name,
            topic.messages,
            topic.rate_hz,
            topic.gaps,
            topic.longest_interval_s,
            topic.backward_stamps,
            topic.missing
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_of_any_length_is_printed() {
        let topic = TopicInfo {
            name: "x".repeat(70_000),
            type_name: "t".repeat(70_000),
            messages: 1,
            bytes: 1,
            serial_bytes: None,
            first_ns: 0,
            last_ns: 0,
            rate_hz: 0.0,
            gaps: 0,
            longest_interval_s: 0.0,
            backward_stamps: 0,
            missing: 0,
        };
        let mut out = Vec::new();
        print_topics(&mut out, &[topic]).unwrap();
        assert_eq!(String::from_utf8(out).unwrap().matches('x').count(), 70_000);
    }
}
