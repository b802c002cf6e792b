//! The one thing that the TOML crate's messages do not say: what kind of value an entry of an effect's file
//! takes. (For `start = five` they expect `false`, for `start = 0,05` another entry.)

use std::ops::Range;

const NUMBERS: [&str; 3] = ["start", "min", "max"];
const TEXTS: [&str; 6] = ["id", "title", "moment", "unit", "name", "rate"];

/// Where the value of the entry before byte `at` of `text` stands, what is wrong with it and what to do; none
/// where it is of its kind.
pub fn value(text: &str, at: usize) -> Option<(Range<usize>, String, String)> {
    // What is missing at the end of a line is found at the beginning of the next.
    let at = text.get(..at)?.trim_end_matches('\n').len();
    let start = text[..at].rfind('\n').map_or(0, |n| n + 1);
    let line = text[start..].split('\n').next().unwrap_or_default();
    let (name, begin) = entry_before(&line[..at - start])?;
    let rest = &line[begin..];
    let value = rest[..end(rest, line[..begin].contains('{'))].trim();
    let from = start + begin + usize::from(rest.starts_with(' '));
    let span = from..from + value.len();
    // What stands in brackets last: a state begins at an expression.
    let table = text[..start].lines().rfind(|line| line.trim_start().starts_with('['));
    let of_state = table.is_some_and(|table| table.trim_start().starts_with("[[state"));
    let is_number = NUMBERS.contains(&name) && !of_state;
    let (what, help) = match value {
        // A comma is missing.
        _ if value.contains('=') && !value.starts_with('=') => return None,
        "" => ("nothing stands behind", "write its value there"),
        _ if is_number && value.contains(',') => ("a number", "write a point, not a comma: 0.05"),
        _ if is_number && value.parse::<f64>().is_err() => {
            ("a number", "write a number such as 0.05 or 1e-3, without quotes")
        }
        _ if !is_number && !value.starts_with(['"', '\'']) => ("a text in quotes", "write quotes"),
        _ => return None,
    };
    let what = match value {
        "" => format!("{what} {name} ="),
        _ => format!("{name} is to be {what}, and not {value}"),
    };
    Some((span, what, help.to_owned()))
}

/// The last `NAME =` of a known name, and the byte after it.
fn entry_before(line: &str) -> Option<(&'static str, usize)> {
    let of = |name: &'static str| {
        let at = line.rfind(name)?;
        let is_whole = !line[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
        let gap = &line[at + name.len()..];
        let sign = gap.len() - gap.trim_start().len();
        let is_entry = is_whole && gap[sign..].starts_with('=');
        is_entry.then_some((name, at + name.len() + sign + 1))
    };
    NUMBERS.into_iter().chain(TEXTS).filter_map(of).max_by_key(|(_, begin)| *begin)
}

/// Where a value ends: at a remark, and in braces at the next comma that is none of a number's.
fn end(rest: &str, in_braces: bool) -> usize {
    let is_digit = |k: usize| rest.as_bytes().get(k).is_some_and(u8::is_ascii_digit);
    let is_end = |(k, c): &(usize, char)| match c {
        '#' => true,
        ',' => in_braces && !(*k > 0 && is_digit(k - 1) && is_digit(k + 1)),
        '}' => in_braces,
        _ => false,
    };
    rest.char_indices().find(is_end).map_or(rest.len(), |(k, _)| k)
}
