//! Channels that are computed from others: `atan2(x, -y)`.

use super::table::Channel;
use std::borrow::Cow;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_expression::OfChannels;

/// `table`, with the channel that `name` is an expression of, if it is one.
///
/// # Errors
/// Exit 3 where it is an expression of channels that are not there, or cannot be used.
pub(super) fn with<'a>(
    table: Cow<'a, [Channel]>,
    name: Option<&str>,
    file: &Path,
) -> Result<Cow<'a, [Channel]>> {
    let there = |name: &str| {
        let mut found = table.iter().filter(|c| c.name == name || c.own_name() == name);
        let numbered = || table.get(name.strip_prefix('#')?.parse::<usize>().ok()?.checked_sub(1)?);
        found.next().filter(|_| found.next().is_none()).or_else(numbered)
    };
    let Some(name) = name.filter(|name| there(name).is_none()) else { return Ok(table) };
    let Some(expression) = computed(name) else { return Ok(table) };
    let fail = |what: String, help: &str| {
        Err(Error::data(format!("{}: in {name:?}, {what}", file.display())).help(help))
    };
    let mut inputs = Vec::new();
    for input in expression.names() {
        match there(input).map(|channel| channel.values.as_deref()) {
            Some(Ok(values)) => inputs.push(values),
            Some(Err(why)) => {
                return fail(format!("channel {input} cannot be used: {why}"), "choose others")
            }
            None => {
                let all: Vec<String> = table.iter().map(Channel::described).collect();
                let what =
                    format!("there is no channel {input:?}; its channels: {}", all.join(", "));
                return fail(
                    what,
                    "name channels of the file: a name with more than letters, digits and _ in it in double quotes, \
                     \"Potential (V)\", or the second one as #2",
                );
            }
        }
    }
    let length = inputs[0].len();
    if inputs.iter().any(|values| values.len() != length) {
        return fail("the channels are not as long as each other".to_owned(), "choose others");
    }
    let unit_of = |name: &str| there(name).and_then(|channel| channel.unit.clone());
    let unit = match expression.unit(&unit_of) {
        Ok(unit) => unit,
        Err(flaw) => return fail(flaw.message, &flaw.help),
    };
    let value = |k: usize| {
        let values: Vec<f64> = inputs.iter().map(|values| values[k]).collect();
        expression.evaluate(&values)
    };
    let computed = Channel {
        name: name.to_owned(),
        unit,
        step_s: there(&expression.names()[0]).and_then(|channel| channel.step_s),
        values: Ok((0..length).map(value).collect()),
    };
    let mut table = table.into_owned();
    table.push(computed);
    Ok(Cow::Owned(table))
}

/// The expression, where there is more in it than a name or a number.
fn computed(name: &str) -> Option<OfChannels> {
    name.contains(['+', '-', '*', '/', '^', '(']).then(|| OfChannels::parse(name).ok())?
}

/// A channel's name, or its number, as an expression has it.
pub(super) fn written(name: &str) -> String {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    match name.strip_prefix("column ").unwrap_or(name) {
        number if number.bytes().all(|b| b.is_ascii_digit()) => format!("#{number}"),
        word if word.chars().all(is_word) && !word.starts_with(|c: char| c.is_ascii_digit()) => {
            word.to_owned()
        }
        other => format!("\"{other}\""),
    }
}
