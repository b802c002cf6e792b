//! What the numbers of a record are: the motion's coordinate, its rate or its acceleration, and in what unit.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::sync::Arc;

/// How often the coordinate of the motion is derived by time in what is recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Derivative {
    /// The coordinate itself: an angle or a displacement.
    #[default]
    None,
    /// Its rate: a gyroscope's, a coil's.
    Rate,
    /// Its acceleration.
    Acceleration,
}

impl Derivative {
    fn order(self) -> i32 {
        match self {
            Self::None => 0,
            Self::Rate => 1,
            Self::Acceleration => 2,
        }
    }

    /// The amplitude that is recorded of a motion of this amplitude and frequency: of a decaying oscillation,
    /// too, if it is the undamped one.
    pub fn recorded(self, amplitude: f64, frequency_rad_s: f64) -> f64 {
        amplitude * frequency_rad_s.powi(self.order())
    }

    /// The amplitude of the motion, from that which is recorded.
    pub fn of_motion(self, recorded: f64, frequency_rad_s: f64) -> f64 {
        recorded * frequency_rad_s.powi(-self.order())
    }

    /// Coordinate and rate of a plain oscillation from what is recorded and its slope.
    pub(crate) fn state(self, [y, slope]: [f64; 2], wn: f64, zeta: f64) -> [f64; 2] {
        // x = -(x'' + 2 zeta wn x') / wn^2, of the coordinate as of its rate.
        let before = |y: f64, slope: f64| -(slope + 2.0 * zeta * wn * y) / (wn * wn);
        match self {
            Self::None => [y, slope],
            Self::Rate => [before(y, slope), y],
            Self::Acceleration => {
                let rate = before(y, slope);
                [before(rate, y), rate]
            }
        }
    }
}

/// What the field calls the motion: the words of axes, plots and reports, and nothing else.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Called {
    /// Yaw angle and yaw rate.
    #[default]
    Yaw,
    /// Pitch angle and pitch rate.
    Pitch,
    /// Roll angle and roll rate.
    Roll,
    /// Angle and rate.
    Pendulum,
    /// Displacement and rate.
    Displacement,
}

impl Called {
    /// As it is typed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Yaw => "yaw",
            Self::Pitch => "pitch",
            Self::Roll => "roll",
            Self::Pendulum => "pendulum",
            Self::Displacement => "displacement",
        }
    }
}

/// What a record's numbers are. By itself a yaw angle in deg.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Measurand {
    called: Called,
    derivative: Derivative,
    /// Of a motion that is no angle.
    linear: Option<Arc<Linear>>,
}

#[derive(Debug, PartialEq, Eq)]
struct Linear {
    /// Of the record's numbers.
    unit: String,
    /// Of the coordinate.
    of: String,
}

impl Measurand {
    /// Of an angle: deg, deg/s or deg/s2.
    pub fn angular(derivative: Derivative) -> Self {
        Self { called: Called::Yaw, derivative, linear: None }
    }

    /// Of a displacement, or of anything in proportion to it, the record's numbers being in `unit`.
    ///
    /// ```
    /// use yawrig_core::record::{Derivative, Measurand};
    ///
    /// let velocity = Measurand::linear(Derivative::Rate, "mm/s");
    /// assert_eq!((velocity.quantity(), velocity.unit(), velocity.coordinate_unit()), ("rate", "mm/s", "mm"));
    /// assert_eq!(velocity.parameter_unit("1/(rad2 s2)"), "1/(mm2 s2)");
    /// ```
    pub fn linear(derivative: Derivative, unit: &str) -> Self {
        let ends: &[&str] = match derivative {
            Derivative::None => &[""],
            Derivative::Rate => &["/s"],
            Derivative::Acceleration => &["/s2", "/s^2", "/s²"],
        };
        let stem = ends.iter().find_map(|end| unit.strip_suffix(end));
        let of = match (stem, derivative) {
            (Some(stem), _) => stem.to_owned(),
            (None, Derivative::Acceleration) => format!("{unit} s2"),
            (None, _) => format!("{unit} s"),
        };
        let linear = Some(Arc::new(Linear { unit: unit.to_owned(), of }));
        Self { called: Called::Displacement, derivative, linear }
    }

    /// The same in the words of another motion.
    pub fn called(self, called: Called) -> Self {
        Self { called, ..self }
    }

    /// What the motion is called.
    pub fn motion(&self) -> Called {
        self.called
    }

    /// Whether the motion is called so.
    pub fn is_called(&self, called: Called) -> bool {
        self.called == called
    }

    /// `yaw`, as in "at zero yaw".
    pub fn word(&self) -> &'static str {
        match self.called {
            Called::Yaw => "yaw",
            Called::Pitch => "pitch",
            Called::Roll => "roll",
            Called::Pendulum => "angle",
            Called::Displacement => "displacement",
        }
    }

    /// `yaw angle`.
    pub fn coordinate(&self) -> &'static str {
        match self.called {
            Called::Yaw => "yaw angle",
            Called::Pitch => "pitch angle",
            Called::Roll => "roll angle",
            Called::Pendulum => "angle",
            Called::Displacement => "displacement",
        }
    }

    /// `yaw rate`.
    pub fn rate(&self) -> &'static str {
        match self.called {
            Called::Yaw => "yaw rate",
            Called::Pitch => "pitch rate",
            Called::Roll => "roll rate",
            Called::Pendulum | Called::Displacement => "rate",
        }
    }

    /// What is recorded: `yaw angle`, `roll rate`, `acceleration`.
    pub fn recorded(&self) -> &'static str {
        match self.derivative {
            Derivative::None => self.coordinate(),
            Derivative::Rate => self.rate(),
            Derivative::Acceleration => "acceleration",
        }
    }

    /// Of the coordinate, its rate or its acceleration.
    pub fn derivative(&self) -> Derivative {
        self.derivative
    }

    /// Whether the motion is one of an angle.
    pub fn is_of_angle(&self) -> bool {
        self.linear.is_none()
    }

    /// Whether it is an angle.
    pub fn is_angle(&self) -> bool {
        self.is_of_angle() && self.derivative == Derivative::None
    }

    /// Whether it shows where the motion comes to rest.
    pub fn shows_rest(&self) -> bool {
        self.derivative == Derivative::None
    }

    /// `angle`, `rate`, `acceleration` or `displacement`.
    pub fn quantity(&self) -> &'static str {
        match (self.derivative, &self.linear) {
            (Derivative::None, None) => "angle",
            (Derivative::None, Some(_)) => "displacement",
            (Derivative::Rate, _) => "rate",
            (Derivative::Acceleration, _) => "acceleration",
        }
    }

    /// The unit of the record's numbers.
    pub fn unit(&self) -> &str {
        match (&self.linear, self.derivative) {
            (Some(linear), _) => &linear.unit,
            (None, Derivative::None) => "deg",
            (None, Derivative::Rate) => "deg/s",
            (None, Derivative::Acceleration) => "deg/s2",
        }
    }

    /// The unit of the coordinate, in which amplitudes are.
    pub fn coordinate_unit(&self) -> &str {
        self.linear.as_ref().map_or("deg", |linear| &linear.of)
    }

    /// The unit of the coordinate's rate.
    pub fn rate_unit(&self) -> String {
        format!("{}/s", self.coordinate_unit())
    }

    /// An effect's `unit`, which the library writes for an angle in rad, for this motion.
    pub fn parameter_unit(&self, unit: &str) -> String {
        match &self.linear {
            None => unit.to_owned(),
            Some(linear) if linear.of.contains([' ', '/']) => {
                unit.replace("rad", &format!("({})", linear.of))
            }
            Some(linear) => unit.replace("rad", &linear.of),
        }
    }

    /// How many of its units an effect's unit is of an angle.
    fn per_unit(&self) -> f64 {
        match self.linear {
            None => 180.0 / PI,
            Some(_) => 1.0,
        }
    }

    /// A number of the model, rad of an angle, in the unit in which it is shown.
    pub fn shown(&self, number: f64) -> f64 {
        number * self.per_unit()
    }

    /// A number as it is shown, as a model has it.
    pub fn of_model(&self, shown: f64) -> f64 {
        shown / self.per_unit()
    }

    /// What stands beside a record in JSON; nothing beside an angle in deg.
    pub fn said(&self) -> Said {
        let usual = if self.is_of_angle() { Called::Yaw } else { Called::Displacement };
        let motion = Some(self.called).filter(|called| *called != usual);
        match self.is_angle() {
            true => Said { motion, ..Said::default() },
            false => Said {
                quantity: Some(self.quantity().to_owned()),
                unit: Some(self.unit().to_owned()),
                amplitude_unit: Some(self.coordinate_unit().to_owned()),
                motion,
            },
        }
    }
}

/// What a record's numbers are, where they are no angle in deg: fields of JSON that end in `_deg` are then in
/// these units.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Said {
    /// One of `displacement`, `rate` and `acceleration`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantity: Option<String>,
    /// Of what is read: the record, its noise and residuals, the sensor's zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Of the motion: amplitudes, and what a law is over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub amplitude_unit: Option<String>,
    /// What the motion is called, where it is not yaw.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Called>,
}

impl Said {
    /// Whether there is nothing to say.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// What it is said of.
    pub fn measurand(&self) -> Measurand {
        let derivative = match self.quantity.as_deref() {
            Some("rate") => Derivative::Rate,
            Some("acceleration") => Derivative::Acceleration,
            _ => Derivative::None,
        };
        let measurand = match (&self.amplitude_unit, &self.unit) {
            (Some(of), Some(unit)) if of != "deg" => Measurand::linear(derivative, unit),
            _ => Measurand::angular(derivative),
        };
        match self.motion {
            Some(called) => measurand.called(called),
            None => measurand,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A damped oscillation in closed form: x = e^(-s t) cos(w t).
    #[test]
    fn state_and_amplitude_are_found_from_any_derivative() {
        let (wn, zeta, t) = (7.0f64, 0.03, 0.4f64);
        let (s, w) = (zeta * wn, wn * (1.0 - zeta * zeta).sqrt());
        let at = |order: i32| {
            let angle = w * t + f64::from(order) * (w.atan2(-s));
            wn.powi(order) * (-s * t).exp() * angle.cos()
        };
        for (order, derivative) in
            [(0, Derivative::None), (1, Derivative::Rate), (2, Derivative::Acceleration)]
        {
            let [x, rate] = derivative.state([at(order), at(order + 1)], wn, zeta);
            assert!((x - at(0)).abs() < 1e-12 && (rate - at(1)).abs() < 1e-12, "{derivative:?}");
            assert!((derivative.of_motion(wn.powi(order), wn) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn units_follow_the_coordinate() {
        let coil = Measurand::linear(Derivative::Rate, "V");
        assert_eq!((coil.coordinate_unit(), coil.rate_unit().as_str()), ("V s", "V s/s"));
        assert_eq!(coil.parameter_unit("1/rad"), "1/(V s)");
        let beam = Measurand::linear(Derivative::Acceleration, "m/s2");
        assert_eq!((beam.quantity(), beam.coordinate_unit()), ("acceleration", "m"));
        assert_eq!(Measurand::angular(Derivative::Rate).unit(), "deg/s");
        assert_eq!(beam.shown(2.0), 2.0);
        let roll = Measurand::angular(Derivative::Rate).called(Called::Roll);
        assert_eq!((roll.recorded(), roll.coordinate()), ("roll rate", "roll angle"));
        for all in [coil, beam, roll, Measurand::angular(Derivative::Rate), Measurand::default()] {
            assert_eq!(all.said().measurand(), all);
        }
    }
}
