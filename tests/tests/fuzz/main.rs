//! Everything that reads what others wrote, on inputs that are wrong in as many ways as can be made: no
//! panic, no memory out of proportion, no hang.
//!
//! Mutations of a kept corpus, `tests/fuzz/corpus/TARGET`; an input that brings a new kind of answer joins it
//! for the run. The same seed every time, so that a finding comes again. A short run in the normal tests; a
//! long one by `YAWRIG_FUZZ_SECONDS=600 cargo test --release -p yawrig-tests --test fuzz -- --nocapture`,
//! seconds a target, another seed by `YAWRIG_FUZZ_SEED`; `YAWRIG_FUZZ_KEEP=1` writes what joined into the
//! corpus. An input that fails is written to `tests/fuzz/found`; put it into the corpus with the repair.

mod mutate;
mod run;
mod targets;

use peak_alloc::PeakAlloc;

/// Counts what is allocated.
#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

macro_rules! fuzz {
    ($($name:ident)*) => {$(
        #[test]
        fn $name() {
            run::run(stringify!($name), &targets::$name());
        }
    )*};
}

fuzz!(frames messages device samples blob record foreign campaign model effect expression);
