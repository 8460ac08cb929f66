//! Numbers, stamps, trajectories and finished models as text.

pub(crate) mod model_json;
pub(crate) mod number;
pub(crate) mod shapes_json;
pub(crate) mod short;
pub(crate) mod trajectory;
