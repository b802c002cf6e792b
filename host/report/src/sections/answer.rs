//! What is to be taken from a release, for the page.

use super::cells::quantity;
use crate::answer::Answer;
use crate::escape::escaped;
use crate::{Estimate, ReleaseReport, Report};
use yawrig_core::quantity::Quantity;

pub(super) fn answered(answer: &Answer) -> String {
    let row = |(name, q, unit): (String, Quantity, String)| {
        format!("<dt>{}</dt><dd>{} {}</dd>", escaped(&name), quantity(q), escaped(&unit))
    };
    let rest = match answer.parameters.is_empty() {
        true => "",
        false => ", wn and zeta those at rest",
    };
    format!(
        "<div class=\"answer\"><p>{}: leaves {:.2} times the noise; k = 1{rest}</p>\n<dl>{}</dl></div>\n",
        escaped(&answer.model),
        answer.residual_over_noise,
        answer.rows().into_iter().map(row).collect::<String>()
    )
}

/// The answer to a report about one release, for its head.
pub(super) fn headline(report: &Report) -> String {
    match &report.releases[..] {
        [ReleaseReport { answer: Some(answer), .. }] => answered(answer),
        _ => String::new(),
    }
}

/// Why, below a table; nothing where none is.
pub(super) fn why_not_valid<'a>(estimates: impl IntoIterator<Item = &'a Estimate>) -> &'static str {
    match estimates.into_iter().any(|e| e.refused) {
        true => {
            "<p class=\"note\">Not valid: wn and zeta of a second-order model, which the diagnosis refuses for that release.</p>\n"
        }
        false => "",
    }
}
