//! Least-squares planes of point sets, and the noise that they have to allow for.

pub(crate) mod eigen;
pub(crate) mod noise;
pub(crate) mod scatter;
