//! Sines, logarithms and the like with the same bits on every machine.
//!
//! Those of std are the C library's: their last digit differs between C libraries, their versions, and
//! processors. Where a decision hangs on one, poses and models differ in more. These are in Rust (crate
//! `libm`), whatever the machine has. Square roots and rounding are exact everywhere and stay std's.

/// Elementary functions that do not ask the C library. Angles are in radians.
pub trait PortableMath: Sized {
    /// Sine.
    #[must_use]
    fn portable_sin(self) -> Self;
    /// Cosine.
    #[must_use]
    fn portable_cos(self) -> Self;
    /// Sine and cosine.
    #[must_use]
    fn portable_sin_cos(self) -> (Self, Self);
    /// Tangent.
    #[must_use]
    fn portable_tan(self) -> Self;
    /// Arc cosine.
    #[must_use]
    fn portable_acos(self) -> Self;
    /// The direction of the point (`x`, `self`).
    #[must_use]
    fn portable_atan2(self, x: Self) -> Self;
    /// Length of the hypotenuse of a right triangle: a square root, which is exact everywhere. Squares of
    /// lengths in meters neither overflow nor vanish.
    #[must_use]
    fn portable_hypot(self, other: Self) -> Self;
    /// e to this power.
    #[must_use]
    fn portable_exp(self) -> Self;
    /// Natural logarithm.
    #[must_use]
    fn portable_ln(self) -> Self;
    /// Natural logarithm of one more than this.
    #[must_use]
    fn portable_ln_1p(self) -> Self;
    /// Logarithm to base 2.
    #[must_use]
    fn portable_log2(self) -> Self;
    /// Logarithm to base 10.
    #[must_use]
    fn portable_log10(self) -> Self;
    /// This to a power.
    #[must_use]
    fn portable_powf(self, exponent: Self) -> Self;
    /// The largest whole number that is not above this, as `floor() as i32` gives it. The C library is not
    /// called: for one number that takes longer than all the rest of finding a cell.
    #[must_use]
    fn floor_to_i32(self) -> i32;
}

/// The functions of `libm` for one type, in the order of the trait.
macro_rules! portable_math {
    ($real:ty: $sin:ident $cos:ident $sin_cos:ident $tan:ident $acos:ident $atan2:ident $exp:ident
     $ln:ident $ln_1p:ident $log2:ident $log10:ident $powf:ident) => {
        impl PortableMath for $real {
            fn portable_sin(self) -> Self {
                libm::$sin(self)
            }

            fn portable_cos(self) -> Self {
                libm::$cos(self)
            }

            fn portable_sin_cos(self) -> (Self, Self) {
                libm::$sin_cos(self)
            }

            fn portable_tan(self) -> Self {
                libm::$tan(self)
            }

            fn portable_acos(self) -> Self {
                libm::$acos(self)
            }

            fn portable_atan2(self, x: Self) -> Self {
                libm::$atan2(self, x)
            }

            fn portable_hypot(self, other: Self) -> Self {
                (self * self + other * other).sqrt()
            }

            fn portable_exp(self) -> Self {
                libm::$exp(self)
            }

            fn portable_ln(self) -> Self {
                libm::$ln(self)
            }

            fn portable_ln_1p(self) -> Self {
                libm::$ln_1p(self)
            }

            fn portable_log2(self) -> Self {
                libm::$log2(self)
            }

            fn portable_log10(self) -> Self {
                libm::$log10(self)
            }

            fn portable_powf(self, exponent: Self) -> Self {
                libm::$powf(self, exponent)
            }

            #[inline]
            fn floor_to_i32(self) -> i32 {
                let towards_zero = self as i32;
                towards_zero.saturating_sub(i32::from(towards_zero as $real > self))
            }
        }
    };
}

portable_math!(f64: sin cos sincos tan acos atan2 exp log log1p log2 log10 pow);
portable_math!(f32: sinf cosf sincosf tanf acosf atan2f expf logf log1pf log2f log10f powf);

#[cfg(test)]
mod tests {
    use super::PortableMath;

    /// Hashes of 2000 values each.
    const GOLDEN: [(&str, u64); 12] = [
        ("sin", 0xd0ce_e100_6221_4d4a),
        ("cos", 0x3d9d_af3f_ef5e_8ef9),
        ("tan", 0xf7f3_ed88_584f_76e8),
        ("acos", 0xea86_c9c8_f9e4_5dd8),
        ("atan2", 0x0db7_15cb_16f5_b52f),
        ("hypot", 0x32eb_8706_c8fd_9698),
        ("exp", 0xf561_2dae_3bfb_6bc2),
        ("ln", 0xe9a3_0270_3dfe_809b),
        ("ln_1p", 0x562d_60e4_c731_9c39),
        ("log2", 0x1ae8_03de_7449_cecb),
        ("log10", 0x6aed_c217_6adb_115c),
        ("powf", 0x1d20_9c2e_1cf9_8cfc),
    ];

    /// FNV-1a over the bits of values.
    fn hash(values: impl Iterator<Item = f64>) -> u64 {
        let bytes = values.flat_map(|value| value.to_bits().to_le_bytes());
        bytes
            .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
    }

    /// Values of both signs and many sizes, exact on every machine.
    fn arguments() -> impl Iterator<Item = f64> {
        (1..=2000).map(|number| f64::from(number * 7919 % 2003 - 1001) / 64.0)
    }

    #[test]
    fn the_bits_are_those_of_every_other_machine() {
        let pairs = || arguments().zip(arguments().skip(1));
        let positive = || arguments().map(f64::abs).filter(|value| *value > 0.0);
        let found = [
            ("sin", hash(arguments().map(f64::portable_sin))),
            ("cos", hash(arguments().map(f64::portable_cos))),
            ("tan", hash(arguments().map(f64::portable_tan))),
            ("acos", hash(arguments().map(|value| (value / 16.0).portable_acos()))),
            ("atan2", hash(pairs().map(|(y, x)| y.portable_atan2(x)))),
            ("hypot", hash(pairs().map(|(y, x)| y.portable_hypot(x)))),
            ("exp", hash(arguments().map(f64::portable_exp))),
            ("ln", hash(positive().map(f64::portable_ln))),
            ("ln_1p", hash(positive().map(f64::portable_ln_1p))),
            ("log2", hash(positive().map(f64::portable_log2))),
            ("log10", hash(positive().map(f64::portable_log10))),
            ("powf", hash(positive().map(|value| value.portable_powf(1.7)))),
        ];
        assert_eq!(found, GOLDEN, "{found:#x?}");
    }

    #[test]
    fn they_are_what_std_says_but_for_the_last_digits() {
        let near =
            |found: f64, expected: f64| (found - expected).abs() <= 4.0 * f64::EPSILON * expected.abs();
        for value in arguments() {
            let (sin, cos) = value.portable_sin_cos();
            assert!(sin == value.portable_sin() && cos == value.portable_cos(), "{value}");
            assert!(near(sin, value.sin()) && near(cos, value.cos()), "{value}");
            assert!(near(value.portable_exp(), value.exp()), "{value}");
            assert!(near(value.portable_atan2(0.7), value.atan2(0.7)), "{value}");
            assert!(near(value.portable_hypot(0.7), value.hypot(0.7)), "{value}");
        }
        assert!((f64::from(0.5_f32.portable_sin()) - 0.5_f64.sin()).abs() < 1e-7);
    }

    #[test]
    fn whole_numbers_below_are_those_of_floor() {
        let large = [0.0, -0.0, 0.5, -0.5, 1e9, -1e9, 3e9, -3e9, 2_147_483_647.5, -2_147_483_648.5, 1e300];
        let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -f64::MIN_POSITIVE];
        for value in arguments().chain(large).chain(odd) {
            assert_eq!(value.floor_to_i32(), value.floor() as i32, "{value}");
            let value = value as f32;
            assert_eq!(value.floor_to_i32(), value.floor() as i32, "{value}");
        }
    }
}
