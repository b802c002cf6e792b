//! The eight springs and the derivatives planted on them.

use super::Axis;
use crate::error::{Error, Quantity, Result};
use yawrig_shared::derivatives::{at_front_axis, YawDerivatives};

/// A pair of springs and what the wind does to the model while it oscillates on them, per radian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    pub name: &'static str,
    /// Linear stiffness Ks of each, N/m.
    pub stiffness_n_per_m: f64,
    mid: YawDerivatives,
    front_cn_beta: f64,
    cy_r: f64,
}

const fn spring(
    name: &'static str,
    stiffness_n_per_m: f64,
    cn_beta: f64,
    cn_r: f64,
    front_cn_beta: f64,
    cy_r: f64,
) -> Spring {
    Spring { name, stiffness_n_per_m, mid: YawDerivatives { cn_beta, cn_r }, front_cn_beta, cy_r }
}

/// Table 3.2's stiffnesses with the derivatives of Table 3.3 and, for the front axis, Table 3.4.
pub const SPRINGS: [Spring; 8] = [
    spring("K1", 119.0, 0.5120, -0.0769, 0.3542, 0.7967),
    spring("K2", 214.0, 0.5842, -0.0898, 0.3268, 0.5764),
    spring("K3", 306.0, 0.5321, -0.0901, 0.3626, 0.5729),
    spring("K4", 806.0, 0.5462, -0.1009, 0.3495, 0.2913),
    spring("K5", 1051.0, 0.5202, -0.1002, 0.3564, 0.4492),
    spring("K6", 1751.0, 0.5847, -0.1062, 0.3104, 0.8613),
    spring("K7", 2242.0, 0.5615, -0.1027, 0.3457, 0.5731),
    spring("K8", 2594.0, 0.4426, -0.1091, 0.3297, 0.3870),
];

impl Spring {
    /// The spring of this name, K1 to K8.
    ///
    /// # Errors
    /// For any other name.
    pub fn named(name: &str) -> Result<Self> {
        SPRINGS.into_iter().find(|spring| spring.name.eq_ignore_ascii_case(name)).ok_or_else(|| {
            Error::wrong(
                Quantity::Spring,
                format!("there is no spring {name}"),
                "the springs are K1 to K8",
            )
        })
    }

    /// Yaw moment derivatives about `axis`; the damping at the front axis follows from Cy_r.
    pub(super) fn derivatives(
        &self,
        axis: Axis,
        length_m: f64,
        axis_offset_m: f64,
    ) -> YawDerivatives {
        match axis {
            Axis::Mid => self.mid,
            Axis::Front => YawDerivatives {
                cn_beta: self.front_cn_beta,
                cn_r: at_front_axis(self.mid.cn_r, self.cy_r, length_m, axis_offset_m),
            },
        }
    }
}
