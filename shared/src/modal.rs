//! Natural frequency and damping ratio of b'' + 2 zeta wn b' + wn^2 b = 0, and what else they are called.
//!
//! Equation numbers are those of the thesis (Ramli 2008, chapter 3). Damping may be zero or negative
//! (self-excited oscillation); nothing here clamps it.

use crate::units::{hz_from_rad_s, rad_s_from_hz};
use core::f64::consts::LN_2;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The two modal parameters of one release.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Modal {
    /// wn, rad/s, positive.
    pub natural_frequency_rad_s: f64,
    /// zeta, 1; below 1 for an oscillation, negative where it grows.
    pub damping_ratio: f64,
}

impl Modal {
    /// From the equation of motion divided by the inertia, (3.8) and (3.9).
    ///
    /// `stiffness_rad2_s2` is wn^2, `damping_rad_s` is 2 zeta wn. `None` where the stiffness is not
    /// positive: the model then diverges instead of oscillating.
    pub fn from_stiffness_and_damping(stiffness_rad2_s2: f64, damping_rad_s: f64) -> Option<Self> {
        if stiffness_rad2_s2.is_nan() || stiffness_rad2_s2 <= 0.0 {
            return None;
        }
        let natural_frequency_rad_s = libm::sqrt(stiffness_rad2_s2);
        Some(Self {
            natural_frequency_rad_s,
            damping_ratio: damping_rad_s / (2.0 * natural_frequency_rad_s),
        })
    }

    /// From the damped frequency fd in Hz and the time to half amplitude in s, (3.23) to (3.25).
    ///
    /// A negative half-life is a doubling time; an infinite one means no damping.
    pub fn from_damped_frequency_and_half_life(damped_frequency_hz: f64, half_life_s: f64) -> Self {
        let decay_rate_per_s = LN_2 / half_life_s;
        let natural_frequency_rad_s =
            libm::hypot(rad_s_from_hz(damped_frequency_hz), decay_rate_per_s);
        Self { natural_frequency_rad_s, damping_ratio: decay_rate_per_s / natural_frequency_rad_s }
    }

    /// wn^2 in rad2/s2: stiffness over inertia, (3.8).
    pub fn stiffness_rad2_s2(&self) -> f64 {
        self.natural_frequency_rad_s * self.natural_frequency_rad_s
    }

    /// 2 zeta wn in rad/s: damping over inertia, (3.9).
    pub fn damping_rad_s(&self) -> f64 {
        2.0 * self.damping_ratio * self.natural_frequency_rad_s
    }

    /// zeta wn in 1/s: the amplitude falls as exp(-zeta wn t), (3.22).
    pub fn decay_rate_per_s(&self) -> f64 {
        self.damping_ratio * self.natural_frequency_rad_s
    }

    /// wd = wn sqrt(1 - zeta^2) in rad/s, (3.24); NaN beyond critical damping.
    pub fn damped_frequency_rad_s(&self) -> f64 {
        self.natural_frequency_rad_s * libm::sqrt(1.0 - self.damping_ratio * self.damping_ratio)
    }

    /// fd in Hz, (3.24).
    pub fn damped_frequency_hz(&self) -> f64 {
        hz_from_rad_s(self.damped_frequency_rad_s())
    }

    /// Time to half amplitude in s, (3.23); negative where the oscillation grows, infinite without damping.
    pub fn half_life_s(&self) -> f64 {
        LN_2 / self.decay_rate_per_s()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a} is not {b}");
    }

    /// The thesis's K3 wind-off release: fd 1.3592 Hz (Fig 3.9), half-life 21.97 s (Fig 3.10).
    #[test]
    fn spring_k3_of_the_thesis() {
        let modal = Modal::from_damped_frequency_and_half_life(1.3592, 21.97);
        close(modal.natural_frequency_rad_s, 8.5401, 1e-5);
        close(modal.damping_rad_s(), 1.3863 / 21.97, 1e-4);
        close(modal.damped_frequency_hz(), 1.3592, 1e-14);
        close(modal.half_life_s(), 21.97, 1e-14);
    }

    #[test]
    fn there_and_back_with_damping_of_either_sign() {
        for damping_ratio in [-0.05, 0.001, 0.1, 0.9] {
            let modal = Modal { natural_frequency_rad_s: 7.5, damping_ratio };
            let by_half_life = Modal::from_damped_frequency_and_half_life(
                modal.damped_frequency_hz(),
                modal.half_life_s(),
            );
            close(by_half_life.natural_frequency_rad_s, 7.5, 1e-14);
            close(by_half_life.damping_ratio, damping_ratio, 1e-13);
            let (k, c) = (modal.stiffness_rad2_s2(), modal.damping_rad_s());
            let by_moments = Modal::from_stiffness_and_damping(k, c).unwrap();
            close(by_moments.natural_frequency_rad_s, 7.5, 1e-14);
            close(by_moments.damping_ratio, damping_ratio, 1e-14);
        }
    }

    #[test]
    fn no_damping_is_an_infinite_half_life() {
        let modal = Modal { natural_frequency_rad_s: 7.5, damping_ratio: 0.0 };
        assert_eq!(modal.half_life_s(), f64::INFINITY);
        let again =
            Modal::from_damped_frequency_and_half_life(modal.damped_frequency_hz(), f64::INFINITY);
        assert_eq!(again.damping_ratio, 0.0);
    }

    #[test]
    fn a_model_without_stiffness_does_not_oscillate() {
        assert_eq!(Modal::from_stiffness_and_damping(0.0, 1.0), None);
        assert_eq!(Modal::from_stiffness_and_damping(-1.0, 1.0), None);
        assert_eq!(Modal::from_stiffness_and_damping(f64::NAN, 1.0), None);
    }
}
