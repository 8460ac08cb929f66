//! The words that part a recording: of `record` and `replay`.

use biplane_recording::Rotation;

const NS_PER_MINUTE: f64 = 60e9;
const BYTES_PER_MB: f64 = 1e6;

/// When the next part of a recording begins: RUN.mcap becomes RUN_0.mcap, RUN_1.mcap, ..., each readable
/// alone.
#[derive(Copy, Clone, Debug, clap::Args)]
pub(crate) struct RotationArgs {
    /// Begin the next part (RUN_0.mcap, RUN_1.mcap, ...) after so many minutes.
    #[arg(long, value_name = "N", value_parser = positive)]
    rotate_minutes: Option<f64>,
    /// Begin the next part when this one has so many megabytes.
    #[arg(long, value_name = "N", value_parser = positive)]
    rotate_mb: Option<f64>,
}

impl RotationArgs {
    pub(crate) fn rotation(self) -> Rotation {
        Rotation {
            span_ns: self.rotate_minutes.map(|minutes| (minutes * NS_PER_MINUTE) as i64),
            bytes: self.rotate_mb.map(|megabytes| (megabytes * BYTES_PER_MB) as u64),
        }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| format!("expected a number greater than 0, found \"{text}\""))
}
