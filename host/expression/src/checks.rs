//! What a moment is made to show before it is believed: finite, smooth enough to integrate, parameters that a
//! fit can tell apart, and whether it takes energy out.

use super::expression::{Flaw, Kind, Node, Span};
use super::number::Dual;
use super::program::{Program, State};
use nalgebra::DMatrix;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// States asked, at random but the same every time.
const STATES: usize = 200;
/// Largest yaw angle, rad, yaw rate, rad/s, and time, s, asked.
const LARGEST: (f64, f64, f64) = (0.4, 10.0, 60.0);
/// Wind-on speed asked, m/s.
const WIND_M_S: f64 = 10.0;
/// Steepness by the rate, 1/s, beyond which following the moment takes very small steps.
const STEEP_PER_S: f64 = 1e5;
/// Two columns are one if what is left of the second is less than this share.
const SAME: f64 = 1e-8;
/// Share of the exchanged energy that a conservative moment may seem to gain over a cycle.
const ENERGY: f64 = 1e-3;

/// A compiled moment and where its parameters start.
pub struct Subject<'a> {
    pub node: &'a Node,
    pub program: &'a Program,
    pub names: &'a [String],
    pub starts: &'a [f64],
    pub bounds: Vec<(f64, f64)>,
}

impl Subject<'_> {
    fn uses(&self, name: &str) -> bool {
        let mut used = Vec::new();
        self.node.names(&mut used);
        used.iter().any(|u| u.0 == name)
    }
}

/// Numbers of a state by which a derivative is taken.
#[derive(Clone, Copy, PartialEq)]
enum By {
    Yaw,
    Rate,
    Parameter(usize),
}

/// # Errors
/// A moment that is not finite, or parameters that no fit can tell apart. Warnings are returned.
pub fn check(
    subject: &Subject,
    first_use: &dyn Fn(&str) -> Option<Span>,
) -> Result<Vec<Flaw>, Flaw> {
    let states = states();
    finite(subject, &states)?;
    let mut warnings = Vec::new();
    warnings.extend(differentiable(subject, &states));
    warnings.extend(told_apart(subject, &states, first_use)?);
    warnings.extend(energy(subject));
    Ok(warnings)
}

fn at(b: f64, r: f64, t: f64, wn: f64, wind: f64) -> State<f64> {
    State {
        yaw_rad: b,
        rate_rad_s: r,
        time_s: t,
        natural_frequency_rad_s: wn,
        wind_speed_m_s: wind,
        rate_sign: if r < 0.0 { -1.0 } else { 1.0 },
        yaw_sign: if b < 0.0 { -1.0 } else { 1.0 },
    }
}

/// Rest with either sign of the rate and wind off, then states of every size a swing goes through.
fn states() -> Vec<State<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let rest = at(0.0, 0.0, 0.0, 10.0, 0.0);
    let mut out = vec![rest, State { rate_sign: -1.0, yaw_sign: -1.0, ..rest }];
    let mut size = |most: f64| {
        let size = most * 10f64.powf(random.random_range(-4.0..0.0));
        if random.random_bool(0.5) {
            size
        } else {
            -size
        }
    };
    for k in 0..STATES {
        let (b, r, t) = (size(LARGEST.0), size(LARGEST.1), size(LARGEST.2).abs());
        let wn = 2.5 * 10f64.powf((k % 11) as f64 / 10.0);
        out.push(at(b, r, t, wn, [0.0, WIND_M_S, 2.0 * WIND_M_S][k % 3]));
    }
    out
}

fn described(state: &State<f64>) -> String {
    format!(
        "b = {:.4} rad, r = {:.4} rad/s, t = {:.3} s, wn = {:.2} rad/s, wind = {} m/s",
        state.yaw_rad,
        state.rate_rad_s,
        state.time_s,
        state.natural_frequency_rad_s,
        state.wind_speed_m_s
    )
}

fn finite(subject: &Subject, states: &[State<f64>]) -> Result<(), Flaw> {
    let wrong = |program: &Program, state: &State<f64>| {
        let value = program.evaluate(state, subject.starts);
        (!value.is_finite()).then_some(value)
    };
    let Some(state) = states.iter().find(|s| wrong(subject.program, s).is_some()) else {
        return Ok(());
    };
    // The innermost piece that is not finite there.
    let (mut node, mut value) = (subject.node, f64::NAN);
    loop {
        let bad = |n: &Node| {
            let program = Program::new(n, subject.names).ok()?;
            wrong(&program, state)
        };
        value = bad(node).unwrap_or(value);
        match parts(node).into_iter().find(|n| bad(n).is_some()) {
            Some(part) => node = part,
            None => break,
        }
    }
    Err(Flaw::new(
        node.span.clone(),
        format!("this is {value} at {}", described(state)),
        "a moment is finite at rest, with the wind off (or not known: wind is then 0) and over the swing",
    ))
}

fn parts(node: &Node) -> Vec<&Node> {
    match &node.kind {
        Kind::Number(_) | Kind::Name(_) => Vec::new(),
        Kind::Negated(a) => vec![a],
        Kind::Binary(_, a, b) => vec![a, b],
        Kind::Call(_, arguments) => arguments.iter().collect(),
    }
}

/// Value and derivative by one number, by forward differentiation.
fn derivative(program: &Program, state: &State<f64>, parameters: &[f64], by: By) -> Dual {
    let dual = |value: f64, here: bool| Dual { value, slope: f64::from(u8::from(here)) };
    let state = State {
        yaw_rad: dual(state.yaw_rad, by == By::Yaw),
        rate_rad_s: dual(state.rate_rad_s, by == By::Rate),
        time_s: dual(state.time_s, false),
        natural_frequency_rad_s: dual(state.natural_frequency_rad_s, false),
        wind_speed_m_s: dual(state.wind_speed_m_s, false),
        rate_sign: state.rate_sign,
        yaw_sign: state.yaw_sign,
    };
    let parameters: Vec<Dual> =
        parameters.iter().enumerate().map(|(k, p)| dual(*p, by == By::Parameter(k))).collect();
    program.evaluate(&state, &parameters)
}

/// The derivatives against central differences: where they differ, the moment jumps or is steeper than it can
/// be followed.
fn differentiable(subject: &Subject, states: &[State<f64>]) -> Option<Flaw> {
    let mut steepest: (f64, State<f64>) = (0.0, states[0]);
    let (mut asked, mut off) = (0, 0);
    let mut where_off = states[0];
    for state in states {
        let moving = state.yaw_rad != 0.0;
        for by in [By::Yaw, By::Rate] {
            let exact = derivative(subject.program, state, subject.starts, by).slope;
            if by == By::Rate && (exact.is_nan() || exact.abs() > steepest.0) {
                steepest = (if exact.is_nan() { f64::INFINITY } else { exact.abs() }, *state);
            }
            if !moving {
                continue;
            }
            let moved = |by_how_much: f64| {
                let mut state = *state;
                match by {
                    By::Yaw => state.yaw_rad += by_how_much,
                    _ => state.rate_rad_s += by_how_much,
                }
                subject.program.evaluate(&state, subject.starts)
            };
            let size = if by == By::Yaw { state.yaw_rad } else { state.rate_rad_s };
            let h = 1e-5 * size.abs();
            let (up, down) = (moved(h), moved(-h));
            let difference = (up - down) / (2.0 * h);
            let rounding = 1e-15 * (up.abs() + down.abs()) / h;
            asked += 1;
            let apart = (exact - difference).abs();
            if apart.is_nan() || apart > 1e-3 * (exact.abs() + difference.abs()) + 8.0 * rounding {
                off += 1;
                where_off = *state;
            }
        }
    }
    let span = subject.node.span.clone();
    if off * 50 > asked {
        return Some(Flaw::new(
            span,
            format!("the derivative and a difference disagree, as at {}", described(&where_off)),
            "a moment that jumps or ripples this finely cannot be fitted reliably: use a wider scale",
        ));
    }
    (steepest.0 > STEEP_PER_S).then(|| {
        Flaw::new(
            span,
            format!(
                "very steep by the yaw rate ({:.1e}/s at {})",
                steepest.0,
                described(&steepest.1)
            ),
            "for friction use sign(r), whose corner is located exactly, or a wider scale",
        )
    })
}

/// Whether the moments of small changes of the parameters differ from each other, and from those of wn and
/// zeta.
fn told_apart(
    subject: &Subject,
    states: &[State<f64>],
    first_use: &dyn Fn(&str) -> Option<Span>,
) -> Result<Option<Flaw>, Flaw> {
    // Off the starts, which may be special; within the bounds.
    let values: Vec<f64> = subject
        .starts
        .iter()
        .zip(&subject.bounds)
        .enumerate()
        .map(|(k, (start, (min, max)))| {
            let other = start * (1.1 + 0.07 * k as f64);
            if (*min..=*max).contains(&other) {
                other
            } else {
                start * (0.9 - 0.05 * k as f64)
            }
        })
        .collect();
    let column = |k: usize| -> Vec<f64> {
        let by = By::Parameter(k);
        states.iter().map(|s| derivative(subject.program, s, &values, by).slope).collect()
    };
    let columns: Vec<Vec<f64>> = (0..values.len()).map(column).collect();
    let span = |k: usize| first_use(&subject.names[k]).unwrap_or(subject.node.span.clone());
    for (k, column) in columns.iter().enumerate() {
        let name = &subject.names[k];
        if column.iter().all(|x| x.abs() < 1e-300 || x.is_nan()) {
            let help = "take it away, or write the moment so that it depends on it";
            return Err(Flaw::new(span(k), format!("the moment does not depend on {name}"), help));
        }
        let others: Vec<usize> = (0..k).collect();
        if left_over(&columns, &others, column) < SAME {
            let same = others.iter().find(|j| left_over(&columns, &[**j], column) < SAME);
            let with = match same {
                Some(j) => subject.names[*j].clone(),
                None => "those before it".to_owned(),
            };
            let message =
                format!("no fit can tell {name} from {with}: they change the moment alike");
            return Err(Flaw::new(span(k), message, "make one parameter of them"));
        }
    }
    // wn^2 b and 2 zeta wn r are in the model already; with the wind the same, so is anything in proportion.
    let calm: Vec<&State<f64>> = states.iter().collect();
    let plain = vec![
        calm.iter().map(|s| s.yaw_rad).collect::<Vec<f64>>(),
        calm.iter().map(|s| s.rate_rad_s).collect(),
    ];
    let alike = (0..columns.len()).find(|k| {
        let held =
            |s: &State<f64>| State { natural_frequency_rad_s: 7.0, wind_speed_m_s: WIND_M_S, ..*s };
        let by = By::Parameter(*k);
        let column: Vec<f64> =
            calm.iter().map(|s| derivative(subject.program, &held(s), &values, by).slope).collect();
        left_over(&plain, &[0, 1], &column) < SAME
    });
    Ok(alike.map(|k| {
        let name = &subject.names[k];
        Flaw::new(
            span(k),
            format!(
                "in one release {name} cannot be distinguished from natural frequency and damping"
            ),
            "they hold every moment in proportion to b and r already",
        )
    }))
}

/// Norm of what is left of `column` beyond the columns `others`, of its own.
fn left_over(columns: &[Vec<f64>], others: &[usize], column: &[f64]) -> f64 {
    let norm = |c: &[f64]| c.iter().map(|x| x * x).sum::<f64>().sqrt();
    // Of one that overflows nothing can be said.
    let others: Vec<usize> =
        others.iter().copied().filter(|j| norm(&columns[*j]).is_finite()).collect();
    let own = norm(column);
    if others.is_empty() || !own.is_finite() || own == 0.0 {
        return 1.0;
    }
    let unit = |c: &[f64]| {
        let norm = norm(c).max(f64::MIN_POSITIVE);
        c.iter().map(|x| x / norm).collect::<Vec<f64>>()
    };
    let base: Vec<f64> = others.iter().flat_map(|j| unit(&columns[*j])).collect();
    let base = DMatrix::from_vec(column.len(), others.len(), base);
    let wanted = nalgebra::DVector::from_vec(unit(column));
    match base.clone().svd(true, true).solve(&wanted, 1e-12) {
        Ok(x) => (wanted - base * x).norm(),
        Err(_) => 1.0,
    }
}

/// The first parameter to which the moment is in proportion at every state.
pub fn size_parameter(subject: &Subject) -> Option<usize> {
    let states = states();
    let proportional = |k: usize| {
        let mut doubled = subject.starts.to_vec();
        doubled[k] *= 2.0;
        states.iter().all(|s| {
            let once = subject.program.evaluate(s, subject.starts);
            (subject.program.evaluate(s, &doubled) - 2.0 * once).abs() <= 1e-12 * once.abs()
        })
    };
    (0..subject.starts.len())
        .find(|k| proportional(*k) && subject.bounds[*k].0 <= 0.0 && subject.bounds[*k].1 >= 0.0)
}

/// Whether it depends on time, or puts energy in.
pub fn keeps_moving(subject: &Subject) -> bool {
    subject.uses("t") || energy(subject).is_some()
}

/// Whether the moment puts energy in over a cycle. One that depends on time may do either, and is not asked.
fn energy(subject: &Subject) -> Option<Flaw> {
    if subject.uses("t") {
        return None;
    }
    for wind in [0.0, WIND_M_S] {
        for (amplitude, wn) in [(0.25, 10.0), (0.1, 3.0), (0.1, 25.0), (0.02, 10.0)] {
            let (mut gained, mut exchanged) = (0.0, 0.0);
            for k in 0..2000 {
                let (s, c) = (TAU * (f64::from(k) + 0.5) / 2000.0).sin_cos();
                let state = at(amplitude * c, -amplitude * wn * s, 0.0, wn, wind);
                let power = subject.program.evaluate(&state, subject.starts) * state.rate_rad_s;
                gained += power;
                exchanged += power.abs();
            }
            if gained > ENERGY * exchanged {
                return Some(Flaw::new(
                    subject.node.span.clone(),
                    format!(
                        "at its start values this puts energy into a swing of {:.1} deg at {wn} rad/s, wind {wind} m/s",
                        amplitude.to_degrees()
                    ),
                    "right for self-excited oscillation; friction and drag take energy out: check the sign",
                ));
            }
        }
    }
    None
}
