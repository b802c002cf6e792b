//! Which channel of a file is the time of another, by where it stands and what it is called.

use super::names;
use super::table::Channel;

/// Letters and numbers of a name by which channels of one kind are told apart: `1` of `theta1`, `A` of `Pos A
/// (mm)`.
pub(super) fn marks(name: &str) -> Vec<String> {
    let stem = names::stem(name);
    let mut marks: Vec<String> = Vec::new();
    let mut digits = String::new();
    for c in stem.chars().chain([' ']) {
        if c.is_ascii_digit() {
            digits.push(c);
        } else if !digits.is_empty() {
            marks.push(std::mem::take(&mut digits));
        }
    }
    let words = stem.split(|c: char| !c.is_alphanumeric());
    marks.extend(words.skip(1).filter(|w| w.len() == 1 && !digits_only(w)).map(str::to_owned));
    marks
}

fn digits_only(word: &str) -> bool {
    word.bytes().all(|b| b.is_ascii_digit())
}

/// What a channel stands in with others: a group, or a matrix.
pub(super) fn group_of(channel: &Channel) -> &str {
    let matrix = channel.name.rsplit_once('(').filter(|(_, of)| of.contains(':'));
    let group = || channel.name.strip_suffix(channel.own_name()).unwrap_or("");
    matrix.map_or_else(group, |(matrix, _)| matrix)
}

pub(super) fn rank(channel: &Channel) -> Option<u8> {
    names::as_time(channel.own_name()).or_else(|| names::as_time(&channel.name))
}

/// The channel that is by its name the time of `of`: of its group where there is one in it, surest by its
/// name; of several the one with the same marks, then, where channels stand `in_order`, the nearest before
/// it.
///
/// # Errors
/// Where several may be.
pub(super) fn of_channel<'a>(
    table: &'a [Channel],
    of: &Channel,
    in_order: bool,
) -> std::result::Result<Option<&'a Channel>, ()> {
    let is_same = |c: &Channel| std::ptr::eq(c, of) || c.name == of.name;
    let mut all: Vec<(usize, &Channel)> =
        table.iter().enumerate().filter(|(_, c)| !is_same(c) && rank(c).is_some()).collect();
    if all.iter().any(|(_, c)| group_of(c) == group_of(of)) {
        all.retain(|(_, c)| group_of(c) == group_of(of));
    }
    let best = all.iter().filter_map(|(_, c)| rank(c)).min();
    all.retain(|(_, c)| rank(c) == best);
    let marked: Vec<(usize, &Channel)> =
        all.iter().copied().filter(|(_, c)| marks(c.own_name()) == marks(of.own_name())).collect();
    let at = table.iter().position(|c| std::ptr::eq(c, of));
    match (all.as_slice(), marked.as_slice()) {
        ([], _) => Ok(None),
        ([(_, one)], _) => Ok(Some(one)),
        (_, [(_, one)]) if !marks(of.own_name()).is_empty() => Ok(Some(one)),
        _ => {
            let before: Vec<(usize, &Channel)> =
                all.into_iter().filter(|(k, _)| in_order && at.is_some_and(|at| *k < at)).collect();
            match before.as_slice() {
                [] => Err(()),
                // Two clocks beside each other are both of what follows.
                [.., (a, _), (b, _)] if a + 1 == *b => Err(()),
                [.., (_, nearest)] => Ok(Some(nearest)),
            }
        }
    }
}
