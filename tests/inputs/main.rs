//! Every parser of outside bytes over the committed corpus and over seeded damage to it, on stable Rust; what
//! each promises stands in `biplane_tests::inputs`. A coverage-guided fuzzer runs the same functions
//! (`tests/fuzz`).
//!
//! `BIPLANE_SEEDS=1000` runs so many inputs of each target in place of the usual number, `BIPLANE_SEED=17`
//! that one alone.

use std::panic::{AssertUnwindSafe, catch_unwind};

use biplane_mock::rng::Rng;
use biplane_tests::inputs::making::{corpus, mutate};
use biplane_tests::inputs::{TARGETS, Target, judge, named};

/// Memory is judged too.
#[global_allocator]
static ALLOCATOR: biplane_tests::inputs::making::peak::PeakAllocator =
    biplane_tests::inputs::making::peak::PeakAllocator;

/// Damaged inputs of each target in a plain run.
const INPUTS: u64 = 300;
/// A target's corpus stays so small, bytes.
const CORPUS_BYTES: usize = 100_000;

fn seeds() -> std::ops::RangeInclusive<u64> {
    let number = |name| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    match (number("BIPLANE_SEED"), number("BIPLANE_SEEDS")) {
        (Some(seed), _) => seed..=seed,
        (None, many) => 1..=many.unwrap_or(INPUTS),
    }
}

/// Judges the inputs of one target; panics after the first that fails, with where to find it.
fn attack(target: &Target) {
    let corpus = corpus::of(target);
    for (name, input) in &corpus {
        let outcome = catch_unwind(AssertUnwindSafe(|| judge(target, input)));
        assert!(outcome.is_ok(), "{}: corpus/{}/{name} breaks a promise", target.name, target.name);
    }
    let inputs: Vec<Vec<u8>> = corpus.into_iter().map(|(_, input)| input).collect();
    let seeds = seeds();
    println!("{}: {} of the corpus, seeds {seeds:?}", target.name, inputs.len());
    for seed in seeds {
        let input = mutate::damaged(target.form, &inputs, &mut Rng::new(seed, 0xF022, 0));
        if catch_unwind(AssertUnwindSafe(|| judge(target, &input))).is_err() {
            let path = std::env::temp_dir().join(format!("biplane-{}-{seed}", target.name));
            let _ = std::fs::write(&path, &input);
            panic!(
                "{}: BIPLANE_SEED={seed} breaks a promise; the input stands in {}",
                target.name,
                path.display()
            );
        }
    }
}

/// A test a target, so that they run side by side and a failure has a name.
macro_rules! targets {
    ($($name:ident),+ $(,)?) => {
        $(
            #[test]
            fn $name() {
                attack(named(stringify!($name)).expect("a target of that name"));
            }
        )+

        #[test]
        fn every_target_is_attacked() {
            let mut attacked = vec![$(stringify!($name)),+];
            attacked.sort_unstable();
            let mut all: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
            all.sort_unstable();
            assert_eq!(attacked, all);
        }
    };
}

targets!(
    lms,
    cola,
    scip,
    p2os,
    rflex,
    roboclaw,
    xsens,
    laser_session,
    base_session,
    message,
    mcap,
    rig,
    carmen,
    bag,
    poses,
    relations,
    ifc,
    obj,
    ply,
    model_json,
    las,
    e57,
    pcd,
    ptx,
    xyz,
    world_path,
    live_request,
    words
);

#[test]
fn every_corpus_is_small_and_holds_seeds() {
    for target in TARGETS {
        let corpus = corpus::of(target);
        let bytes: usize = corpus.iter().map(|(_, input)| input.len()).sum();
        assert!(
            !corpus.is_empty() && bytes <= CORPUS_BYTES,
            "{}: {} inputs, {bytes} bytes",
            target.name,
            corpus.len()
        );
    }
}

#[test]
fn memory_beyond_what_an_input_is_worth_is_noticed() {
    fn greedy(input: &[u8]) {
        let promised = input.first().map_or(0, |byte| usize::from(*byte) << 20);
        std::hint::black_box(Vec::<u8>::with_capacity(promised));
    }
    let target = Target { check: greedy, ..*named("ply").expect("it is there") };
    judge(&target, &[0]);
    assert!(catch_unwind(|| judge(&target, &[200])).is_err());
}
