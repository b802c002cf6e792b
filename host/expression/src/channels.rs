//! A channel that is computed from others, sample by sample: `atan2(x, -y)`, `(V - 0.217) * 3.38`.

use super::expression::{parse, Flaw, Kind, Node, Operator};
use super::program::{Program, State};

/// An expression of channels, by their names.
#[derive(Clone, Debug)]
pub struct OfChannels {
    program: Program,
    names: Vec<String>,
    /// As it was written.
    written: Node,
}

/// Most channels of an expression.
const MAX: usize = 64;
/// What comes out in radians, whatever goes in.
const ANGLES: [&str; 4] = ["atan2", "atan", "asin", "acos"];

impl OfChannels {
    /// # Errors
    /// What is no expression, holds a function that there is not, or no channel at all.
    pub fn parse(text: &str) -> Result<Self, Flaw> {
        let written = parse(text)?;
        let mut node = written.clone();
        let mut names = Vec::new();
        number(&mut node, &mut names);
        if names.is_empty() {
            return Err(Flaw::new(0..text.len(), "no channel is in it", "name one"));
        }
        if names.len() > MAX {
            let what = format!("more than {MAX} channels are in it");
            return Err(Flaw::new(0..text.len(), what, "compute it in two steps"));
        }
        let parameters: Vec<String> = (0..names.len()).map(parameter).collect();
        Ok(Self { program: Program::new(&node, &parameters)?, names, written })
    }

    /// The channels in it, in the order in which [`Self::evaluate`] takes their values.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Its unit, `of` being those of the channels as far as they are known: of a sum that of what is added,
    /// of an inverse function rad; of a product none is known, since a number may convert it.
    ///
    /// # Errors
    /// Where channels of different units are added, compared, or the sides of an angle.
    pub fn unit(&self, of: &dyn Fn(&str) -> Option<String>) -> Result<Option<String>, Flaw> {
        unit(&self.written, of).map(|unit| match unit {
            Unit::Of(unit) => Some(unit),
            Unit::Number | Unit::Unknown => None,
        })
    }

    /// Its value where the channels have these.
    pub fn evaluate(&self, values: &[f64]) -> f64 {
        let none = State {
            yaw_rad: 0.0,
            rate_rad_s: 0.0,
            time_s: 0.0,
            natural_frequency_rad_s: 0.0,
            wind_speed_m_s: 0.0,
            rate_sign: 1.0,
            yaw_sign: 1.0,
        };
        self.program.evaluate(&none, values)
    }
}

/// What is known of a unit.
#[derive(Clone, Debug, PartialEq)]
enum Unit {
    /// A number takes on that of what it stands beside.
    Number,
    Unknown,
    Of(String),
}

fn unit(node: &Node, of: &dyn Fn(&str) -> Option<String>) -> Result<Unit, Flaw> {
    let same = |nodes: &[&Node]| {
        let mut found = Unit::Number;
        for one in nodes {
            found = match (found, unit(one, of)?) {
                (Unit::Of(a), Unit::Of(b)) if a != b => {
                    let what = format!("{a} and {b} stand side by side");
                    return Err(Flaw::new(node.span.clone(), what, "convert one of them first"));
                }
                (Unit::Of(unit), _) | (_, Unit::Of(unit)) => Unit::Of(unit),
                (Unit::Unknown, _) | (_, Unit::Unknown) => Unit::Unknown,
                (Unit::Number, Unit::Number) => Unit::Number,
            };
        }
        Ok(found)
    };
    Ok(match &node.kind {
        Kind::Number(_) => Unit::Number,
        Kind::Name(name) if name == "pi" => Unit::Number,
        Kind::Name(name) => of(name).map_or(Unit::Unknown, Unit::Of),
        Kind::Negated(a) => unit(a, of)?,
        Kind::Binary(Operator::Add | Operator::Subtract, a, b) => same(&[&**a, &**b])?,
        Kind::Binary(_, a, b) => {
            unit(a, of)?;
            unit(b, of)?;
            Unit::Unknown
        }
        Kind::Call(function, arguments) => {
            let arguments: Vec<&Node> = arguments.iter().collect();
            match function.as_str() {
                "atan2" => {
                    same(&arguments)?;
                    Unit::Of("rad".to_owned())
                }
                "abs" | "min" | "max" => same(&arguments)?,
                _ => {
                    arguments.iter().try_for_each(|a| unit(a, of).map(drop))?;
                    match ANGLES.contains(&function.as_str()) {
                        true => Unit::Of("rad".to_owned()),
                        false => Unit::Unknown,
                    }
                }
            }
        }
    })
}

/// What no channel is called in the program, so that `t` and `b` are channels as well.
fn parameter(index: usize) -> String {
    format!("channel_{index}")
}

/// Puts numbers in the place of the names, which join `names`.
fn number(node: &mut Node, names: &mut Vec<String>) {
    match &mut node.kind {
        Kind::Number(_) => {}
        Kind::Name(name) if name == "pi" => {}
        Kind::Name(name) => {
            let index = names.iter().position(|known| known == name).unwrap_or_else(|| {
                names.push(name.clone());
                names.len() - 1
            });
            *name = parameter(index);
        }
        Kind::Negated(a) => number(a, names),
        Kind::Binary(_, a, b) => {
            number(a, names);
            number(b, names);
        }
        Kind::Call(_, arguments) => arguments.iter_mut().for_each(|a| number(a, names)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_has_the_unit_of_its_channels_and_a_product_none() {
        let of = |name: &str| match name {
            "x" | "y" => Some("mm".to_owned()),
            "u" => Some("V".to_owned()),
            _ => None,
        };
        let unit = |text: &str| OfChannels::parse(text).unwrap().unit(&of);
        for (text, expected) in [
            ("x - 3.5", Some("mm")),
            ("-(x + y)", Some("mm")),
            ("max(x, w)", Some("mm")),
            ("atan2(x, -y)", Some("rad")),
            ("(u - 2.5) * 45", None),
            ("w + 1", None),
        ] {
            assert_eq!(unit(text).unwrap().as_deref(), expected, "{text}");
        }
        for wrong in ["x + u", "atan2(x, u)", "2 * (x - u)"] {
            let flaw = unit(wrong).unwrap_err();
            assert!(flaw.message.contains("mm and V"), "{wrong}: {}", flaw.message);
        }
    }

    #[test]
    fn channels_are_computed_from_others() {
        let angle = OfChannels::parse("atan2(x, -y)").expect("an expression");
        assert_eq!(angle.names(), ["x", "y"]);
        assert_eq!(angle.unit(&|_| None).unwrap().as_deref(), Some("rad"));
        assert_eq!(angle.evaluate(&[1.0, -1.0]), std::f64::consts::FRAC_PI_4);
        // Names of what a moment depends on are names of channels here.
        let scaled = OfChannels::parse("(b - 0.217) * 3.38 + 0 * t + abs(r)").expect("another");
        assert_eq!(scaled.names().len(), 3);
        assert_eq!(scaled.unit(&|_| Some("V".into())).unwrap().as_deref(), Some("V"));
        assert!((scaled.evaluate(&[1.217, 9.0, -2.0]) - 5.38).abs() < 1e-12);
        let quoted = OfChannels::parse("(\"Potential (V)\" - #3) * 2").expect("names in quotes");
        assert_eq!(quoted.names(), ["Potential (V)", "#3"]);
        assert_eq!(quoted.evaluate(&[3.0, 1.0]), 4.0);
        for wrong in ["", "x +", "\"x", "#", "\"\"", "2 * pi", "sine(x)", "atan2(x)"] {
            assert!(OfChannels::parse(wrong).is_err(), "{wrong}");
        }
    }
}
