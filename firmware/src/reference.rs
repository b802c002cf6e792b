//! The wind-off result that wind-on releases are held against.
//!
//! It belongs to one rig, a spring and an axis with a model on it, and to one kind of result: the network's
//! or the refined one. It is given up where the rig changes and where its last wind-off release is of no use,
//! so that no release is ever held against another spring.

use serde::{Deserialize, Serialize};
use yawrig_shared::derivatives::{reduced_frequency, Model, YawDerivatives};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Condition, Derivatives, Flags, Measured};

/// A result with its standard uncertainties.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Known {
    pub modal: Modal,
    pub natural_frequency_u: f32,
    pub damping_ratio_u: f32,
    /// Of the clock, relative, and not part of the two: it is one clock for all releases.
    pub clock_u: f32,
}

/// Wind-off result of the rig at hand, once there is one.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Reference {
    rig: Option<(u32, Model)>,
    wind_off: Option<(u32, Known)>,
}

impl Reference {
    pub const fn new() -> Self {
        Self { rig: None, wind_off: None }
    }

    /// The wind-off release, if there is one.
    pub fn release(&self) -> Option<u32> {
        self.wind_off.map(|(release, _)| release)
    }

    /// The wind-off result is none any more; the rig stays mounted.
    pub fn forget(&mut self) {
        self.wind_off = None;
    }

    /// The coming releases are made under this condition.
    pub fn mount(&mut self, condition: &Condition) {
        let rig = Some((condition.rig, condition.model));
        if self.rig != rig {
            *self = Self { rig, wind_off: None };
        }
    }

    /// A release has ended, with this result if it has one. Wind off: it is the reference from now on, or,
    /// where anything is the matter with it, there is none. Wind on: its derivatives, or the flag that says
    /// that there is nothing to hold it against.
    #[inline(never)]
    pub fn judge(
        &mut self,
        release: u32,
        known: Option<Known>,
        flags: &mut Flags,
        condition: Option<&Condition>,
    ) -> Option<Derivatives> {
        let condition = condition?;
        // A late result, and the rig has been changed in the meantime.
        let mounted = self.rig == Some((condition.rig, condition.model));
        if condition.wind.speed_m_s == 0.0 {
            if mounted {
                let fit = known.filter(|_| !flags.unfit_as_reference());
                self.wind_off = fit.map(|known| (release, known));
            }
            return None;
        }
        let known = known.filter(|_| !flags.unusable())?;
        if condition.inertia_kg_m2 <= 0.0 {
            return None;
        }
        let Some((reference_release, off)) = self.wind_off.filter(|_| mounted) else {
            flags.set(Flags::NO_REFERENCE);
            return None;
        };
        Some(derivatives(&known, &off, reference_release, condition))
    }
}

fn derivatives(
    on: &Known,
    off: &Known,
    reference_release: u32,
    condition: &Condition,
) -> Derivatives {
    let Condition { wind, model, inertia_kg_m2, .. } = condition;
    let YawDerivatives { cn_beta, cn_r } =
        YawDerivatives::from_releases(&on.modal, &off.modal, *inertia_kg_m2, wind, model);
    // wn^2 and 2 zeta wn of both releases, which know nothing of each other. In single precision: it is an
    // uncertainty.
    let mut variance = [0.0_f32; 2];
    for Known { modal, natural_frequency_u, damping_ratio_u, .. } in [on, off] {
        let (wn, zeta) = (modal.natural_frequency_rad_s as f32, modal.damping_ratio as f32);
        let (by_wn, by_zeta) = (zeta * natural_frequency_u, wn * damping_ratio_u);
        variance[0] += wn * wn * natural_frequency_u * natural_frequency_u;
        variance[1] += by_wn * by_wn + by_zeta * by_zeta;
    }
    // Cn_beta goes with the square of the clock's rate, Cn_r with the rate.
    let measured = |value: f64, variance: f32, scale: f64, power: f32| {
        let by_clock = power * on.clock_u * value as f32;
        let per = 2.0 * (*inertia_kg_m2 / scale) as f32;
        let u = libm::sqrtf(variance * per * per + by_clock * by_clock);
        Measured { value: value as f32, u }
    };
    Derivatives {
        cn_beta: measured(cn_beta, variance[0], wind.stiffness_scale_nm(model), 2.0),
        cn_r: measured(cn_r, variance[1], wind.damping_scale_nm_s(model), 1.0),
        reduced_frequency: reduced_frequency(&on.modal, wind, model) as f32,
        reference_release,
    }
}
