//! Writing `model.toml`, with what the user wrote beside the values left in place.

use crate::model::document::{Model, ParameterEntry, RecordEntry, SCHEMA_VERSION};
use toml_edit::{
    ArrayOfTables, DocumentMut, InlineTable, Item, RawString, Table, TableLike, Value,
};
use yawrig_base::error::{Error, Result};
use yawrig_core::effects::{Effect, MeasuredLaw, Part};

const HEADER: &str = "\
# Second-order model of the yaw motion, b'' = -2 zeta wn r - wn^2 b, and the effects added to it; angles in rad,
# moments divided by Izz. A number with free = false keeps its value in the next `yawrig fit`; min and max bound it.
schema_version = 1
";
/// Of a standard uncertainty: what may be rounded off a value.
const ROUNDING_DIGITS: i32 = 4;

impl Model {
    /// The text of its file: `old` with the new values, comments kept; without one, a new file.
    ///
    /// # Errors
    /// Where `old` is not TOML.
    pub fn text(&self, old: Option<&str>) -> Result<String> {
        let mut document: DocumentMut = old
            .unwrap_or(HEADER)
            .parse()
            .map_err(|e| Error::internal(format!("cannot write the model: {e}")))?;
        let root = document.as_table_mut();
        put(root, "schema_version", i64::from(SCHEMA_VERSION));
        put(root, "unknown_zero", self.unknown_zero);
        self.write_records(tables(root, "record"));
        self.write_modal(sub_table(root, "modal", true));
        self.write_effects(tables(root, "effect"));
        for name in ["record", "effect"] {
            if root
                .get(name)
                .and_then(Item::as_array_of_tables)
                .is_some_and(ArrayOfTables::is_empty)
            {
                root.remove(name);
            }
        }
        Ok(document.to_string())
    }

    fn write_records(&self, tables: &mut ArrayOfTables) {
        tables.retain(|t| self.records.iter().any(|r| text_of(t, "file") == Some(&r.file)));
        for record in &self.records {
            record.write(with_text(tables, "file", &record.file));
        }
    }

    fn write_modal(&self, modal: &mut Table) {
        modal.retain(|condition, _| self.modal.contains_key(condition));
        for (condition, entry) in &self.modal {
            let table = sub_table(modal, condition, false);
            entry.natural_frequency_rad_s.write(table, "natural_frequency_rad_s", "rad/s");
            entry.damping_ratio.write(table, "damping_ratio", "1");
        }
    }

    fn write_effects(&self, tables: &mut ArrayOfTables) {
        tables.retain(|t| self.effects.iter().any(|e| text_of(t, "id") == Some(e.effect.id())));
        for entry in &self.effects {
            let table = with_text(tables, "id", entry.effect.id());
            if let Effect::Own(own) = &entry.effect {
                put(table, "definition", own.text.as_str());
            }
            if let Effect::Measured(law) = &entry.effect {
                write_law(sub_table(table, "law", false), law);
            }
            let parameters = sub_table(table, "parameters", false);
            for (known, value) in entry.effect.parameters().iter().zip(&entry.parameters) {
                value.write(parameters, &known.name, &known.unit);
            }
        }
    }
}

/// Where a measured law is known, and the weight of each curve's roughness.
fn write_law(table: &mut Table, law: &MeasuredLaw) {
    put(table, "yaw_deg", law.yaw_rad.to_degrees());
    put(table, "rate_deg_s", law.rate_rad_s.to_degrees());
    put(table, "friction", law.friction);
    put(table, "dissipative", law.dissipative);
    table.retain(|key, _| {
        !Part::ALL.iter().any(|p| p.name() == key) || law.parts.iter().any(|(p, _)| p.name() == key)
    });
    for (part, weight) in &law.parts {
        put(table, part.name(), *weight);
    }
}

impl RecordEntry {
    fn write(&self, table: &mut Table) {
        put(table, "condition", self.condition.as_str());
        put(table, "held_out", self.held_out);
        if let Some(made) = &self.made_under {
            put(table, "spring", made.spring.as_str());
            put(table, "axis", made.axis.to_string());
            put(table, "wind_speed_m_s", made.wind_speed_m_s);
        }
    }
}

impl ParameterEntry {
    fn write(&self, table: &mut Table, name: &str, unit: &str) {
        // A table under a header of its own keeps what the user wrote in it; an inline one has no room for comments.
        if let Some(entry) = table.get_mut(name).and_then(Item::as_table_mut) {
            return self.fill(entry, unit);
        }
        let mut entry = InlineTable::new();
        self.fill(&mut entry, unit);
        put(table, name, Value::InlineTable(entry));
    }

    fn fill(&self, entry: &mut dyn TableLike, unit: &str) {
        for (key, value) in
            [("value", self.value.map(|v| rounded(v, self.u))), ("u", self.u.map(four_digits))]
        {
            match value {
                Some(value) => put(entry, key, value),
                None => drop(entry.remove(key)),
            }
        }
        put(entry, "unit", unit);
        put(entry, "min", self.min);
        put(entry, "max", self.max);
        put(entry, "free", self.free);
    }
}

/// Without the digits that its uncertainty makes meaningless, so that a person can read it.
fn rounded(value: f64, u: Option<f64>) -> f64 {
    let Some(u) = u.filter(|u| u.is_finite() && *u > 0.0) else { return value };
    let decimals = ROUNDING_DIGITS - u.log10().floor() as i32;
    if decimals < 0 {
        return value;
    }
    format!("{value:.*}", decimals as usize).parse().unwrap_or(value)
}

fn four_digits(u: f64) -> f64 {
    format!("{u:.3e}").parse().unwrap_or(u)
}

/// Sets a value, with the white space and comments of the one it takes the place of.
fn put(table: &mut dyn TableLike, key: &str, new: impl Into<Value>) {
    let mut new = new.into();
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => {
            *new.decor_mut() = old.decor().clone();
            *old = new;
        }
        None => drop(table.insert(key, Item::Value(new))),
    }
}

fn text_of<'a>(table: &'a Table, key: &str) -> Option<&'a str> {
    table.get(key).and_then(Item::as_str)
}

/// The array of tables `key`; one written as an inline array is rewritten.
fn tables<'a>(root: &'a mut Table, key: &str) -> &'a mut ArrayOfTables {
    if root.get(key).is_some_and(|item| !item.is_array_of_tables()) {
        let (comments, inline) = taken(root, key);
        let of_entries = comments_of_entries(&inline);
        let mut made = inline.into_array_of_tables().unwrap_or_default();
        for (table, own) in made.iter_mut().zip(of_entries) {
            put_comments(table, &own);
        }
        if let Some(first) = made.get_mut(0) {
            put_comments(first, &comments);
        }
        root.insert(key, Item::ArrayOfTables(made));
    }
    let item = root.entry(key).or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
    item.as_array_of_tables_mut().expect("it has just been made one")
}

fn with_text<'a>(tables: &'a mut ArrayOfTables, key: &str, text: &str) -> &'a mut Table {
    let known = tables.iter().position(|t| text_of(t, key) == Some(text));
    let at = known.unwrap_or_else(|| {
        let mut table = Table::new();
        put(&mut table, key, text);
        tables.push(table);
        tables.len() - 1
    });
    tables.get_mut(at).expect("it is there")
}

/// The table `key`; one written inline is rewritten. `implicit`: no header of its own.
fn sub_table<'a>(parent: &'a mut Table, key: &str, implicit: bool) -> &'a mut Table {
    if parent.get(key).is_some_and(|item| !item.is_table()) {
        let (comments, inline) = taken(parent, key);
        let mut made = inline.into_table().unwrap_or_default();
        put_comments(&mut made, &comments);
        parent.insert(key, Item::Table(made));
    }
    let item = parent.entry(key).or_insert_with(|| {
        let mut table = Table::new();
        table.set_implicit(implicit);
        Item::Table(table)
    });
    item.as_table_mut().expect("it has just been made one")
}

/// Takes an inline value out, with the comments above and beside it. It needs a new key: the old one has what stood
/// before it, which must not get between the brackets.
fn taken(table: &mut Table, key: &str) -> (Vec<String>, Item) {
    let Some((key, inline)) = table.remove_entry(key) else { return Default::default() };
    let above = key.leaf_decor().prefix();
    let beside = inline.as_value().and_then(|value| value.decor().suffix());
    ([above, beside].into_iter().flatten().flat_map(comments_in).collect(), inline)
}

/// The comments of each entry of an inline array: above it, or after it on its line.
fn comments_of_entries(inline: &Item) -> Vec<Vec<String>> {
    let Some(array) = inline.as_array() else { return Vec::new() };
    let mut of_entries = vec![Vec::new(); array.len()];
    for (index, value) in array.iter().enumerate() {
        let decor = value.decor();
        let before = decor.prefix().and_then(RawString::as_str).unwrap_or("");
        // What follows a comma on its line belongs to the entry before that.
        let (beside, above) = before.split_once('\n').unwrap_or(("", before));
        let of_beside = if index > 0 { index - 1 } else { 0 };
        of_entries[of_beside].extend(comment_lines(beside));
        of_entries[index].extend(comment_lines(above));
        of_entries[index].extend(decor.suffix().into_iter().flat_map(comments_in));
    }
    if let Some(last) = of_entries.last_mut() {
        last.extend(comments_in(array.trailing()));
    }
    of_entries
}

fn comments_in(text: &RawString) -> Vec<String> {
    comment_lines(text.as_str().unwrap_or(""))
}

fn comment_lines(text: &str) -> Vec<String> {
    text.lines().map(str::trim).filter(|line| line.starts_with('#')).map(str::to_owned).collect()
}

/// Sets comments above a table's header, before those that are there.
fn put_comments(table: &mut Table, comments: &[String]) {
    if comments.is_empty() {
        return;
    }
    let there = table.decor().prefix().map(comments_in).unwrap_or_default();
    let lines: String = comments.iter().chain(&there).map(|line| format!("{line}\n")).collect();
    table.decor_mut().set_prefix(format!("\n{lines}"));
    // A header that is left out would take them with it.
    table.set_implicit(false);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::document::{EffectEntry, ModalEntry};
    use std::path::Path;

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
            held_out: false,
            made_under: None,
            line: 0,
        };
        Model {
            unknown_zero: false,
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
            ("\"rad/s2\"", "\"deg/s2\"", "coulomb_friction.c is in rad/s2", "convert"),
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
}
