//! Errors point at the character, and say what to do.

use super::tests::{file, read};
use super::*;

/// Column, width, message and help of what is wrong with a moment.
type InMoment = (&'static str, usize, usize, &'static str, &'static str);

const MADE_OF: &str = "numbers, names, + - * / ^, parentheses and commas make up an expression";
const UNITS: &str = "a moment is divided by the inertia; a bare number takes any unit it needs";
const FINITE: &str =
    "a moment is finite at rest, with the wind off (or not known: wind is then 0) and over the swing";

const IN_MOMENTS: &[InMoment] = &[
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
    (
        "c*s*sqrt(-1 - abs(b))",
        5,
        17,
        "this is NaN at b = 0.0000 rad, r = 0.0000 rad/s, t = 0.000 s, \
         wn = 10.00 rad/s, wind = 0 m/s",
        FINITE,
    ),
    (
        "c*s/(wind/1.0)",
        1,
        14,
        "this is inf at b = 0.0000 rad, r = 0.0000 rad/s, t = 0.000 s, \
         wn = 10.00 rad/s, wind = 0 m/s",
        FINITE,
    ),
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
    ("(((((((((((((((((((((((((", 25, 1, "nested more than 24 deep", "write it more simply"),
];

/// What is wrong with the moment, where, and what to do; the line shown and the caret under it.
#[test]
fn errors_in_a_moment_point_at_the_character() {
    for &(moment, column, width, message, help) in IN_MOMENTS {
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

const C: &str = "c = { unit = \"rad/s2\", start = 0.05, min = 0.0 }";
const RESERVED: &str = "take another name than b, r, t, wn, wind, pi, abs, sign, exp, ln, log, log10, sqrt, sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, atan2, pow, min, max";
const IDENTIFIER: &str = "lower-case letters, digits and _, a letter first, at most 40";
const KNOWN_UNITS: &str = "units are made of 1, rad, s, Hz, m, kg, N, Pa, as in 1/(rad2 s)";

/// What stands in the file, in what it is changed; line, column, width, message and help.
type Elsewhere = (&'static str, &'static str, usize, usize, usize, &'static str, &'static str);

const ELSEWHERE: &[Elsewhere] = &[
    (
        "\"mine\"",
        "\"coulomb_friction\"",
        1,
        6,
        18,
        "\"coulomb_friction\" is an effect of the library",
        "give your own effect another id",
    ),
    ("\"mine\"", "\"My effect\"", 1, 6, 11, "\"My effect\" is no identifier", IDENTIFIER),
    ("\"Mine\"", "\" \"", 2, 9, 3, "the title is empty", "say what the effect is"),
    (C, "wn = { unit = \"1\", start = 1.0 }", 5, 1, 2, "\"wn\" is reserved", RESERVED),
    (C, "exp = { unit = \"1\", start = 1.0 }", 5, 1, 3, "\"exp\" is reserved", RESERVED),
    (
        C,
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
        KNOWN_UNITS,
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
];

#[test]
fn errors_elsewhere_in_the_file_point_at_the_character_too() {
    for &(from, to, line, column, width, message, help) in ELSEWHERE {
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
fn a_file_that_cannot_be_read_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let error = super::read(&folder.path().join("none.toml"), &[]).unwrap_err();
    assert!(matches!(error, Error::Unreadable { .. }), "{error}");
    assert!(error.to_string().starts_with("cannot read "), "{error}");
    let error = super::read(folder.path(), &[]).unwrap_err();
    assert!(error.to_string().contains("it is a folder"), "{error}");
}
