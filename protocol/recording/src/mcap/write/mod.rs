//! Writes a recording so that a crash costs a second at most: chunks go to disk whole, one a second of log
//! time, in a file `NAME.active` that takes its name when it is finished.
//!
//! The same calls give the same bytes, on any machine: no clock is read, nothing depends on threads or hash
//! order.

mod error;
mod options;
mod outputs;
mod parts;
mod report;
mod saving;
mod shown;
mod storage;
mod target;
#[cfg(test)]
mod tests;
mod writer;

pub use error::WriteError;
pub use options::WriterOptions;
pub use outputs::{check_apart, check_outputs};
pub use parts::{PartsReport, PartsWriter, Rotation, part_path};
pub(crate) use parts::{part_of, parts_on_disk};
pub use report::{TakenAway, WriteReport};
pub use saving::PROMISED_NS;
pub use shown::{Shown, write_shown};
pub use storage::{Disk, Storage, StoredFile, Whereabouts};
pub(crate) use target::recovering_path;
pub use target::{active_path, is_being_written, is_same_file, with_suffix};
pub use writer::Writer;
