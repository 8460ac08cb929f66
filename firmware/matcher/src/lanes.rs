//! Work in lanes, compiled twice: for every processor, and for those whose lanes are twice as wide.
//!
//! Only the time differs. Both are made of the same source, and no product is fused with a sum: each number
//! is rounded as often as written, and comes out the same to the bit.

/// Work that is written in lanes.
pub(crate) trait InLanes {
    /// What comes of it.
    type Output;

    /// Does it. Always inlined, as all that it calls where it counts: the rest is compiled once.
    fn work(self) -> Self::Output;
}

/// Does work in lanes as wide as the processor has them.
#[inline(always)]
pub(crate) fn widest<W: InLanes>(what: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if are_wide() {
        // SAFETY: the processor has just been asked for all that `wide` is compiled for.
        return unsafe { wide(what) };
    }
    what.work()
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn are_wide() -> bool {
    std::arch::is_x86_feature_detected!("avx2")
        && std::arch::is_x86_feature_detected!("bmi1")
        && std::arch::is_x86_feature_detected!("bmi2")
        && std::arch::is_x86_feature_detected!("lzcnt")
        && std::arch::is_x86_feature_detected!("popcnt")
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn wide<W: InLanes>(what: W) -> W::Output {
    what.work()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Products added to numbers, as an alignment has them: fused they would be rounded once.
    struct Products<'a>(&'a [[f32; 3]]);

    impl InLanes for Products<'_> {
        type Output = Vec<u32>;

        #[inline(always)]
        fn work(self) -> Vec<u32> {
            self.0.iter().map(|[a, b, c]| (a * b + c).to_bits()).collect()
        }
    }

    #[test]
    fn wide_lanes_round_as_often_as_narrow_ones() {
        let number = |i: usize, k: usize| ((i * 7919 + k * 104_729) % 1009) as f32 / 503.1 - 1.0;
        let all: Vec<[f32; 3]> = (0..1000).map(|i| [number(i, 1), number(i, 2), number(i, 3)]).collect();
        let narrow = Products(&all).work();
        assert_eq!(widest(Products(&all)), narrow);
        let fused = all.iter().zip(&narrow).filter(|([a, b, c], bits)| a.mul_add(*b, *c).to_bits() != **bits);
        assert!(fused.count() > 100, "the numbers tell");
    }
}
