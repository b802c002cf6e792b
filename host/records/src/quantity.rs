//! What a channel's numbers are, by its unit and by what is said of it.

use super::units;
use serde::{Deserialize, Serialize};
use yawrig_core::record::{Derivative, Measurand};

/// What is recorded, as a [`Selection`](super::Selection) says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Quantity {
    /// Of the motion.
    Angle,
    /// Of an angle or of a displacement.
    Rate,
    /// Of an angle or of a displacement.
    Acceleration,
    /// Or anything in proportion to it, a strain or a voltage: its own unit is kept.
    Displacement,
}

impl Quantity {
    /// As it is typed.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::Rate => "rate",
            Self::Acceleration => "acceleration",
            Self::Displacement => "displacement",
        }
    }

    /// That of this name.
    pub(super) fn named(name: &str) -> Option<Self> {
        let all = [Self::Angle, Self::Rate, Self::Acceleration, Self::Displacement];
        all.into_iter().find(|one| one.name() == name)
    }

    fn of_angle(derivative: Derivative) -> Self {
        match derivative {
            Derivative::None => Self::Angle,
            Derivative::Rate => Self::Rate,
            Derivative::Acceleration => Self::Acceleration,
        }
    }

    /// What numbers in `unit`, which is none of an angle, most likely are.
    pub(super) fn likely(unit: &str) -> Self {
        let unit = unit.trim();
        let per = |ends: &[&str]| ends.iter().any(|end| unit.ends_with(end));
        match unit {
            "g" => Self::Acceleration,
            _ if per(&["/s2", "/s^2", "/s²", "/s/s"]) => Self::Acceleration,
            _ if per(&["/s"]) => Self::Rate,
            _ => Self::Displacement,
        }
    }

    /// Of numbers in `unit`.
    fn linear(self, unit: &str) -> Option<Measurand> {
        let derivative = match self {
            Self::Angle => return None,
            Self::Displacement => Derivative::None,
            Self::Rate => Derivative::Rate,
            Self::Acceleration => Derivative::Acceleration,
        };
        Some(Measurand::linear(derivative, unit))
    }
}

/// What numbers are, and by what they are multiplied to be in the record's own unit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Meant {
    pub(super) measurand: Measurand,
    pub(super) scale: f64,
}

/// Why it is not clear what numbers are.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Unclear {
    /// They have no unit.
    NoUnit,
    /// Their unit is none of an angle, and nobody says what they are.
    NoAngle,
    /// They cannot be what is said of them: that, and what they are by their unit.
    Against(Quantity, Quantity),
}

impl Unclear {
    /// Of numbers in `unit`, called `what`.
    pub(super) fn said_of(&self, what: &str, unit: &str) -> String {
        match self {
            Self::NoUnit => format!("{what} is in an unknown unit"),
            Self::NoAngle => format!("{what} is in {unit:?}, which is no angle"),
            Self::Against(said, is) => {
                let (said, is) = (said.name(), is.name());
                let article = if is.starts_with('a') { "an" } else { "a" };
                format!(
                    "{what} is in {unit:?}: its numbers are no {said}, and may be {article} {is}"
                )
            }
        }
    }
}

/// Of an angle, its rate or its acceleration: which, and how many deg, deg/s or deg/s2 the unit is.
pub(super) fn angular(unit: &str) -> Option<(Derivative, f64)> {
    let unit = unit.trim().to_lowercase().replace(' ', "");
    if ["rpm", "1/min", "u/min"].contains(&unit.as_str()) {
        return Some((Derivative::Rate, 6.0));
    }
    let ends: [(Derivative, &[&str]); 2] = [
        (Derivative::Acceleration, &["/s2", "/s^2", "/s²", "/s/s", "s-2"]),
        (Derivative::Rate, &["/s", "/sec", "s-1"]),
    ];
    let stripped = ends.iter().find_map(|(derivative, ends)| {
        ends.iter().find_map(|end| Some((*derivative, unit.strip_suffix(end)?)))
    });
    let (derivative, angle) = stripped.unwrap_or((Derivative::None, &unit));
    units::degrees(angle).map(|deg| (derivative, deg))
}

/// What numbers in `unit` are, of which somebody says that they are this `quantity`.
pub(super) fn meant(
    quantity: Option<Quantity>,
    unit: Option<&str>,
) -> std::result::Result<Meant, Unclear> {
    let unit = unit.map(str::trim).filter(|unit| !unit.is_empty() && *unit != "-");
    let Some(unit) = unit else { return Err(Unclear::NoUnit) };
    if let Some((derivative, scale)) = angular(unit) {
        let is = Quantity::of_angle(derivative);
        return match quantity.filter(|said| *said != is) {
            Some(said) => Err(Unclear::Against(said, is)),
            None => Ok(Meant { measurand: Measurand::angular(derivative), scale }),
        };
    }
    let said = quantity.ok_or(Unclear::NoAngle)?;
    // A sensor of a rate may be read in volts, but metres per second squared are none of a rate.
    let likely = Quantity::likely(unit);
    if likely != Quantity::Displacement && likely != said {
        return Err(Unclear::Against(said, likely));
    }
    match said.linear(unit) {
        Some(measurand) => Ok(Meant { measurand, scale: 1.0 }),
        None => Err(Unclear::Against(said, Quantity::likely(unit))),
    }
}

/// The name of a record's second column: what it holds, with its unit.
pub(super) fn column(measurand: &Measurand) -> String {
    match measurand.is_angle() {
        true => "yaw_deg".to_owned(),
        false => format!("{} ({})", measurand.quantity(), measurand.unit()),
    }
}

/// What stands in a column of this name, which [`column`] writes; `yaw_rad`, too.
pub(super) fn of_column(name: &str) -> Option<Meant> {
    let angle = |unit| meant(Some(Quantity::Angle), Some(unit)).ok();
    match name {
        "yaw_deg" => return angle("deg"),
        "yaw_rad" => return angle("rad"),
        _ => {}
    }
    let (quantity, unit) = name.strip_suffix(')')?.split_once(" (")?;
    let quantity = Quantity::named(quantity).filter(|named| *named != Quantity::Angle)?;
    meant(Some(quantity), Some(unit)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_says_what_numbers_are_or_somebody_must() {
        let is = |quantity, unit| meant(quantity, Some(unit)).map(|m| (m.measurand, m.scale));
        let rate = Measurand::angular(Derivative::Rate);
        assert_eq!(is(None, "deg/s"), Ok((rate.clone(), 1.0)));
        let (found, scale) = is(Some(Quantity::Rate), "rad/s").unwrap();
        assert_eq!((found, (scale - 57.295_779_5).abs() < 1e-6), (rate.clone(), true));
        assert_eq!(is(None, "rpm"), Ok((rate, 6.0)));
        assert_eq!(is(Some(Quantity::Angle), "turns"), Ok((Measurand::default(), 360.0)));
        assert_eq!(is(None, "V"), Err(Unclear::NoAngle));
        let against = Unclear::Against(Quantity::Angle, Quantity::Displacement);
        assert_eq!(is(Some(Quantity::Angle), "mm"), Err(against));
        let against = Unclear::Against(Quantity::Angle, Quantity::Rate);
        assert_eq!(is(Some(Quantity::Angle), "rad/s"), Err(against));
        let (found, scale) = is(Some(Quantity::Acceleration), "m/s²").unwrap();
        assert_eq!((found.quantity(), found.coordinate_unit(), scale), ("acceleration", "m", 1.0));
        let against = Unclear::Against(Quantity::Rate, Quantity::Acceleration);
        assert_eq!(is(Some(Quantity::Rate), "m/s^2"), Err(against));
        let (found, _) = is(Some(Quantity::Rate), "V").unwrap();
        assert_eq!((found.quantity(), found.coordinate_unit()), ("rate", "V s"));
        assert_eq!(meant(Some(Quantity::Rate), Some(" ")), Err(Unclear::NoUnit));
    }

    #[test]
    fn a_column_is_read_as_it_is_written() {
        for measurand in [
            Measurand::default(),
            Measurand::angular(Derivative::Rate),
            Measurand::angular(Derivative::Acceleration),
            Measurand::linear(Derivative::None, "px"),
            Measurand::linear(Derivative::Rate, "mm/s"),
            Measurand::linear(Derivative::Acceleration, "m/s2"),
        ] {
            let found = of_column(&column(&measurand)).expect("a column of ours");
            assert_eq!((found.measurand, found.scale), (measurand, 1.0));
        }
        for other in ["rate", "rate_rad_s", "speed (m/s)", "yaw"] {
            assert_eq!(of_column(other), None);
        }
    }
}
