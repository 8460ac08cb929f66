//! Tests over the whole chain, as one binary.
