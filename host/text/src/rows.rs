//! Text as other programs write it: decoded, its comments put aside, its lines split by what parts them.

use crate::clocks;
use std::borrow::Cow;

/// A line of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row<'a> {
    /// Its number in the file, from 1.
    pub line: usize,
    pub fields: Vec<Cow<'a, str>>,
    /// All of it, without its comment sign.
    pub text: &'a str,
    /// It stands behind a comment sign.
    pub is_comment: bool,
}

/// What parts the fields of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Separator {
    Tab,
    Semicolon,
    Comma,
    Blanks,
    /// Two blanks or more: a name may hold one.
    WideBlanks,
}

impl Separator {
    /// In the order in which they are tried.
    pub const ALL: [Self; 4] = [Self::Tab, Self::Semicolon, Self::Comma, Self::Blanks];
}

/// UTF-8 and UTF-16 with or without their marks; what is no UTF-8 is taken for Latin-1, as Windows writes a
/// degree sign.
pub fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    let wide = |of: fn([u8; 2]) -> u16, bytes: &[u8]| {
        let units: Vec<u16> = bytes.chunks_exact(2).map(|pair| of([pair[0], pair[1]])).collect();
        Cow::Owned(String::from_utf16_lossy(&units))
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => wide(u16::from_le_bytes, rest),
        [0xfe, 0xff, rest @ ..] => wide(u16::from_be_bytes, rest),
        [0xef, 0xbb, 0xbf, rest @ ..] => utf8_or_latin1(rest),
        [_, 0, _, 0, ..] => wide(u16::from_le_bytes, bytes),
        [0, _, 0, _, ..] => wide(u16::from_be_bytes, bytes),
        _ => utf8_or_latin1(bytes),
    }
}

fn utf8_or_latin1(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().map(|byte| char::from(*byte)).collect()),
    }
}

/// The lines that hold something, split.
pub fn rows(text: &str, separator: Separator) -> Vec<Row<'_>> {
    text.lines().enumerate().filter_map(|(index, line)| row(index + 1, line, separator)).collect()
}

fn row(number: usize, line: &str, separator: Separator) -> Option<Row<'_>> {
    let trimmed = line.trim();
    let bare = trimmed.trim_start_matches(['#', '%']);
    let bare = bare.strip_prefix("//").unwrap_or(bare);
    let is_comment = bare.len() < trimmed.len();
    let line = if is_comment { bare.trim() } else { line.trim_end_matches(['\r', ' ']) };
    (!line.trim().is_empty()).then(|| Row {
        line: number,
        fields: split(line, separator),
        text: line,
        is_comment,
    })
}

/// The fields of a line.
pub fn split(line: &str, separator: Separator) -> Vec<Cow<'_, str>> {
    let sign = match separator {
        Separator::Tab => '\t',
        Separator::Semicolon => ';',
        Separator::Comma => ',',
        Separator::Blanks => return by_blanks(line),
        Separator::WideBlanks => {
            let fields = line.split("  ").map(|field| field.trim().trim_matches('"'));
            return fields.filter(|field| !field.is_empty()).map(Cow::Borrowed).collect();
        }
    };
    if !line.contains('"') {
        return line.split(sign).map(|field| Cow::Borrowed(field.trim())).collect();
    }
    let mut fields = vec![String::new()];
    let mut is_quoted = false;
    for c in line.chars() {
        match c {
            '"' => is_quoted = !is_quoted,
            c if c == sign && !is_quoted => fields.push(String::new()),
            c => fields.last_mut().expect("one at least").push(c),
        }
    }
    fields.iter().map(|field| Cow::Owned(field.trim().to_owned())).collect()
}

/// A unit in brackets belongs to the word before it, a time of day to its date.
fn by_blanks(line: &str) -> Vec<Cow<'_, str>> {
    let mut fields: Vec<Cow<str>> = Vec::new();
    for word in line.split_whitespace() {
        let goes_on = |last: &str| {
            word.starts_with(['(', '['])
                || word.contains(':') && clocks::is_date(last)
                || clocks::is_half(word) && last.contains(':')
        };
        match fields.last_mut() {
            Some(last) if goes_on(last) => *last = Cow::Owned(format!("{last} {word}")),
            _ => fields.push(Cow::Borrowed(word.trim_matches('"'))),
        }
    }
    fields
}
