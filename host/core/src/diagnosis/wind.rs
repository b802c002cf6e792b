//! What an effect's coefficients say of the wind: whether they go with the power of its speed that their
//! dimension asks for, the dimensionless derivative that they then are, and from which source a model takes
//! the effect.

use crate::derivatives::campaign::Campaign;
use crate::derivatives::table::ByAxis;
use crate::diagnosis::origin::{changes_with_wind, Origin, Seen};
use crate::effects::{Effect, SourceKind};
use crate::quantity::{weighted_mean, Quantity, CHANCE};
use serde::Serialize;
use yawrig_shared::axis::Axis;

/// The test that an effect's coefficient goes with a power of the wind speed, the same on all springs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GrowsAs {
    /// By the dimension of the coefficient.
    pub power: f64,
    /// Of the coefficients with the wind on about one for each axis.
    pub chi_squared: f64,
    /// Coefficients less those fitted.
    pub degrees: usize,
}

impl GrowsAs {
    /// Of the wind-on ones of `seen`; `None` for one wind speed, and where no dimension says a power.
    pub(super) fn new(effect: &Effect, seen: &[Seen]) -> Option<Self> {
        let power = effect.wind_power(&[]).filter(|power| power.is_finite())?;
        let on: Vec<&Seen> =
            seen.iter().filter(|s| s.is_on() && s.coefficient.is_known()).collect();
        if on.iter().all(|s| s.is_as_fast(on[0])) {
            return None;
        }
        let (mut chi_squared, mut fitted) = (0.0, 0);
        for axis in Axis::BOTH {
            let at: Vec<Quantity> =
                on.iter().filter(|s| s.condition.axis == axis).map(|s| s.reduced(power)).collect();
            let Some(mean) = weighted_mean(at.iter().copied()) else { continue };
            chi_squared += crate::quantity::chi_squared(at, mean.value);
            fitted += 1;
        }
        let degrees = on.len().saturating_sub(fitted);
        (degrees > 0).then_some(Self { power, chi_squared, degrees })
    }

    /// Whether chance explains how far the coefficients are off it.
    pub fn holds(&self) -> bool {
        let degrees = self.degrees as f64;
        self.chi_squared <= degrees + CHANCE * (2.0 * degrees).sqrt()
    }
}

impl Seen {
    /// The coefficient over the wind speed's `power`.
    fn reduced(&self, power: f64) -> Quantity {
        self.coefficient.by(|c| c / self.condition.wind_speed_m_s.powf(power))
    }
}

/// The dimensionless derivative that an aerodynamic coefficient is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Dimensionless {
    /// Of the yaw moment by which power of angle and rate.
    pub name: &'static str,
    /// At the middle axis.
    #[serde(flatten)]
    pub quantity: Quantity,
}

impl Dimensionless {
    /// From the coefficients at the middle axis with the wind on; its u that of these and of the inertia.
    pub(super) fn new(
        effect: &Effect,
        seen: &[Seen],
        made: &Campaign,
        inertia_kg_m2: &ByAxis<Quantity>,
    ) -> Option<Self> {
        let power = effect.wind_power(&[]).filter(|power| power.is_finite())?;
        let mid = seen.iter().filter(|s| s.is_on() && s.condition.axis == Axis::Mid);
        let mean = weighted_mean(mid.map(|s| s.reduced(power)))?;
        Self::at(effect, (mean, 1.0), made, inertia_kg_m2)
    }

    /// Of the effect's coefficient at the middle axis at a wind speed, m/s; its u that of the coefficient and of
    /// the inertia. `None` where it is no derivative with a name, or no inertia is known.
    pub fn at(
        effect: &Effect,
        (coefficient, wind_speed_m_s): (Quantity, f64),
        made: &Campaign,
        inertia_kg_m2: &ByAxis<Quantity>,
    ) -> Option<Self> {
        let (name, sign) = effect.derivative()?;
        let power = effect.wind_power(&[]).filter(|power| power.is_finite())?;
        let (inertia, model) = (inertia_kg_m2.mid?, &made.model);
        // 1/2 rho V^2 A l Cn, of which each rate takes an l/V.
        let per_izz = 0.5
            * made.air.density_kg_m3
            * wind_speed_m_s.powf(power)
            * model.frontal_area_m2
            * model.length_m.powf(3.0 - power)
            / inertia.value;
        let value = sign * coefficient.value / per_izz;
        let u = (coefficient.u / per_izz).hypot(value * inertia.u / inertia.value);
        Some(Self { name, quantity: Quantity::new(value, u) })
    }
}

/// The source from which a model takes `effect`.
pub(super) fn source(
    effect: &Effect,
    origin: Origin,
    seen: &[Seen],
    grows: Option<GrowsAs>,
) -> SourceKind {
    let may_be_blown = effect.wind_power(&[]).is_some();
    let follows_power = grows.is_none_or(|grows| grows.holds());
    match origin {
        Origin::Aerodynamic if may_be_blown && follows_power => SourceKind::Aerodynamic,
        Origin::Aerodynamic | Origin::Undecided if may_be_blown && changes_with_wind(seen) => {
            SourceKind::EachWind
        }
        _ => SourceKind::Mechanical,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::answer::Condition;

    fn seen(spring: &str, wind_speed_m_s: f64, value: f64) -> Seen {
        let condition = Condition { spring: spring.into(), axis: Axis::Mid, wind_speed_m_s };
        Seen { condition, coefficient: Quantity::new(value, 0.1) }
    }

    /// 0.5 a 10 m/s: 2 at 20 m/s with the square, 1 with the speed.
    #[test]
    fn the_power_of_the_speed_is_told_by_chi_squared() {
        let with = |fast: f64| {
            [("K1", 0.05), ("K2", -0.05)]
                .into_iter()
                .flat_map(|(spring, off)| {
                    [
                        seen(spring, 0.0, off),
                        seen(spring, 10.0, 5.0 + off),
                        seen(spring, 20.0, fast),
                    ]
                })
                .collect::<Vec<_>>()
        };
        let cubic = |seen: &[Seen]| GrowsAs::new(&Effect::CubicStiffness, seen).unwrap();
        let grows = cubic(&with(20.0));
        assert_eq!((grows.power, grows.degrees), (2.0, 3));
        assert!(grows.holds() && grows.chi_squared < 1.0, "{grows:?}");
        assert!(!cubic(&with(10.0)).holds());
        let linear = GrowsAs::new(&Effect::CubicDamping, &with(10.0)).unwrap();
        assert!(linear.power == 1.0 && linear.holds(), "{linear:?}");
        assert!(GrowsAs::new(&Effect::FreePlay, &with(20.0)).is_none());
        let of = |seen: &[Seen]| {
            let grows = GrowsAs::new(&Effect::CubicStiffness, seen);
            source(&Effect::CubicStiffness, Origin::Aerodynamic, seen, grows)
        };
        assert_eq!(
            [of(&with(20.0)), of(&with(10.0))].map(SourceKind::name),
            ["aerodynamic", "each_wind"]
        );
    }
}
