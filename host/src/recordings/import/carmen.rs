//! CARMEN logs: the front laser's scans and the odometry, with their own stamps, in file order.
//!
//! The file is read twice: once to learn what it holds (kinds of lines, the "no return" value), once to
//! write. Stamps are the lines' own (ipc_stamp), unchanged, also where they step back; `log_time` is their
//! running maximum.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use biplane_recording::file_kind::{KIND_BYTES, describe};
use biplane_recording::mcap::read::RIG_ASSUMED;
use biplane_recording::{Rig, Topic, WriteError, Writer, WriterOptions};

use super::carmen_line::{LaserKind, LaserLine, Line, LineError, OdometryLine, parse_line};
use super::carmen_messages as messages;
use super::log_lines::{LogLine, LogLines};
use super::no_return::RangeCounts;

/// So many broken lines are kept with their reasons; the others are counted.
const BROKEN_KEPT: usize = 20;

/// Why a log was not imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The log cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The log.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Nothing to import.
    #[error(
        "{} holds no laser line (FLASER, ROBOTLASER1 or RAWLASER1) in {lines} line{}{}: it {}",
        path.display(), if *.lines == 1 { "" } else { "s" }, first_broken(.broken), describe(.start)
    )]
    NoScans {
        /// The log.
        path: PathBuf,
        /// How many lines it has.
        lines: usize,
        /// The first line that could not be read.
        broken: Option<BrokenLine>,
        /// How it begins.
        start: Vec<u8>,
    },
    /// The recording cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

fn start_of(log: &Path) -> io::Result<Vec<u8>> {
    let mut start = Vec::new();
    File::open(log)?.take(KIND_BYTES).read_to_end(&mut start)?;
    Ok(start)
}

fn first_broken(broken: &Option<BrokenLine>) -> String {
    broken.as_ref().map(|line| format!(" (line {}: {})", line.number, line.reason)).unwrap_or_default()
}

/// A line that does not hold what its kind should.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct BrokenLine {
    /// Line number from 1.
    pub number: usize,
    /// What is wrong with it.
    pub reason: String,
}

/// What an import did.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct ImportReport {
    /// Scans written.
    pub scans: usize,
    /// Odometry messages written.
    pub odometry: usize,
    /// Number of beams and how many scans have it.
    pub beams: BTreeMap<usize, usize>,
    /// Scans whose stamp lies before the scan before.
    pub backward_stamps: usize,
    /// First and last scan's stamp.
    pub stamps_ns: Option<[i64; 2]>,
    /// From this range on nothing came back, meters; `None` when every range looks measured.
    pub no_return_m: Option<f64>,
    /// Lines with data that were lost: how many.
    pub broken_lines: usize,
    /// The first of them.
    pub broken: Vec<BrokenLine>,
    /// Lines of kinds that are not taken, by kind.
    pub others: BTreeMap<String, usize>,
}

/// What the first reading learns.
#[derive(Default)]
struct Survey {
    lines: usize,
    ranges: BTreeMap<LaserKind, RangeCounts>,
    first: BTreeMap<LaserKind, LaserLine>,
    has_odometry: bool,
    first_broken: Option<BrokenLine>,
}

/// Imports a log into a new recording.
///
/// # Errors
/// When the log cannot be read or holds no scan, and when the recording cannot be written. Broken lines are
/// no error: they are in the report.
pub fn import(log: &Path, output: &Path, options: &WriterOptions) -> Result<ImportReport, ImportError> {
    let unreadable = |source| ImportError::Read { path: log.to_owned(), source };
    let survey = survey(log).map_err(unreadable)?;
    // A log with several kinds of laser lines holds each scan several times; the kind that knows most is
    // taken.
    let Some((&kind, first)) = survey.first.first_key_value() else {
        return Err(ImportError::NoScans {
            path: log.to_owned(),
            lines: survey.lines,
            broken: survey.first_broken,
            start: start_of(log).map_err(unreadable)?,
        });
    };
    let counts = survey.ranges.get(&kind);
    let mut conversion = Conversion {
        writer: Writer::create(output, options)?,
        kind,
        has_odometry: survey.has_odometry,
        longest_m: counts.and_then(RangeCounts::largest_m).unwrap_or_default(),
        report: ImportReport {
            no_return_m: counts.and_then(RangeCounts::no_return_m),
            ..ImportReport::default()
        },
    };
    conversion.describe(log, &messages::rig(first))?;
    let mut lines = LogLines::open(log).map_err(unreadable)?;
    while let Some((number, line)) = lines.next().map_err(unreadable)? {
        match read_line(line) {
            Ok(line) => conversion.take(&line)?,
            Err(reason) => conversion.lose(number, reason),
        }
    }
    conversion.writer.finish()?;
    Ok(conversion.report)
}

fn read_line(line: LogLine<'_>) -> Result<Line, String> {
    match line {
        LogLine::Text(text) => parse_line(&text).map_err(|error: LineError| error.to_string()),
        LogLine::TooLong => Err("the line is longer than any line of a log".to_owned()),
    }
}

fn survey(log: &Path) -> io::Result<Survey> {
    let mut survey = Survey::default();
    let mut lines = LogLines::open(log)?;
    while let Some((number, line)) = lines.next()? {
        survey.lines = number;
        match read_line(line) {
            Ok(Line::Laser(line)) => {
                survey.ranges.entry(line.kind).or_default().add_scan(&line.ranges_m);
                survey.first.entry(line.kind).or_insert(line);
            }
            Ok(Line::Odometry(_)) => survey.has_odometry = true,
            Ok(Line::Nothing | Line::Other(_)) => {}
            Err(reason) => {
                survey.first_broken.get_or_insert(BrokenLine { number, reason });
            }
        }
    }
    Ok(survey)
}

/// The second reading.
struct Conversion {
    writer: Writer,
    kind: LaserKind,
    has_odometry: bool,
    longest_m: f64,
    report: ImportReport,
}

impl Conversion {
    fn describe(&mut self, log: &Path, rig: &Rig) -> Result<(), WriteError> {
        self.writer.attach("rig.toml", "application/toml", rig.to_toml().as_bytes())?;
        let name = log.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let no_return =
            self.report.no_return_m.map_or_else(|| "none".to_owned(), |value| format!("{value} m"));
        let values = [
            ("program", format!("biplane {}", env!("CARGO_PKG_VERSION"))),
            ("source", format!("CARMEN log {name}")),
            ("no_return", no_return),
            (
                RIG_ASSUMED,
                "ports, mounts and the base are assumed: a CARMEN log does not say them".to_owned(),
            ),
        ];
        self.writer.metadata("biplane", &values.map(|(key, value)| (key.to_owned(), value)).into())
    }

    fn take(&mut self, line: &Line) -> Result<(), WriteError> {
        match line {
            Line::Laser(laser) if laser.kind == self.kind => self.take_scan(laser),
            Line::Laser(laser) => {
                self.count_other(laser.kind.name());
                Ok(())
            }
            Line::Odometry(odometry) => self.write_odometry(odometry),
            Line::Other(kind) => {
                self.count_other(kind);
                Ok(())
            }
            Line::Nothing => Ok(()),
        }
    }

    fn count_other(&mut self, kind: &str) {
        *self.report.others.entry(kind.to_owned()).or_default() += 1;
    }

    fn lose(&mut self, number: usize, reason: String) {
        self.report.broken_lines += 1;
        if self.report.broken.len() < BROKEN_KEPT {
            self.report.broken.push(BrokenLine { number, reason });
        }
    }

    fn take_scan(&mut self, line: &LaserLine) -> Result<(), WriteError> {
        if !self.has_odometry
            && let Some(pose) = line.odometry
        {
            let stamp_ns = line.stamp_ns;
            self.write_odometry(&OdometryLine { pose, forward_m_s: 0.0, turn_rad_s: 0.0, stamp_ns })?;
        }
        let scan = messages::scan(line, self.report.no_return_m, self.longest_m);
        self.writer.write(Topic::ScanHorizontal, line.stamp_ns, line.stamp_ns, &scan)?;
        let report = &mut self.report;
        report.scans += 1;
        *report.beams.entry(line.ranges_m.len()).or_default() += 1;
        let [first_ns, last_ns] = report.stamps_ns.unwrap_or([line.stamp_ns; 2]);
        report.backward_stamps += usize::from(line.stamp_ns < last_ns);
        report.stamps_ns = Some([first_ns, line.stamp_ns]);
        Ok(())
    }

    fn write_odometry(&mut self, line: &OdometryLine) -> Result<(), WriteError> {
        self.report.odometry += 1;
        self.writer.write(Topic::Odom, line.stamp_ns, line.stamp_ns, &messages::odometry(line))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::PathBuf;

    use biplane_recording::{AnyMessage, Reader, WriterOptions};

    use super::{ImportError, ImportReport, import};

    struct Imported {
        report: ImportReport,
        /// Topic, log time and message, in file order.
        messages: Vec<(String, i64, AnyMessage)>,
    }

    fn paths(name: &str) -> [PathBuf; 2] {
        ["log", "mcap"].map(|end| {
            let path =
                std::env::temp_dir().join(format!("biplane-carmen-{}-{name}.{end}", std::process::id()));
            let _ = fs::remove_file(&path);
            path
        })
    }

    fn imported(name: &str, text: &str) -> Imported {
        let [log, output] = paths(name);
        fs::write(&log, text).unwrap();
        let report = import(&log, &output, &WriterOptions::default()).unwrap();
        let reader = Reader::open(&output).unwrap();
        assert!(reader.rig().unwrap().is_some());
        let messages = reader
            .messages()
            .map(|entry| entry.unwrap())
            .map(|entry| (entry.topic_name.clone(), entry.log_time_ns, entry.decode().unwrap()))
            .collect();
        fs::remove_file(log).unwrap();
        fs::remove_file(output).unwrap();
        Imported { report, messages }
    }

    const THREE_SCANS: &str = "# a log\nPARAM robot_length 0.3 nohost 0\n\
        FLASER 2 1.5 81.83 9 9 9 1 2 0.5 100.25 nohost 0.1\n\
        FLASER 2 1.25 1.75 9 9 9 3 4 0.5 100.125 nohost 0.2\n\
        RLASER 2 1 1 0 0 0 0 0 0 100.3 nohost 0.25\n\
        FLASER 2 1.25 81.91 9 9 9 5 6 0.5 100.5 nohost 0.3\n";

    #[test]
    fn stamps_stay_file_order_stays_and_log_time_never_steps_back() {
        let Imported { report, messages } = imported("order", THREE_SCANS);
        let shape: Vec<(&str, i64, Option<i64>)> = messages
            .iter()
            .map(|(topic, log_ns, message)| (topic.as_str(), *log_ns, message.stamp_ns()))
            .collect();
        let (a, b, c) = (100_250_000_000, 100_125_000_000, 100_500_000_000);
        let expected = [
            ("/odom", a, Some(a)),
            ("/scan/horizontal", a, Some(a)),
            ("/odom", a, Some(b)),
            ("/scan/horizontal", a, Some(b)),
            ("/odom", c, Some(c)),
            ("/scan/horizontal", c, Some(c)),
        ];
        assert_eq!(shape, expected);
        assert_eq!(
            (report.scans, report.odometry, report.backward_stamps, report.broken_lines),
            (3, 3, 1, 0)
        );
        assert_eq!(report.stamps_ns, Some([a, c]));
        assert_eq!((report.no_return_m, report.others.get("RLASER")), (Some(81.83), Some(&1)));
        let AnyMessage::Scan(last) = &messages[5].2 else { panic!() };
        assert_eq!(last.ranges_m, [1.25, f32::INFINITY]);
        let AnyMessage::Odometry(first) = &messages[0].2 else { panic!() };
        assert_eq!(first.position_m, [1.0, 2.0, 0.0]);
    }

    #[test]
    fn odom_lines_take_the_place_of_the_scans_own_odometry() {
        let text = "FLASER 1 1.5 9 9 9 1 2 0.5 7 h 0\nODOM 4 5 0 0.5 0 0 7.5 h 0\nFLASER 1 1.5 9 9 9 1 2 0.5 8 h 0\n";
        let Imported { report, messages } = imported("odom", text);
        let topics: Vec<&str> = messages.iter().map(|(topic, ..)| topic.as_str()).collect();
        assert_eq!(topics, ["/scan/horizontal", "/odom", "/scan/horizontal"]);
        assert_eq!(report.odometry, 1);
    }

    #[test]
    fn a_scan_that_a_log_holds_as_two_kinds_of_lines_is_written_once() {
        let text = "RAWLASER1 0 -1.5 3 1.5 81.9 0.01 0 3 1 2 3 0 7 h 0\n\
            ROBOTLASER1 0 -1.5 3 1.5 81.9 0.01 0 3 1 2 3 0 0 0 0 4 5 0 0 0 0 0 0 7 h 0\n";
        let Imported { report, messages } = imported("kinds", text);
        assert_eq!((report.scans, report.odometry, report.others.get("RAWLASER1")), (1, 1, Some(&1)));
        let AnyMessage::Scan(scan) = &messages[1].2 else { panic!() };
        assert_eq!((scan.angle_min_rad, scan.angle_increment_rad), (-1.5, 1.5));
    }

    #[test]
    fn a_broken_line_costs_itself_and_is_named() {
        let lines: Vec<&str> = THREE_SCANS.lines().collect();
        let broken = [lines[2], "FLASER 2 1.5 x 9 9 9 1 2 0.5 100.3", lines[5], &lines[5][..20]].join("\n");
        let Imported { report, messages } = imported("broken", &broken);
        assert_eq!((report.scans, report.broken_lines, messages.len()), (2, 2, 4));
        let named: Vec<(usize, &str)> =
            report.broken.iter().map(|line| (line.number, line.reason.as_str())).collect();
        assert_eq!(named[0], (2, "expected a range, found \"x\""));
        assert_eq!(named[1].0, 4);
    }

    #[test]
    fn a_log_without_scans_makes_no_file() {
        let [log, output] = paths("empty");
        fs::write(&log, "# nothing\nFLASER 3 1\n").unwrap();
        let error = import(&log, &output, &WriterOptions::default()).unwrap_err();
        assert!(matches!(error, ImportError::NoScans { lines: 2, .. }), "{error}");
        assert!(error.to_string().contains("(line 2: the line ends where a range should stand)"), "{error}");
        assert!(!output.exists());
        fs::remove_file(&log).unwrap();
        assert!(matches!(import(&log, &output, &WriterOptions::default()), Err(ImportError::Read { .. })));
    }
}
