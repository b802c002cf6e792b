//! States in an effect's file: read, checked, and refused where they cannot be used.

use super::tests::read;
use super::*;

/// A lag of angle with c and T, its state as it is written here.
fn lag(state: &str, moment: &str) -> String {
    format!(
        "id = \"lag\"\ntitle = \"Lag\"\nmoment = \"{moment}\"\n{state}[parameters]\n\
         c = {{ unit = \"1/s2\", start = 3.0 }}\nT = {{ unit = \"s\", start = 0.2, min = 0.001 }}\n"
    )
}

const STATE: &str = "[[state]]\nname = \"z\"\nunit = \"rad\"\nrate = \"(b - z) / T\"\n";

#[test]
fn a_state_is_read_and_begins_in_balance() {
    let effect = read(&lag(STATE, "-c * z")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(effect.formula, "-c * z, z' = (b - z) / T");
    assert_eq!((effect.moment.as_str(), effect.states.len()), ("-c * z", 1));
    assert_eq!(effect.size_parameter(), Some(0));
    // What follows a spring late puts energy in.
    assert!(effect.warnings.iter().all(|w| w.contains("puts energy")), "{:?}", effect.warnings);
    let term = OwnTerm::new(&Arc::new(effect), &[3.0, 0.2]);
    assert_eq!(term.begun(0.1, 7.0, 0.0)[0], 0.1);
    // 1 / (1 + i wn T) of the angle.
    let strength = term.effect.strength(&[3.0, 0.2], 0.1, 7.0);
    let exact = 0.3 / 2f64.sqrt() / (1.0 + 1.4 * 1.4f64).sqrt();
    assert!((strength / exact - 1.0).abs() < 2e-3, "{strength} {exact}");
    let two = "[[state]]\nname = \"y\"\nunit = \"rad\"\nrate = \"tanh(b - y - 9 * y^3) / T\"\n\
               [[state]]\nname = \"z\"\nunit = \"rad\"\nrate = \"(y - z) / T\"\nstart = \"2 * b\"\n";
    let effect = read(&lag(two, "-c * z")).unwrap_or_else(|e| panic!("{e}"));
    let [y, z] = OwnTerm::new(&Arc::new(effect), &[3.0, 0.2]).begun(0.272, 7.0, 0.0);
    assert!((y - 0.2).abs() < 1e-9 && z == 0.544, "{y} {z}");
}

/// A number begins a state, too; without a unit it is a pure number, as which an angle counts.
#[test]
fn a_state_takes_a_number_and_needs_no_unit() {
    for (start, begins) in [("start = 0.0", 0.0), ("start = 2", 2.0), ("", 0.0)] {
        let state = format!("[[state]]\nname = \"x\"\nrate = \"r - x / T\"\n{start}\n");
        let effect = read(&lag(&state, "-c * x")).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(effect.states[0].unit, "1");
        assert_eq!(OwnTerm::new(&Arc::new(effect), &[3.0, 0.2]).begun(0.1, 7.0, 0.0)[0], begins);
    }
}

#[test]
fn what_a_state_cannot_be_is_refused_at_its_place() {
    let with = |from: &str, to: &str| STATE.replace(from, to);
    let three = STATE.repeat(3).replacen("\"z\"", "\"x\"", 1).replacen("\"z\"", "\"y\"", 1);
    for (state, moment, what, help) in [
        (with("(b - z) / T", "(b - z) / c"), "-c * z", "this has the unit s2, not 1/s", "over s"),
        (with("(b - z) / T", "(r - z) / T"), "-c * z", "do not go together: 1/s and 1", "bare"),
        (with("(b - z) / T", "(b - q) / T"), "-c * z", "there is no \"q\"", "b, r, t"),
        (with("(b - z) / T", "(b - z / T"), "-c * z", "not closed", "add a )"),
        (with("(b - z) / T", "b / T"), "-c * z", "z has no balance", "start = \"b\""),
        (
            with("(b - z) / T", "r - abs(r) * z / 0.1"),
            "-c * z * T / 1.0",
            "z has no balance",
            "start",
        ),
        (with("(b - z) / T", "(1 + z^2) / T"), "-c * z", "z has no balance", "start"),
        (with("\"rad\"", "\"furlong\""), "-c * z", "there is no unit \"furlong\"", "units are"),
        (with("\"rad\"", "\"m\""), "-c * z", "do not go together: 1 and m", "bare"),
        (with("\"z\"", "\"wn\""), "-c * b", "\"wn\" is reserved", "another name"),
        (with("\"z\"", "\"c\""), "-c * b", "\"c\" is there already", "another name"),
        (with("\"z\"", "\"2z\""), "-c * b", "no name of a state", "letters"),
        (STATE.to_owned(), "-c * b^3", "does not use the state \"z\"", "use it"),
        (STATE.to_owned() + "start = \"r / z\"\n", "-c * z", "there is no \"z\"", "there are"),
        (STATE.to_owned() + "start = \"r\"\n", "-c * z", "has the unit 1/s, not rad", "own unit"),
        (
            STATE.to_owned() + "start = \"ln(b)\"\n",
            "-c * z",
            "the start of z is -inf at b = 0",
            "finite",
        ),
        (
            STATE.to_owned() + "start = true\n",
            "-c * z",
            "start of a state is to be a text",
            "write",
        ),
        (STATE.to_owned() + "start = b\n", "-c * z", "start is to be a text in quotes", "quotes"),
        (
            STATE.to_owned() + "begin = \"b\"\n",
            "-c * z",
            "\"begin\" is no entry of a state",
            "name, unit",
        ),
        (with("rate = \"(b - z) / T\"\n", ""), "-c * z", "rate of a state is missing", "add rate"),
        (with("[[state]]", "[state]"), "-c * z", "double brackets, and not a table", "[[state]]"),
        (three, "-c * z", "more than 2 states", "no record"),
        (
            with("(b - z) / T", "1e7 * (b - z) / T"),
            "-c * z",
            "z cannot be followed along a swing",
            "bring it back",
        ),
    ] {
        let error = read(&lag(&state, moment)).map(|e| e.id).expect_err(&state);
        assert!(
            error.to_string().contains(what) && error.help().contains(help),
            "{error}\n{}",
            error.help()
        );
        assert!(error.to_string().starts_with("my.toml:"), "{error}");
    }
}
