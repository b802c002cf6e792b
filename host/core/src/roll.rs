//! Roll damping as naval architects write it, after the inertia is known.
//!
//! A44 p' + B0 sign(p) + B1 p + B2 abs(p) p + B3 p^3 + C1 phi + C3 phi^3 + C5 phi^5 = 0,
//!
//! phi being the roll angle (rad) from rest and p its rate. Equivalent linear damping Be(phi_a) takes as much
//! out of a cycle of amplitude phi_a as all of the damping does (J. F. Dalzell, J. Ship Res. 22, 1978; Y.
//! Himeno, Univ. of Michigan Rep. 239, 1981): 2 zeta wn A44 with the natural frequency and the damping ratio
//! at that amplitude, whatever the law.

use crate::effects::{Effect, RollTerm};
use crate::fit::fitting::Modal;
use crate::identify::AtAmplitude;
use crate::quantity::Quantity;
use serde::Serialize;
use std::collections::BTreeMap;

/// Standard gravity, m/s2.
const GRAVITY_M_S2: f64 = 9.806_65;

/// What is known of the ship.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ship {
    /// A44, added inertia included.
    Inertia {
        /// In kg m2.
        a44_kg_m2: f64,
    },
    /// Metacentric height and displacement: C1 = g GM m, and A44 follows from the natural frequency.
    Stability {
        /// GM, m.
        gm_m: f64,
        /// Of the ship, kg.
        displacement_kg: f64,
    },
}

impl Ship {
    /// A44 of a ship of this natural frequency (rad/s).
    fn a44_kg_m2(self, wn: Quantity) -> Quantity {
        match self {
            Self::Inertia { a44_kg_m2 } => Quantity::exact(a44_kg_m2),
            Self::Stability { gm_m, displacement_kg } => {
                let a44 = GRAVITY_M_S2 * gm_m * displacement_kg / wn.value.powi(2);
                Quantity::new(a44, 2.0 * a44 * wn.u / wn.value)
            }
        }
    }
}

/// A coefficient over the inertia, and of the ship where that is known.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Coefficient {
    /// `B1`.
    pub name: &'static str,
    /// Over A44.
    pub over_a44: Quantity,
    /// Its unit.
    pub over_a44_unit: &'static str,
    /// Of the ship.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of_ship: Option<Quantity>,
    /// Its unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of_ship_unit: Option<&'static str>,
}

/// Equivalent linear damping of a cycle that begins at an amplitude.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Equivalent {
    /// Where the cycle begins.
    pub amplitude_deg: f64,
    /// Be over A44.
    pub over_a44_1_s: Quantity,
    /// Be of the ship.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of_ship_n_m_s: Option<Quantity>,
}

/// A roll decay in the coefficients of its field.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RollDecay {
    /// A44, where the ship is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub a44_kg_m2: Option<Quantity>,
    /// Those that the model has; none of a law that was measured and has no formula.
    pub coefficients: Vec<Coefficient>,
    /// Effects of the model that are none of the coefficients.
    pub beside: Vec<Effect>,
    /// From the largest amplitude of the record to the smallest.
    pub equivalent: Vec<Equivalent>,
}

impl RollDecay {
    /// Of a model with these `effects`, their numbers by name (`quadratic_damping.d`), and what it is at rest
    /// and against amplitude.
    ///
    /// ```
    /// use yawrig_core::effects::Effect;
    /// use yawrig_core::diagnosis::diagnose::Modal;
    /// use yawrig_core::quantity::Quantity;
    /// use yawrig_core::roll::{RollDecay, Ship};
    ///
    /// let modal = Modal {
    ///     natural_frequency_rad_s: Quantity::new(0.5, 0.001),
    ///     damping_ratio: Quantity::new(0.02, 0.001),
    /// };
    /// let numbers = [("quadratic_damping.d".to_owned(), Quantity::new(0.3, 0.01))].into();
    /// let ship = Ship::Inertia { a44_kg_m2: 100.0 };
    /// let roll = RollDecay::of_model(&modal, &[Effect::QuadraticDamping], &numbers, &[], Some(ship));
    /// let named = |name| roll.coefficients.iter().find(|c| c.name == name).and_then(|c| c.of_ship);
    /// assert!(named("B1").is_some_and(|b1| b1.holds(2.0, 0.1)));
    /// assert!(named("B2").is_some_and(|b2| b2.holds(30.0, 0.1)));
    /// ```
    pub fn of_model(
        modal: &Modal,
        effects: &[Effect],
        numbers: &BTreeMap<String, Quantity>,
        at: &[AtAmplitude],
        ship: Option<Ship>,
    ) -> Self {
        let (wn, zeta) = (modal.natural_frequency_rad_s, modal.damping_ratio);
        let mut found = Self::of_law(wn, at, ship);
        let a44 = found.a44_kg_m2;
        let mut add = |name, over_a44: Quantity, over_a44_unit, unit| {
            let of_ship = a44.map(|a44| product(over_a44, a44));
            let of_ship_unit = of_ship.map(|_| unit);
            found.coefficients.push(Coefficient {
                name,
                over_a44,
                over_a44_unit,
                of_ship,
                of_ship_unit,
            });
        };
        let of = |term: RollTerm| {
            let effect = effects.iter().find(|e| e.roll_term() == Some(term))?;
            numbers.get(&format!("{effect}.{}", effect.parameters()[0].name)).copied()
        };
        if let Some(c) = of(RollTerm::Friction) {
            add("B0", c, "1/s2", "N m");
        }
        add("B1", product(Quantity::exact(2.0), product(zeta, wn)), "1/s", "N m s");
        if let Some(d) = of(RollTerm::Quadratic) {
            add("B2", d, "1", "N m s2");
        }
        if let Some(c) = of(RollTerm::AngleSquared) {
            let cycle = Quantity::new(1.0, 2.0 * wn.u / wn.value);
            let b3 = product(c, cycle).by(|c| c / (3.0 * wn.value.powi(2)));
            add("B3", b3, "s", "N m s3");
        }
        let c1 = Quantity::new(wn.value.powi(2), 2.0 * wn.value * wn.u);
        add("C1", c1, "1/s2", "N m");
        for (term, name) in [(RollTerm::StiffnessCubed, "C3"), (RollTerm::StiffnessFifth, "C5")] {
            if let Some(k) = of(term) {
                add(name, k, "1/s2", "N m");
            }
        }
        // By the metacentric height it is known: what is not known of A44 and of wn cancels.
        if let Some(Ship::Stability { gm_m, displacement_kg }) = ship {
            let c1 = found.coefficients.iter_mut().find(|c| c.name == "C1").expect("added above");
            c1.of_ship = Some(Quantity::exact(GRAVITY_M_S2 * gm_m * displacement_kg));
        }
        let is_beside = |e: &&Effect| e.roll_term().is_none() && !e.moves_rest();
        found.beside = effects.iter().filter(is_beside).cloned().collect();
        found
    }

    /// Of a law that was measured: its equivalent linear damping.
    pub fn of_law(wn: Quantity, at: &[AtAmplitude], ship: Option<Ship>) -> Self {
        let a44_kg_m2 = ship.map(|ship| ship.a44_kg_m2(wn));
        let equivalent = at.iter().map(|at| {
            let by_rate = product(at.damping_ratio, at.natural_frequency_rad_s);
            let over_a44_1_s = product(Quantity::exact(2.0), by_rate);
            let of_ship_n_m_s = a44_kg_m2.map(|a44| product(over_a44_1_s, a44));
            Equivalent { amplitude_deg: at.amplitude_deg, over_a44_1_s, of_ship_n_m_s }
        });
        let equivalent = equivalent.collect();
        Self { a44_kg_m2, coefficients: vec![], beside: vec![], equivalent }
    }
}

/// Of two numbers whose errors are independent of each other.
fn product(a: Quantity, b: Quantity) -> Quantity {
    Quantity::new(a.value * b.value, (a.u * b.value).hypot(a.value * b.u))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::at_amplitude::at_amplitudes;
    use crate::fit::fitting::{fit_added, fit_plain};
    use crate::fit::free_decay::FreeDecay;
    use crate::record::Record;

    /// A model ship's roll, followed by Runge and Kutta's steps; coefficients, and Be by the closed form of a
    /// harmonic cycle.
    #[test]
    fn planted_coefficients_come_out_and_equivalent_damping_is_that_of_the_closed_form() {
        let (b1, b2, c1, c3) = (0.06, 0.25, 5.8, -3.0);
        let rate_of = |phi: f64, p: f64| -b1 * p - b2 * p.abs() * p - c1 * phi - c3 * phi.powi(3);
        let (h, mut phi, mut p) = (0.002, 25f64.to_radians(), 0.0);
        let (mut time_s, mut roll_deg) = (Vec::new(), Vec::new());
        for k in 0..30_000 {
            if k % 10 == 0 {
                time_s.push(h * f64::from(k));
                roll_deg.push(phi.to_degrees() + 0.01 * f64::from(k / 10 % 3 - 1));
            }
            let step = |(x, v): (f64, f64), by: f64| {
                let (x, v) = (phi + by * x, p + by * v);
                (v, rate_of(x, v))
            };
            let k1 = step((0.0, 0.0), 0.0);
            let k2 = step(k1, 0.5 * h);
            let k3 = step(k2, 0.5 * h);
            let k4 = step(k3, h);
            phi += h / 6.0 * (k1.0 + 2.0 * (k2.0 + k3.0) + k4.0);
            p += h / 6.0 * (k1.1 + 2.0 * (k2.1 + k3.1) + k4.1);
        }
        let decay =
            FreeDecay::from_record(&Record::new("roll", time_s, roll_deg)).expect("a free decay");
        let plain = fit_plain(&decay, false, decay.yaw_rad.len());
        let damped = fit_added(&decay, &plain, &Effect::QuadraticDamping);
        let model = fit_added(&decay, &damped, &Effect::CubicStiffness);
        let numbers = model.effect_parameters().into_iter().collect();
        let at = at_amplitudes(&decay, &model);
        let ship = Ship::Stability { gm_m: 0.05, displacement_kg: 40.0 };
        let modal = Modal {
            natural_frequency_rad_s: model.natural_frequency_rad_s(),
            damping_ratio: model.damping_ratio(),
        };
        let of = |ship| RollDecay::of_model(&modal, &model.structure.effects, &numbers, &at, ship);
        let roll = of(Some(ship));
        let a44 = 9.806_65 * 0.05 * 40.0 / c1;
        for (name, value) in [("B1", b1), ("B2", b2), ("C1", c1), ("C3", c3)] {
            let found = roll.coefficients.iter().find(|c| c.name == name).expect(name);
            // What the two integrators differ by is more than the noise leaves.
            let off = (found.over_a44.value / value - 1.0).abs();
            assert!(off < 1e-3, "{name} {} {value}", found.over_a44);
            let of_ship = found.of_ship.expect("with GM");
            assert!((of_ship.value / (value * a44) - 1.0).abs() < 0.01, "{name} {of_ship}");
        }
        assert!(roll.beside.is_empty());
        for be in &roll.equivalent {
            // In the middle of the cycle.
            let of_cycle = be.over_a44_1_s.value / c1.sqrt();
            let middle =
                be.amplitude_deg.to_radians() * (-0.5 * std::f64::consts::PI * of_cycle).exp();
            let w = (c1 + 0.75 * c3 * middle * middle).sqrt();
            let closed = b1 + 8.0 / (3.0 * std::f64::consts::PI) * w * middle * b2;
            // That of a harmonic: its error goes with the square of the amplitude, 2.6 % from 25 deg.
            let allowed = 0.002 + 0.2 * middle * middle;
            assert!((be.over_a44_1_s.value / closed - 1.0).abs() < allowed, "{be:?} {closed}");
        }
        let without = of(None);
        assert!(without.a44_kg_m2.is_none() && without.coefficients[0].of_ship.is_none());
    }
}
