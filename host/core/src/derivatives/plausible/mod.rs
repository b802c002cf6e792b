//! Whether a campaign can be true: what its file says, what its records hold and what was identified in them,
//! held against each other. All of it before any derivative is computed.
//!
//! Each release has a natural frequency that the others foretell: its spring's stiffness on the line through
//! all springs, the other axis, the wind's share on the other springs, its repeats (`frame`). Where one is
//! off by more than its own stated uncertainty and the scatter of sound campaigns allow, it is asked what
//! would put it right: which two records exchanged, which unit (`explain`). What the numbers say by
//! themselves is in `ranges` and `inertia`.

mod explain;
mod frame;
mod inertia;
mod mistake;
pub mod ranges;

use super::campaign::Campaign;
use super::condition::Identified;
pub use super::doubt::{Doubt, Kind};
use crate::record::faults::{self, Facts, FaultKind};

/// All that is doubtful about a campaign, errors first, then in the order of its releases. `facts` are those
/// of each release's record, or none where there is no record.
pub fn doubts(campaign: &Campaign, identified: &[Identified], facts: &[Facts]) -> Vec<Doubt> {
    let mut all = ranges::doubts(campaign);
    all.extend(faults(campaign, facts));
    all.extend(copies(campaign, facts));
    // A number that cannot be, or a record that is another's, makes nonsense of all that follows.
    if !all.iter().any(|doubt| doubt.is_error) {
        let frame = frame::Frame::new(campaign, identified);
        all.extend(explain::doubts(campaign, &frame));
        all.extend(inertia::doubts(campaign, &frame));
    }
    for doubt in &mut all {
        let of_release = doubt.release.and_then(|index| campaign.release.get(index));
        let mut accepted = campaign
            .accept
            .iter()
            .chain(of_release.into_iter().flat_map(|release| &release.accept));
        doubt.accepted = !doubt.is_error && accepted.any(|kind| *kind == doubt.kind);
    }
    all.sort_by_key(|doubt| (!doubt.is_error, doubt.release));
    all
}

fn faults(campaign: &Campaign, facts: &[Facts]) -> Vec<Doubt> {
    let one = |(index, of): (usize, &Facts)| {
        let file = campaign.release[index].file.clone();
        of.faults.clone().into_iter().map(move |fault| {
            let kind = match fault.kind {
                FaultKind::Clipped => Kind::Clipped,
                FaultKind::DeadSpot => Kind::DeadSpot,
                FaultKind::LostSamples => Kind::LostSamples,
            };
            Doubt::new(kind, format!("{file}: {}", fault.message), fault.evidence).at(index, "file")
        })
    };
    facts.iter().enumerate().flat_map(one).collect()
}

/// One record as two releases.
fn copies(campaign: &Campaign, facts: &[Facts]) -> Vec<Doubt> {
    let one = |&(earlier, later): &(usize, usize)| {
        let [a, b] = [earlier, later].map(|index| &campaign.release[index].file);
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
        doubt.at(later, "file")
    };
    faults::copies(facts).iter().map(one).collect()
}
