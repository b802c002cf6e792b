//! What a field of a table says: a number, a time of day, a gap or words; and what a comma is in one.

use crate::clocks::clock_s;
use crate::rows::Row;

/// What a field says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell {
    Number(f64),
    /// Seconds of a time of day or a date with one.
    Clock(f64),
    Missing,
    Text,
}

/// What a comma is within a number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Comma {
    /// Not known, or the point is the decimal sign of some numbers and the comma of others.
    #[default]
    Either,
    /// The decimal sign; a point parts thousands.
    Decimal,
    /// It parts thousands; the decimal sign is a point.
    Thousands,
}

pub fn cell(field: &str, comma: Comma) -> Cell {
    const MISSING: [&str; 9] = ["", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--"];
    let plain = || match comma {
        // What all commas of a file say of its points.
        Comma::Decimal => with_decimal_comma(field),
        _ => field.parse::<f64>().ok(),
    };
    match plain().or_else(|| written(field, comma)) {
        Some(value) if value.is_finite() => Cell::Number(value),
        Some(_) => Cell::Missing,
        None if MISSING.iter().any(|missing| missing.eq_ignore_ascii_case(field)) => Cell::Missing,
        None => clock_s(field).map_or(Cell::Text, Cell::Clock),
    }
}

/// The number in a short field without a point, as most are where the comma is the decimal sign.
fn with_decimal_comma(field: &str) -> Option<f64> {
    let mut plain = [0; 32];
    let plain = plain.get_mut(..field.len())?;
    plain.copy_from_slice(field.as_bytes());
    if plain.contains(&b'.') {
        return None;
    }
    if let Some(comma) = plain.iter_mut().find(|b| **b == b',') {
        *comma = b'.';
    }
    std::str::from_utf8(plain).ok()?.parse().ok()
}

/// A number as people write it: with a true minus, thousands parted, a decimal comma.
fn written(field: &str, comma: Comma) -> Option<f64> {
    let bare = unsigned(field);
    if !bare.starts_with(|c: char| c.is_ascii_digit() || ".,".contains(c)) {
        return None;
    }
    let sign = if bare.len() == field.len() || field.starts_with('+') { "" } else { "-" };
    let bare = without(bare, &['\'', '\u{2019}', ' ', '\u{a0}', '\u{202f}', '\u{2009}'])?;
    let number = match comma {
        Comma::Thousands => without(&bare, &[','])?,
        Comma::Decimal => without(&bare, &['.'])?.replacen(',', ".", 1),
        Comma::Either => match (bare.contains('.'), bare.contains(',')) {
            (true, true) if bare.rfind(',') < bare.rfind('.') => without(&bare, &[','])?,
            (true, true) => without(&bare, &['.'])?.replacen(',', ".", 1),
            (false, true) if bare.matches(',').count() > 1 => without(&bare, &[','])?,
            (true, false) if bare.matches('.').count() > 1 => without(&bare, &['.'])?,
            _ => bare.replacen(',', ".", 1),
        },
    };
    format!("{sign}{number}").parse().ok()
}

/// A number without its sign: a true minus is one, and a dash.
fn unsigned(field: &str) -> &str {
    field.strip_prefix(['-', '+', '\u{2212}', '\u{2013}']).unwrap_or(field)
}

/// `number` without these signs, where each parts three digits.
fn without(number: &str, signs: &[char]) -> Option<String> {
    if !number.contains(signs) {
        return Some(number.to_owned());
    }
    let whole = number.find(|c: char| !c.is_ascii_digit() && !signs.contains(&c));
    let (whole, rest) = number.split_at(whole.unwrap_or(number.len()));
    let is_parted = !rest.contains(signs) && parts_thousands(whole, signs);
    is_parted.then(|| whole.replace(signs, "") + rest)
}

/// Whether `whole` is digits, one to three and then three behind each sign, as no decimals begin with a zero.
fn parts_thousands(whole: &str, signs: &[char]) -> bool {
    let mut groups = whole.split(signs);
    let digits = |group: &str| group.bytes().all(|b| b.is_ascii_digit());
    groups.next().is_some_and(|g| (1..=3).contains(&g.len()) && digits(g) && !g.starts_with('0'))
        && groups.all(|g| g.len() == 3 && digits(g))
}

/// What the numbers of a column say about commas.
#[derive(Clone, Default)]
struct Column {
    /// The first whose comma may part thousands or be the decimal sign.
    open: Option<(usize, String)>,
    /// Whether there are whole ones without a comma, and one that should have had one.
    has_whole: bool,
    has_long: bool,
}

/// What a comma is in the numbers of these rows, by what makes all of them agree.
///
/// # Errors
/// Line and field where each of two readings makes all of them agree.
pub fn comma_of(rows: &[Row]) -> Result<Comma, (usize, String)> {
    let [mut point_is_decimal, mut comma_is_decimal] = [false; 2];
    let mut columns: Vec<Column> = Vec::new();
    for row in rows.iter().filter(|row| !row.is_comment) {
        if columns.len() < row.fields.len() {
            columns.resize(row.fields.len(), Column::default());
        }
        for (column, field) in columns.iter_mut().zip(&row.fields) {
            // Once commas are known to be decimal signs only points matter.
            if comma_is_decimal && !field.contains('.') {
                continue;
            }
            let bare = unsigned(field);
            let is_number = |b: u8| b.is_ascii_digit() || b".,eE+-".contains(&b);
            if !bare.bytes().next().is_some_and(is_number) || !bare.bytes().all(is_number) {
                continue;
            }
            match (bare.matches('.').count(), bare.matches(',').count()) {
                (0, 0) => {
                    column.has_whole = true;
                    column.has_long |= bare.len() > 3;
                }
                (1, 0) => point_is_decimal = point_is_decimal || !parts_thousands(bare, &['.']),
                (0, 1) if parts_thousands(bare, &[',']) => {
                    column.open.get_or_insert_with(|| (row.line, field.to_string()));
                }
                // Two commas are no decimal signs.
                (0, 2..) => point_is_decimal = true,
                (0, 1) | (2.., 0) => comma_is_decimal = true,
                _ if bare.rfind(',') < bare.rfind('.') => point_is_decimal = true,
                _ => comma_is_decimal = true,
            }
        }
        if comma_is_decimal && point_is_decimal {
            return Ok(Comma::Either);
        }
    }
    let mut open = columns.into_iter().filter(|column| column.open.is_some());
    Ok(match (comma_is_decimal, point_is_decimal) {
        (true, _) => Comma::Decimal,
        (false, true) => Comma::Thousands,
        (false, false) => match open.next() {
            None => Comma::Either,
            // Some have none, for they are below a thousand, or are and should have one.
            Some(Column { has_long: true, .. }) => Comma::Decimal,
            Some(Column { has_whole: true, .. }) => Comma::Thousands,
            Some(Column { open, .. }) => return Err(open.unwrap_or_default()),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::{rows, Separator};

    #[test]
    fn a_number_is_read_as_its_file_has_it() {
        for (text, comma, expected) in [
            ("1,492", Comma::Thousands, 1492.0),
            ("-1,234,567.5e1", Comma::Thousands, -12_345_675.0),
            ("1,492", Comma::Decimal, 1.492),
            ("1.234.567,5", Comma::Decimal, 1_234_567.5),
            ("1.492", Comma::Decimal, 1492.0),
            ("12,5", Comma::Either, 12.5),
            ("2,406.4", Comma::Either, 2406.4),
            ("\u{2212}0.5", Comma::Either, -0.5),
            ("1'004.5", Comma::Either, 1004.5),
            ("1\u{202f}004,5", Comma::Decimal, 1004.5),
            (",5", Comma::Decimal, 0.5),
        ] {
            assert_eq!(cell(text, comma), Cell::Number(expected), "{text} {comma:?}");
        }
        for (text, comma) in [
            ("1,49", Comma::Thousands),
            ("0,492", Comma::Thousands),
            ("1.49", Comma::Decimal),
            ("1 2", Comma::Either),
            ("--5", Comma::Thousands),
            ("5 V", Comma::Either),
        ] {
            assert_eq!(cell(text, comma), Cell::Text, "{text} {comma:?}");
        }
    }

    #[test]
    fn a_comma_is_what_makes_all_rows_agree() {
        let of = |text: &str| comma_of(&rows(text, Separator::Semicolon));
        assert_eq!(of("0.04;1,492\n"), Ok(Comma::Thousands));
        assert_eq!(of("0,04;1,492\n"), Ok(Comma::Decimal));
        assert_eq!(of("982;5\n1,004;5\n"), Ok(Comma::Thousands));
        assert_eq!(of("9820;5\n1,004;5\n"), Ok(Comma::Decimal));
        assert_eq!(of("0.04;1,5\n"), Ok(Comma::Either));
        assert_eq!(of("1.5;2\n"), Ok(Comma::Thousands));
        assert_eq!(of("5;1,492\n6;2,492\n"), Err((1, "1,492".to_owned())));
    }
}
