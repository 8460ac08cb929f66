//! `probe`: talks to each device once.

use std::path::PathBuf;

use biplane_recording::Port;

use crate::cli::rig;
use crate::io::probe::device_report::DeviceReport;
use crate::types::error::OnboardError;

/// Asks each device what it is and how it is set; prints a table.
///
/// Settings are not changed; a running output is stopped. Exit code 1 when a device does not answer.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane-onboard probe --rig rig.toml\n  \
    biplane-onboard probe --rig rig.toml --only vertical")]
pub(crate) struct Args {
    /// The robot.
    #[arg(long)]
    rig: PathBuf,
    /// Only this device: horizontal, vertical, base or imu. May be given several times; without it, every
    /// device of the rig.
    #[arg(long, value_name = "DEVICE", value_parser = device)]
    only: Vec<Port>,
    /// As JSON on stdout.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<u8, OnboardError> {
    let reports = crate::io::probe::probe(&rig::load_to_open(&args.rig)?, &args.only)?;
    if args.json {
        let text = serde_json::to_string_pretty(&reports).unwrap_or_default();
        crate::cli::print_result(&(text + "\n"));
    } else {
        crate::cli::print_result(&table(&reports));
    }
    Ok(u8::from(reports.is_empty() || reports.iter().any(|report| !report.answered)))
}

fn device(word: &str) -> Result<Port, String> {
    match word {
        "horizontal" => Ok(Port::Horizontal),
        "vertical" => Ok(Port::Vertical),
        "base" => Ok(Port::Base),
        "imu" => Ok(Port::Imu),
        _ => Err("expected horizontal, vertical, base or imu".to_owned()),
    }
}

/// Columns as wide as their widest word.
pub(crate) fn table(reports: &[DeviceReport]) -> String {
    let head = ["device", "port", "baud", "type", "firmware", "field", "step", "units", "mode", "status"];
    let mut rows = vec![head.map(str::to_owned)];
    rows.extend(reports.iter().map(row));
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; 10] = std::array::from_fn(width);
    let mut text = String::new();
    // The head has no remarks.
    let remarks = std::iter::once(&[][..]).chain(reports.iter().map(|report| &report.remarks[..]));
    for (row, remarks) in rows.iter().zip(remarks) {
        let cells: Vec<_> = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}")).collect();
        text += cells.join("  ").trim_end();
        text.push('\n');
        for remark in remarks {
            text += &format!("  {remark}\n");
        }
    }
    text
}

fn row(report: &DeviceReport) -> [String; 10] {
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
    let baud = match report.baud_found {
        Some(baud) if baud != report.baud_configured => format!("{baud} (rig: {})", report.baud_configured),
        Some(baud) => baud.to_string(),
        None => "-".to_owned(),
    };
    let status = match (&report.problem, report.fault) {
        (Some(problem), _) => problem.clone(),
        (None, Some(true)) => "FAULT".to_owned(),
        (None, _) => "ok".to_owned(),
    };
    [
        report.device.to_owned(),
        report.port.clone(),
        baud,
        or_dash(report.kind.clone()),
        or_dash(report.firmware.clone()),
        or_dash(report.fov_deg.map(|fov_deg| fov_deg.to_string())),
        or_dash(report.resolution_deg.map(|step_deg| step_deg.to_string())),
        or_dash(report.units.map(str::to_owned)),
        or_dash(report.measuring_mode.map(|mode| format!("{mode:02X}"))),
        status,
    ]
}
