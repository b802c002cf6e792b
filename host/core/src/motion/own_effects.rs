//! What a user's own effects add to a motion: their moments, and their states, which have equations of motion
//! of their own and are followed by the steps of the motion.

use super::oscillator::Motion;
use super::piece::Piece;
use std::cell::RefCell;
use yawrig_expression::{follow, Prepared, MAX_OWN, MAX_STATES};

/// States of all own effects of a model; those beyond what there are are zero.
pub(super) type States = [f64; MAX_OWN * MAX_STATES];

/// `from` and the slopes over `h` s, weighted.
#[inline]
pub(super) fn weighted(from: States, h: f64, weights: &[f64], slopes: &[States]) -> States {
    let mut out = from;
    for (weight, slope) in weights.iter().zip(slopes) {
        for (out, slope) in out.iter_mut().zip(slope) {
            *out += h * weight * slope;
        }
    }
    out
}

/// The own effects of a motion, made ready for it.
pub(super) struct Own {
    each: RefCell<Vec<(Prepared, Vec<Prepared>)>>,
    /// How many states there are.
    pub(super) count: usize,
}

impl Own {
    pub(super) fn new(motion: &Motion) -> Self {
        let (wn, wind) = (motion.natural_frequency_rad_s, motion.terms.wind_speed_m_s);
        let each: Vec<_> = motion.terms.own().iter().map(|own| own.prepared(wn, wind)).collect();
        let count = each.iter().map(|(_, rates)| rates.len()).sum();
        Self { each: RefCell::new(each), count }
    }

    /// Their moments, rad/s2.
    pub(super) fn moment(&self, [b, r, t]: [f64; 3], piece: Piece, z: &States) -> f64 {
        let at = [b, r, t, piece.direction, piece.half];
        let mut from = 0;
        let mut sum = 0.0;
        for (moment, rates) in self.each.borrow_mut().iter_mut() {
            sum += moment.evaluate(at, &z[from..from + rates.len()]);
            from += rates.len();
        }
        sum
    }

    /// How fast their states change, per s.
    pub(super) fn rates(&self, [b, r, t]: [f64; 3], piece: Piece, z: &States) -> States {
        let at = [b, r, t, piece.direction, piece.half];
        let mut out = States::default();
        let mut from = 0;
        for (_, rates) in self.each.borrow_mut().iter_mut() {
            let own = from..from + rates.len();
            for (out, rate) in out[own.clone()].iter_mut().zip(rates) {
                *out = rate.evaluate(at, &z[own.clone()]);
            }
            from = own.end;
        }
        out
    }

    /// The states `h` s after t along angles and rates `path` of the time from then.
    pub(super) fn along(
        &self,
        z: States,
        [t, h]: [f64; 2],
        piece: Piece,
        path: &dyn Fn(f64) -> [f64; 2],
    ) -> States {
        if self.count == 0 {
            return z;
        }
        follow(z, h, &mut |after, z| {
            let [b, r] = path(after);
            self.rates([b, r, t + after], piece, z)
        })
    }
}
