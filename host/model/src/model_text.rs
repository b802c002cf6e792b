//! Writing `model.toml`, with what the user wrote beside the values left in place.

use crate::document::{Model, ParameterEntry, RecordEntry, SCHEMA_VERSION};
use toml_edit::{
    ArrayOfTables, DocumentMut, InlineTable, Item, RawString, Table, TableLike, Value,
};
use yawrig_base::error::{Error, Result};
use yawrig_core::effects::{Effect, MeasuredLaw, Part, Source};

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
        match self.recorded.is_none() {
            true => drop(root.remove("recorded")),
            false => put(root, "recorded", Value::InlineTable(as_told(&self.recorded))),
        }
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
            self.write_source(table, &entry.effect);
            if let Effect::Own(own) = entry.effect.bare() {
                put(table, "definition", own.text.as_str());
            }
            if let Effect::Measured(law) = &entry.effect {
                write_law(sub_table(table, "law", false), law);
            }
            let parameters = sub_table(table, "parameters", false);
            parameters.retain(|name, _| entry.effect.parameters().iter().any(|p| p.name == name));
            for (known, value) in entry.effect.parameters().iter().zip(&entry.parameters) {
                let unit = entry.effect.unit_in(&self.recorded.measurand(), &known.name);
                value.write(parameters, &known.name, &unit);
            }
        }
    }
}

impl Model {
    /// Where the strength comes from; of records without any wind nothing is said.
    fn write_source(&self, table: &mut Table, effect: &Effect) {
        let source = effect.source();
        let is_told = source != Source::Mechanical || self.wind_speeds().iter().any(|v| *v > 0.0);
        if is_told || table.contains_key("source") {
            put(table, "source", source.kind().name());
        }
        match &source {
            Source::Aerodynamic { reference_m_s } => {
                put(table, "reference_wind_m_s", *reference_m_s);
            }
            _ => drop(table.remove("reference_wind_m_s")),
        }
        match &source {
            Source::EachWind { speeds_m_s } => {
                put(table, "wind_speeds_m_s", Value::Array(speeds_m_s.iter().copied().collect()));
            }
            _ => drop(table.remove("wind_speeds_m_s")),
        }
    }
}

/// Where a measured law is known; of each curve the weight of its roughness, and its knots as shares of the
/// range; the factors on the damping's values that give the line in it, which is nil.
fn write_law(table: &mut Table, law: &MeasuredLaw) {
    put(table, "yaw_deg", law.yaw_rad.to_degrees());
    put(table, "rate_deg_s", law.rate_rad_s.to_degrees());
    put(table, "friction", law.friction);
    put(table, "dissipative", law.dissipative);
    match law.line {
        Some(line) => put(table, "damping_line", Value::Array(line.into_iter().collect())),
        None => drop(table.remove("damping_line")),
    }
    table.retain(|key, _| {
        !Part::ALL.iter().any(|p| p.name() == key) || law.parts.iter().any(|(p, _)| p.name() == key)
    });
    for (part, weight) in &law.parts {
        let mut curve = InlineTable::new();
        curve.insert("weight", (*weight).into());
        curve.insert("knots", Value::Array(law.knots[*part as usize].into_iter().collect()));
        put(table, part.name(), Value::InlineTable(curve));
    }
}

impl RecordEntry {
    fn write(&self, table: &mut Table) {
        put(table, "condition", self.condition.as_str());
        put(table, "held_out", self.held_out);
        match self.reading.is_empty() {
            true => drop(table.remove("reading")),
            false => put(table, "reading", Value::InlineTable(as_told(&self.reading))),
        }
        if let Some(made) = &self.made_under {
            put(table, "spring", made.spring.as_str());
            put(table, "axis", made.axis.to_string());
            put(table, "wind_speed_m_s", made.wind_speed_m_s);
        }
        if let Some(crc32) = &self.crc32 {
            put(table, "crc32", crc32.as_str());
        }
    }
}

/// As a file has it whose entries these are.
fn as_told(entries: &impl serde::Serialize) -> InlineTable {
    let told: DocumentMut =
        toml::to_string(entries).unwrap_or_default().parse().unwrap_or_default();
    told.as_table().clone().into_inline_table()
}

impl ParameterEntry {
    fn write(&self, table: &mut Table, name: &str, unit: &str) {
        // A table under a header of its own keeps what the user wrote in it; an inline one has no room for
        // comments.
        if let Some(entry) = table.get_mut(name).and_then(Item::as_table_mut) {
            return self.fill(entry, unit);
        }
        let mut entry = InlineTable::new();
        self.fill(&mut entry, unit);
        put(table, name, Value::InlineTable(entry));
    }

    fn fill(&self, entry: &mut dyn TableLike, unit: &str) {
        let u = self.u.filter(|u| u.is_finite());
        for (key, value) in
            [("value", self.value.map(|v| rounded(v, u))), ("u", u.map(four_digits))]
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

/// Takes an inline value out, with the comments above and beside it. It needs a new key: the old one has what
/// stood before it, which must not get between the brackets.
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
#[path = "model_text_tests.rs"]
mod tests;
