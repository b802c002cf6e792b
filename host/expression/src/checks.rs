//! What a moment is made to show before it is believed: finite, smooth enough to integrate, parameters that a
//! fit can tell apart, and whether it takes energy out.

use super::expression::{Flaw, Kind, Node, Span};
use super::program::{Program, State};
use super::samples::{derivative, described, By, Sample, Subject, WIND_M_S};
use nalgebra::DMatrix;

/// Steepness by the rate, 1/s, beyond which following the moment takes very small steps.
const STEEP_PER_S: f64 = 1e5;
/// Two columns are one if what is left of the second is less than this share.
const SAME: f64 = 1e-8;
/// Share of the exchanged energy that a conservative moment may seem to gain over a cycle.
const ENERGY: f64 = 1e-3;

/// # Errors
/// A moment that is not finite, or parameters that no fit can tell apart. Warnings are returned.
pub fn check(
    subject: &Subject,
    first_use: &dyn Fn(&str) -> Option<Span>,
) -> Result<Vec<Flaw>, Flaw> {
    let samples = subject.samples(subject.starts);
    finite(subject, &samples)?;
    let mut warnings = Vec::new();
    warnings.extend(differentiable(subject, &samples));
    warnings.extend(told_apart(subject, first_use)?);
    warnings.extend(energy(subject));
    Ok(warnings)
}

fn finite(subject: &Subject, samples: &[Sample]) -> Result<(), Flaw> {
    let lost = |(state, z): &Sample| {
        let k = (0..subject.states.len()).find(|k| !z[*k].is_finite())?;
        Some((subject.states[k].name.as_str(), *state))
    };
    if let Some((name, state)) = samples.iter().find_map(lost) {
        let message = format!(
            "{name} cannot be followed along a swing of {:.1} deg at {:.0} rad/s",
            state.yaw_rad.hypot(state.rate_rad_s / state.natural_frequency_rad_s).to_degrees(),
            state.natural_frequency_rad_s
        );
        let help =
            "its rate is to bring it back, in a thousandth of a cycle or more, and be finite";
        return Err(Flaw::new(subject.node.span.clone(), message, help));
    }
    let wrong = |program: &Program, sample: &Sample| {
        let value = subject.evaluate(program, sample, subject.starts);
        (!value.is_finite()).then_some(value)
    };
    let Some(sample) = samples.iter().find(|s| wrong(subject.program, s).is_some()) else {
        return Ok(());
    };
    // The innermost piece that is not finite there.
    let (mut node, mut value) = (subject.node, f64::NAN);
    loop {
        let bad = |n: &Node| {
            let program = Program::new(n, subject.names).ok()?;
            wrong(&program, sample)
        };
        value = bad(node).unwrap_or(value);
        match parts(node).into_iter().find(|n| bad(n).is_some()) {
            Some(part) => node = part,
            None => break,
        }
    }
    Err(Flaw::new(
        node.span.clone(),
        format!("this is {value} at {}", described(&sample.0)),
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

/// The derivatives against central differences: where they differ, the moment jumps or is steeper than it can
/// be followed.
fn differentiable(subject: &Subject, samples: &[Sample]) -> Option<Flaw> {
    let mut steepest: (f64, State<f64>) = (0.0, samples[0].0);
    let (mut asked, mut off) = (0, 0);
    let mut where_off = samples[0].0;
    for sample in samples {
        let state = &sample.0;
        let moving = state.yaw_rad != 0.0;
        for by in [By::Yaw, By::Rate] {
            let exact = derivative(subject, sample, subject.starts, by).slope;
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
                subject.evaluate(subject.program, &(state, sample.1), subject.starts)
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
    let samples = subject.samples(&values);
    let column = |k: usize| subject.column(k, &values, &samples);
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
    let plain = vec![
        samples.iter().map(|(s, _)| s.yaw_rad).collect::<Vec<f64>>(),
        samples.iter().map(|(s, _)| s.rate_rad_s).collect(),
    ];
    let one_release: Vec<Sample> = samples
        .iter()
        .map(|(s, z)| (State { natural_frequency_rad_s: 7.0, wind_speed_m_s: WIND_M_S, ..*s }, *z))
        .collect();
    let alike = (0..columns.len())
        .find(|k| left_over(&plain, &[0, 1], &subject.column(*k, &values, &one_release)) < SAME);
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
    let moments = |parameters: &[f64]| -> Vec<f64> {
        let samples = subject.samples(parameters);
        samples.iter().map(|s| subject.evaluate(subject.program, s, parameters)).collect()
    };
    let once = moments(subject.starts);
    let proportional = |k: usize| {
        let mut doubled = subject.starts.to_vec();
        doubled[k] *= 2.0;
        let twice = moments(&doubled);
        once.iter().zip(twice).all(|(once, twice)| (twice - 2.0 * once).abs() <= 1e-12 * once.abs())
    };
    (0..subject.starts.len())
        .find(|k| proportional(*k) && subject.bounds[*k].0 <= 0.0 && subject.bounds[*k].1 >= 0.0)
}

/// Whether it depends on time, or puts energy in.
pub fn keeps_moving(subject: &Subject) -> bool {
    subject.uses_time() || energy(subject).is_some()
}

/// Whether the moment puts energy in over a cycle. One that depends on time may do either, and is not asked.
fn energy(subject: &Subject) -> Option<Flaw> {
    if subject.uses_time() {
        return None;
    }
    for wind in [0.0, WIND_M_S] {
        for (amplitude, wn) in [(0.25, 10.0), (0.1, 3.0), (0.1, 25.0), (0.02, 10.0)] {
            let (mut gained, mut exchanged) = (0.0, 0.0);
            for sample in subject.cycle(amplitude, wn, wind) {
                let moment = subject.evaluate(subject.program, &sample, subject.starts);
                let power = moment * sample.0.rate_rad_s;
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
