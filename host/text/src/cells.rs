//! What a field of a table says: a number, a time of day, a gap or words.

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

pub fn cell(field: &str, is_decimal_comma_possible: bool) -> Cell {
    const MISSING: [&str; 9] = ["", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--"];
    // The decimal sign is the only comma, and no point stands beside it.
    let halves = || field.split_once(',').filter(|(_, rest)| !rest.contains(','));
    let parsed = field.parse::<f64>().or_else(|e| match halves() {
        Some((whole, rest)) if is_decimal_comma_possible && !field.contains('.') => {
            [whole, rest].join(".").parse()
        }
        _ => Err(e),
    });
    match parsed {
        Ok(value) if value.is_finite() => Cell::Number(value),
        Ok(_) => Cell::Missing,
        Err(_) if MISSING.iter().any(|missing| missing.eq_ignore_ascii_case(field)) => {
            Cell::Missing
        }
        Err(_) => clock_s(field).map_or(Cell::Text, Cell::Clock),
    }
}

/// Numbers of a row, times of day and gaps beside a number counted.
pub fn numbers(row: &Row, comma: bool) -> usize {
    let cells = || row.fields.iter().map(|field| cell(field, comma));
    let number = |c: &Cell| matches!(c, Cell::Number(_) | Cell::Clock(_));
    match !row.is_comment && cells().any(|c| number(&c)) {
        true => cells().filter(|c| number(c) || *c == Cell::Missing).count(),
        false => 0,
    }
}

/// 2020-03-01, in days from the year 0 on.
const SPRING_2020: i64 = 737_791;

/// Seconds of `12:03:04.125`, or of a date with such a time behind it, from spring 2020 on.
fn clock_s(text: &str) -> Option<f64> {
    let (date, time) = match text.trim().trim_end_matches('Z').rsplit_once(['T', ' ']) {
        Some((date, time)) => (Some(date), time),
        None => (None, text.trim()),
    };
    let mut parts = time.split(':');
    let (hours, minutes, seconds) = (parts.next()?, parts.next()?, parts.next()?);
    if parts.next().is_some() {
        return None;
    }
    let hours: u32 = hours.parse().ok().filter(|h| *h < 24)?;
    let minutes: u32 = minutes.parse().ok().filter(|m| *m < 60)?;
    let seconds: f64 =
        seconds.replace(',', ".").parse().ok().filter(|s| (0.0..61.0).contains(s))?;
    let days = match date {
        None => 0.0,
        Some(date) => days(date)?,
    };
    Some(86_400.0 * days + 3600.0 * f64::from(hours) + 60.0 * f64::from(minutes) + seconds)
}

/// Days of `2026-03-01` or `01.03.2026`, counted from a day so near that their seconds keep their digits.
fn days(date: &str) -> Option<f64> {
    let is_reversed = date.contains('.');
    let parts: Vec<&str> = date.split(if is_reversed { '.' } else { '-' }).collect();
    let [first, month, last] = parts[..] else { return None };
    let (year, day) = if is_reversed { (last, first) } else { (first, last) };
    let (year, month, day): (i64, i64, i64) =
        (year.parse().ok()?, month.parse().ok()?, day.parse().ok()?);
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // March is the first month, so that a leap day is a year's last.
    let (year, month) = if month < 3 { (year - 1, month + 9) } else { (year, month - 3) };
    let since_year_0 = 365 * year + year / 4 - year / 100 + year / 400;
    Some((since_year_0 + (153 * month + 2) / 5 + day - SPRING_2020) as f64)
}
