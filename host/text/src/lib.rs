//! Text as people and programs write it: tables of numbers, and what errors about a text have in common, the
//! character pointed at, the name that was meant.
#![forbid(unsafe_code)]

pub mod cells;
pub mod clocks;
pub mod rows;

use std::fmt::Write as _;
use std::ops::Range;
use std::path::Path;

/// `message` about `span` (bytes) of the file's `text`: file, line and column, the line itself and a caret
/// under it.
pub fn pointed(file: &Path, text: &str, span: Range<usize>, message: &str) -> String {
    let floor = |mut at: usize| {
        at = at.min(text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    let (start, end) = (floor(span.start), floor(span.end));
    let line_start = text[..start].rfind('\n').map_or(0, |n| n + 1);
    let line_number = text[..start].matches('\n').count() + 1;
    let line = text[line_start..].lines().next().unwrap_or("");
    let before = &text[line_start..start];
    let column = before.chars().count() + 1;
    let line_end = line_start + line.len();
    let width = text[start..end.clamp(start, line_end.max(start))].chars().count().max(1);
    // Tabs keep their width, whatever that is.
    let indent: String = before.chars().map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
    let gutter = " ".repeat(line_number.to_string().len());
    let mut out = format!("{}:{line_number}:{column}: {message}\n", file.display());
    let _ = writeln!(out, "  {line_number} | {line}");
    let _ = write!(out, "  {gutter} | {indent}{}", "^".repeat(width));
    out
}

/// The name nearest to a misspelt one, if any is near.
pub fn nearest<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    names
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(wrong, name), name))
        .filter(|(distance, name)| *distance <= (name.len().max(wrong.chars().count()) + 1) / 3)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

/// A word of a command line as a shell takes it.
///
/// ```
/// assert_eq!(yawrig_text::quoted("runs/K1.csv"), "runs/K1.csv");
/// assert_eq!(yawrig_text::quoted("Yaw (deg)"), "'Yaw (deg)'");
/// assert_eq!(yawrig_text::quoted("it's"), r"'it'\''s'");
/// ```
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./:=+,@%".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_at_the_character_and_finds_the_name_that_was_meant() {
        let text = "first\n\tsecond = 3\n";
        let said = pointed(Path::new("a.toml"), text, 16..17, "not 3");
        assert_eq!(said, "a.toml:2:11: not 3\n  2 | \tsecond = 3\n    | \t         ^");
        assert_eq!(
            nearest("coulom_friction", ["cubic_damping", "coulomb_friction"]),
            Some("coulomb_friction")
        );
        assert_eq!(nearest("xyz", ["cubic_damping"]), None);
    }
}
