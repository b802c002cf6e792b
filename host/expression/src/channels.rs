//! A channel that is computed from others, sample by sample: `atan2(x, -y)`, `(V - 0.217) * 3.38`.

use super::expression::{parse, Flaw, Kind, Node};
use super::program::{Program, State};

/// An expression of channels, by their names.
#[derive(Clone, Debug)]
pub struct OfChannels {
    program: Program,
    names: Vec<String>,
    is_angle_rad: bool,
}

/// Most channels of an expression.
const MOST: usize = 64;
/// What comes out in radians, whatever goes in.
const ANGLES: [&str; 4] = ["atan2", "atan", "asin", "acos"];

impl OfChannels {
    /// # Errors
    /// What is no expression, holds a function that there is not, or no channel at all.
    pub fn parse(text: &str) -> Result<Self, Flaw> {
        let mut node = parse(text)?;
        let is_angle_rad =
            matches!(&node.kind, Kind::Call(function, _) if ANGLES.contains(&function.as_str()));
        let mut names = Vec::new();
        number(&mut node, &mut names);
        if names.is_empty() {
            return Err(Flaw::new(0..text.len(), "no channel is in it", "name one"));
        }
        if names.len() > MOST {
            let what = format!("more than {MOST} channels are in it");
            return Err(Flaw::new(0..text.len(), what, "compute it in two steps"));
        }
        let parameters: Vec<String> = (0..names.len()).map(parameter).collect();
        Ok(Self { program: Program::new(&node, &parameters)?, names, is_angle_rad })
    }

    /// The channels in it, in the order in which [`Self::evaluate`] takes their values.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Whether it is an angle in radians by itself.
    pub fn is_angle_rad(&self) -> bool {
        self.is_angle_rad
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
    fn channels_are_computed_from_others() {
        let angle = OfChannels::parse("atan2(x, -y)").expect("an expression");
        assert_eq!(angle.names(), ["x", "y"]);
        assert!(angle.is_angle_rad());
        assert_eq!(angle.evaluate(&[1.0, -1.0]), std::f64::consts::FRAC_PI_4);
        // Names of what a moment depends on are names of channels here.
        let scaled = OfChannels::parse("(b - 0.217) * 3.38 + 0 * t + abs(r)").expect("another");
        assert_eq!((scaled.names().len(), scaled.is_angle_rad()), (3, false));
        assert!((scaled.evaluate(&[1.217, 9.0, -2.0]) - 5.38).abs() < 1e-12);
        for wrong in ["", "x +", "2 * pi", "sine(x)", "atan2(x)"] {
            assert!(OfChannels::parse(wrong).is_err(), "{wrong}");
        }
    }
}
