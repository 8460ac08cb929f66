//! The numbers that vectors are made of.

use core::ops::{Add, Div, Mul, Sub};

/// `f32` or `f64`.
pub trait Scalar:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + sealed::Sealed
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// The square root.
    #[cfg(feature = "std")]
    #[must_use]
    fn square_root(self) -> Self;
}

macro_rules! scalar {
    ($type:ty) => {
        impl Scalar for $type {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            #[cfg(feature = "std")]
            #[inline]
            fn square_root(self) -> Self {
                self.sqrt()
            }
        }
        impl sealed::Sealed for $type {}
    };
}

scalar!(f32);
scalar!(f64);

mod sealed {
    pub trait Sealed {}
}
