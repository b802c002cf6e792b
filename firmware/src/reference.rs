//! The wind-off result that wind-on releases are held against.
//!
//! It belongs to one rig, a spring and an axis with a model on it, and to one kind of result: the network's or the
//! refined one. It is given up where the rig changes and where its last wind-off release is of no use, so that no
//! release is ever held against another spring.

use yawrig_shared::derivatives::{reduced_frequency, Model, YawDerivatives};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Condition, Derivatives, Flags, Measured};

/// A result with its standard uncertainties.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    pub modal: Modal,
    pub natural_frequency_u: f64,
    pub damping_ratio_u: f64,
}

/// Wind-off result of the rig at hand, once there is one.
#[derive(Clone, Copy, Debug, Default)]
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

    /// The coming releases are made under this condition.
    pub fn mount(&mut self, condition: &Condition) {
        let rig = Some((condition.rig, condition.model));
        if self.rig != rig {
            *self = Self { rig, wind_off: None };
        }
    }

    /// A release has ended, with this result if it has one. Wind off: it is the reference from now on, or, where
    /// anything is the matter with it, there is none. Wind on: its derivatives, or the flag that says that there is
    /// nothing to hold it against.
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
    // wn^2 and 2 zeta wn of both releases, which know nothing of each other.
    let stiffness_u =
        |known: &Known| 2.0 * known.modal.natural_frequency_rad_s * known.natural_frequency_u;
    let damping_u = |known: &Known| {
        let Modal { natural_frequency_rad_s, damping_ratio } = known.modal;
        2.0 * libm::hypot(
            damping_ratio * known.natural_frequency_u,
            natural_frequency_rad_s * known.damping_ratio_u,
        )
    };
    let both = |u: &dyn Fn(&Known) -> f64| inertia_kg_m2 * libm::hypot(u(on), u(off));
    let measured = |value: f64, u: f64| Measured { value: value as f32, u: u as f32 };
    Derivatives {
        cn_beta: measured(cn_beta, both(&stiffness_u) / wind.stiffness_scale_nm(model)),
        cn_r: measured(cn_r, both(&damping_u) / wind.damping_scale_nm_s(model)),
        reduced_frequency: reduced_frequency(&on.modal, wind, model) as f32,
        reference_release,
    }
}
