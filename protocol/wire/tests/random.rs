//! Little noise through every deframer; `examples/random_bytes.rs` takes as much as you like.

mod noise;

use noise::{Damage, damage, deframers, questions, unasked};

#[test]
fn random_bytes_are_taken_no_more_often_than_the_checksum_allows() {
    for outcome in deframers(2_000_000, 1).into_iter().chain([questions(2_000_000, 2), unasked(200_000, 3)]) {
        assert!(outcome.is_within(), "{outcome:?}, allowed {:.1}", outcome.allowed());
    }
}

#[test]
fn single_bits_and_lost_bytes_are_found_and_pairs_of_bytes_not_always() {
    let one = damage(Damage::Bits(1), 30_000, 4);
    assert_eq!((one.damaged, one.by_checksum), (30_000, 0));
    let two = damage(Damage::Bits(2), 100_000, 5);
    assert!(two.by_checksum < two.damaged / 100, "{two:?}");
}
