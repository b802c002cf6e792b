//! What the line loses.

use crate::case::{case, Case, Must};
use crate::faults::{Given, Signal};
use rand::Rng;
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::Flags;

pub fn cases() -> Vec<Case> {
    vec![
        case(
            "samples missing, counted",
            Must::BeRightAndFlag,
            &[Flags::LOST_SAMPLES],
            &[("1 in one place", 1.0), ("15 in one place", 15.0), ("20 in one place", 20.0)],
            |truth, seed, count| missing(truth, seed, count as usize, true),
        ),
        case(
            "samples missing, counted",
            Must::Flag,
            &[Flags::LOST_SAMPLES],
            &[("200 in one place", 200.0), ("2000 in one place", 2000.0)],
            |truth, seed, count| missing(truth, seed, count as usize, true),
        ),
        case(
            "samples missing, not counted",
            Must::Either,
            &[Flags::DISTURBED],
            &[("1 in one place", 1.0), ("10 in one place", 10.0), ("100 in one place", 100.0)],
            |truth, seed, count| missing(truth, seed, count as usize, false),
        ),
    ]
}

fn missing(truth: Modal, seed: u64, count: usize, counted: bool) -> Vec<Given> {
    let mut signal = Signal::new(truth, seed);
    let share = signal.random.random_range(0.02..0.22);
    let at = signal.moment(share);
    let mut given = signal.given();
    let end = (at + count).min(given.len());
    let said = counted.then_some(Given::Lost((end - at) as u32));
    given.splice(at..end, said);
    given
}
