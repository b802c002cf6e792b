//! Rows of any text or sheet to channels: where the numbers begin, what names stand above them, and in which
//! unit.

use super::names;
use super::table::Channel;
use yawrig_text::cells::{cell, numbers, Cell};
use yawrig_text::rows::{rows, Row, Separator};

/// So many rows of numbers one after the other are the beginning of the data.
const BEGINNING: usize = 3;
/// Lines that show what parts the columns.
const SAMPLE: usize = 2000;

/// The channels of a text, parted by whatever gives the most columns of numbers.
pub(super) fn of_text(text: &str) -> Result<Vec<Channel>, String> {
    let mut lines = text.char_indices().filter(|(_, c)| *c == '\n').map(|(at, _)| at);
    let sample = &text[..lines.nth(SAMPLE).unwrap_or(text.len())];
    let separator = separator_of(sample).or_else(|| separator_of(text));
    let separator = separator.unwrap_or(Separator::ALL[0]);
    let comma = separator.is_decimal_comma_possible();
    let rows = rows(text, separator);
    match with_decimal_commas(&rows).filter(|_| !comma) {
        Some(joined) => of_rows(&joined, true),
        None => of_rows(&rows, comma),
    }
}

/// What gives a text the most rows of several numbers: the first of those that do as well; none where nothing
/// gives enough.
fn separator_of(text: &str) -> Option<Separator> {
    let score = |separator: &Separator| {
        let comma = separator.is_decimal_comma_possible();
        rows(text, *separator).iter().filter(|row| numbers(row, comma) >= 2).count()
    };
    let scores = Separator::ALL.into_iter().map(|separator| (score(&separator), separator));
    // Fewer are no columns: a line of settings above one column.
    let best = scores.rev().max_by_key(|(score, _)| *score)?;
    (best.0 >= BEGINNING).then_some(best.1)
}

/// Where the comma parts the columns and is the decimal sign, too, the rows with each number's two halves put
/// together: all are whole, twice as many as names, or with zeros in front that no whole number has.
fn with_decimal_commas<'a>(rows: &[Row<'a>]) -> Option<Vec<Row<'a>>> {
    let digits = |field: &str| !field.is_empty() && field.bytes().all(|b| b.is_ascii_digit());
    let first = rows.iter().position(|row| {
        !row.is_comment && row.fields.iter().all(|f| digits(f.trim_start_matches('-')))
    })?;
    let (heads, data) = rows.split_at(first);
    let width = data[0].fields.len();
    let pairs = |row: &Row| {
        row.fields.len() == width
            && row
                .fields
                .chunks(2)
                .all(|half| digits(half[0].trim_start_matches('-')) && digits(&half[1]))
    };
    if width % 2 != 0 || width < 4 || !data.iter().all(pairs) {
        return None;
    }
    let named = heads.last().is_some_and(|names| 2 * names.fields.len() == width);
    let zeros =
        |row: &Row| row.fields.chunks(2).any(|half| half[1].len() > 1 && half[1].starts_with('0'));
    if !named && !data.iter().any(zeros) {
        return None;
    }
    let joined = |row: &Row<'a>| Row {
        fields: row.fields.chunks(2).map(|half| half.join(",").into()).collect(),
        ..row.clone()
    };
    Some(heads.iter().cloned().chain(data.iter().map(joined)).collect())
}

/// The channels of these rows.
pub(super) fn of_rows(rows: &[Row], comma: bool) -> Result<Vec<Channel>, String> {
    let count = |row: &Row| numbers(row, comma);
    // Two are enough, and found among the first rows as a rule.
    let widest = match rows.iter().any(|row| count(row) >= 2) {
        true => 2,
        false => rows.iter().map(count).max().unwrap_or(0),
    };
    let is_data = |row: &Row| widest > 0 && count(row) >= widest;
    let begins = |at: &usize| {
        let run = &rows[*at..rows.len().min(at + BEGINNING)];
        run.iter().all(is_data) && run.iter().all(|r| r.fields.len() == run[0].fields.len())
    };
    let first = (0..rows.len()).find(begins).ok_or("there are no columns of numbers in it")?;
    let width = rows[first].fields.len();
    let (heads, data) = rows.split_at(first);
    let mut channels: Vec<Channel> = header(heads, width)
        .into_iter()
        .map(|(name, unit)| Channel { name, unit, step_s: None, values: Ok(Vec::new()) })
        .collect();
    // What stands below the numbers is no part of them.
    let last = data.iter().rposition(is_data).unwrap_or(0);
    for row in data[..=last].iter().filter(|row| !row.is_comment) {
        for (k, channel) in channels.iter_mut().enumerate() {
            let Ok(values) = &mut channel.values else { continue };
            match row.fields.get(k).map_or(Cell::Missing, |field| cell(field, comma)) {
                Cell::Number(value) => values.push(value),
                Cell::Clock(seconds) => {
                    channel.unit = Some("s".to_owned());
                    values.push(seconds);
                }
                // A gap: its row is left out.
                Cell::Missing => values.push(f64::NAN),
                Cell::Text => {
                    let what = format!("line {}: {:?} is not a number", row.line, row.fields[k]);
                    channel.values = Err(what);
                }
            }
        }
    }
    Ok(channels)
}

/// Name and unit of each column, from the rows above the numbers.
fn header(heads: &[Row], width: usize) -> Vec<(String, Option<String>)> {
    // A comment is a header only where it names the time.
    let fits = |row: &&Row| {
        row.fields.len() >= width
            && row.fields.iter().any(|f| !f.is_empty())
            && (!row.is_comment || row.fields.iter().any(|f| names::as_time(f).is_some()))
    };
    let mut above = heads.iter().rev().take(2).filter(fits);
    let is_units =
        |row: &Row| row.fields.iter().all(|f| f.is_empty() || names::bracketed(f).is_some());
    let (names, units) = match (above.next(), above.next()) {
        (Some(units), Some(names)) if is_units(units) => (Some(names), Some(units)),
        (names, _) => (names, None),
    };
    (0..width)
        .map(|k| {
            let field = |row: Option<&Row>| Some(row?.fields.get(k)?.clone().into_owned());
            let name = field(names).filter(|n| !n.is_empty());
            let name = name.unwrap_or_else(|| format!("column {}", k + 1));
            let unit = field(units).and_then(|text| names::bracketed(&text));
            let unit = unit.or_else(|| names::unit_in(&name));
            (name, unit)
        })
        .collect()
}
