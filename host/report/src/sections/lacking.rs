//! What a second-order model lacks, with a card for each effect.

use super::cells::{figure, quantity};
use crate::charts::{self};
use crate::escape::escaped;
use crate::table::table;
use crate::units::sized;
use crate::{CandidateRow, Criticism, EffectFound, ParameterRow, StaircaseStep};

use std::fmt::Write as _;
use yawrig_base::error::Result;
use yawrig_core::quantity::Quantity;

pub(super) fn lacking(c: &Criticism) -> Result<String> {
    let mut out = String::new();
    for sentence in &c.sentences {
        let _ = writeln!(out, "<p>{}.</p>", escaped(sentence));
    }
    if let Some(chart) = charts::staircase(c) {
        // A staircase needs two steps.
        if c.steps.len() > 1 {
            out.push_str(&figure(&chart)?);
        }
        let row = |s: &StaircaseStep| {
            [
                escaped(&s.name),
                sized(&c.said.measurand(), s.residual_rms_deg, 5),
                format!("{:.4}", s.residual_over_noise),
                format!("{:.4}", s.held_out_over_noise),
            ]
        };
        let residual = format!("residual rms ({})", c.said.measurand().unit());
        let header = ["model", &residual, "residual / noise", "held out / noise"];
        out.push_str(&table(&header, 1, c.steps.iter().map(row)));
    }
    for effect in &c.effects {
        out.push_str(&card(effect));
    }
    for [a, b] in &c.indistinguishable {
        let _ = writeln!(
            out,
            "<p class=\"note\">{} and {} cannot be distinguished in these data.</p>",
            escaped(a),
            escaped(b)
        );
    }
    if !c.candidates.is_empty() {
        let row = |c: &CandidateRow| {
            let evidence = match c.converged {
                true => format!("{:.1}", c.evidence),
                false => "not converged".to_owned(),
            };
            [escaped(&c.effect), format!("{:.4}", c.residual_over_noise), evidence]
        };
        out.push_str("<h3>Every effect alone</h3>\n");
        let header = ["effect", "residual / noise", "difference of BIC"];
        out.push_str(&table(&header, 1, c.candidates.iter().map(row)));
    }
    if let Some(chart) = charts::laws(c) {
        out.push_str("<h3>Where it fails</h3>\n");
        out.push_str(&figure(&chart)?);
    }
    Ok(out)
}

fn card(e: &EffectFound) -> String {
    let mut out = format!(
        "<div class=\"card\"><h3>{} <code>{}</code></h3>\n<p class=\"formula\">{}</p>\n",
        escaped(&e.title),
        escaped(&e.id),
        escaped(&e.formula)
    );
    if !e.parameters.is_empty() {
        let row = |p: &ParameterRow| {
            let value = quantity(Quantity::new(p.value, p.u.unwrap_or(f64::NAN)));
            [escaped(&p.name), value, escaped(&p.unit)]
        };
        out.push_str(&table(
            &["parameter", "value, k = 1", "unit"],
            1,
            e.parameters.iter().map(row),
        ));
    }
    out.push_str("<dl>");
    if let Some([origin, reason]) = &e.origin {
        let _ = write!(out, "<dt>Origin</dt><dd>{}: {}</dd>", escaped(origin), escaped(reason));
    }
    for (name, text) in [
        ("Usual cause", &e.cause),
        ("Fingerprint", &e.fingerprint),
        ("To confirm", &e.confirm),
        ("To remove", &e.remove),
    ] {
        let _ = write!(out, "<dt>{name}</dt><dd>{}</dd>", escaped(text));
    }
    out.push_str("</dl></div>\n");
    out
}
