//! Pieces of a motion between its corners.

/// A smooth piece of the motion: which side of each corner it is on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// Sign of the yaw rate; 0: at rest, or to be decided.
    pub(super) direction: f64,
    /// Side of the dead zone, 0 inside; 1 without one.
    pub(super) side: f64,
    /// Sign of the yaw angle.
    pub(super) half: f64,
}

impl Piece {
    pub(super) fn at([b, r]: [f64; 2], dead_zone_rad: f64) -> Self {
        Self {
            direction: if r == 0.0 { 0.0 } else { r.signum() },
            side: if dead_zone_rad > 0.0 && b.abs() < dead_zone_rad { 0.0 } else { b.signum() },
            half: b.signum(),
        }
    }
}
