//! From modal parameters to aerodynamic derivatives and back: chapter 3 of the thesis (Ramli 2008).
//!
//! Sign convention, the thesis's: Cn_beta > 0 lowers the stiffness (destabilising), Cn_r < 0 adds damping.
//! All derivatives are per radian. In pure yaw about a fixed axis the yaw rate and the rate of sideslip are
//! one motion, so what is called Cn_r here is the combined Cn_r - Cn_betadot of flight mechanics.

use crate::modal::Modal;
use core::f64::consts::PI;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The air stream.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Wind {
    /// rho, kg/m3.
    pub density_kg_m3: f64,
    /// V, m/s; 0 with the wind off.
    pub speed_m_s: f64,
}

/// The model's reference quantities.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Model {
    /// l, m.
    pub length_m: f64,
    /// A, m2.
    pub frontal_area_m2: f64,
}

/// The yaw moment derivatives about one axis, per radian.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct YawDerivatives {
    pub cn_beta: f64,
    /// Combined: Cn_r - Cn_betadot.
    pub cn_r: f64,
}

impl Wind {
    /// 1/2 rho V^2 A l in N m: the moment that Cn_beta multiplies, (3.3).
    pub fn stiffness_scale_nm(&self, model: &Model) -> f64 {
        0.5 * self.density_kg_m3
            * self.speed_m_s
            * self.speed_m_s
            * model.frontal_area_m2
            * model.length_m
    }

    /// 1/2 rho V A l^2 in N m s: the moment per yaw rate that Cn_r multiplies, (3.4).
    pub fn damping_scale_nm_s(&self, model: &Model) -> f64 {
        0.5 * self.density_kg_m3
            * self.speed_m_s
            * model.frontal_area_m2
            * model.length_m
            * model.length_m
    }
}

/// Nbeta_hat = -(wn_on^2 - wn_off^2) in rad2/s2, (3.26).
pub fn normalised_yaw_stiffness(on: &Modal, off: &Modal) -> f64 {
    off.stiffness_rad2_s2() - on.stiffness_rad2_s2()
}

/// Nr_hat = -(2 zeta wn_on - 2 zeta wn_off) in rad/s, (3.27).
pub fn normalised_yaw_damping(on: &Modal, off: &Modal) -> f64 {
    off.damping_rad_s() - on.damping_rad_s()
}

impl YawDerivatives {
    /// From a wind-on release and its wind-off reference on the same spring and axis, step 5 of 3.5:
    /// Cn_beta = 2 Izz Nbeta_hat / (rho V^2 A l), Cn_r = 2 Izz Nr_hat / (rho V A l^2).
    ///
    /// `inertia_kg_m2` is Izz about the same axis. Not finite where the wind speed is 0.
    pub fn from_releases(
        on: &Modal,
        off: &Modal,
        inertia_kg_m2: f64,
        wind: &Wind,
        model: &Model,
    ) -> Self {
        Self {
            cn_beta: inertia_kg_m2 * normalised_yaw_stiffness(on, off)
                / wind.stiffness_scale_nm(model),
            cn_r: inertia_kg_m2 * normalised_yaw_damping(on, off) / wind.damping_scale_nm_s(model),
        }
    }

    /// What the wind makes of a wind-off release, (3.8) and (3.9): the inverse of [`Self::from_releases`].
    ///
    /// `None` where the aerodynamic moment outweighs the springs (static divergence).
    pub fn wind_on(
        &self,
        off: &Modal,
        inertia_kg_m2: f64,
        wind: &Wind,
        model: &Model,
    ) -> Option<Modal> {
        let stiffness_nm = wind.stiffness_scale_nm(model) * self.cn_beta;
        let damping_nm_s = wind.damping_scale_nm_s(model) * self.cn_r;
        Modal::from_stiffness_and_damping(
            off.stiffness_rad2_s2() - stiffness_nm / inertia_kg_m2,
            off.damping_rad_s() - damping_nm_s / inertia_kg_m2,
        )
    }
}

/// Cy_beta from Cn_beta, or Cy_r from Cn_r, at the two axes: (mid - front) l / dl, (3.19) and (3.20).
///
/// `axis_offset_m` is dl, how far the front axis lies ahead of the middle one.
pub fn side_force(mid: f64, front: f64, length_m: f64, axis_offset_m: f64) -> f64 {
    (mid - front) * length_m / axis_offset_m
}

/// The yaw derivative at the front axis from the one at the middle axis: the inverse of [`side_force`].
pub fn at_front_axis(mid: f64, side_force: f64, length_m: f64, axis_offset_m: f64) -> f64 {
    mid - side_force * axis_offset_m / length_m
}

/// Kr = 2 Ks b^2 in N m/rad of a pair of springs, (3.14).
///
/// `spring_arm_m` is the distance of each spring from the axis of rotation.
pub fn torsional_stiffness_nm(spring_stiffness_n_per_m: f64, spring_arm_m: f64) -> f64 {
    2.0 * spring_stiffness_n_per_m * spring_arm_m * spring_arm_m
}

/// Izz = Kr / wn_off^2 in kg m2 from one wind-off release, (3.13).
pub fn inertia_kg_m2(torsional_stiffness_nm: f64, off: &Modal) -> f64 {
    torsional_stiffness_nm / off.stiffness_rad2_s2()
}

/// km = pi f l / V, f the damped frequency of the wind-on release. Infinite with the wind off.
pub fn reduced_frequency(on: &Modal, wind: &Wind, model: &Model) -> f64 {
    PI * on.damped_frequency_hz() * model.length_m / wind.speed_m_s
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: Model = Model { length_m: 0.625, frontal_area_m2: 0.036 };
    const WIND: Wind = Wind { density_kg_m3: 1.2, speed_m_s: 10.0 };
    const AXIS_OFFSET_M: f64 = 0.05;

    /// Table 3.3 with the front axis of Table 3.4: Cn_beta, Cn_r, Cy_beta, Cy_r, Cn_beta front.
    const TABLE_3_3: [[f64; 5]; 8] = [
        [0.5120, -0.0769, 1.9719, 0.7967, 0.3542],
        [0.5842, -0.0898, 3.2180, 0.5764, 0.3268],
        [0.5321, -0.0901, 2.1192, 0.5729, 0.3626],
        [0.5462, -0.1009, 2.4591, 0.2913, 0.3495],
        [0.5202, -0.1002, 2.0465, 0.4492, 0.3564],
        [0.5847, -0.1062, 3.4285, 0.8613, 0.3104],
        [0.5615, -0.1027, 2.6974, 0.5731, 0.3457],
        [0.4426, -0.1091, 1.4104, 0.3870, 0.3297],
    ];

    /// Table 4.8, conventional method: Cn_beta, Cn_r, Cy_beta, Cy_r.
    const TABLE_4_8: [[f64; 4]; 8] = [
        [0.5516, -0.0829, 2.8663, 0.5638],
        [0.6294, -0.0968, 4.1513, 0.3363],
        [0.5733, -0.0971, 3.0425, 0.3325],
        [0.5885, -0.1087, 3.3813, 0.0538],
        [0.5604, -0.1080, 2.9513, 0.1988],
        [0.6299, -0.1144, 4.3438, 0.5613],
        [0.6049, -0.1107, 3.6300, 0.3063],
        [0.4768, -0.1175, 2.2100, 0.1238],
    ];

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a} is not {b}");
    }

    #[test]
    fn side_force_of_table_3_3_from_the_axes_of_table_3_4() {
        for [mid, _, cy_beta, _, front] in TABLE_3_3 {
            let computed = side_force(mid, front, MODEL.length_m, AXIS_OFFSET_M);
            // Table 3.4 has four decimals, so each difference may be 1e-4 out, times 12.5.
            assert!((computed - cy_beta).abs() <= 0.001, "{computed} is not {cy_beta}");
            close(at_front_axis(mid, computed, MODEL.length_m, AXIS_OFFSET_M), front, 1e-12);
        }
    }

    /// Table 4.8's conventional column is Table 3.3 with 0.11 kg m2 as inertia: the ratio is one number an
    /// axis. That makes the front axis's inertia 0.1209, so the text's 1.205 kg m2 is 0.1205.
    #[test]
    fn table_4_8_is_table_3_3_with_another_inertia() {
        for ([mid, cn_r, _, cy_r, front], [mid_8, cn_r_8, cy_beta_8, cy_r_8]) in
            TABLE_3_3.into_iter().zip(TABLE_4_8)
        {
            close(mid_8, mid * 1.0774, 4e-4);
            close(cn_r_8, cn_r * 1.0774, 1.2e-3);
            let front_8 = at_front_axis(mid_8, cy_beta_8, MODEL.length_m, AXIS_OFFSET_M);
            close(front_8, front * 0.910, 1e-3);
            // The same holds for the damping at the front axis.
            let front_r = at_front_axis(cn_r, cy_r, MODEL.length_m, AXIS_OFFSET_M);
            let front_r_8 = at_front_axis(cn_r_8, cy_r_8, MODEL.length_m, AXIS_OFFSET_M);
            close(front_r_8, front_r * 0.910, 2e-3);
        }
        close(0.11 / 1.0774, 0.1021, 1e-3);
        close(0.11 / 0.910, 0.1209, 1e-3);
    }

    /// An inertia in error scales every derivative by the same factor: what Table 4.8 shows.
    #[test]
    fn derivatives_are_proportional_to_the_inertia() {
        let off = Modal { natural_frequency_rad_s: 8.0, damping_ratio: 0.004 };
        let on = Modal { natural_frequency_rad_s: 7.6, damping_ratio: 0.01 };
        let a = YawDerivatives::from_releases(&on, &off, 0.1021, &WIND, &MODEL);
        let b = YawDerivatives::from_releases(&on, &off, 0.11, &WIND, &MODEL);
        close(b.cn_beta / a.cn_beta, 1.0774, 1e-4);
        close(b.cn_r / a.cn_r, 1.0774, 1e-4);
    }

    #[test]
    fn signs_are_those_of_the_thesis() {
        let off = Modal { natural_frequency_rad_s: 8.0, damping_ratio: 0.004 };
        let derivatives = YawDerivatives { cn_beta: 0.5321, cn_r: -0.0901 };
        let on = derivatives.wind_on(&off, 0.101, &WIND, &MODEL).unwrap();
        assert!(on.natural_frequency_rad_s < off.natural_frequency_rad_s, "Cn_beta > 0 softens");
        assert!(on.damping_rad_s() > off.damping_rad_s(), "Cn_r < 0 damps");
        let driven = YawDerivatives { cn_beta: 0.5, cn_r: 0.3 };
        assert!(driven.wind_on(&off, 0.101, &WIND, &MODEL).unwrap().damping_ratio < 0.0);
        let diverged = YawDerivatives { cn_beta: 20.0, cn_r: 0.0 };
        assert_eq!(diverged.wind_on(&off, 0.101, &WIND, &MODEL), None);
    }

    #[test]
    fn there_and_back() {
        for [cn_beta, cn_r, ..] in TABLE_3_3 {
            let off = Modal { natural_frequency_rad_s: 12.6, damping_ratio: 0.0025 };
            let truth = YawDerivatives { cn_beta, cn_r };
            let on = truth.wind_on(&off, 0.101, &WIND, &MODEL).unwrap();
            let again = YawDerivatives::from_releases(&on, &off, 0.101, &WIND, &MODEL);
            close(again.cn_beta, cn_beta, 1e-12);
            close(again.cn_r, cn_r, 1e-12);
        }
    }

    /// (3.26) and (3.27) as the thesis writes them, from fd and half-life.
    #[test]
    fn normalised_derivatives_by_frequency_and_half_life() {
        let (fd_on, half_on, fd_off, half_off) = (1.2731, 5.5, 1.3592, 21.97);
        let on = Modal::from_damped_frequency_and_half_life(fd_on, half_on);
        let off = Modal::from_damped_frequency_and_half_life(fd_off, half_off);
        let ln2 = core::f64::consts::LN_2;
        let stiffness = -(4.0 * PI * PI * (fd_on * fd_on - fd_off * fd_off)
            + ln2 * ln2 * (1.0 / (half_on * half_on) - 1.0 / (half_off * half_off)));
        close(normalised_yaw_stiffness(&on, &off), stiffness, 1e-12);
        close(
            normalised_yaw_damping(&on, &off),
            -2.0 * ln2 * (1.0 / half_on - 1.0 / half_off),
            1e-12,
        );
    }

    #[test]
    fn rig_quantities() {
        close(torsional_stiffness_nm(306.0, 0.1), 6.12, 1e-12);
        let off = Modal::from_stiffness_and_damping(6.12 / 0.101, 0.0631).unwrap();
        close(inertia_kg_m2(6.12, &off), 0.101, 1e-12);
        // K4 in the wind, ten windows of Fig 4.20 around 12.82 rad/s: Table 3.3's km 0.40.
        let on = Modal { natural_frequency_rad_s: 12.82, damping_ratio: 0.0062 };
        assert!((reduced_frequency(&on, &WIND, &MODEL) - 0.40).abs() < 0.005);
    }
}
