//! Angles that begin anew after a turn, as counts that do not: two turns are all counts of 16 bits.

use crate::sensor::FINE_BITS;

/// Degrees a count of what [`Turns::fine`] gives.
pub const DEGREES_PER_COUNT: f32 = 720.0 / 65_536.0;
/// A turn in parts of a count.
const TURN: i64 = 1 << (15 + FINE_BITS);
/// Bits of the factor from the sensor's counts to these.
const FACTOR_BITS: u32 = 16;

/// Follows an angle about the middle of a turn.
#[derive(Clone, Copy, Debug)]
pub struct Turns {
    per_turn: i32,
    factor: i64,
    /// From the middle, in the sensor's own counts; none before the first.
    at: Option<i32>,
}

impl Turns {
    /// Of so many counts a turn, 2 to 4 194 304.
    pub const fn new(per_turn: u32) -> Self {
        assert!(per_turn >= 2 && per_turn <= 1 << 22, "counts of a turn");
        let per_turn = per_turn as i32;
        let factor = ((TURN << FACTOR_BITS) + per_turn as i64 / 2) / per_turn as i64;
        Self { per_turn, factor, at: None }
    }

    pub const fn per_turn(&self) -> i32 {
        self.per_turn
    }

    /// Degrees from one of the sensor's counts to the next.
    pub fn step_deg(&self) -> f32 {
        360.0 / self.per_turn as f32
    }

    /// A position within its turn, the shorter way from the last one.
    pub fn turn_to(&mut self, position: u32) {
        let position = (position % self.per_turn as u32) as i32 - self.per_turn / 2;
        let at = self.at.unwrap_or(position);
        let step = (position - at).rem_euclid(self.per_turn);
        let step = if step > self.per_turn / 2 { step - self.per_turn } else { step };
        self.set(at + step);
    }

    /// So many counts further.
    pub fn turn_by(&mut self, step: i32) {
        self.set(self.at.unwrap_or(0) + step);
    }

    fn set(&mut self, at: i32) {
        // A model that was turned by more than one turn is looked at from the next.
        let turns = at / self.per_turn;
        self.at = Some(at - turns * self.per_turn);
    }

    /// Where it is, from counts of zero on: their middle is that of the turn.
    pub fn fine(&self) -> i32 {
        let at = i64::from(self.at.unwrap_or(0));
        (((at * self.factor) >> FACTOR_BITS) + TURN) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_goes_on_over_the_end_of_its_turn_either_way() {
        for per_turn in [4096, 4000, 1 << 18] {
            let mut turns = Turns::new(per_turn);
            let degrees = |turns: &Turns| {
                (f64::from(turns.fine()) / f64::from(1 << FINE_BITS) - 32_768.0)
                    * f64::from(DEGREES_PER_COUNT)
            };
            for angle_deg in (-900..=900).chain((-900..900).rev()).map(|k| 0.37 * f64::from(k)) {
                let share = (0.5 + angle_deg / 360.0).rem_euclid(1.0);
                turns.turn_to((share * f64::from(per_turn)) as u32 % per_turn);
                let off = degrees(&turns) - angle_deg;
                // It began a whole turn off, and is nowhere else than a count's width from there.
                let whole = (off / 360.0).round() * 360.0;
                assert!(
                    (off - whole).abs() <= 360.0 / f64::from(per_turn) + 1e-4,
                    "{angle_deg}: {off}"
                );
            }
        }
    }
}
