use super::file::from_text;
use super::number::Dual;
use super::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The example of the documentation, verbatim.
pub const STRIBECK: &str = r#"id = "stribeck_friction"
title = "Stribeck friction"
moment = "-c * tanh(r / 0.002) * (1 + s * exp(-abs(r) / v))"   # rad/s2; b, r, t, wn, wind available
[parameters]
c = { unit = "rad/s2", start = 0.05, min = 0.0 }
s = { unit = "1", start = 0.5, min = 0.0 }
v = { unit = "rad/s", start = 0.1, min = 0.0 }
"#;

pub fn read(text: &str) -> Result<OwnEffect> {
    from_text(Path::new("my.toml"), text, &["coulomb_friction", "cubic_damping"])
}

/// A file with one moment and the parameters c (rad/s2) and s (a pure number).
pub fn file(moment: &str) -> String {
    format!(
        "id = \"mine\"\ntitle = \"Mine\"\nmoment = \"{moment}\"\n[parameters]\nc = {{ unit = \"rad/s2\", start = 0.05, min = 0.0 }}\ns = {{ unit = \"1\", start = 0.5 }}\n"
    )
}

fn state(b: f64, r: f64, t: f64) -> State<f64> {
    State {
        yaw_rad: b,
        rate_rad_s: r,
        time_s: t,
        natural_frequency_rad_s: 7.0,
        wind_speed_m_s: 10.0,
        rate_sign: r.signum(),
        yaw_sign: b.signum(),
    }
}

/// Value of an expression of b, r, t and the parameters c and s.
fn value(moment: &str, b: f64, r: f64, t: f64, [c, s]: [f64; 2]) -> f64 {
    let node = expression::parse(moment).unwrap_or_else(|e| panic!("{moment}: {e:?}"));
    let program = Program::new(&node, &["c".to_owned(), "s".to_owned()]).unwrap();
    let value = program.evaluate(&state(b, r, t), &[c, s]);
    // The same with its numbers put in.
    let mut prepared = Prepared::new(&program, &[c, s], 7.0, 10.0);
    for _ in 0..2 {
        let again = prepared.evaluate([b, r, t, r.signum(), b.signum()], &[]);
        assert!(again == value || again.is_nan() && value.is_nan(), "{moment}: {again} {value}");
    }
    value
}

#[test]
fn the_example_of_the_documentation_is_read() {
    let effect = read(STRIBECK).unwrap();
    assert_eq!(effect.id, "stribeck_friction");
    assert_eq!(effect.formula, "-c * tanh(r / 0.002) * (1 + s * exp(-abs(r) / v))");
    let names: Vec<&str> = effect.parameters.iter().map(|p| &*p.name).collect();
    assert_eq!(names, ["c", "s", "v"]);
    assert_eq!(effect.starts, [0.05, 0.5, 0.1]);
    assert_eq!(effect.size_parameter(), Some(0));
    assert!(effect.program.has_rate_corner && !effect.keeps_moving);
    assert!(effect.warnings.is_empty(), "{:?}", effect.warnings);
    let r = -0.03_f64;
    let expected = 0.2 * (0.03_f64 / 0.002).tanh() * (1.0 + 0.7 * (-0.03_f64 / 0.05).exp());
    let moment = effect.program.evaluate(&state(0.1, r, 3.0), &[0.2, 0.7, 0.05]);
    assert!((moment - expected).abs() < 1e-15);
}

#[test]
fn expressions_have_their_usual_values() {
    let (b, r, t, p) = (0.3_f64, -1.2_f64, 2.0_f64, [0.7_f64, 1.3_f64]);
    let [c, s] = p;
    for (text, expected) in [
        ("-b^2", -(b * b)),
        ("2^3^2", 512.0),
        ("2^-b", 2f64.powf(-b)),
        ("c - s - 1", c - s - 1.0),
        ("c / s / 2", c / s / 2.0),
        ("1 + 2 * 3", 7.0),
        ("- - b", b),
        ("+b*-r", -b * r),
        ("(c+s)*(c-s)", (c + s) * (c - s)),
        ("abs(r)*sign(b)", 1.2),
        ("abs(r-1)+sign(r-1)", 1.2),
        ("abs(b)*r + sign(r)", b * r - 1.0),
        ("exp(b)+ln(c)-log(c)+log10(c)", b.exp() + c.log10()),
        ("sqrt(c)*pow(s, 2.5)", c.sqrt() * s.powf(2.5)),
        ("c^-2", c.powi(-2)),
        ("sin(b)+cos(b)+tan(b)", b.sin() + b.cos() + b.tan()),
        ("asin(b)+acos(b)+atan(b)", b.asin() + b.acos() + b.atan()),
        ("sinh(b)+cosh(b)+tanh(b)", b.sinh() + b.cosh() + b.tanh()),
        ("atan2(r, b)", r.atan2(b)),
        ("min(b, r) + 10*max(b, t)", r + 10.0 * t),
        ("cos(pi) + wind + wn", -1.0 + 10.0 + 7.0),
        (".5e1 + 1.e-1 + 1E2", 5.0 + 0.1 + 100.0),
    ] {
        let found = value(text, b, r, t, p);
        assert!(
            (found - expected).abs() < 1e-12 * (1.0 + expected.abs()),
            "{text}: {found} {expected}"
        );
    }
    assert!(value("min(sqrt(-c), b)", b, r, t, p).is_nan());
    assert!(value("max(b, sqrt(-c))", b, r, t, p).is_nan());
}

/// Forward differentiation of every function against central differences.
#[test]
fn derivatives_are_those_of_differences() {
    for text in [
        "b*c + s/b - b^3 + b^s + s^b + 2^b + b^-2 + pow(b, 1.5)",
        "exp(b*s) + ln(b) + log10(b) + sqrt(b)",
        "sin(b) + cos(3*b) + tan(b) + asin(b) + acos(b*0.5) + atan(b)",
        "sinh(b) + cosh(b) + tanh(b/s)",
        "atan2(b, s) + atan2(c, b)",
        "min(b, 1) + max(b, 0) + abs(b - 1) + sign(b - 1) * b",
        "-(b - c)^2 / (1 + abs(b))",
    ] {
        let node = expression::parse(text).unwrap();
        let program = Program::new(&node, &["c".to_owned(), "s".to_owned()]).unwrap();
        let b = 0.37;
        let constant = |v: f64| Dual { value: v, slope: 0.0 };
        let dual = State {
            yaw_rad: Dual { value: b, slope: 1.0 },
            rate_rad_s: constant(0.0),
            time_s: constant(0.0),
            natural_frequency_rad_s: constant(7.0),
            wind_speed_m_s: constant(0.0),
            rate_sign: 1.0,
            yaw_sign: 1.0,
        };
        let slope = program.evaluate(&dual, &[constant(0.4), constant(1.3)]).slope;
        let at = |b: f64| program.evaluate(&state(b, 0.0, 0.0), &[0.4, 1.3]);
        let difference = (at(b + 1e-6) - at(b - 1e-6)) / 2e-6;
        assert!(
            (slope - difference).abs() < 1e-7 * (1.0 + slope.abs()),
            "{text}: {slope} {difference}"
        );
    }
}

#[test]
fn what_is_doubtful_is_warned_of() {
    for (moment, about) in [
        (
            "c*(2 + s)*sign(r) - s*c*b",
            "puts energy into a swing of 14.3 deg at 10 rad/s, wind 0 m/s",
        ),
        ("-c*b^3 - s*r*1.0", "s cannot be distinguished from natural frequency and damping"),
        ("-c*sin(1e9*b)*(1 + s*b)", "the derivative and a difference disagree"),
        ("-c*tanh(r / 1e-7)*(1 + s*abs(b))", "very steep by the yaw rate (5.0e5/s"),
    ] {
        let warnings = read(&file(moment)).unwrap_or_else(|e| panic!("{e}")).warnings;
        assert!(warnings.iter().any(|w| w.contains(about)), "{moment}: {warnings:?}");
    }
    // Self-excitation is real, and not refused; drag and springs are not warned of.
    for moment in ["-c*b*b*b*1.0*(1 + s*b*b)", "-c*abs(r)*r*1.0*(1 + s*b*b)"] {
        assert!(read(&file(moment)).unwrap().warnings.is_empty(), "{moment}");
    }
}

/// Time of an evaluation; printed, not asserted.
#[test]
fn an_evaluation_is_timed() {
    let effect = read(STRIBECK).unwrap();
    let mut prepared = Prepared::new(&effect.program, &[0.05, 0.5, 0.1], 7.0, 0.0);
    let (mut sum, n) = (0.0, 1_000_000);
    let started = std::time::Instant::now();
    for k in 0..n {
        sum += prepared.evaluate([0.1, 1e-6 * f64::from(k), 1.0, 1.0, 1.0], &[]);
    }
    let each = started.elapsed().as_secs_f64() / f64::from(n) * 1e9;
    println!("{each:.1} ns an evaluation, {sum:.3}");
    assert!(sum.is_finite());
}

/// Random bytes, and random pieces of expressions: refused or read, never a panic or a hang.
#[test]
fn nonsense_is_refused_without_harm() {
    let pieces = [
        "b", "r", "t", "wn", "wind", "c", "s", "pi", "abs(", "exp(", "pow(", "min(", ",", "(", ")",
        "+", "-", "*", "/", "^", "1", "0.5", "1e3", ".", "e", " ", "é", "^-", "((", "))", "1e",
        "sign(r)",
    ];
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut read_all = 0;
    for k in 0..20_000 {
        let length = random.random_range(0..60);
        let text: String = if k % 2 == 0 {
            let bytes: Vec<u8> = (0..length).map(|_| random.random()).collect();
            String::from_utf8_lossy(&bytes).into_owned()
        } else {
            (0..length / 3).map(|_| pieces[random.random_range(0..pieces.len())]).collect()
        };
        if let Ok(node) = expression::parse(&text) {
            let _ = Program::new(&node, &["c".to_owned(), "s".to_owned()]);
        }
        // The whole file, with whatever quotes and line ends are in it.
        read_all += u32::from(read(&file(&format!("c*({text}) + c*s*b^3"))).is_ok());
    }
    println!("{read_all} of 20000 are usable");
    assert!(read_all > 10);
    for deep in ["(", "-", "abs(", "2^", "-(", "1+(", "^"] {
        assert!(read(&file(&deep.repeat(100_000 / deep.len()))).is_err());
        assert!(read(&file(&deep.repeat(300))).is_err());
    }
    let nested = format!("{}b{}", "(".repeat(25), ")".repeat(25));
    let error = expression::parse(&nested).unwrap_err();
    assert_eq!(error.message, "nested more than 24 deep");
    // Long, but flat.
    assert!(expression::parse(&format!("b{}", "+b".repeat(490))).is_ok());
}
