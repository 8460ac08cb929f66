//! What a run writes: messages, diagnostics, the file's attachments and names, and files that an earlier run
//! left unfinished.

pub(crate) mod diagnostics;
pub(crate) mod file_sink;
pub(crate) mod journal;
pub(crate) mod message_ring;
pub(crate) mod provenance;
pub(crate) mod run_name;
pub(crate) mod salvage;
pub(crate) mod tap;
