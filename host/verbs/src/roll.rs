//! `--inertia-kg-m2`, `--gm-m`, `--displacement-kg`: a roll decay as naval architects write it.

use super::common::{bare, within};
use clap::Args;
use std::fmt::Write as _;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::quantity::Quantity;
use yawrig_core::record::{Called, Measurand};
use yawrig_core::roll::{RollDecay, Ship};
use yawrig_report::units::sized;

#[derive(Args, Debug, Clone, Default)]
pub struct RollArgs {
    /// Of a roll decay: inertia A44 of the ship or model, that of the water with it included
    #[arg(long, value_name = "KG_M2", conflicts_with = "gm_m", allow_negative_numbers = true)]
    inertia_kg_m2: Option<f64>,
    /// Of a roll decay: metacentric height, from which A44 follows with the displacement
    #[arg(long, value_name = "M", requires = "displacement_kg", allow_negative_numbers = true)]
    gm_m: Option<f64>,
    /// Of a roll decay: displacement of the ship or model
    #[arg(long, value_name = "KG", requires = "gm_m", allow_negative_numbers = true)]
    displacement_kg: Option<f64>,
}

impl RollArgs {
    /// What was said of the ship.
    ///
    /// # Errors
    /// Exit 2 for what no ship has.
    pub fn ship(&self) -> Result<Option<Ship>> {
        let said = [
            ("inertia_kg_m2", self.inertia_kg_m2),
            ("gm_m", self.gm_m),
            ("displacement_kg", self.displacement_kg),
        ];
        for (setting, value) in said {
            value.map_or(Ok(()), |value| within(&settings::name(setting), value, 1e-9, 1e15))?;
        }
        Ok(match (self.inertia_kg_m2, self.gm_m.zip(self.displacement_kg)) {
            (Some(a44_kg_m2), _) => Some(Ship::Inertia { a44_kg_m2 }),
            (None, Some((gm_m, displacement_kg))) => {
                Some(Ship::Stability { gm_m, displacement_kg })
            }
            (None, None) => None,
        })
    }

    /// Whether the motion is called roll.
    ///
    /// # Errors
    /// Exit 2 where something was said of a ship that does not roll.
    pub fn rolls(&self, measurand: &Measurand) -> Result<bool> {
        let ship = self.ship()?;
        let rolls = measurand.is_of_angle() && measurand.is_called(Called::Roll);
        if !rolls && ship.is_some() {
            return Err(Error::usage(format!(
                "an inertia, GM or displacement with a record of {}",
                measurand.coordinate()
            ))
            .help(format!("say that it is a roll decay: {}", settings::given("motion", "roll"))));
        }
        Ok(rolls)
    }

    /// Whether all these motions are called roll.
    ///
    /// # Errors
    /// As [`Self::rolls`].
    pub fn all_roll<'a>(&self, of: impl Iterator<Item = &'a Measurand>) -> Result<bool> {
        of.map(|one| self.rolls(one)).try_fold(true, |all, rolls| Ok(all && rolls?))
    }

    /// `decay` of the ship, where the motion is called roll; `None` where it is another.
    ///
    /// # Errors
    /// As [`Self::rolls`].
    pub fn of(
        &self,
        measurand: &Measurand,
        decay: impl FnOnce(Option<Ship>) -> RollDecay,
    ) -> Result<Option<RollDecay>> {
        let ship = self.ship()?;
        Ok(self.rolls(measurand)?.then(|| decay(ship)))
    }
}

/// The coefficients and the equivalent linear damping, as tables.
pub fn text(roll: &RollDecay, measurand: &Measurand) -> String {
    let mut out = String::new();
    let known = roll.a44_kg_m2.map_or(String::new(), |a44| match a44.u > 0.0 {
        true => format!(", A44 = {a44} kg m2"),
        false => format!(", A44 = {} kg m2", a44.value),
    });
    let of_ship = |q: &Option<Quantity>| q.map_or(String::new(), |q| shown(&q));
    if roll.coefficients.is_empty() {
        let _ = writeln!(out, "  equivalent linear damping Be{known}");
    } else {
        let _ = writeln!(
            out,
            "  A44 p' + B0 sign(p) + B1 p + B2 |p| p + B3 p^3 + C1 phi + C3 phi^3 + C5 phi^5 = 0{known}"
        );
        let columns = if roll.a44_kg_m2.is_some() { 5 } else { 3 };
        let mut table = bare(&["", "over A44", "", "of the ship", ""][..columns]);
        for c in &roll.coefficients {
            let row = [
                format!("  {}", c.name),
                shown(&c.over_a44),
                c.over_a44_unit.to_owned(),
                of_ship(&c.of_ship),
                c.of_ship_unit.unwrap_or_default().to_owned(),
            ];
            table.add_row(&row[..columns]);
        }
        let _ = writeln!(out, "{}", table.trim_fmt());
        if !roll.beside.is_empty() {
            let names: Vec<&str> = roll.beside.iter().map(|e| e.id()).collect();
            let _ = writeln!(out, "  beside these: {}", names.join(", "));
        }
    }
    let amplitude = format!("  amplitude ({})", measurand.coordinate_unit());
    let header = [amplitude.as_str(), "Be / A44 (1/s)", "Be (N m s)"];
    let columns = if roll.a44_kg_m2.is_some() { 3 } else { 2 };
    let mut table = bare(&header[..columns]);
    for e in &roll.equivalent {
        let row = [
            format!("  {}", sized(measurand, e.amplitude_deg, 4)),
            e.over_a44_1_s.to_string(),
            of_ship(&e.of_ship_n_m_s),
        ];
        table.add_row(&row[..columns]);
    }
    let _ = writeln!(out, "{}", table.trim_fmt());
    out
}

/// What was given has no uncertainty.
fn shown(q: &Quantity) -> String {
    if q.u == 0.0 {
        format!("{} (given)", q.value)
    } else {
        q.to_string()
    }
}
