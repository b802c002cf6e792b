//! Formulas that a measured law may be, each as an own effect's file has it. Some are effects of the library
//! too; their parameters have names of their own here, for two formulas together become one file.

use yawrig_expression::{OwnEffect, State};

/// What a parameter is to its form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Role {
    /// The moment is in proportion to it.
    Size,
    /// Tried at these values.
    Plain(&'static [f64]),
    /// Tried at these shares of the largest yaw angle or rate.
    OfReach(&'static [f64]),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FormParameter {
    pub(crate) name: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) role: Role,
    /// Whether it is above zero.
    pub(crate) positive: bool,
}

impl FormParameter {
    /// The least value of it: a shape that a record can tell from a jump, `reach` being the largest yaw angle
    /// or rate.
    fn least(&self, reach: f64) -> Option<f64> {
        self.positive.then_some(match self.role {
            Role::Size => 0.0,
            Role::Plain(_) => 0.25,
            Role::OfReach(_) => 0.05 * reach,
        })
    }
}

/// A formula for a part of a law.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Form {
    pub(crate) id: &'static str,
    pub(crate) title: &'static str,
    /// What is added to b''.
    pub(crate) moment: &'static str,
    pub(crate) parameters: &'static [FormParameter],
    /// Of the yaw angle alone; else it takes energy out.
    pub(crate) is_stiffness: bool,
    /// What a damping of angle and rate does at one frequency, as a law of the rate alone.
    pub(crate) alike: Option<&'static str>,
}

impl Form {
    /// Whether it makes a sum with `other`: both of one number, or the stops of two sides.
    pub(super) fn adds_to(&self, other: &Self) -> bool {
        let is_plain = |f: &Self| f.parameters.len() == 1;
        let are_stops = [(ABOVE, BELOW), (BELOW, ABOVE)].contains(&(self.id, other.id));
        is_plain(self) && is_plain(other) || are_stops
    }

    /// Whether it is a law of an angle, of no other displacement.
    pub(super) fn is_of_angle(&self) -> bool {
        self.moment.contains("sin(")
    }
}

const fn size(name: &'static str, unit: &'static str) -> FormParameter {
    FormParameter { name, unit, role: Role::Size, positive: false }
}

const fn loss(name: &'static str, unit: &'static str) -> FormParameter {
    FormParameter { name, unit, role: Role::Size, positive: true }
}

const fn plain(name: &'static str, tried: &'static [f64]) -> FormParameter {
    FormParameter { name, unit: "1", role: Role::Plain(tried), positive: true }
}

const fn at(name: &'static str, unit: &'static str, tried: &'static [f64]) -> FormParameter {
    FormParameter { name, unit, role: Role::OfReach(tried), positive: true }
}

const fn damping(
    id: &'static str,
    title: &'static str,
    moment: &'static str,
    parameters: &'static [FormParameter],
) -> Form {
    Form { id, title, moment, parameters, is_stiffness: false, alike: None }
}

const fn stiffness(
    id: &'static str,
    title: &'static str,
    moment: &'static str,
    parameters: &'static [FormParameter],
) -> Form {
    Form { id, title, moment, parameters, is_stiffness: true, alike: None }
}

/// The two stops that a model may have, each with its angle and stiffness: a formula alone and together.
const ABOVE: &str = "stop_above";
const BELOW: &str = "stop_below";

/// Every form, simplest first. No two parameters have one name, so that two forms can stand in one formula.
pub(crate) const FORMS: &[Form] = &[
    damping("dry_friction", "dry friction", "-c * sign(r)", &[loss("c", "rad/s2")]),
    damping("drag", "drag with the square of the rate", "-d * abs(r) * r", &[loss("d", "1/rad")]),
    damping("rate_cubed", "damping with the cube of the rate", "-q * r^3", &[loss("q", "s/rad2")]),
    Form {
        alike: Some("-p * abs(r) * r / (2 * wn)"),
        ..damping(
            "angle_damping",
            "damping in proportion to the angle",
            "-p * abs(b) * r",
            &[loss("p", "1/(rad s)")],
        )
    },
    Form {
        alike: Some("-w * r^3 / (3 * wn^2)"),
        ..damping(
            "square_angle_damping",
            "damping with the square of the angle",
            "-w * b^2 * r",
            &[loss("w", "1/(rad2 s)")],
        )
    },
    damping(
        "power_law",
        "damping with a power of the rate",
        "-h * sign(r) * abs(r / 1.0)^n",
        &[loss("h", "rad/s2"), plain("n", &[0.25, 0.5, 0.75, 1.25, 1.5, 1.75, 2.25, 2.5, 3.0])],
    ),
    damping(
        "smooth_friction",
        "friction that sets in smoothly",
        "-f * tanh(r / v)",
        &[loss("f", "rad/s2"), at("v", "rad/s", &[0.12, 0.2, 0.3, 0.5])],
    ),
    damping(
        "stribeck_friction",
        "friction that falls with the rate (Stribeck)",
        "-m * sign(r) * (1 + s * exp(-abs(r) / u))",
        &[
            loss("m", "rad/s2"),
            plain("s", &[0.3, 0.6, 1.0, 2.0]),
            at("u", "rad/s", &[0.05, 0.1, 0.2, 0.4]),
        ],
    ),
    damping(
        "asymmetric_drag",
        "drag that differs between the two directions",
        "-x * (abs(r) + y * r) * r",
        &[
            loss("x", "1/rad"),
            FormParameter { positive: false, ..plain("y", &[-0.8, -0.5, -0.2, 0.2, 0.5, 0.8]) },
        ],
    ),
    stiffness("cubic", "restoring moment with the cube", "-k3 * b^3", &[size("k3", "1/(rad2 s2)")]),
    stiffness(
        "quintic",
        "restoring moment with the fifth power",
        "-k5 * b^5",
        &[size("k5", "1/(rad4 s2)")],
    ),
    stiffness("sine", "gravity of a pendulum", "g * (b - sin(b))", &[size("g", "1/s2")]),
    stiffness(
        "odd_quadratic",
        "restoring moment with the square, odd",
        "-ka * abs(b) * b",
        &[size("ka", "1/(rad s2)")],
    ),
    stiffness("quadratic", "uneven restoring moment", "-k2 * b^2", &[size("k2", "1/(rad s2)")]),
    stiffness("one_sided_spring", "a spring on one side", "-ko * max(b, 0)", &[size("ko", "1/s2")]),
    stiffness(
        "stop",
        "a stop beyond an angle",
        "-ke * max(abs(b) - ge, 0) * sign(b)",
        &[size("ke", "1/s2"), at("ge", "rad", &[0.2, 0.35, 0.5, 0.65, 0.8])],
    ),
    stiffness(
        ABOVE,
        "a stop on the positive side",
        "-ku * max(b - gu, 0)",
        &[size("ku", "1/s2"), at("gu", "rad", &[0.1, 0.2, 0.35, 0.5, 0.65, 0.8])],
    ),
    stiffness(
        BELOW,
        "a stop on the negative side",
        "-kl * min(b + gl, 0)",
        &[size("kl", "1/s2"), at("gl", "rad", &[0.1, 0.2, 0.35, 0.5, 0.65, 0.8])],
    ),
    stiffness(
        "dead_zone",
        "no spring within an angle",
        "kd * max(min(b, gd), -gd)",
        &[size("kd", "1/s2"), at("gd", "rad", &[0.05, 0.1, 0.2])],
    ),
    stiffness(
        "power_stiffness",
        "restoring moment with a power of the angle",
        "-kp * sign(b) * abs(b / 1.0)^o",
        &[size("kp", "rad/s2"), plain("o", &[0.5, 0.75, 1.3, 1.5, 1.75, 2.5, 4.0, 6.0])],
    ),
];

/// One form or a sum of two, as an own effect.
#[derive(Clone, Debug)]
pub(crate) struct Formula {
    pub(crate) forms: Vec<&'static Form>,
}

impl Formula {
    pub(crate) fn id(&self) -> String {
        let ids: Vec<&str> = self.forms.iter().map(|f| f.id).collect();
        let whole = ids.join("_and_");
        // An own effect's identifier has forty letters at most.
        if whole.len() <= 40 {
            return whole;
        }
        let most = (40 + "_and_".len()) / ids.len() - "_and_".len();
        let short = |id: &&str| id[..id.len().min(most)].trim_end_matches('_').to_owned();
        ids.iter().map(short).collect::<Vec<_>>().join("_and_")
    }

    pub(crate) fn title(&self) -> String {
        let title = self.forms.iter().map(|f| f.title).collect::<Vec<_>>().join(" and ");
        let mut letters = title.chars();
        letters.next().map_or_else(String::new, |c| c.to_uppercase().chain(letters).collect())
    }

    pub(crate) fn parameters(&self) -> impl Iterator<Item = &'static FormParameter> + '_ {
        self.forms.iter().flat_map(|f| f.parameters)
    }

    /// The text of its file, `starts` being where a fit begins; `moment` of each form; `reach` the largest
    /// yaw angle (rad) and rate (rad/s).
    pub(crate) fn text(
        &self,
        starts: &[f64],
        reach: (f64, f64),
        moment: impl Fn(&Form) -> &'static str,
    ) -> String {
        let sum = self.forms.iter().map(|f| moment(f)).collect::<Vec<_>>().join(" + ");
        let mut text = format!(
            "id = \"{}\"\ntitle = \"{}\"\nmoment = \"{}\"   # rad/s2\n[parameters]\n",
            self.id(),
            self.title(),
            sum.replace("+ -", "- ")
        );
        let reaches = self.forms.iter().flat_map(|f| {
            let of = if f.is_stiffness { reach.0 } else { reach.1 };
            f.parameters.iter().map(move |_| of)
        });
        for ((p, start), reach) in self.parameters().zip(starts).zip(reaches) {
            let least = p.least(reach);
            let start = if *start == 0.0 { 1e-6 } else { start.max(least.unwrap_or(*start)) };
            let min = least.map_or_else(String::new, |least| format!(", min = {least:.4}"));
            let (name, unit) = (p.name, p.unit);
            text += &format!("{name} = {{ unit = \"{unit}\", start = {start:e}{min} }}\n");
        }
        text
    }

    /// Starts with which any formula passes the checks of an own effect.
    pub(crate) fn typical(&self) -> Vec<f64> {
        let of = |p: &FormParameter| if matches!(p.role, Role::OfReach(_)) { 0.05 } else { 0.5 };
        self.parameters().map(of).collect()
    }

    /// Compiled, to be fitted from `starts`.
    pub(crate) fn effect(
        &self,
        starts: &[f64],
        reach: (f64, f64),
        moment: impl Fn(&Form) -> &'static str,
    ) -> Option<OwnEffect> {
        let text = self.text(starts, reach, moment);
        match yawrig_expression::from_text(self.id().as_ref(), &text, &[]) {
            Ok(effect) => Some(effect),
            Err(error) => {
                debug_assert!(false, "{error:?}\n{text}");
                None
            }
        }
    }
}

/// The moment of `effect` at an angle and a rate, rad/s2.
pub(super) fn moment(effect: &OwnEffect, p: &[f64], yaw_rad: f64, rate_rad_s: f64, wn: f64) -> f64 {
    let sign = |x: f64| if x == 0.0 { 0.0 } else { x.signum() };
    let state = State {
        yaw_rad,
        rate_rad_s,
        time_s: 0.0,
        natural_frequency_rad_s: wn,
        wind_speed_m_s: 0.0,
        rate_sign: sign(rate_rad_s),
        yaw_sign: sign(yaw_rad),
    };
    effect.program.evaluate(&state, p)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_and_every_sum_of_two_is_an_own_effect() {
        for (k, a) in FORMS.iter().enumerate() {
            let one = Formula { forms: vec![a] };
            let effect = one.effect(&one.typical(), (1.0, 1.0), |f| f.moment).expect(a.id);
            let (b, r) = if a.is_stiffness { (0.6, 0.0) } else { (0.1, 0.7) };
            // On one side at least.
            let sizes = [b, -b].map(|b| moment(&effect, &one.typical(), b, r, 7.0));
            assert!(sizes.iter().all(|s| s.is_finite()) && sizes != [0.0; 2], "{}", a.id);
            for b in FORMS[..k].iter().filter(|b| a.adds_to(b)) {
                let two = Formula { forms: vec![b, a] };
                let effect = two.effect(&two.typical(), (1.0, 1.0), |f| f.moment);
                assert!(effect.is_some(), "{}", two.id());
            }
        }
    }
}
