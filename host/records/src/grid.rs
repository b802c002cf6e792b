//! Rows of any text or sheet to channels: where the numbers begin, what parts them, what names stand above
//! them.

use super::columns::{self, dressed, kind, BEGINNING};
use super::header::header;
use super::table::Channel;
use yawrig_text::cells::{comma_of, Cell, Comma};
use yawrig_text::rows::{rows, Row, Separator};

/// Lines that show what parts the columns.
const SAMPLE: usize = 2000;

/// The channels of a text, parted by what makes most of its rows agree.
pub(super) fn of_text(text: &str) -> Result<Vec<Channel>, String> {
    let mut lines = text.char_indices().filter(|(_, c)| *c == '\n').map(|(at, _)| at);
    let sample = &text[..lines.nth(SAMPLE).unwrap_or(text.len())];
    let separator = separator_of(sample).or_else(|| separator_of(text));
    let separator = separator.unwrap_or(Separator::ALL[0]);
    let rows = rows(text, separator);
    if let Some(joined) = with_decimal_commas(&rows).filter(|_| separator == Separator::Comma) {
        return with_comma(&joined, Comma::Decimal);
    }
    let parts_all = separator == Separator::Comma && !text.contains('"');
    match parts_all || !text.contains(',') {
        true => with_comma(&rows, Comma::Either),
        false => of_rows(&rows),
    }
}

/// What makes the most rows of a text agree in how many fields and how many numbers they have, and leaves the
/// fewest words beside these; none where nothing does.
fn separator_of(text: &str) -> Option<Separator> {
    let score = |separator: Separator| {
        let mut alike: Vec<((usize, usize), usize)> = Vec::new();
        for row in rows(text, separator) {
            let of = (row.fields.len(), numbers(&row, Comma::Either));
            match alike.iter_mut().find(|(known, _)| *known == of) {
                _ if of.1 == 0 => {}
                Some((_, count)) => *count += 1,
                None => alike.push((of, 1)),
            }
        }
        let most = alike.into_iter().max_by_key(|(of, count)| (*count, of.1));
        most.map_or((0, 0), |((width, numbers), count)| (count, 2 * numbers as i64 - width as i64))
    };
    let scores = Separator::ALL.into_iter().map(|separator| (score(separator), separator));
    // The first of those that do as well.
    let best = scores.rev().max_by_key(|(score, _)| *score)?;
    (best.0 .0 >= BEGINNING).then_some(best.1)
}

/// Numbers of a row, times of day and gaps beside a number counted.
fn numbers(row: &Row, comma: Comma) -> usize {
    if row.is_comment {
        return 0;
    }
    let (mut numbers, mut gaps) = (0, 0);
    for field in &row.fields {
        match kind(field, comma) {
            Cell::Number(_) | Cell::Clock(_) => numbers += 1,
            Cell::Missing => gaps += 1,
            Cell::Text => {}
        }
    }
    if numbers > 0 {
        numbers + gaps
    } else {
        0
    }
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
    if width % 2 != 0 || !data.iter().all(pairs) {
        return None;
    }
    let names = heads.last().filter(|names| 2 * names.fields.len() == width);
    // One word above two columns may be a title, but for one with a unit.
    let named = names.is_some_and(|names| width > 2 || columns::has_unit(&names.fields[0]));
    let padded = |field: &str| field.len() > 1 && field.starts_with('0');
    let zeros = |row: &Row| row.fields.chunks(2).any(|half| padded(&half[1]));
    let wholes = |row: &Row| row.fields.chunks(2).any(|half| padded(&half[0]));
    let one_number = data.iter().any(zeros) && !data.iter().any(wholes);
    if !(named || one_number) {
        return None;
    }
    let joined = |row: &Row<'a>| Row {
        fields: row.fields.chunks(2).map(|half| half.join(",").into()).collect(),
        ..row.clone()
    };
    Some(heads.iter().cloned().chain(data.iter().map(joined)).collect())
}

/// The channels of these rows.
pub(super) fn of_rows(rows: &[Row]) -> Result<Vec<Channel>, String> {
    let (first, _) = begin(rows, Comma::Either)?;
    let comma = comma_of(&rows[first..]).map_err(|(line, field)| {
        let point = field.replace(',', ".");
        let whole = field.replace(',', "");
        format!(
            "line {line}: {field:?} may be {whole} or {point}, and nothing in it says what the comma is; \
             write it with a decimal point"
        )
    })?;
    with_comma(rows, comma)
}

/// Where the numbers begin, and how many of them make a row of a table.
fn begin(rows: &[Row], comma: Comma) -> Result<(usize, usize), String> {
    let count = |row: &Row| numbers(row, comma);
    // Two are enough, and found among the first rows as a rule.
    let widest = match rows.iter().any(|row| count(row) >= 2) {
        true => 2,
        false => rows.iter().map(count).max().unwrap_or(0),
    };
    let begins = |at: &usize| {
        let run = &rows[*at..rows.len().min(at + BEGINNING)];
        run.iter().all(|row| widest > 0 && count(row) >= widest)
            && run.iter().all(|r| columns::is_like(r, &run[0]))
    };
    let first = (0..rows.len()).find(begins).ok_or("there are no columns of numbers in it")?;
    Ok((first, widest))
}

fn with_comma(rows: &[Row], comma: Comma) -> Result<Vec<Channel>, String> {
    if let Some(expanded) = columns::with_tuples_parted(rows) {
        return with_comma(&expanded, comma);
    }
    let (first, widest) = begin(rows, comma)?;
    let is_data = |row: &Row| numbers(row, comma) >= widest;
    let (heads, data) = rows.split_at(first);
    let open = || open(heads, data, comma);
    let (mut done, mut channels) = (Vec::new(), open());
    // What stands below the numbers is no part of them.
    let last = data.iter().rposition(is_data).unwrap_or(0);
    for row in data[..=last].iter().filter(|row| !row.is_comment) {
        if columns::is_head(row, heads) {
            if channels.iter().any(|column| !column.is_empty()) {
                done.push(std::mem::replace(&mut channels, open()));
            }
            continue;
        }
        for (k, column) in channels.iter_mut().enumerate() {
            column.push(row.line, row.fields.get(k).map_or("", |field| field), comma);
        }
    }
    done.push(channels);
    let group = |number: usize| match number {
        0 => String::new(),
        number => format!("recording {}/", number + 1),
    };
    let recordings = done.into_iter().enumerate();
    let channels = recordings
        .flat_map(|(k, of)| of.into_iter().filter_map(move |column| column.channel(&group(k))));
    Ok(channels.collect())
}

/// The columns of a recording, without numbers yet.
fn open(heads: &[Row], data: &[Row], comma: Comma) -> Vec<columns::Column> {
    let fields = &data[0].fields;
    let run = &data[..data.len().min(BEGINNING)];
    // Where each row ends with what parts its columns, there is one column less.
    let ends = |k: usize| run.iter().all(|row| row.fields.get(k).is_none_or(|f| f.is_empty()));
    let used = (0..fields.len()).rev().find(|k| !ends(*k)).map_or(fields.len(), |k| k + 1);
    let named = header(heads, fields.len(), used).into_iter().zip(fields).enumerate();
    named
        .map(|(k, ((name, unit), field))| {
            let label = dressed(field, comma).map(|found| found.label.to_owned());
            let label = label.filter(|label| !label.is_empty());
            let bare = name.is_none() && k >= used;
            let name = name.or(label.clone()).unwrap_or_else(|| format!("column {}", k + 1));
            columns::Column::new(name, unit, label, bare)
        })
        .collect()
}
