//! What is wrong with a broken file, place by place.

/// One thing that is wrong.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Finding {
    /// Where it begins, in bytes from the file's start.
    pub offset: u64,
    /// How many bytes of the file could not be used because of it.
    pub bytes: u64,
    /// How many more the file should have had there, as far as it says.
    pub missing_bytes: u64,
    /// Messages kept from there.
    pub kept_messages: u64,
    /// Messages known to be lost there.
    pub lost_messages: u64,
    /// What it is.
    pub problem: Problem,
}

/// Kinds of damage.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Problem {
    /// The file ends inside a chunk.
    CutChunk,
    /// A chunk's bytes are in part zeros that were never written.
    TornChunk,
    /// A chunk's bytes are not those that were written.
    DamagedChunk {
        /// What says so.
        what: String,
    },
    /// Bytes that are no record.
    NoRecord,
    /// An attachment is not what was written.
    DamagedAttachment,
    /// A record cannot be read, or belongs to a channel that nothing defines.
    DamagedRecord {
        /// What is wrong with it.
        what: String,
    },
    /// The checksum over all data differs though every part seems intact.
    Checksum,
    /// The recording was not finished: what had not reached the disk is not there.
    NoEnd,
    /// The data is whole; the index or the footer behind it is not.
    NoIndex,
    /// The data is whole; the index behind it is not what was written.
    DamagedIndex,
}

impl Problem {
    /// Whether data was lost by it, or may have been.
    #[must_use]
    pub fn loses_data(&self) -> bool {
        !matches!(self, Self::NoIndex | Self::DamagedIndex)
    }
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { offset, bytes, missing_bytes, kept_messages, lost_messages, problem } = self;
        write!(f, "byte {offset}: ")?;
        match problem {
            Problem::CutChunk => write!(f, "the file ends inside a chunk")?,
            Problem::TornChunk => write!(f, "a chunk holds zeros that were never overwritten")?,
            Problem::DamagedChunk { what } => write!(f, "a chunk is damaged: {what}")?,
            Problem::NoRecord => write!(f, "no record can be made out")?,
            Problem::DamagedAttachment => write!(f, "an attachment is damaged")?,
            Problem::DamagedRecord { what } => write!(f, "{what}")?,
            Problem::Checksum => {
                write!(f, "the checksum over all data differs, though every part seems intact")?;
            }
            Problem::NoEnd => {
                return write!(f, "the recording was not finished; what was not on the disk yet is lost");
            }
            Problem::NoIndex => return write!(f, "the data is whole; the index behind it is not"),
            Problem::DamagedIndex => return write!(f, "the index was damaged and is rebuilt"),
        }
        write!(f, "; {bytes} bytes unusable")?;
        if *missing_bytes > 0 {
            write!(f, ", {missing_bytes} more missing")?;
        }
        if *kept_messages > 0 {
            let unproven = matches!(problem, Problem::CutChunk | Problem::TornChunk);
            let proof = if unproven { " by their form, without a checksum" } else { "" };
            write!(f, ", {kept_messages} messages kept{proof}")?;
        }
        if *lost_messages > 0 {
            write!(f, ", {lost_messages} messages lost")?;
        }
        Ok(())
    }
}
