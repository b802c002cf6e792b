//! One record as two releases.

use super::super::campaign::Campaign;
use super::super::condition::Identified;
use super::{Doubt, Kind};
use crate::quantity::Quantity;
use crate::record::faults::{copies, Facts};

/// Two releases' results agree by chance to this share of their uncertainty once in thirty thousand pairs.
const SAME: f64 = 0.01;

pub(super) fn doubts(
    campaign: &Campaign,
    identified: &[Identified],
    facts: &[Facts],
) -> Vec<Doubt> {
    let file = |index: usize| &campaign.release[index].file;
    let by_content = copies(facts);
    let mut all = Vec::new();
    for &(earlier, later) in &by_content {
        let (a, b) = (file(earlier), file(later));
        let doubt = match facts[earlier].is_same(&facts[later]) {
            true => Doubt::new(
                Kind::SameContent,
                format!("{b} has the same content as {a}: one record cannot be two releases"),
                "all readings are the same",
            )
            .error_if(true),
            false => Doubt::new(
                Kind::SameRecord,
                format!("{b} holds readings of {a}: a part or a copy of the same record?"),
                "blocks of readings are the same",
            ),
        };
        all.push(doubt.at(later, "file"));
    }
    let close = |a: Quantity, b: Quantity| (a.value - b.value).abs() < SAME * a.u.min(b.u);
    for later in 0..identified.len() {
        let of = &identified[later];
        let earlier = (0..later).find(|&k| {
            close(identified[k].natural_frequency_rad_s, of.natural_frequency_rad_s)
                && close(identified[k].damping_ratio, of.damping_ratio)
        });
        let Some(earlier) =
            earlier.filter(|_| !by_content.iter().any(|(_, known)| *known == later))
        else {
            continue;
        };
        all.push(
            Doubt::new(
                Kind::SameRecord,
                format!(
                    "{} and {} have the same natural frequency and damping ratio: the same record twice?",
                    file(later),
                    file(earlier)
                ),
                format!("they differ by less than {SAME} of their uncertainty"),
            )
            .at(later, "file"),
        );
    }
    all
}
