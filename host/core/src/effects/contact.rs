//! What stops have in common: a soft one pushes back in proportion to how far the model is in it, and one that
//! takes energy out by `1 + a v` times that, `v` the rate at which it goes in. So there is no jump where they touch
//! (K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42, 1975, 440).

use super::law::{Scale, Seen};
use crate::quantity::Quantity;

/// Within so many standard uncertainties a simpler effect has the name.
const ALIKE: f64 = 2.0;
/// Of the amplitude: where stops are looked for.
pub(super) const ANGLES: [f64; 3] = [0.7, 0.4, 0.9];
/// Cycles whose mid-line says on which side a stop is.
const FIRST_CYCLES: f64 = 3.0;
/// A loss of less than this share of the elastic moment is none: of a swing that is all in a stop it takes 4/3 of
/// that share of the energy out on each pass, a damping ratio of 0.002.
const MIN_LOSS: f64 = 0.02;
/// Of the elastic moment at the largest rate, the loss that a fit begins with.
const LOSS: f64 = 0.2;

/// How far the model is in a stop at `stop_rad`, on the side of its sign; 0 short of it.
#[inline]
pub(super) fn within(yaw_rad: f64, side: f64, stop_rad: f64) -> f64 {
    (side * (yaw_rad - stop_rad)).max(0.0)
}

/// Moment of stops on both sides, `ku`, `gu`, `kl`, `gl`, that push `along` harder at this upward rate.
#[inline]
pub(super) fn both(yaw_rad: f64, [ku, gu, kl, gl]: [f64; 4], along: f64) -> f64 {
    kl * within(yaw_rad, -1.0, -gl) * (1.0 - along) - ku * within(yaw_rad, 1.0, gu) * (1.0 + along)
}

/// How large the numbers of stops on both sides are.
pub(super) fn both_sizes(scale: &Scale) -> [f64; 4] {
    let (k, g) = (scale.stiffness(), scale.amplitude_rad);
    [k, g, k, g]
}

/// How large a loss `a` is, s/rad.
pub(super) fn loss_size(scale: &Scale) -> f64 {
    (scale.natural_frequency_rad_s * scale.amplitude_rad).recip()
}

/// Both sides' angles, as a fit begins with them.
pub(super) fn both_angles(seen: &Seen) -> Vec<[f64; 2]> {
    let a = seen.scale.amplitude_rad;
    ANGLES.iter().flat_map(|up| ANGLES.map(|low| [up * a, low * a])).collect()
}

/// The angles of a stop on either side, as a fit begins with them: first the side from which the mid-line moves
/// away in the first cycles, or a fit may end with a stop on the other.
pub(super) fn either_angle(seen: &Seen) -> Vec<f64> {
    let a = seen.scale.amplitude_rad;
    let count = (FIRST_CYCLES * seen.per_cycle) as usize;
    let first = &seen.residuals_rad[..count.min(seen.residuals_rad.len())];
    let side = 1.0_f64.copysign(first.iter().sum());
    [side, -side].iter().flat_map(|side| ANGLES.map(|share| side * share * a)).collect()
}

/// The loss `a` that a fit begins with, s/rad.
pub(super) fn loss(seen: &Seen) -> f64 {
    LOSS / (seen.natural_frequency_rad_s * seen.scale.amplitude_rad)
}

/// Whether it may be none.
pub(super) fn may_be_zero(q: Quantity) -> bool {
    q.u.is_nan() || q.holds(0.0, ALIKE)
}

/// Whether stops of this stiffness and loss take no energy out that shows at an amplitude. Their own frequency
/// stands for that of the motion.
pub(super) fn may_take_none_out(k: Quantity, a: Quantity, amplitude_rad: f64) -> bool {
    may_be_zero(a) || a.value * k.value.abs().sqrt() * amplitude_rad < MIN_LOSS
}

/// Whether both may be one number.
pub(super) fn may_be_equal(one: Quantity, other: Quantity) -> bool {
    may_be_zero(Quantity::new(one.value - other.value, one.u.hypot(other.u)))
}
