//! The faults, in the order in which they are told.

use crate::case::{case, Case, Must};
use crate::faults::Signal;
use crate::{line, model, sensor};

pub fn cases() -> Vec<Case> {
    [in_order(), sensor::cases(), line::cases(), model::cases()].into_iter().flatten().collect()
}

fn in_order() -> Vec<Case> {
    vec![
        case("nothing", Must::BeRightAndClean, &[], &[("", 0.0)], |truth, seed, _| {
            Signal::new(truth, seed).given()
        }),
        case(
            "wrong direction",
            Must::BeRightAndClean,
            &[],
            &[("let go at -15 deg", -15.0), ("at -11 deg", -11.0)],
            |truth, seed, from| Signal::released(truth, from, seed).given(),
        ),
        case(
            "jittering samples",
            Must::BeRightAndClean,
            &[],
            &[("by up to 5 %", 0.05), ("by up to 20 %", 0.2)],
            |truth, seed, share| Signal::jittered(truth, share, seed).given(),
        ),
    ]
}
