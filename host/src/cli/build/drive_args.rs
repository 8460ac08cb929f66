//! What to build of, and whose poses to take: words that `tiles plan` has too.

use std::path::PathBuf;

use crate::cli::terminal::values::length;

/// Which recordings, and with which poses: words that `tiles plan` has too.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct DriveArgs {
    /// Posed recordings; of one in parts all of them, in any order, or its name without the number
    #[arg(required = true, value_name = "RUN.mcap")]
    pub recordings: Vec<PathBuf>,
    /// Use this trajectory (TUM: t x y z qx qy qz qw), or the poses of this recording, instead of the
    /// recorded ones. Loops are not closed then
    #[arg(long, value_name = "T.tum")]
    pub poses: Option<PathBuf>,
    /// Take the poses as they were recorded; several recordings are then in one frame already. Otherwise
    /// loops are closed first. A recording that has none keeps its poses, and so does one that is optimized
    /// already
    #[arg(long, conflicts_with = "poses")]
    pub no_optimize: bool,
    /// Leave the poses in the plane: do not seek height, roll and pitch (of one recording)
    #[arg(long)]
    pub planar: bool,
    /// Range noise of the laser, one standard deviation, meters. Larger: steps between surfaces disappear;
    /// smaller: a wall becomes several planes [default: estimated from the points]
    #[arg(long, value_name = "M", value_parser = length)]
    pub sigma: Option<f64>,
}
