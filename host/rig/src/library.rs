//! The laws that a virtual rig can hide in its records, one entry an effect: identifier, parameters, formula.
//!
//! Moments are over the inertia, rad/s2, angles in rad; those that are not smooth while the model moves one
//! way are written out where they act.

use std::borrow::Cow;
use std::sync::LazyLock;

/// One parameter of an effect and the values it may have, ends included.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub name: Cow<'static, str>,
    pub unit: Cow<'static, str>,
    pub(super) least: f64,
    pub(super) most: f64,
}

/// One effect of the library.
#[derive(Clone, Debug)]
pub struct Kind {
    pub id: Cow<'static, str>,
    /// Added to b'' = -2 zeta wn r - wn^2 b, or the reading where it says so.
    pub term: Cow<'static, str>,
    pub parameters: Vec<Parameter>,
    /// Values that show plainly in a release from some 10 deg at 7 rad/s.
    pub example: &'static str,
    /// Of a moment that is smooth while the model moves one way; the others are written out where they act.
    pub(super) smooth: Option<Smooth>,
}

/// A moment over the inertia that is smooth while the model moves one way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smooth {
    /// rad/s2, from the parameters' values, angle (rad), rate (rad/s) and the sign of the rate.
    pub moment: fn(&[f64], f64, f64, f64) -> f64,
    /// Its potential, rad2/s2, zero at no angle; `None` where it takes energy out.
    pub potential: Option<fn(&[f64], f64) -> f64>,
}

fn any(name: &'static str, unit: &'static str) -> Parameter {
    within(name, unit, f64::MIN, f64::MAX)
}

fn positive(name: &'static str, unit: &'static str) -> Parameter {
    within(name, unit, f64::MIN_POSITIVE, f64::MAX)
}

fn within(name: &'static str, unit: &'static str, least: f64, most: f64) -> Parameter {
    Parameter { name: Cow::Borrowed(name), unit: Cow::Borrowed(unit), least, most }
}

/// An effect that is written out where it acts.
fn kind(
    id: &'static str,
    term: &'static str,
    parameters: Vec<Parameter>,
    example: &'static str,
) -> Kind {
    let (id, term) = (Cow::Borrowed(id), Cow::Borrowed(term));
    Kind { id, term, parameters, example, smooth: None }
}

fn smooth(mut kind: Kind, law: Smooth) -> Kind {
    kind.smooth = Some(law);
    kind
}

/// An effect that takes energy out.
fn damping(kind: Kind, moment: fn(&[f64], f64, f64, f64) -> f64) -> Kind {
    smooth(kind, Smooth { moment, potential: None })
}

/// A restoring moment with its potential.
fn stiffness(
    kind: Kind,
    moment: fn(&[f64], f64, f64, f64) -> f64,
    potential: fn(&[f64], f64) -> f64,
) -> Kind {
    smooth(kind, Smooth { moment, potential: Some(potential) })
}

/// Fastest forcing, rad/s: beyond it the integration's steps no longer resolve a cycle.
const FASTEST_FORCING_RAD_S: f64 = 1000.0;

/// Every effect there is.
///
/// Friction and drag only take energy out, so that their coefficients are positive; a negative
/// `cubic_damping` is allowed, since damping that falls with amplitude is seen on such rigs.
pub static LIBRARY: LazyLock<Vec<Kind>> = LazyLock::new(|| {
    vec![
        kind(
            "coulomb_friction",
            "- c sign(r); sticks while r = 0 and the other torque is at most c",
            vec![positive("c", "rad/s2")],
            "c=0.12",
        ),
        damping(
            kind("quadratic_damping", "- d |r| r", vec![positive("d", "1/rad")], "d=0.3"),
            |p, _, r, sign| -p[0] * sign * r * r,
        ),
        damping(
            kind("cubic_damping", "- c b^2 r", vec![any("c", "1/(rad2 s)")], "c=2"),
            |p, b, r, _| -p[0] * b * b * r,
        ),
        stiffness(
            kind("cubic_stiffness", "- k3 b^3", vec![any("k3", "1/(rad2 s2)")], "k3=40"),
            |p, b, _, _| -p[0] * b * b * b,
            |p, b| p[0] * b * b * b * b / 4.0,
        ),
        stiffness(
            kind("quadratic_stiffness", "- k2 b^2", vec![any("k2", "1/(rad s2)")], "k2=20"),
            |p, b, _, _| -p[0] * b * b,
            |p, b| p[0] * b * b * b / 3.0,
        ),
        kind("static_offset", "+ m", vec![any("m", "rad/s2")], "m=0.3"),
        kind(
            "free_play",
            "the spring term wn^2 b acts on b beyond a dead zone of +-g only",
            vec![within("g", "rad", f64::MIN_POSITIVE, std::f64::consts::PI)],
            "g=0.01",
        ),
        kind(
            "harmonic_forcing",
            "+ f cos(w t + phi), w at least 10 % of wn away from it",
            vec![
                positive("f", "rad/s2"),
                within("w", "rad/s", f64::MIN_POSITIVE, FASTEST_FORCING_RAD_S),
                any("phi", "rad"),
            ],
            "f=0.3,w=11,phi=0.5",
        ),
        kind(
            "stiffness_drift",
            "wn^2 (1 + e t) in place of wn^2",
            vec![any("e", "1/s")],
            "e=0.003",
        ),
        kind(
            "buffeting",
            "+ white random moment of intensity q",
            vec![positive("q", "rad2/s3")],
            "q=0.01",
        ),
        kind(
            "second_mode",
            "reading + amplitude exp(-zeta2 w2 t) cos(w2 sqrt(1 - zeta2^2) t + phase)",
            vec![
                positive("amplitude", "rad"),
                any("phase", "rad"),
                positive("w2", "rad/s"),
                within("zeta2", "1", 0.001, 0.99),
            ],
            "amplitude=0.01,phase=0.4,w2=19,zeta2=0.01",
        ),
        kind("sensor_nonlinearity", "reading = b + s b^2", vec![any("s", "1/rad")], "s=0.3"),
        kind("baseline_drift", "reading = b + d t", vec![any("d", "rad/s")], "d=0.001"),
        stiffness(
            kind("quintic_stiffness", "- k5 b^5", vec![any("k5", "1/(rad4 s2)")], "k5=900"),
            |p, b, _, _| -p[0] * b * b * b * b * b,
            |p, b| p[0] * b * b * b * b * b * b / 6.0,
        ),
        stiffness(
            kind("pendulum_gravity", "+ g (b - sin b)", vec![any("g", "1/s2")], "g=49"),
            |p, b, _, _| p[0] * (b - b.sin()),
            |p, b| p[0] * (1.0 - b.cos() - b * b / 2.0),
        ),
        stiffness(
            kind("odd_quadratic_stiffness", "- k |b| b", vec![any("k", "1/(rad s2)")], "k=-10"),
            |p, b, _, _| -p[0] * b.abs() * b,
            |p, b| p[0] * b.abs() * b * b / 3.0,
        ),
        damping(
            kind(
                "power_damping",
                "- c |r|^n sign(r), 0 < n < 3",
                vec![positive("c", "(rad/s2)/(rad/s)^n"), within("n", "1", f64::MIN_POSITIVE, 3.0)],
                "c=0.1,n=1.5",
            ),
            // Beyond the turning point, which ends a step, the rate counts as none.
            |p, _, r, sign| -p[0] * sign * (sign * r).max(0.0).powf(p[1]),
        ),
        stiffness(
            kind(
                "end_stop",
                "- k (|b| - g) sign(b) beyond |b| > g",
                vec![positive("k", "1/s2"), positive("g", "rad")],
                "k=20,g=0.1",
            ),
            |p, b, _, _| -p[0] * (b.abs() - p[1]).max(0.0).copysign(b),
            |p, b| 0.5 * p[0] * (b.abs() - p[1]).max(0.0).powi(2),
        ),
        kind(
            "hysteresis",
            "- h z, z' = r - |r| z / y",
            vec![positive("h", "1/s2"), positive("y", "rad")],
            "h=2,y=0.05",
        ),
        stiffness(
            kind(
                "one_sided_stop",
                "- k (b - g) beyond g; the sign of g is its side",
                vec![positive("k", "1/s2"), any("g", "rad")],
                "k=40,g=0.1",
            ),
            |p, b, _, _| -p[0] * beyond(b, p[1]),
            |p, b| 0.5 * p[0] * (beyond(b, p[1]).powi(2) - beyond(0.0, p[1]).powi(2)),
        ),
        stiffness(
            kind(
                "two_stops",
                "- ku (b - gu) above gu, - kl (b + gl) below -gl",
                [stop("ku", "gu"), stop("kl", "gl")].concat(),
                "ku=40,gu=0.1,kl=60,gl=0.14",
            ),
            |p, b, _, _| -p[0] * beyond(b, p[1]) - p[2] * beyond(b, -p[3]),
            |p, b| 0.5 * (p[0] * beyond(b, p[1]).powi(2) + p[2] * beyond(b, -p[3]).powi(2)),
        ),
        damping(
            kind(
                "damped_stop",
                "- k (b - g) (1 + a r) beyond g; mirrored where g < 0",
                vec![positive("k", "1/s2"), any("g", "rad"), positive("a", "s/rad")],
                "k=40,g=0.1,a=0.5",
            ),
            |p, b, r, _| -p[0] * beyond(b, p[1]) * (1.0 + p[2] * r * p[1].signum()),
        ),
        damping(
            kind(
                "damped_stops",
                "- ku (b - gu) (1 + a r) above gu; likewise below -gl",
                [stop("ku", "gu"), stop("kl", "gl"), vec![positive("a", "s/rad")]].concat(),
                "ku=40,gu=0.1,kl=60,gl=0.14,a=0.5",
            ),
            |p, b, r, _| {
                let (above, below) = (beyond(b, p[1]), beyond(b, -p[3]));
                -p[0] * above * (1.0 + p[4] * r) - p[2] * below * (1.0 - p[4] * r)
            },
        ),
    ]
});

/// Stiffness and angle of a stop.
fn stop(stiffness: &'static str, angle: &'static str) -> Vec<Parameter> {
    vec![positive(stiffness, "1/s2"), positive(angle, "rad")]
}

/// How far `b` lies beyond `stop` on its side, with that side's sign.
fn beyond(b: f64, stop: f64) -> f64 {
    let side = stop.signum();
    side * (side * (b - stop)).max(0.0)
}
