//! One record as two releases.

use super::super::campaign::Campaign;
use super::super::doubt::{Doubt, Kind};
use crate::record::faults::{copies, Facts};

pub(super) fn doubts(campaign: &Campaign, facts: &[Facts]) -> Vec<Doubt> {
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
    all
}
