//! The numbers of an effect as the integration holds them.

/// Most numbers that a moment or a change of the reading has.
pub(super) const MAX_NUMBERS: usize = 5;

pub(super) fn padded(p: &[f64]) -> [f64; MAX_NUMBERS] {
    std::array::from_fn(|i| p.get(i).copied().unwrap_or(0.0))
}
