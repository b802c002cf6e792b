//! Errors on training and test set with the thesis's beside them, as columns of a table.

use super::report::{percent, scientific};
use yawrig_train::errors::Errors;

/// Their heads.
pub(super) const COLUMNS: [&str; 11] = [
    "train wn",
    "(thesis)",
    "train zeta",
    "(thesis)",
    "test wn",
    "(thesis)",
    "test zeta",
    "(thesis)",
    "zeta rms %",
    "median %",
    "95 % below",
];

/// MSE of wn and zeta on the training set and on the test set.
pub(super) fn mse(train: &Errors, test: &Errors) -> [f64; 4] {
    let of = |errors: &Errors| [errors.natural_frequency_mse, errors.damping_ratio_mse];
    let ([a, b], [c, d]) = (of(train), of(test));
    [a, b, c, d]
}

/// A row's cells below [`COLUMNS`].
pub(super) fn cells(ours: [f64; 4], thesis: [f64; 4], test: &Errors) -> Vec<String> {
    let mse = ours.into_iter().zip(thesis);
    let mut cells: Vec<String> = mse
        .flat_map(|(ours, thesis)| [scientific(ours), format!("({})", scientific(thesis))])
        .collect();
    cells.extend([
        percent(test.damping_ratio_rms_percent),
        percent(test.damping_ratio_median_percent),
        percent(test.damping_ratio_p95_percent),
    ]);
    cells
}
