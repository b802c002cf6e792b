//! What would put right the releases that do not go with the others.

use super::super::campaign::Campaign;
use super::super::doubt::{Doubt, Kind};
use super::frame::{Frame, Misfit, Node, Place, DISAGREES};
use super::mistake::{about, candidates, is_impossible, Mistake};
use super::ranges::{STIFFNESS, WIND};
use yawrig_shared::axis::Axis;

pub(super) fn doubts(campaign: &Campaign, frame: &Frame) -> Vec<Doubt> {
    let mut frame = frame.clone();
    let mut all = Vec::new();
    // One mistake after the other.
    for _ in 0..6 {
        let Some((mistake, told)) = mistake(campaign, &frame) else { break };
        frame = mistake.undone(&frame);
        all.push(told);
    }
    let left: Vec<Misfit> = frame.misfits().into_iter().filter(|m| m.z > DISAGREES).collect();
    all.extend(unexplained(campaign, &frame, &left));
    all.extend(as_a_whole(&frame, &all));
    all
}

/// The mistake without which most goes together.
fn mistake(campaign: &Campaign, frame: &Frame) -> Option<(Mistake, Doubt)> {
    let misfits = frame.misfits();
    let flagged: Vec<&Misfit> = misfits.iter().filter(|m| m.z > DISAGREES).collect();
    if flagged.is_empty() {
        return None;
    }
    let (count, total) = frame.cost();
    let tried = candidates(frame, &flagged).into_iter().filter_map(|mistake| {
        let undone = mistake.undone(frame);
        let (left, cost) = undone.cost();
        // Dear, and only of those that may win.
        let is_better = left < count && mistake.fits(&undone);
        is_better.then(|| (left, mistake.order(), cost, mistake))
    });
    let better = tried.filter(|(_, _, cost, _)| *cost < total - 2.0);
    let (left, _, cost, mistake) =
        better.min_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)))?;
    let worst = flagged.iter().map(|m| m.z).fold(0.0, f64::max);
    let evidence = format!(
        "{count} comparisons do not agree as it stands, the worst by {worst:.0} standard uncertainties, {left} without it; \
         misfit {total:.1} and {cost:.1}"
    );
    let told = told(campaign, frame, &mistake, &evidence);
    Some((mistake, told))
}

fn file<'a>(campaign: &'a Campaign, frame: &Frame, node: usize) -> &'a str {
    &campaign.release[frame.nodes[node].release].file
}

fn files(campaign: &Campaign, frame: &Frame, nodes: impl IntoIterator<Item = usize>) -> String {
    let each = nodes.into_iter().map(|node| file(campaign, frame, node));
    each.collect::<Vec<_>>().join(", ")
}

fn axis_name(axis: usize) -> Axis {
    Axis::BOTH[axis]
}

fn told(campaign: &Campaign, frame: &Frame, mistake: &Mistake, evidence: &str) -> Doubt {
    let file = |node: usize| file(campaign, frame, node);
    let at = |kind, what: String, release: usize, field: &str| {
        Doubt::new(kind, what, evidence).at(release, field)
    };
    let first_of = |spring: usize| {
        let is_it = |n: &&Node| n.spring == spring;
        frame.nodes.iter().filter(is_it).map(|n| n.release).min().unwrap_or(0)
    };
    match mistake {
        Mistake::Exchanged(pairs) => {
            let (a, b) = pairs[0];
            let (one, other) = (frame.nodes[a], frame.nodes[b]);
            let is_wind = (one.speed_m_s == 0.0) != (other.speed_m_s == 0.0);
            let kind = match (one.spring == other.spring, one.axis == other.axis) {
                (true, true) if is_wind => Kind::WindExchanged,
                (true, false) => Kind::AxesExchanged,
                _ => Kind::RecordsExchanged,
            };
            let names = |which: fn(&(usize, usize)) -> usize| {
                files(campaign, frame, pairs.iter().map(which))
            };
            let both = match kind {
                Kind::WindExchanged => "wind off and on, are exchanged",
                Kind::AxesExchanged => "the two axes, are exchanged",
                _ => "are exchanged",
            };
            let what = format!(
                "{} and {}, {both}, it seems: the other way round they go with the other releases",
                names(|pair| pair.0),
                names(|pair| pair.1)
            );
            at(kind, what, one.release.min(other.release), "file")
        }
        Mistake::Stiffness(a, b) => {
            let (one, other) = (&frame.springs[*a], &frame.springs[*b]);
            let what = format!(
                "the stiffnesses of springs {one} and {other} are exchanged, it seems: the other way round they go with the \
                 frequencies of all releases"
            );
            at(Kind::StiffnessExchanged, what, first_of(*a), STIFFNESS.name)
        }
        Mistake::StiffnessUnit(spring, factor, unit) => {
            let release = first_of(*spring);
            let stated = campaign.release[release].spring_stiffness_n_per_m;
            let what = format!(
                "spring {} disagrees with the others: its frequencies ask for {:.5} N/m where {stated} is stated ({}): \
                 {unit}, it seems; is it in N/m?",
                frame.springs[*spring],
                stated / factor,
                campaign.release[release].file
            );
            at(Kind::StiffnessUnit, what, release, STIFFNESS.name).error_if(is_impossible(*factor))
        }
        Mistake::WindUnit(nodes, factor, unit) => {
            let release = frame.nodes[nodes[0]].release;
            let stated = campaign.release[release].wind_speed_m_s;
            let what = format!(
                "the wind of {} is {:.4} m/s by what it does, where {stated} is stated: {unit}, it seems",
                files(campaign, frame, nodes.iter().copied()),
                stated / factor
            );
            at(Kind::WindUnit, what, release, WIND.name)
        }
        Mistake::Clock(node, factor) => {
            let what = format!(
                "{}: its oscillation is {factor} times too slow for the other releases: was it sampled at {factor} times the \
                 rate that it says?",
                file(*node)
            );
            at(Kind::Clock, what, frame.nodes[*node].release, "file")
        }
    }
}

/// What does not go with the others and by no mistake that is known.
fn unexplained(campaign: &Campaign, frame: &Frame, left: &[Misfit]) -> Vec<Doubt> {
    let mut all: Vec<Doubt> = Vec::new();
    let mut told: Vec<usize> = Vec::new();
    // What a spring is doubted for at first explains the rest of it.
    for misfit in left {
        let about = about(frame, misfit.place);
        let Some(&first) = about.last() else { continue };
        let spring = frame.nodes[first].spring;
        let is_of_spring = matches!(misfit.place, Place::Line { .. } | Place::Origin { .. });
        if is_of_spring && told.contains(&spring) {
            continue;
        }
        let file = |node: usize| file(campaign, frame, node);
        let those = files(campaign, frame, about.iter().copied());
        let name = &frame.springs[spring];
        let release = frame.nodes[first].release;
        let percent = 100.0 * (misfit.ratio - 1.0);
        let (kind, field, what) = match misfit.place {
            Place::Line { axis, .. } => {
                told.push(spring);
                (Kind::SpringDisagrees, STIFFNESS.name, format!(
                    "spring {name} disagrees with the others about the {} axis ({those}): its stiffness is {percent:+.0} % off \
                     what its frequency asks for",
                    axis_name(axis)
                ))
            }
            Place::Origin { axis } => (Kind::SpringDisagrees, STIFFNESS.name, format!(
                "the springs' stiffnesses do not go with their frequencies about the {} axis ({those}): there would have to be \
                 more other stiffness than springs",
                axis_name(axis)
            )),
            Place::Axes { .. } => (Kind::AxesDisagree, "file", format!(
                "spring {name}: the frequencies about the two axes ({those}) are {percent:+.1} % off the ratio of the other springs"
            )),
            Place::Wind { node } => {
                let quiet = misfit.ratio.abs() < 0.1;
                let (kind, what) = match quiet {
                    true => (Kind::NoWind, "has the frequency of the wind off: was the wind on?".to_owned()),
                    false => (Kind::WindDisagrees, format!(
                        "says that the wind does {:.2} times what it does on the other springs",
                        misfit.ratio
                    )),
                };
                let off = files(campaign, frame, about[..about.len() - 1].iter().copied());
                (kind, "file", format!("{} beside {off}: {what}", file(node)))
            }
            Place::Repeat { node } => (Kind::RepeatsDisagree, "file", format!(
                "{} is {percent:+.1} % in wn^2 off its repeats",
                file(node)
            )),
        };
        // Within half a percent of wn^2.
        let like = frame.nodes.iter().enumerate().find(|(k, node)| {
            !about.contains(k) && (node.square / frame.nodes[first].square).ln().abs() < 5e-3
        });
        let like = like.map_or(String::new(), |(k, _)| {
            format!("; {} has the frequency of {}", file(first), file(k))
        });
        let evidence = format!("{:.0} standard uncertainties{like}", misfit.z);
        let is_error = is_of_spring && is_impossible(misfit.ratio);
        all.push(Doubt::new(kind, what + &like, evidence).at(release, field).error_if(is_error));
    }
    all
}

/// Mistakes that were made with all records at once.
fn as_a_whole(frame: &Frame, known: &[Doubt]) -> Vec<Doubt> {
    let mut all = Vec::new();
    let has = |kind: Kind| known.iter().any(|doubt| doubt.kind == kind);
    if let Some(ratio) =
        frame.axes_ratio().filter(|ratio| *ratio < 1.0 && !has(Kind::AxesExchanged))
    {
        all.push(
            Doubt::new(
                Kind::AxesExchanged,
                "the model turns more easily about the front axis than about the middle one: are the records, or the \
                 entries axis, of the two exchanged?",
                format!("wn_off^2 about the middle axis is {ratio:.4} times that about the front one; more than 1 is usual"),
            )
            .at(0, "axis"),
        );
    }
    let against =
        |axis: &usize| frame.wind(*axis).is_some_and(|(shift, damps)| shift < 0.0 && !damps);
    if let Some(axis) = (0..2).find(against).filter(|_| !has(Kind::WindExchanged)) {
        let axis = axis_name(axis);
        all.push(
            Doubt::new(
                Kind::WindExchanged,
                format!(
                    "about the {axis} axis the wind stiffens the model and takes its damping away: are the records with the \
                     wind off and on exchanged? (Else the wind feeds the oscillation: Cn_r > 0.)"
                ),
                "Cn_beta < 0 and Cn_r > 0 on most springs",
            )
            .at(0, WIND.name),
        );
    }
    all
}
