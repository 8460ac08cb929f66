//! `encode`: scans and odometry back into the bytes that devices would have sent.

use super::fan_lasers::FanLaserTypes;
use crate::capture::encode::{EncodeOptions, run};
use biplane_cli::counted;
use std::path::PathBuf;

/// Encode the scans and odometry of an import or recording as the bytes that the devices would have sent: a
/// capture.
///
/// A laser with protocol = "cola" or "scip" in the rig is the one of --network-laser or --hokuyo.
/// Samples of an inertial unit (/imu) are kept as they are.
///
/// Examples:
///   biplane-mock encode intel.mcap -o intel-capture.mcap
///   biplane-mock encode run.mcap --rig ust20lx.toml --hokuyo UST-20LX -o capture.mcap
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(super) struct Encode {
    /// Import or recording.
    #[arg(value_name = "SCANS.mcap")]
    input: PathBuf,
    /// Capture to write.
    #[arg(short, long, value_name = "C.mcap")]
    output: PathBuf,
    /// Rig whose lines carry the bytes; else the input's own, else the template with the scans' field of
    /// view.
    #[arg(long, value_name = "rig.toml")]
    rig: Option<PathBuf>,
    #[command(flatten)]
    types: FanLaserTypes,
    /// Replace an existing capture.
    #[arg(long, visible_alias = "overwrite")]
    force: bool,
}

impl Encode {
    /// Encodes and says what came of it.
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let options = EncodeOptions {
            input: self.input.clone(),
            output: self.output.clone(),
            rig: self.rig.clone(),
            overwrite: self.force,
            network_laser: self.types.network_laser.clone(),
            hokuyo: self.types.hokuyo.clone(),
            ..EncodeOptions::default()
        };
        let report = run(&options)?;
        eprintln!(
            "{}: {} horizontal and {}, {} ({} had no room); {} waited for their line, at most {:.1} ms; {}; {} beyond the unit's; {}",
            self.output.display(),
            report.scans_horizontal,
            counted(report.scans_vertical, "vertical scan"),
            counted(report.odometry, "odometry packet"),
            report.odometry_skipped,
            report.delayed,
            report.longest_delay_ms,
            counted(report.backward_stamps, "backward stamp"),
            counted(report.beyond_range, "range"),
            counted(report.inertial, "inertial sample")
        );
        for (port, baud) in &report.raised {
            eprintln!(
                "the {} line runs at {baud} Bd: the stamps stand too close for the rig's own rate",
                port.name()
            );
        }
        Ok(())
    }
}
