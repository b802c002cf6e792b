//! The wind-off result that wind-on releases are held against.

use yawrig_shared::derivatives::{reduced_frequency, YawDerivatives};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Condition, Derivatives};

/// Wind-off result of the axis and spring at hand, once there is one.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reference(Option<Modal>);

impl Reference {
    pub const fn new() -> Self {
        Self(None)
    }

    pub fn is_known(&self) -> bool {
        self.0.is_some()
    }

    /// Derivatives of a wind-on release against the wind-off one before it, which this becomes
    /// where the wind is off.
    #[inline(never)]
    pub fn derivatives(
        &mut self,
        modal: &Modal,
        condition: Option<&Condition>,
    ) -> Option<Derivatives> {
        let Condition { wind, model, inertia_kg_m2 } = condition?;
        if wind.speed_m_s == 0.0 {
            self.0 = Some(*modal);
            return None;
        }
        let reference = self.0?;
        if *inertia_kg_m2 <= 0.0 {
            return None;
        }
        let YawDerivatives { cn_beta, cn_r } =
            YawDerivatives::from_releases(modal, &reference, *inertia_kg_m2, wind, model);
        Some(Derivatives {
            cn_beta: cn_beta as f32,
            cn_r: cn_r as f32,
            reduced_frequency: reduced_frequency(modal, wind, model) as f32,
        })
    }
}
