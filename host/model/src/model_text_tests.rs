use super::*;
use crate::document::{EffectEntry, ModalEntry};
use std::path::Path;
use yawrig_records::Selection;

fn sample() -> Model {
    let mut modal = ModalEntry::default();
    modal.natural_frequency_rad_s.value = Some(7.500_012_345_678);
    modal.natural_frequency_rad_s.u = Some(0.000_123_456);
    modal.damping_ratio.value = Some(0.012);
    modal.damping_ratio.free = false;
    let mut friction = EffectEntry::unfitted(Effect::CoulombFriction);
    friction.parameters[0].value = Some(0.05);
    friction.parameters[0].u = Some(0.001);
    let record = RecordEntry {
        file: "releases/a.csv".into(),
        condition: "releases/a".into(),
        reading: Selection {
            quantity: Some(yawrig_records::Quantity::Rate),
            unit: Some("rad/s".into()),
            yaw: Some("gyro z".into()),
            ..Selection::default()
        },
        held_out: false,
        made_under: None,
        crc32: None,
        line: 0,
    };
    Model {
        unknown_zero: false,
        recorded: yawrig_core::record::Measurand::linear(Default::default(), "mm").said(),
        records: vec![record],
        modal: [("releases/a".to_string(), modal)].into(),
        effects: vec![friction, EffectEntry::unfitted(Effect::HarmonicForcing)],
    }
}

fn read(text: &str) -> Model {
    let mut model = Model::parse(text, Path::new("model.toml")).unwrap();
    model.records.iter_mut().for_each(|r| r.line = 0);
    model
}

#[test]
fn what_is_written_is_read_back() {
    let mut model = sample();
    let text = model.text(None).unwrap();
    let wn = &mut model.modal.get_mut("releases/a").unwrap().natural_frequency_rad_s;
    (wn.value, wn.u) = (Some(7.500_012_35), Some(0.000_123_5));
    assert_eq!(read(&text), model, "{text}");
    assert_eq!(model.text(Some(&text)).unwrap(), text);
}

#[test]
fn comments_of_the_user_stay() {
    let model = sample();
    let text = model.text(None).unwrap();
    let commented = text
        .replace("[[effect]]", "# rubs at the seal\n[[effect]]")
        .replace("unknown_zero = false", "unknown_zero = false # zeroed in the morning");
    let mut other = model.clone();
    other.effects[0].parameters[0].value = Some(0.06);
    other.effects.pop();
    let new = other.text(Some(&commented)).unwrap();
    assert!(new.contains("# rubs at the seal") && new.contains("# zeroed in the morning"));
    assert_eq!(read(&new).effects, other.effects, "{new}");
    other.effects.clear();
    let new = other.text(Some(&new)).unwrap();
    assert_eq!(read(&new).effects, [], "{new}");
    assert!(new.contains("# zeroed in the morning"));
}

#[test]
fn tables_written_inline_are_understood() {
    let text = "schema_version = 1\n\
        record = [{ file = \"a.csv\" }]\n\n\
        effect = [{ id = \"cubic_stiffness\", parameters = { k3 = { value = 2, free = false } } }]\n\
        modal = { a = { damping_ratio = { value = 0.01 } } }\n";
    let model = read(text);
    let k3 = model.effects[0].parameters[0];
    assert_eq!((k3.value, k3.free, k3.min), (Some(2.0), false, f64::NEG_INFINITY));
    let new = model.text(Some(text)).unwrap();
    assert_eq!(read(&new), model, "{new}");
}

#[test]
fn comments_of_tables_written_inline_stay() {
    let text = "# of the wing\nschema_version = 1\n\n\
        # from Tuesday\nrecord = [\n  # the quiet one\n  { file = \"a.csv\" }, # at night\n\
        # the gusty one\n  { file = \"b.csv\" }, # at noon\n] # both on K4\n\n\
        # rubs at the seal\neffect = [{ id = \"cubic_stiffness\", parameters = { k3 = { value = 2 } } }]\n\
        # known from the drawing\nmodal = { a = { damping_ratio = { value = 0.01 } } } # of K4\n";
    let model = read(text);
    let new = model.text(Some(text)).unwrap();
    assert_eq!(read(&new), model, "{new}");
    let at = |words: &str| {
        let count = new.matches(words).count();
        assert_eq!(count, 1, "{words} stands {count} times in\n{new}");
        new.find(words).unwrap()
    };
    let in_order = [
        "# of the wing",
        "# from Tuesday\n",
        "# both on K4\n",
        "# the quiet one\n",
        "# at night\n",
        "a.csv",
        "# the gusty one\n",
        "# at noon\n",
        "b.csv",
        "# known from the drawing\n# of K4\n",
        "# rubs at the seal\n[[effect]]",
    ]
    .map(at);
    assert!(in_order.is_sorted_by_key(|place| *place), "{in_order:?}\n{new}");
    assert_eq!(model.text(Some(&new)).unwrap(), new);
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let text = sample().text(None).unwrap();
    for (from, to, said, help) in [
        (
            "coulomb_friction",
            "coulomb_fricton",
            "there is no effect",
            "did you mean coulomb_friction?",
        ),
        ("\"mm/s2\"", "\"deg/s2\"", "coulomb_friction.c is in mm/s2", "convert"),
        ("c = {", "k = {", "has no parameter \"k\"", "its parameters: c"),
        (
            "min = 0.0, max = inf, free = true }\n\n[[",
            "min = -1.0, max = inf }\n\n[[",
            "min = -1",
            "0 <=",
        ),
        ("value = 0.05", "value = -0.05", "value -0.05 is not between", "give a value"),
        ("value = 0.05", "vale = 0.05", "unknown field `vale`", "correct"),
        ("value = 0.05, ", "free = false, ", "duplicate key", "correct"),
        ("held_out = false", "held_out = 0", "invalid type", "correct"),
        ("[modal.\"releases/a\"]", "[modal.b]", "no record has the condition \"b\"", "correct"),
        (
            "schema_version = 1",
            "schema_version = 2",
            "schema_version is 2",
            "reads schema_version 1",
        ),
        ("harmonic_forcing", "coulomb_friction", "is in the model twice", "delete"),
        ("harmonic_forcing", "buffeting", "cannot be simulated", "diagnose"),
    ] {
        let wrong = text.replacen(from, to, 1);
        assert_ne!(wrong, text, "{from} is not in\n{text}");
        let line = 1 + wrong.lines().zip(text.lines()).position(|(a, b)| a != b).unwrap();
        let error = Model::parse(&wrong, Path::new("m.toml")).unwrap_err().to_string();
        assert!(error.contains(&format!("m.toml:{line}:")), "line {line}: {error}\n{wrong}");
        assert!(error.contains(said) && error.contains(help), "{error}");
    }
}

#[test]
fn size_and_phase_of_a_line_are_fixed_together() {
    let text = sample().text(None).unwrap();
    let fixed = |f: &str, phi: &str| {
        let line = |name: &str| text.lines().find(|l| l.starts_with(name)).unwrap().to_owned();
        let text = text
            .replace(&line("f = "), &format!("f = {{ value = 0.1, free = {f} }}"))
            .replace(&line("w = "), "w = { value = 5.0 }")
            .replace(&line("phi = "), &format!("phi = {{ value = 0.2, free = {phi} }}"));
        Model::parse(&text, Path::new("m.toml"))
    };
    assert!(fixed("false", "false").is_ok() && fixed("true", "true").is_ok());
    for (f, phi) in [("false", "true"), ("true", "false")] {
        let error = fixed(f, phi).unwrap_err().to_string();
        assert!(error.contains("f and phi are free within no bounds, or all fixed"), "{error}");
    }
}
