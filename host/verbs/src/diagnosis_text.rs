//! A diagnosis, of a record or of a campaign, as text.

use super::common::bare;
use super::model::{amplitude_rows, needed, parameter};
use super::roll;
use std::fmt::Write as _;
use yawrig_core::derivatives::table::Point;
use yawrig_core::diagnosis::diagnose::{BeforeAndAfter, Diagnosis, HeldOut, Step};
use yawrig_core::diagnosis::wind::{Dimensionless, GrowsAs};
use yawrig_core::effects::Effect;
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Measurand;
use yawrig_report::units::sized;

/// What the difference of BIC of the candidates is; the first is what `compare --effect` prints, too.
const BIC_OF_WHOLE: &str =
    "difference of BIC: how much better the model with the effect does, on the independent \
    residuals of the better one, as `compare --effect` prints it";
const BIC_OF_PIECES: &str = "difference of BIC of pieces fitted each with its own state, an independent residual each half \
    cycle; `compare --effect` prints that of one fit to the whole record";

/// The verdict on what is called `name`, and what it rests on. `model`: what its effects were looked for
/// beside.
pub fn of(name: &str, d: &Diagnosis, model: &str) -> String {
    let measurand = &d.said.measurand();
    let count = d.releases.len();
    let is_campaign = d.releases[0].condition.is_some();
    let what = match (is_campaign, count) {
        (true, _) => format!("{name}, {count} releases"),
        (false, 1) => name.to_owned(),
        (false, _) => format!("{count} releases"),
    };
    let verdict = d.verdict(model);
    let noise = format!("noise {} {}", sized(measurand, d.noise_rms_deg, 4), measurand.unit());
    let modal = d.modal.map_or(String::new(), |modal| {
        format!("wn {} rad/s, zeta {}, ", modal.natural_frequency_rad_s, modal.damping_ratio)
    });
    let mut out = format!(
        "{what}: {verdict}\n  {}\n  {modal}{noise}\n{}\n  held out: {}\n",
        d.sentence,
        step_rows(measurand, &d.steps, model),
        d.held_out.words()
    );
    let whose = if count > 1 && !is_campaign { " for all" } else { "" };
    for (name, value) in d.steps.last().iter().flat_map(|s| &s.parameters) {
        let _ = writeln!(out, "  {}{whose}", parameter(measurand, name, value));
    }
    out.push_str(&needed(&d.needed_by_prediction));
    if !is_campaign {
        out.push_str(&by_release(d, measurand));
    }
    for id in d.effects.iter().map(|e| e.id()).filter(|id| d.origin.contains_key(*id)) {
        let _ = write!(
            out,
            "\n{id} is {}: {}\n  fitted with {}\n{}\n",
            d.origin[id],
            d.origin_reason.get(id).map_or("", String::as_str),
            d.sharing.get(id).copied().unwrap_or_default(),
            coefficient_rows(d, id)
        );
        out.push_str(&in_wind(d, id));
    }
    let _ = writeln!(out, "\n{}", candidate_rows(d, model));
    for refusal in d.refusals() {
        let _ = writeln!(out, "\n  {refusal}");
    }
    out.push_str(&groups(
        &d.indistinguishable,
        if count > 1 { "these releases" } else { "this record" },
        measurand,
    ));
    let unexplained: Vec<String> = d
        .releases
        .iter()
        .filter(|r| is_campaign && !r.explained)
        .map(|r| format!("{} ({:.2} times the noise)", r.file, r.residual_over_noise))
        .collect();
    if !unexplained.is_empty() {
        let _ = writeln!(out, "\nNot down to the noise: {}", unexplained.join(", "));
    }
    if let Some(derivatives) = &d.derivatives {
        let _ = writeln!(
            out,
            "\nDerivatives per rad about the middle axis, before and after the effects, k = 1:\n{}",
            derivative_rows(derivatives)
        );
        out.push_str("Cn_r is the combined damping derivative Cn_r - Cn_betadot.\n");
    }
    d.effects.iter().for_each(|effect| out.push_str(&card(effect, measurand)));
    out.truncate(out.trim_end().len());
    out
}

/// How an effect's coefficient goes with the wind, and the dimensionless derivative that it is.
fn in_wind(d: &Diagnosis, id: &str) -> String {
    let mut out = String::new();
    if let Some(grows) = d.grows_as.get(id) {
        let GrowsAs { power, chi_squared, degrees } = grows;
        let holds = if grows.holds() { "holds" } else { "does not hold" };
        let _ = writeln!(
            out,
            "  that it goes with V^{power} {holds}: chi squared {chi_squared:.1} of {degrees} degrees of freedom"
        );
    }
    if let Some(Dimensionless { name, quantity }) = d.dimensionless.get(id) {
        let _ = writeln!(out, "  {name} = {quantity} about the middle axis");
    }
    out
}

/// The numbers of each release.
fn by_release(d: &Diagnosis, measurand: &Measurand) -> String {
    let mut out = String::new();
    let rest = format!("rest ({})", measurand.unit());
    let mut rows = bare(&["record", "wn (rad/s)", "zeta", &rest, "over noise"]);
    for r in &d.releases {
        rows.add_row([
            r.file.clone(),
            r.modal.natural_frequency_rad_s.to_string(),
            r.modal.damping_ratio.to_string(),
            r.rest_angle_deg.map_or("-".to_owned(), |rest| rest.to_string()),
            format!("{:.3}", r.residual_over_noise),
        ]);
    }
    if d.only().is_none() {
        let _ = writeln!(out, "\n{rows}");
    }
    for r in &d.releases {
        let rows = amplitude_rows(measurand, &r.at_amplitude);
        let roll = r.roll.as_ref().map_or(String::new(), |roll| roll::text(roll, measurand));
        for of_it in [rows, roll].iter().filter(|rows| !rows.is_empty()) {
            match d.only() {
                Some(_) => out.push_str(of_it),
                None => out.push_str(&format!("  {}:\n{of_it}\n", r.file)),
            }
        }
    }
    for (effect, _) in d.sharing.iter().filter(|(_, how)| how.starts_with("each")) {
        for r in &d.releases {
            for (name, value) in r.parameters.iter().filter(|(n, _)| n.starts_with(effect)) {
                let _ = writeln!(out, "  {}: {}", r.file, parameter(measurand, name, value));
            }
        }
    }
    out
}

/// For each accepted effect those that do as well in its place, and the release that would separate them.
fn groups(pairs: &[[Effect; 2]], place: &str, measurand: &Measurand) -> String {
    let mut out = String::new();
    for of_one in pairs.chunk_by(|a, b| a[0] == b[0]) {
        let [accepted, _] = &of_one[0];
        let mut names: Vec<&str> = of_one.iter().map(|[_, other]| other.id()).collect();
        let last = names.pop().unwrap_or_default();
        names.insert(0, accepted.id());
        let _ = writeln!(
            out,
            "\n  {} and {last} cannot be distinguished in {place}; what would: {}",
            names.join(", "),
            accepted.card_in(measurand).release
        );
    }
    out
}

fn coefficient_rows(d: &Diagnosis, id: &str) -> comfy_table::Table {
    let rows = d.coefficients.get(id).map_or(&[][..], Vec::as_slice);
    let title = rows.first().map_or(String::new(), |c| format!("{} ({})", c.name, c.unit));
    let mut table = bare(&["  spring", "axis", "V (m/s)", &title]);
    for c in rows {
        table.add_row([
            format!("  {}", c.condition.spring),
            c.condition.axis.to_string(),
            format!("{:.3}", c.condition.wind_speed_m_s),
            c.quantity.to_string(),
        ]);
    }
    table
}

fn candidate_rows(d: &Diagnosis, model: &str) -> String {
    let mut rows = bare(&["effect alone", "over noise", "difference of BIC"]);
    for c in d.candidates.iter().take(5) {
        let evidence =
            if c.converged { format!("{:.1}", c.delta_bic) } else { "not converged".to_string() };
        rows.add_row([c.effect.to_string(), format!("{:.3}", c.residual_over_noise), evidence]);
    }
    let of = match (d.only().is_some(), d.held_out) {
        (false, _) => &format!("in the releases, eight at most, that {model} explains worst"),
        (true, HeldOut::Pieces) => BIC_OF_PIECES,
        (true, _) => BIC_OF_WHOLE,
    };
    format!("{rows}\n{of}")
}

fn derivative_rows(derivatives: &BeforeAndAfter) -> comfy_table::Table {
    let mut rows = bare(&["spring", "V (m/s)", "", "Cn_beta", "Cn_r", "Cy_beta", "Cy_r"]);
    let shown = |q: Option<Quantity>| q.map_or("-".to_owned(), |q| format!("{q:.4}"));
    for (before, after) in derivatives.before.iter().zip(&derivatives.after) {
        for (when, Point { spring, at, wind_speed_m_s, cn_beta, cn_r, cy_beta, cy_r, .. }) in
            [("before", before), ("after", after)]
        {
            rows.add_row([
                [spring.clone(), at.to_string()].join(" ").trim_end().to_owned(),
                format!("{wind_speed_m_s:.3}"),
                when.to_owned(),
                shown(Some(*cn_beta)),
                shown(Some(*cn_r)),
                shown(*cy_beta),
                shown(*cy_r),
            ]);
        }
    }
    rows
}

fn step_rows(measurand: &Measurand, steps: &[Step], model: &str) -> comfy_table::Table {
    let first = model.trim_start_matches("the ");
    let residual = format!("residual ({})", measurand.unit());
    let mut rows = bare(&["model", &residual, "over noise", "held out over noise"]);
    for step in steps {
        rows.add_row([
            step.added.clone().map_or(first.to_owned(), |e| format!("+ {e}")),
            sized(measurand, step.residual_rms_deg, 4),
            format!("{:.3}", step.residual_over_noise),
            format!("{:.3}", step.held_out_over_noise),
        ]);
    }
    rows
}

/// An effect's card, to be read.
fn card(effect: &Effect, measurand: &Measurand) -> String {
    let card = effect.card_in(measurand);
    format!(
        "\n{}: {}\n  usual cause: {}\n  fingerprint: {}\n  to confirm: {}\n  to remove: {}\n",
        card.title, card.formula, card.cause, card.fingerprint, card.confirm, card.remove
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_that_cannot_be_distinguished_are_said_as_one_group() {
        use Effect::{CoulombFriction, CubicStiffness, FreePlay, QuinticStiffness};
        let pairs = [[CubicStiffness, QuinticStiffness], [CubicStiffness, FreePlay]];
        let said = groups(&pairs, "this record", &Measurand::default());
        assert!(said.contains("cubic_stiffness, quintic_stiffness and free_play cannot"), "{said}");
        assert!(said.contains(CubicStiffness.card().release), "{said}");
        assert_eq!(said.trim().lines().count(), 1);
        let two = [[CubicStiffness, QuinticStiffness], [CoulombFriction, FreePlay]];
        assert_eq!(groups(&two, "this record", &Measurand::default()).trim().lines().count(), 3);
    }
}
