//! One column of a table: its cells, whatever they wear.

use super::names;
use super::table::Channel;
use std::borrow::Cow;
use yawrig_text::cells::{cell, Cell, Comma};
use yawrig_text::clocks::over_midnight;
use yawrig_text::rows::Row;

/// So many rows of numbers one after the other are the beginning of the data.
pub(super) const BEGINNING: usize = 3;
/// Rows that show whether a column holds several numbers in brackets.
const SAMPLE: usize = 50;

/// A number with a label before it or its unit behind it: `angle:12.04`, `12.04 deg`.
pub(super) struct Dressed<'a> {
    value: f64,
    pub(super) label: &'a str,
    unit: &'a str,
}

pub(super) fn dressed(field: &str, comma: Comma) -> Option<Dressed<'_>> {
    let (label, rest) = match field.split_once([':', '=']) {
        Some((label, rest)) if label.starts_with(char::is_alphabetic) => {
            (label.trim(), rest.trim())
        }
        _ => ("", field),
    };
    // An exponent is no unit.
    let is_unit = |(at, c): &(usize, char)| {
        let next = rest[at + c.len_utf8()..].chars().next();
        let exponent =
            "eE".contains(*c) && next.is_some_and(|c| c.is_ascii_digit() || "+-".contains(c));
        *at > 0 && !exponent && (c.is_alphabetic() || "\u{b0}\u{ba}%".contains(*c))
    };
    let (number, unit) =
        rest.split_at(rest.char_indices().find(is_unit).map_or(rest.len(), |u| u.0));
    let is_dressed = match unit {
        "" => !label.is_empty(),
        unit => names::is_known(unit),
    };
    match cell(number.trim(), comma) {
        Cell::Number(value) if is_dressed => Some(Dressed { value, label, unit: unit.trim() }),
        _ => None,
    }
}

/// What a cell says, whatever it wears.
pub(super) fn kind(field: &str, comma: Comma) -> Cell {
    match cell(field, comma) {
        Cell::Text => dressed(field, comma).map_or(Cell::Text, |found| Cell::Number(found.value)),
        plain => plain,
    }
}

/// Whether a name says a unit.
pub(super) fn has_unit(name: &str) -> bool {
    names::unit_in(name).is_some()
}

/// Whether two rows may be of one table: as wide, with the same labels.
pub(super) fn is_like(row: &Row, other: &Row) -> bool {
    let label = |field: &str| dressed(field, Comma::Either).map(|found| found.label.to_owned());
    row.fields.len() == other.fields.len()
        && row.fields.iter().zip(&other.fields).all(|(a, b)| label(a) == label(b))
}

/// Whether it is one of the rows above the numbers once more.
pub(super) fn is_head(row: &Row, heads: &[Row]) -> bool {
    let begins = row.text.starts_with(|c: char| c.is_alphabetic() || c == '"');
    begins && heads.iter().any(|head| !head.is_comment && head.fields == row.fields)
}

/// Rows of which a field is `(1500, 685)`, with a field for each number; none where there are none such.
pub(super) fn with_tuples_parted<'a>(rows: &[Row<'a>]) -> Option<Vec<Row<'a>>> {
    let of = |row: &Row, k: usize| {
        row.fields.get(k).and_then(|field| tuple(field)).map_or(0, |t| t.len())
    };
    let sample = &rows[..rows.len().min(SAMPLE)];
    let width = sample.iter().map(|row| row.fields.len()).max()?;
    let found = (0..width).find_map(|k| {
        let size = sample.iter().map(|row| of(row, k)).max()?;
        let count = sample.iter().filter(|row| of(row, k) == size).count();
        (size > 1 && count >= BEGINNING).then_some((k, size))
    });
    let (k, size) = found?;
    let parted = |row: &Row<'a>| {
        let mut fields = row.fields.clone();
        if k < fields.len() {
            let field = fields[k].clone();
            let parts = match tuple(&field) {
                Some(parts) if parts.len() == size => parts,
                _ if field.is_empty() => vec![String::new(); size],
                _ => (1..=size).map(|number| format!("{field} {number}")).collect(),
            };
            fields.splice(k..=k, parts.into_iter().map(Cow::Owned));
        }
        Row { fields, ..row.clone() }
    };
    let rows: Vec<Row> = rows.iter().map(parted).collect();
    Some(with_tuples_parted(&rows).unwrap_or(rows))
}

fn tuple(field: &str) -> Option<Vec<String>> {
    let inner = field.strip_prefix(['(', '['])?.strip_suffix([')', ']'])?;
    let parts: Vec<String> = inner.split([',', ';']).map(|part| part.trim().to_owned()).collect();
    let numbers = parts.iter().all(|part| part.parse::<f64>().is_ok());
    (numbers && parts.len() > 1).then_some(parts)
}

/// A column as it is read.
pub(super) struct Column {
    name: String,
    unit: Option<String>,
    label: Option<String>,
    /// No name was ever meant for it.
    bare: bool,
    has_clocks: bool,
    values: Result<Vec<f64>, String>,
}

impl Column {
    pub(super) fn new(
        name: String,
        unit: Option<String>,
        label: Option<String>,
        bare: bool,
    ) -> Self {
        Self { name, unit, label, bare, has_clocks: false, values: Ok(Vec::new()) }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.values.as_ref().is_ok_and(Vec::is_empty)
    }

    pub(super) fn push(&mut self, line: usize, field: &str, comma: Comma) {
        let Ok(values) = &mut self.values else { return };
        match cell(field, comma) {
            Cell::Number(value) => values.push(value),
            Cell::Clock(seconds) => {
                self.has_clocks = true;
                values.push(seconds);
            }
            // A gap: its row is left out.
            Cell::Missing => values.push(f64::NAN),
            Cell::Text => match dressed(field, comma)
                .filter(|d| self.label.as_deref().unwrap_or("") == d.label)
            {
                Some(Dressed { value, unit, .. })
                    if unit.is_empty()
                        || *self.unit.get_or_insert_with(|| unit.to_owned()) == unit =>
                {
                    values.push(value);
                }
                _ => self.values = Err(format!("line {line}: {field:?} is not a number")),
            },
        }
    }

    /// The channel, its name behind that of its group; none of what stays empty and has no name.
    pub(super) fn channel(self, group: &str) -> Option<Channel> {
        let Self { name, mut unit, bare, has_clocks, mut values, .. } = self;
        if bare && values.as_ref().is_ok_and(|values| values.iter().all(|value| value.is_nan())) {
            return None;
        }
        if has_clocks {
            unit = Some("s".to_owned());
            if let Ok(values) = &mut values {
                over_midnight(values);
            }
        }
        Some(Channel { name: format!("{group}{name}"), unit, step_s: None, values })
    }
}
