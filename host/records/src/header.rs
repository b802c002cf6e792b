//! Names and units of columns, from the rows above the numbers.

use super::names;
use std::borrow::Cow;
use yawrig_text::rows::{split, Row, Separator};

/// Rows above the numbers that may hold names or units.
const ROWS: usize = 2;

/// Name and unit of each of `width` columns, of which the last after `used` are empty.
pub(super) fn header(
    heads: &[Row],
    width: usize,
    used: usize,
) -> Vec<(Option<String>, Option<String>)> {
    // Of a line of strokes nothing is a name.
    let says = |row: &&Row| row.text.is_empty() || row.text.contains(char::is_alphabetic);
    let mut above =
        heads.iter().rev().filter(says).take(ROWS).filter_map(|row| fields(row, width, used));
    let (names, units) = match (above.next(), above.next()) {
        (Some(units), Some(names)) if are_units(&units, &names) => (Some(names), Some(units)),
        (names, _) => (names, None),
    };
    let of = |row: &Option<Vec<Cow<str>>>, k: usize| {
        let field = row.as_ref()?.get(k)?.trim();
        (!field.is_empty()).then(|| field.to_owned())
    };
    (0..width)
        .map(|k| {
            let name = of(&names, k);
            let own = of(&units, k).map(|text| text.trim_matches(['(', ')', '[', ']']).to_owned());
            let unit = own.filter(|unit| !unit.is_empty() && unit != "-");
            let unit = unit.or_else(|| names::unit_in(name.as_deref()?));
            (name, unit)
        })
        .collect()
}

/// The fields of a row above the numbers, a name for each column, parted by whatever gives as many.
fn fields<'a>(row: &Row<'a>, width: usize, used: usize) -> Option<Vec<Cow<'a, str>>> {
    let own = &row.fields;
    let named = own.iter().rposition(|field| !field.is_empty()).map_or(0, |k| k + 1);
    let found = if named == used || named == width {
        own.clone()
    } else {
        use Separator::{Blanks, Comma, Semicolon, Tab, WideBlanks};
        let others = [Tab, WideBlanks, Semicolon, Comma, Blanks].into_iter();
        let other = others.map(|other| split(row.text, other)).find(|f| f.len() == used);
        // More names than numbers: the further ones are of columns that stayed empty.
        other.or_else(|| (named > width && own.len() > 1).then(|| own.clone()))?
    };
    // A comment is a header only where it names the time.
    let names_time = || found.iter().any(|field| names::as_time(field).is_some());
    (!row.is_comment || names_time()).then_some(found)
}

/// Whether a row under names holds their units: all are, or that of the time is.
fn are_units(row: &[Cow<str>], names: &[Cow<str>]) -> bool {
    let known = |field: &str| names::bracketed(field).is_some();
    let is_of_time = |(field, name): (&Cow<str>, &Cow<str>)| {
        let is_time = names::as_time(name) == Some(0) && names::unit_in(name).is_none();
        is_time
            && names::bracketed(field).is_some_and(|unit| super::units::seconds(&unit).is_some())
    };
    row.iter().all(|field| field.is_empty() || known(field))
        || row.iter().zip(names).any(is_of_time)
}
