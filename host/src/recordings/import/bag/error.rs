//! Why a bag was not imported.

use std::io;
use std::path::PathBuf;

use biplane_recording::WriteError;

/// Why nothing was imported.
#[derive(Debug, thiserror::Error)]
pub enum BagError {
    /// A file or folder cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file that is no bag, or one of a kind that is not read.
    #[error("{}: expected a ROS 1 bag, a ROS 2 folder, .db3 or .mcap; it {found}", path.display())]
    NotABag {
        /// The file.
        path: PathBuf,
        /// What it is.
        found: String,
    },
    /// A packed file cannot be unpacked.
    #[error("cannot unpack {} beside the output: {source}", path.display())]
    Unpack {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// No laser scan that could be used.
    #[error("no laser scan in {}: {found}", path.display())]
    NoScans {
        /// The first bag.
        path: PathBuf,
        /// What there is.
        found: String,
    },
    /// More than one choice makes sense, or none; the words say how to choose.
    #[error("{0}")]
    Choice(String),
    /// Two bags hold the same time.
    #[error(
        "{} begins {overlap_s:.1} s before {} ends: bags are taken one after the other; merge them first",
        second.display(), first.display()
    )]
    Overlap {
        /// The earlier one.
        first: PathBuf,
        /// The later one.
        second: PathBuf,
        /// How long both go on, in s.
        overlap_s: f64,
    },
    /// The recording cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}
