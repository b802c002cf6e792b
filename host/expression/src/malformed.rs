//! Text that is no TOML, in plain words: the parser tells where it gave up, and the line what was to stand there.

use std::ops::Range;

/// Entries that are numbers, and those that are texts.
const NUMBERS: [&str; 3] = ["start", "min", "max"];
const TEXTS: [&str; 4] = ["id", "title", "moment", "unit"];
const ENTRY: &str =
    "an entry is NAME = VALUE, such as title = \"My effect\"; a remark begins with #";

/// Where to point, what is wrong there and what to do, of the parser's `message` at `span` (bytes) of `text`.
pub fn explained(text: &str, span: &Range<usize>, message: &str) -> (Range<usize>, String, String) {
    // At the end of the file it is the last entry that was not ended.
    let last = if text.get(span.start..).unwrap_or_default().trim().is_empty() {
        text.trim_end().len()
    } else {
        text.len()
    };
    let span = &(span.start.min(last)..span.end.min(last));
    let line = line_at(text, span.start);
    let words = &text[line.clone()];
    let told = |at: Range<usize>, what: String, help: &str| (at, what, help.to_owned());
    let named = text.get(span.clone()).unwrap_or_default();
    if message.starts_with("duplicate key") {
        return told(span.clone(), format!("{named} is written twice"), "keep one of the two");
    }
    let quotes: Vec<usize> =
        words.match_indices('"').map(|(k, _)| k).filter(|k| !is_escaped(words, *k)).collect();
    if let Some(last) = quotes.last().filter(|_| quotes.len() % 2 == 1) {
        let at = line.start + last;
        return told(
            at..at + 1,
            "the quotes are not closed".to_owned(),
            "put a \" at both ends of the text",
        );
    }
    if message.starts_with("missing escaped value") {
        let what = "a backslash in a text has a meaning of its own".to_owned();
        return told(span.clone(), what, "take it away");
    }
    if words.trim_start().starts_with('[') {
        let what = "this is no headline such as [parameters]".to_owned();
        return told(line, what, "write [parameters], in single brackets, on a line of its own");
    }
    if let Some(found) = of_parameter(words, line.start) {
        return found;
    }
    if message.starts_with("unclosed inline table") {
        let at = line.start + words.rfind('{').unwrap_or(0);
        return told(at..at + 1, "the brace is not closed".to_owned(), "end the line with }");
    }
    if message.starts_with("missing comma") {
        let help = "write commas between unit, start, min and max";
        return told(span.clone(), "a comma is missing here".to_owned(), help);
    }
    let at = span.start - line.start;
    if let Some(found) = of_value(words, line.start, at, message) {
        return found;
    }
    if message.starts_with("extra comma") {
        let what = "nothing stands between two commas, or behind the last".to_owned();
        return told(span.clone(), what, "take the comma away");
    }
    if message.starts_with("unexpected key or value") {
        let what = "nothing more can stand on this line".to_owned();
        return told(span.clone(), what, "begin a new line; a remark begins with #");
    }
    let at = if words.trim().is_empty() { span.clone() } else { trimmed(words, line.start) };
    told(at, "this is no entry".to_owned(), ENTRY)
}

/// The line that holds byte `at`, or ends there.
fn line_at(text: &str, at: usize) -> Range<usize> {
    let at = at.min(text.len());
    let start = text.as_bytes()[..at].iter().rposition(|b| *b == b'\n').map_or(0, |n| n + 1);
    let end = text.as_bytes()[at..].iter().position(|b| *b == b'\n').map_or(text.len(), |n| at + n);
    start..end
}

fn is_escaped(words: &str, at: usize) -> bool {
    words[..at].bytes().rev().take_while(|b| *b == b'\\').count() % 2 == 1
}

fn trimmed(words: &str, start: usize) -> Range<usize> {
    let from = words.len() - words.trim_start().len();
    start + from..start + from + words.trim().len()
}

/// Of a parameter's line, what is wrong before its brace.
fn of_parameter(words: &str, start: usize) -> Option<(Range<usize>, String, String)> {
    let before = &words[..words.find('{')?];
    let told = |what: String, help: &str| Some((trimmed(before, start), what, help.to_owned()));
    let Some((name, _)) = before.split_once('=') else {
        let what = format!("an = is missing between {} and its brace", before.trim());
        return told(what, "write NAME = { unit = \"1\", start = 0.5 }");
    };
    let called = name.trim();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if called.is_empty() {
        let help = "write a name before the =: letters, digits and _, a letter first";
        return Some((start..start, "the parameter has no name".to_owned(), help.to_owned()));
    }
    if called.chars().all(is_plain) || called.starts_with(['"', '\'']) {
        return None;
    }
    let what = format!("\"{called}\" is no name of a parameter");
    let help = "letters, digits and _, a letter first, at most 40";
    Some((trimmed(name, start), what, help.to_owned()))
}

/// What is wrong with the value whose entry holds byte `at` of the line.
fn of_value(
    words: &str,
    start: usize,
    at: usize,
    message: &str,
) -> Option<(Range<usize>, String, String)> {
    let pieces = pieces(words);
    let here = pieces.iter().position(|piece| (piece.start..=piece.end).contains(&at))?;
    let is_cut = |piece: &Range<usize>| words[piece.clone()].trim_end().ends_with('=');
    let here = match here.checked_sub(1) {
        Some(before) if message.starts_with("extra comma") && is_cut(&pieces[before]) => before,
        _ => here,
    };
    let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    // Behind a comma that is meant as a point, or behind one that ends the line.
    let is_decimal = here > 0 && is_digits(words[pieces[here].clone()].trim());
    let piece = match is_decimal {
        true => pieces[here - 1].start..pieces[here].end,
        false => pieces[here].clone(),
    };
    let (name, value) = words[piece.clone()].split_once('=')?;
    let name = name.trim().trim_start_matches('{').trim();
    let begin = start + piece.end - value.len();
    let at = match value.trim().is_empty() {
        true => {
            begin + usize::from(value.starts_with(' '))..begin + usize::from(value.starts_with(' '))
        }
        false => trimmed(value, begin),
    };
    let value = value.trim();
    let told = |what: String, help: String| Some((at.clone(), what, help));
    let (is_number, is_text) = (NUMBERS.contains(&name), TEXTS.contains(&name));
    if !is_number && !is_text {
        return None;
    }
    if value.is_empty() {
        let help = match (is_number, name) {
            (true, "start") => "write a typical size such as 0.05".to_owned(),
            (true, _) => format!("write a number, or leave {name} out where there is no bound"),
            _ => format!("write {name} = \"...\", with its text in the quotes"),
        };
        return told(format!("nothing stands behind {name} ="), help);
    }
    if is_number {
        if value.parse::<f64>().is_ok() && !value.starts_with('.') && !value.ends_with('.') {
            // Something else is wrong.
            return None;
        }
        let help = match value {
            _ if is_decimal => "write a point, not a comma: 0.05".to_owned(),
            _ if value.trim_matches('.').parse::<f64>().is_ok()
                && value != value.trim_matches('.') =>
            {
                "write digits before and behind the point: 0.5".to_owned()
            }
            _ => "write a number such as 0.05 or 1e-3, without quotes and without a formula"
                .to_owned(),
        };
        return told(format!("{name} is to be a number, and not {value}"), help);
    }
    let quote = value.chars().next().filter(|c| ['"', '\''].contains(c));
    let Some(quote) = quote else {
        return told(
            format!("{name} is to be a text in quotes, and not {value}"),
            format!("write {name} = \"{value}\""),
        );
    };
    match value[1..].find(quote) {
        None => told(
            "the quotes are not closed".to_owned(),
            format!("put a {quote} at both ends of the text"),
        ),
        Some(_) if message.starts_with("unexpected key or value") => told(
            format!("something stands behind the text of {name}"),
            match value.contains("//") {
                true => "a remark begins with #".to_owned(),
                false => "put all of it into one pair of quotes".to_owned(),
            },
        ),
        Some(_) => told(
            format!("the text of {name} holds a sign that cannot stand there"),
            "write it in letters, digits and signs that can be printed".to_owned(),
        ),
    }
}

/// The line cut at its commas, texts and what follows the last brace apart.
fn pieces(words: &str) -> Vec<Range<usize>> {
    let brace = words.find('{');
    let first = brace.map_or(0, |k| k + 1);
    let (mut out, mut begin, mut quote) = (Vec::new(), first, None);
    for (k, c) in words.char_indices().skip_while(|(k, _)| *k < first) {
        match (quote, c) {
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if c == open && !is_escaped(words, k) => quote = None,
            (None, ',' | '}') if brace.is_some() => {
                out.push(begin..k);
                begin = k + 1;
            }
            (None, '#') => {
                out.push(begin..k);
                return out;
            }
            _ => {}
        }
    }
    out.push(begin..words.len());
    out
}

#[cfg(test)]
mod tests;
