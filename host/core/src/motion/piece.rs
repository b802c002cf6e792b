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

    /// The edge of the dead zone that lies between this side and `b`.
    pub(super) fn edge(&self, b: f64, dead_zone_rad: f64) -> Option<f64> {
        let g = dead_zone_rad;
        if g == 0.0 {
            None
        } else if self.side == 0.0 {
            (b.abs() > g).then(|| g.copysign(b))
        } else {
            (b * self.side < g).then_some(g * self.side)
        }
    }

    /// Into the next piece over an edge of the dead zone at `b`.
    pub(super) fn pass(&mut self, b: f64) {
        self.side = if self.side == 0.0 { b.signum() } else { 0.0 };
    }

    /// Where the spring of this side has no moment.
    pub(super) fn slack(&self, dead_zone_rad: f64) -> f64 {
        if dead_zone_rad > 0.0 {
            dead_zone_rad * self.side
        } else {
            0.0
        }
    }
}
