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

fn read(text: &str) -> Result<OwnEffect> {
    from_text(Path::new("my.toml"), text, &["coulomb_friction", "cubic_damping"])
}

/// A file with one moment and the parameters c (rad/s2) and s (a pure number).
fn file(moment: &str) -> String {
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
        let again = prepared.evaluate(b, r, t, r.signum(), b.signum());
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

/// What is wrong with the moment, where, and what to do; the line shown and the caret under it.
#[test]
fn errors_in_a_moment_point_at_the_character() {
    const MADE_OF: &str = "numbers, names, + - * / ^, parentheses and commas make up an expression";
    const UNITS: &str = "a moment is divided by the inertia; a bare number takes any unit it needs";
    const FINITE: &str = "a moment is finite at rest, with the wind off (or not known: wind is then 0) and over the swing";
    let at_rest = "b = 0.0000 rad, r = 0.0000 rad/s, t = 0.000 s, wn = 10.00 rad/s, wind = 0 m/s";
    for (moment, column, width, message, help) in [
        ("-c * taanh(r)", 6, 5, "there is no function \"taanh\"", "did you mean tanh?"),
        ("-c * (r", 6, 1, "this parenthesis is not closed", "add a )"),
        (
            "-c * r)",
            7,
            1,
            "an operator (+ - * / ^) is expected here, not ')'",
            "take it away, or open a parenthesis before it",
        ),
        (
            "-c r",
            4,
            1,
            "an operator (+ - * / ^) is expected here, not 'r'",
            "a product is written with *",
        ),
        (
            "-c ** r",
            5,
            1,
            "a number, a name or ( is expected here, not '*'",
            "a power is written ^ or pow(x, n)",
        ),
        (
            "-c * wnd",
            6,
            3,
            "there is no \"wnd\"",
            "did you mean wn? A parameter is declared under [parameters]",
        ),
        (
            "-c * q",
            6,
            1,
            "there is no \"q\"",
            "there are b, r, t, wn, wind, pi, c, s; a parameter is declared under [parameters]",
        ),
        ("-c * tanh", 6, 4, "tanh is a function", "give its argument: tanh(...)"),
        ("min(c)", 1, 6, "min takes 2 argument(s), not 1", "arguments are separated by commas"),
        ("min(c, s", 4, 1, "this parenthesis is not closed", "add a )"),
        ("min(c s)", 7, 1, "an operator or ) is expected here, not 's'", MADE_OF),
        (
            "c = s",
            3,
            1,
            "an operator (+ - * / ^) is expected here, not '='",
            "give the right-hand side only, what is added to the yaw acceleration",
        ),
        ("-c * 1e999", 6, 1, "this number is too large", "give a finite number"),
        ("-c # s", 4, 1, "an operator (+ - * / ^) is expected here, not '#'", MADE_OF),
        ("c *", 4, 1, "the expression ends where a number, a name or ( is expected", "complete it"),
        (
            "é * c",
            1,
            1,
            "there is no \"é\"",
            "there are b, r, t, wn, wind, pi, c, s; a parameter is declared under [parameters]",
        ),
        (
            "c + s",
            3,
            1,
            "the units do not go together: 1/s2 and 1",
            "a bare number takes any unit it needs; rad counts as 1",
        ),
        (
            "s * c * exp(t)",
            9,
            3,
            "exp() of something with the unit s",
            "divide by a scale: a parameter of that unit, or a bare number",
        ),
        ("c * s * r", 1, 9, "this has the unit 1/s3, not rad/s2", UNITS),
        (
            "c*s*abs(r)^s",
            11,
            1,
            "a variable power of something with the unit 1/s",
            "divide the base by a scale first: (abs(r) / 1.0)^n",
        ),
        ("c*s*2^t", 6, 1, "an exponent with the unit s", "an exponent is a pure number"),
        ("c*s*sqrt(-1 - abs(b))", 5, 17, &format!("this is NaN at {at_rest}"), FINITE),
        ("c*s/(wind/1.0)", 1, 14, &format!("this is inf at {at_rest}"), FINITE),
        (
            "-c*s*sign(r)",
            4,
            1,
            "no fit can tell s from c: they change the moment alike",
            "make one parameter of them",
        ),
        (
            "-c*(s-s+1)*b*b*b",
            5,
            1,
            "the moment does not depend on s",
            "take it away, or write the moment so that it depends on it",
        ),
        (&"(".repeat(25), 25, 1, "nested more than 24 deep", "write it more simply"),
    ] {
        let error = read(&file(moment)).expect_err(moment);
        let column = column + 10;
        let expected = format!(
            "my.toml:3:{column}: {message}\n  3 | moment = \"{moment}\"\n    | {}{}\n  help: {help}",
            " ".repeat(column - 1),
            "^".repeat(width)
        );
        assert_eq!(format!("{error}\n  help: {}", error.help()), expected);
    }
}

#[test]
fn errors_elsewhere_in_the_file_point_at_the_character_too() {
    let c = "c = { unit = \"rad/s2\", start = 0.05, min = 0.0 }";
    let reserved = "take another name than b, r, t, wn, wind, pi, abs, sign, exp, ln, log, log10, sqrt, sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, atan2, pow, min, max";
    let identifier = "lower-case letters, digits and _, a letter first, at most 40";
    let units = "units are made of 1, rad, s, Hz, m, kg, N, Pa, as in 1/(rad2 s)";
    for (from, to, line, column, width, message, help) in [
        (
            "\"mine\"",
            "\"coulomb_friction\"",
            1,
            6,
            18,
            "\"coulomb_friction\" is an effect of the library",
            "give your own effect another id",
        ),
        ("\"mine\"", "\"My effect\"", 1, 6, 11, "\"My effect\" is no identifier", identifier),
        ("\"Mine\"", "\" \"", 2, 9, 3, "the title is empty", "say what the effect is"),
        (c, "wn = { unit = \"1\", start = 1.0 }", 5, 1, 2, "\"wn\" is reserved", reserved),
        (c, "exp = { unit = \"1\", start = 1.0 }", 5, 1, 3, "\"exp\" is reserved", reserved),
        (
            c,
            "\"c-1\" = { unit = \"1\", start = 1.0 }",
            5,
            1,
            5,
            "\"c-1\" is no name of a parameter",
            "letters, digits and _, a letter first, at most 40",
        ),
        (
            "s * c * tanh(r / 1 + s)",
            "2 * c * tanh(r / 1)",
            6,
            1,
            1,
            "the moment does not use the parameter \"s\"",
            "use it in the moment or take it away",
        ),
        (
            "\"rad/s2\"",
            "\"deg/s2\"",
            5,
            15,
            3,
            "there is no unit \"deg\": angles are in rad",
            units,
        ),
        (
            "\"rad/s2\"",
            "\"rad/\"",
            5,
            15,
            4,
            "\"rad/\" is no complete unit",
            "write it as rad/s2 or 1/(rad2 s); 1 for a pure number",
        ),
        (
            "start = 0.05",
            "start = 0.0",
            5,
            32,
            3,
            "start of c is zero",
            "give a typical size: the fit takes its steps from it, and tries none as well",
        ),
        (
            "start = 0.05",
            "start = -1",
            5,
            32,
            2,
            "start of c, -1, is not between its bounds",
            "start within min and max",
        ),
        (
            "start = 0.05",
            "start = nan",
            5,
            32,
            3,
            "start of c is not finite",
            "leave min or max out where there is no bound",
        ),
        (
            "min = 0.0",
            "min = 3, max = 2",
            5,
            44,
            1,
            "min of c, 3, is not below its max, 2",
            "leave room between them",
        ),
    ] {
        let text = file("s * c * tanh(r / 1 + s)").replacen(from, to, 1);
        let error = read(&text).expect_err(to);
        let shown = text.lines().nth(line - 1).unwrap();
        let expected = format!(
            "my.toml:{line}:{column}: {message}\n  {line} | {shown}\n    | {}{}\n  help: {help}",
            " ".repeat(column - 1),
            "^".repeat(width)
        );
        assert_eq!(format!("{error}\n  help: {}", error.help()), expected);
    }
    let none = "id = \"mine\"\ntitle = \"Mine\"\nmoment = \"-0.1*b^3\"\n";
    let whole = read(none).expect("a factor of its own");
    assert_eq!((whole.formula.as_str(), &whole.starts[..]), ("factor * (-0.1*b^3)", &[1.0][..]));
    assert_eq!(whole.size_parameter(), Some(0));
    let unknown = read(&none.replace("b^3", "c")).unwrap_err().to_string();
    assert!(unknown.starts_with("my.toml:3:16:"), "{unknown}");
    let unknown = read(&file("c*s").replace("title", "titel")).unwrap_err().to_string();
    assert!(unknown.starts_with("my.toml:2:1: \"titel\" is no entry of an effect"), "{unknown}");
    let broken = read("id = \"mine").unwrap_err().to_string();
    assert!(broken.starts_with("my.toml:1:"), "{broken}");
}

#[test]
fn a_moment_on_several_lines_is_pointed_into() {
    let text = file("x").replace("\"x\"", "\"\"\"\n  -c * s\n\t* tanhh(r)\"\"\"");
    let error = read(&text).unwrap_err();
    let expected = "my.toml:5:4: there is no function \"tanhh\"\n  5 | \t* tanhh(r)\"\"\"\n    | \t  ^^^^^\n  help: did you mean tanh?";
    assert_eq!(format!("{error}\n  help: {}", error.help()), expected);
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

#[test]
fn a_file_that_cannot_be_read_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let error = super::read(&folder.path().join("none.toml"), &[]).unwrap_err();
    assert!(matches!(error, Error::Unreadable { .. }), "{error}");
    assert!(error.to_string().starts_with("cannot read "), "{error}");
    let error = super::read(folder.path(), &[]).unwrap_err();
    assert!(error.to_string().contains("it is a folder"), "{error}");
}

/// Time of an evaluation; printed, not asserted.
#[test]
fn an_evaluation_is_timed() {
    let effect = read(STRIBECK).unwrap();
    let mut prepared = Prepared::new(&effect.program, &[0.05, 0.5, 0.1], 7.0, 0.0);
    let (mut sum, n) = (0.0, 1_000_000);
    let started = std::time::Instant::now();
    for k in 0..n {
        sum += prepared.evaluate(0.1, 1e-6 * f64::from(k), 1.0, 1.0, 1.0);
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
