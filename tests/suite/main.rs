//! Tests over the whole chain, as one binary: the tree against its map, and the programs against each other.

mod tidy;
