use super::Document;

const GOOD: &str = "id = \"mine\"\ntitle = \"Mine\"\nmoment = \"-c * sign(r)\"\n[parameters]\nc = { unit = \"rad/s2\", start = 0.05, min = 0.0 }\n";

const MOMENT: &str = "\"-c * sign(r)\"";
const WHOLE: &str = "{ unit = \"rad/s2\", start = 0.05, min = 0.0 }";

/// What is said where `from` is `to`, its first line, and the characters pointed at.
fn said(from: &str, to: &str) -> (String, String, String) {
    let text = GOOD.replacen(from, to, 1);
    assert_ne!(text, GOOD, "{from}");
    let error = Document::read("my.toml".as_ref(), &text).err().unwrap_or_else(|| panic!("{text}"));
    let first = error.to_string().lines().next().unwrap_or_default().to_owned();
    assert!(first.starts_with("my.toml:"), "{error}");
    assert!(!error.help().is_empty(), "{error}");
    let at = error.span().expect("a place");
    (first, text[at].to_owned(), error.help().to_owned())
}

/// What the TOML crate says of what is none, and what this says of values.
#[test]
fn what_is_no_toml_is_explained() {
    for (from, to, what, at) in [
        ("0.05", "five", "start is to be a number, and not five", "five"),
        ("0.05", "0,05", "start is to be a number, and not 0,05", "0,05"),
        ("0.05", "", "nothing stands behind start =", ""),
        ("0.05", ".5", "invalid mantissa", ""),
        ("0.05", "1/3", "start is to be a number, and not 1/3", "1/3"),
        ("0.05", "--5", "start is to be a number, and not --5", "--5"),
        ("min = 0.0", "min = none", "min is to be a number, and not none", "none"),
        ("min = 0.0", "min = 0.0;", "min is to be a number, and not 0.0;", "0.0;"),
        ("min = 0.0", "min = 0.0,,", "extra comma", ""),
        (", start", " start", "missing comma", ""),
        ("\"mine\"", "mine", "id is to be a text in quotes, and not mine", "mine"),
        ("\"mine\"", "", "nothing stands behind id =", ""),
        ("\"mine\"", "\"mine", "invalid basic string, expected `\"`", ""),
        ("\"rad/s2\"", "rad/s2", "unit is to be a text in quotes, and not rad/s2", "rad/s2"),
        (MOMENT, "-c * min(r, b)", "moment is to be a text in quotes", "-c * min(r, b)"),
        (MOMENT, "\"-c\" * sign(r)", "unexpected key or value", ""),
        ("title = ", "id = ", "duplicate key", "id"),
        ("id =", "id", "key with no value, expected `=`", ""),
        ("[parameters]", "[parameters", "unclosed table, expected `]`", ""),
        (" }", "", "unclosed inline table, expected `}`", ""),
        ("c = {", "§ = {", "invalid unquoted key", "§"),
    ] {
        let (first, pointed, _) = said(from, to);
        assert!(first.contains(&format!(": {what}")), "{to}: {first}");
        assert_eq!(pointed, at, "{to}: {first}");
    }
}

/// What stands in the file and in what it is changed; the message, what it points at, and the help.
type Entry = (&'static str, &'static str, &'static str, &'static str, &'static str);

const OF_ANOTHER_KIND: &[Entry] = &[
    (
        "0.05",
        "\"fast\"",
        "start of c is to be a number, and not the text \"fast\"",
        "\"fast\"",
        "0.05",
    ),
    (
        "0.05",
        "\"0.05\"",
        "start of c is to be a number, and not the text",
        "\"0.05\"",
        "take the quotes away: start = 0.05",
    ),
    ("0.05", "true", "start of c is to be a number, and not true", "true", "0.05"),
    ("0.05", "2026-11-21", "start of c is to be a number, and not a date", "2026-11-21", "0.05"),
    (
        "min = 0.0",
        "min = [1]",
        "min of c is to be a number, and not a list in brackets",
        "[1]",
        "leave min out",
    ),
    ("min = 0.0", "max = {}", "max of c is to be a number, and not a table", "{}", "leave max out"),
    ("min = 0.0", "mim = 0.0", "\"mim\" is no entry of c", "mim", "did you mean min?"),
    ("start", "strat", "\"strat\" is no entry of c", "strat", "did you mean start?"),
    ("start", "colour", "\"colour\" is no entry of c", "colour", "unit, start, min and max"),
    (", start = 0.05", "", "start of c is missing", "c", "add start = 0.05"),
    ("unit = \"rad/s2\", ", "", "unit of c is missing", "c", "add unit"),
    (
        "unit = \"rad/s2\"",
        "unit = 1",
        "unit of c is to be a text in quotes, and not the number 1",
        "1",
        "unit = ",
    ),
    (MOMENT, "3", "moment is to be a text in quotes, and not the number 3", "3", "moment = "),
    (
        "moment",
        "momment",
        "\"momment\" is no entry of an effect",
        "momment",
        "did you mean moment?",
    ),
    ("title = \"Mine\"\n", "", "title is missing", "", "add title = "),
    (
        WHOLE,
        "0.05",
        "the parameter c is to have a unit and a start, and not the number 0.05",
        "0.05",
        "c = { unit = \"1\", start = 0.05 }",
    ),
    (
        WHOLE,
        "\"fast\"",
        "the parameter c is to have a unit and a start, and not the text",
        "\"fast\"",
        "c = { unit",
    ),
    (
        "[parameters]",
        "[[parameters]]",
        "parameters is to be a table, and not a list",
        "[[parameters]]",
        "single brackets",
    ),
];

#[test]
fn entries_of_another_kind_are_explained() {
    for &(from, to, what, at, do_this) in OF_ANOTHER_KIND {
        let (first, pointed, help) = said(from, to);
        assert!(first.contains(&format!(": {what}")), "{to}: {first}");
        assert!(help.contains(do_this), "{to}: {help}");
        if from != "[parameters]" {
            assert_eq!(pointed, at, "{to}: {first}");
        }
    }
    // As it was read before.
    for (from, to) in
        [("0.05", "1"), ("0.05", "0x10"), ("0.05", "1_000.5"), ("min = 0.0", "min = -inf")]
    {
        assert!(Document::read("my.toml".as_ref(), &GOOD.replacen(from, to, 1)).is_ok(), "{to}");
    }
}
