//! `measured_law`: restoring moment and dissipation beside wn^2 b and 2 zeta wn r as smooth curves,
//! estimated.
//!
//! b'' = -2 zeta wn r - wn^2 b - K(b) - D(r), with K(b) = sign(b) k(|b|) + e(|b|) and
//! D(r) = sign(r) d(|r|) + u(|r|). The curves k, e, d and u, as far as the law has them, are natural cubic
//! splines through their values at knots from zero to the largest yaw angle and rate reached, nearer where
//! the law bends. They vanish at zero, but for d, which begins at the dry friction c where there is one; all
//! but e with their slope, so that wn is that of small motions. How much of 2 zeta wn r stands in D is a
//! choice: a law may say which line is not in d. Beyond the last knot a curve goes on at its end slope. What
//! the values may do is limited by a roughness: the integral of the squared curvature (P. J. Green and B. W.
//! Silverman, Nonparametric Regression and Generalized Linear Models, 1994, chapter 2), each curve with a
//! weight of its own, and less where its knots are near.

use super::curves::{Curves, Knots, Part, Shape, KNOTS};
use super::law::{Card, Equation, Law, Parameter, Scale, Seen};
use super::terms::{State, Terms};
use super::Effect;
use nalgebra::{DMatrix, DVector};
use std::borrow::Cow;
use std::sync::Arc;

/// Energy that a dissipation with its line taken out may put in, as a share of its largest value: nil is
/// taken instead.
const LITTLE_OFF: f64 = 0.02;

/// The identifier of a measured law.
pub const MEASURED_LAW: &str = "measured_law";

/// Of values at the knots of a curve, the slope of the line in them: of a curve that is 1 at its largest, 1.
pub type Line = [f64; KNOTS];

/// The shape of a measured law: its curves, where their knots are, and how rough they may be. Its values are
/// parameters.
#[derive(Clone, Debug)]
pub struct MeasuredLaw {
    /// Largest yaw angle about the rest that the law was measured at.
    pub yaw_rad: f64,
    /// Largest yaw rate that the law was measured at.
    pub rate_rad_s: f64,
    /// Each with the weight of its roughness; larger is smoother.
    pub parts: Vec<(Part, f64)>,
    /// Whether the dissipation jumps at r = 0.
    pub friction: bool,
    /// Whether d takes energy out at every rate.
    pub dissipative: bool,
    /// Of every part, in the order of [`Part::ALL`].
    pub knots: [Knots; 4],
    /// What d's values are multiplied with for the line in it, which is nil: the damping ratio has it.
    pub line: Option<Line>,
    parameters: Vec<Parameter>,
    shapes: Vec<Shape>,
}

impl MeasuredLaw {
    /// A law known up to `yaw_rad` and `rate_rad_s`. Its parameters: the values of each part at its knots
    /// (`k1` ... of the stiffness, then `e`, `d`, `u`), and with `friction` the jump `c` of the dissipation
    /// at r = 0.
    pub fn new(
        yaw_rad: f64,
        rate_rad_s: f64,
        parts: Vec<(Part, f64)>,
        friction: bool,
        dissipative: bool,
    ) -> Self {
        let parameter = |name: String, min: f64| Parameter {
            name: Cow::Owned(name),
            unit: Cow::Borrowed("rad/s2"),
            min,
            max: f64::INFINITY,
        };
        let mut parameters = Vec::new();
        for (part, _) in &parts {
            let least = if dissipative && *part == Part::Damping { 0.0 } else { f64::NEG_INFINITY };
            parameters
                .extend((1..=KNOTS).map(|k| parameter(format!("{}{k}", part.letter()), least)));
        }
        if friction {
            parameters.push(parameter("c".to_owned(), 0.0));
        }
        let knots = Part::ALL.map(Part::even_knots);
        let law = Self {
            yaw_rad,
            rate_rad_s,
            parts,
            friction,
            dissipative,
            knots,
            line: None,
            parameters,
            shapes: vec![],
        };
        law.placed(knots)
    }

    /// The same law with its knots elsewhere and no line taken out of its dissipation.
    pub fn placed(&self, knots: [Knots; 4]) -> Self {
        let shapes = self.parts.iter().map(|(p, _)| Shape::new(*p, &knots[*p as usize])).collect();
        Self { knots, shapes, line: None, ..self.clone() }
    }

    /// The same law, with `line` taken out of its dissipation.
    pub fn without_line(&self, line: Option<Line>) -> Self {
        Self { line, ..self.clone() }
    }

    /// `values` with the line of the dissipation taken out, and its slope, 1/s: 2 zeta wn has to gain that.
    /// `None` where there is none to take out, or where what is left would put energy in.
    pub(crate) fn leveled(&self, values: &[f64]) -> Option<(Vec<f64>, f64)> {
        let at = KNOTS * self.parts.iter().position(|(part, _)| *part == Part::Damping)?;
        let (mut out, line) = (values.to_vec(), self.line?);
        let d = &mut out[at..at + KNOTS];
        let rise: f64 = line.iter().zip(&*d).map(|(a, b)| a * b).sum();
        let most = d.iter().fold(0.0f64, |m, d| m.max(d.abs()));
        for (d, knot) in d.iter_mut().zip(self.knots[Part::Damping as usize]) {
            *d -= rise * knot;
            if self.dissipative && *d < 0.0 {
                if *d < -LITTLE_OFF * most {
                    return None;
                }
                *d = 0.0;
            }
        }
        Some((out, rise / self.rate_rad_s))
    }

    /// Whether it bends to all that `effect` does: a moment of the yaw angle alone or of the yaw rate alone,
    /// as far as it has the parts that are alike on both sides, or differ, as that does; or dry friction.
    pub(crate) fn holds(&self, effect: &Effect) -> bool {
        if !effect.is_strength_of_state() || effect.moves_rest() {
            return false;
        }
        let terms = Terms::new([(effect.clone(), &[1.0][..])]);
        let at = |yaw: f64, rate: f64| {
            let (yaw_rad, rate_rad_s) = (yaw * self.yaw_rad, rate * self.rate_rad_s);
            let state = State { yaw_rad, rate_rad_s, time_s: 0.0, spring_moment_rad_s2: 0.0 };
            terms.smooth_moment(&state, 0.0)
        };
        let has = |part: Part| self.parts.iter().any(|(there, _)| *there == part);
        let of = |up: f64, down: f64, same: Part, differs: Part| {
            (up + down == 0.0 || has(differs)) && (up == down || has(same))
        };
        match [at(1.0, 0.0), at(0.0, 1.0)] {
            [0.0, 0.0] => self.friction && effect.sticks(),
            [up, 0.0] => of(up, at(-1.0, 0.0), Part::Stiffness, Part::UnevenStiffness),
            [0.0, up] => of(up, at(0.0, -1.0), Part::Damping, Part::UnevenDamping),
            _ => false,
        }
    }

    /// With knots nearer where the law of these `values` bends.
    pub(crate) fn refined(&self, values: &[f64]) -> Self {
        let mut knots = self.knots;
        for (i, (&(part, _), shape)) in self.parts.iter().zip(&self.shapes).enumerate() {
            knots[part as usize] = shape.bent(&self.above(values, i));
        }
        self.placed(knots)
    }

    /// Values of the `i`th part above what it is at zero.
    fn above(&self, p: &[f64], i: usize) -> Vec<f64> {
        let zero = self.at_zero(p, self.parts[i].0);
        p[i * KNOTS..(i + 1) * KNOTS].iter().map(|v| v - zero).collect()
    }

    /// What a part is at zero: dissipation begins at the dry friction.
    fn at_zero(&self, p: &[f64], part: Part) -> f64 {
        match self.friction && part == Part::Damping {
            true => p[self.parameters.len() - 1],
            false => 0.0,
        }
    }

    /// With other parts or weights, and with or without friction.
    pub(crate) fn with(&self, parts: Vec<(Part, f64)>, friction: bool) -> Self {
        let law = Self::new(self.yaw_rad, self.rate_rad_s, parts, friction, self.dissipative);
        Self { line: self.line, ..law.placed(self.knots) }
    }

    /// Whether it has no curve and no friction.
    pub fn is_none(&self) -> bool {
        self.parameters.is_empty()
    }

    /// The parameters of no moment.
    pub(crate) fn no_law(&self) -> Vec<f64> {
        vec![0.0; self.parameters.len()]
    }

    /// `values` of the parameters of `self` as those of `other`, zero for what `self` does not have.
    pub(crate) fn translated(&self, values: &[f64], other: &Self) -> Vec<f64> {
        let mut out = other.no_law();
        if let (true, true, Some(last)) = (self.friction, other.friction, out.last_mut()) {
            *last = values[self.parameters.len() - 1];
        }
        for (j, (part, _)) in other.parts.iter().enumerate() {
            let Some(i) = self.parts.iter().position(|(p, _)| p == part) else {
                let zero = other.at_zero(&out, *part);
                out[j * KNOTS..(j + 1) * KNOTS].fill(zero);
                continue;
            };
            let curve = self.shapes[i].curve(&self.above(values, i), 1.0);
            let zero = self.at_zero(values, *part);
            for (value, at) in out[j * KNOTS..].iter_mut().zip(&other.knots[*part as usize]) {
                *value = zero + curve.at(*at);
            }
        }
        out
    }

    fn reach(&self, part: Part) -> f64 {
        if part.is_of_yaw() {
            self.yaw_rad
        } else {
            self.rate_rad_s
        }
    }

    /// K at `yaw_rad` and D at `rate_rad_s` as rows that the parameters are multiplied with, rad/s2. D at
    /// zero is zero.
    pub(crate) fn rows(&self, yaw_rad: f64, rate_rad_s: f64) -> [DVector<f64>; 2] {
        let n = self.parameters.len();
        let (mut stiffness, mut damping) = (DVector::zeros(n), DVector::zeros(n));
        let sign = |x: f64| if x == 0.0 { 0.0 } else { x.signum() };
        for (i, (&(part, _), shape)) in self.parts.iter().zip(&self.shapes).enumerate() {
            let (x, row) = match part.is_of_yaw() {
                true => (yaw_rad, &mut stiffness),
                false => (rate_rad_s, &mut damping),
            };
            let mut sum = 0.0;
            for k in 0..KNOTS {
                let mut values = [0.0; KNOTS];
                values[k] = 1.0;
                let size = shape.curve(&values, self.reach(part)).at(x.abs());
                row[i * KNOTS + k] = size * if part.is_odd() { sign(x) } else { 1.0 };
                sum += row[i * KNOTS + k];
            }
            if self.friction && part == Part::Damping {
                row[n - 1] -= sum;
            }
        }
        if self.friction {
            damping[n - 1] += sign(rate_rad_s);
        }
        [stiffness, damping]
    }

    /// Rows over the parameters in their sizes, whose squares are the roughness of each curve with its
    /// weight, and the line in the dissipation.
    pub(crate) fn penalty(&self) -> DMatrix<f64> {
        let curves = KNOTS * self.parts.len();
        let lines = usize::from(self.line.is_some());
        let mut rows = DMatrix::zeros(curves + lines, self.parameters.len());
        for (k, (&(part, weight), shape)) in self.parts.iter().zip(&self.shapes).enumerate() {
            let at = k * KNOTS;
            let roughness = shape.roughness() * weight.sqrt();
            if self.friction && part == Part::Damping {
                let last = self.parameters.len() - 1;
                let sums = -roughness.column_sum();
                rows.view_mut((at, last), (KNOTS, 1)).copy_from(&sums);
            }
            rows.view_mut((at, at), (KNOTS, KNOTS)).copy_from(&roughness);
            if let (Part::Damping, Some(line)) = (part, self.line) {
                rows.view_mut((curves, at), (1, KNOTS)).copy_from_slice(&line);
            }
        }
        rows
    }

    /// The terms of a part in the language of a user's own effects, each on a line.
    fn terms(&self, i: usize) -> Vec<String> {
        let (part, shape) = (self.parts[i].0, &self.shapes[i]);
        let x = if part.is_of_yaw() { "b" } else { "r" };
        let above = self.friction && part == Part::Damping;
        let size = |k: usize| {
            let name = &self.parameters[i * KNOTS + k].name;
            if above {
                format!("({name} - c)")
            } else {
                name.to_string()
            }
        };
        let unit = |k: usize| std::array::from_fn::<f64, KNOTS, _>(|j| f64::from(u8::from(j == k)));
        let powers: Vec<_> = (0..KNOTS).map(|k| shape.powers(&unit(k), self.reach(part))).collect();
        let sum = |of: &dyn Fn(usize) -> f64| {
            let all = (0..KNOTS).filter(|&k| of(k) != 0.0);
            let each: Vec<String> = all.map(|k| format!("{:?} * {}", of(k), size(k))).collect();
            (!each.is_empty()).then(|| each.join(" + ").replace("+ -", "- "))
        };
        let odd = part.is_odd();
        let mut out = Vec::new();
        let mut term = |sizes: Option<String>, text: String| {
            out.extend(sizes.map(|sizes| format!("-({sizes}) * {text}")));
        };
        term(sum(&|k| powers[k].0[0]), if odd { x.to_owned() } else { format!("abs({x})") });
        term(
            sum(&|k| powers[k].0[1]),
            if odd { format!("abs({x}) * {x}") } else { format!("{x}^2") },
        );
        for knot in 0..=KNOTS {
            let at = powers[0].1[knot].0;
            let text = match odd {
                true => format!("(max({x} - {at:?}, 0)^3 + min({x} + {at:?}, 0)^3)"),
                false => format!("max(abs({x}) - {at:?}, 0)^3"),
            };
            term(sum(&|k| powers[k].1[knot].1), text);
        }
        out
    }

    fn curves(&self, p: &[f64]) -> Curves {
        let curve = |(k, (&(part, _), shape)): (usize, (&(Part, f64), &Shape))| {
            (part, shape.curve(&self.above(p, k), self.reach(part)))
        };
        Curves(self.parts.iter().zip(&self.shapes).enumerate().map(curve).collect())
    }
}

impl Law for Arc<MeasuredLaw> {
    fn id(&self) -> &str {
        MEASURED_LAW
    }

    fn wind_power(&self, _: &[f64]) -> Option<(usize, f64)> {
        None
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.stiffness() * scale.amplitude_rad; self.parameters.len()]
    }

    fn starts(&self, _: &Seen) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.parameters.len()]]
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        if self.friction {
            terms.rub(p[self.parameters.len() - 1]);
        }
        terms.add_curves(self.curves(p));
    }

    fn equation(&self) -> Option<Equation<'_>> {
        let mut all: Vec<String> = (0..self.parts.len()).flat_map(|i| self.terms(i)).collect();
        all.extend(self.friction.then(|| "-c * sign(r)".to_owned()));
        Some(Equation::Moment(Cow::Owned(all.join("\n"))))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "A law measured from the releases",
            formula: "- K(b) - D(r), curves through their values at knots",
            cause: "something that no effect of the library describes",
            fingerprint: "a missing moment that is a curve over the angle, or over its rate, at every amplitude",
            confirm: "measure it again from another release: the curves agree within their bands",
            remove: "depends on what it stands for: see the formulas that predict as well",
            release: "a larger amplitude, beyond which the law is not known",
        }
    }
}

#[cfg(test)]
#[path = "measured_tests.rs"]
mod tests;
