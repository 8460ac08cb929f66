//! Tests over the whole chain, as one binary: the tree against its map, and the programs against each other and the truth.

mod accuracy;
mod captures;
mod recorded;
mod tidy;
