//! The tree against its own rules: folders, floors, imports, words, documents.

mod floors;
mod imports;
mod layout;
mod portable;
pub(crate) mod tidy;
mod words;
