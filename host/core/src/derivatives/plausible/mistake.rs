//! Mistakes that a campaign may have been written down with, and the campaign without them.

use super::frame::{Frame, Misfit, Node, Place, DISAGREES};

/// Releases of which every exchange with any other is tried.
const MAX_TRIED: usize = 24;

/// A number so many times too large or too small is no number that is a little off.
const IMPOSSIBLE: f64 = 3.0;

/// A stiffness or a speed stated in this is so many times what it is in the unit asked for.
const STIFFNESS_UNITS: [(f64, &str); 10] = [
    (1e-3, "it is in N/mm"),
    (1e3, "it is in mN/m"),
    (1.0 / 9.806_65, "it is in kgf/m"),
    (9.806_65, "it was multiplied by 9.81"),
    (1e-2, "it is in N/cm"),
    (0.1, "a digit is missing"),
    (10.0, "there is a digit too many"),
    (1.0 / 175.127, "it is in lbf/in"),
    (2.0, "it is of both springs together"),
    (0.5, "it is of half a spring"),
];
const WIND_UNITS: [(f64, &str); 5] = [
    (3.6, "it is in km/h"),
    (1.0 / 3.6, "it is 3.6 times too small"),
    (1.943_844, "it is in knots"),
    (2.236_936, "it is in miles per hour"),
    (0.1, "a digit is missing"),
];
/// A record whose time runs so many times too fast, or too slowly.
const CLOCKS: [f64; 10] = [2.0, 0.5, 10.0, 0.1, 5.0, 0.2, 4.0, 0.25, 1000.0, 0.001];

/// Whether a number is so many times what it should be that no sound one is.
pub(super) fn is_impossible(ratio: f64) -> bool {
    !(1.0 / IMPOSSIBLE..=IMPOSSIBLE).contains(&ratio)
}

/// A mistake that may have been made.
#[derive(Clone, Debug)]
pub(super) enum Mistake {
    Exchanged(Vec<(usize, usize)>),
    Stiffness(usize, usize),
    StiffnessUnit(usize, f64, &'static str),
    WindUnit(Vec<usize>, f64, &'static str),
    Clock(usize, f64),
}

impl Mistake {
    /// The campaign without it.
    pub(super) fn undone(&self, frame: &Frame) -> Frame {
        let mut frame = frame.clone();
        match self {
            Self::Exchanged(pairs) => {
                for &(a, b) in pairs {
                    let (one, other) = (frame.nodes[a], frame.nodes[b]);
                    let found = |is: Node, of: Node| Node {
                        release: of.release,
                        square: of.square,
                        u: of.u,
                        damping: of.damping,
                        ..is
                    };
                    (frame.nodes[a], frame.nodes[b]) = (found(one, other), found(other, one));
                }
            }
            Self::Stiffness(a, b) => frame.stiffness_nm.swap(*a, *b),
            Self::StiffnessUnit(spring, factor, _) => frame.stiffness_nm[*spring] /= factor,
            Self::WindUnit(nodes, factor, _) => {
                nodes.iter().for_each(|&node| frame.nodes[node].speed_m_s /= factor);
            }
            Self::Clock(node, factor) => {
                let node = &mut frame.nodes[*node];
                (node.square, node.u) = (node.square * factor * factor, node.u * factor * factor);
            }
        }
        frame
    }

    /// Whether what it is about goes with the others in the frame without it, a unit or a clock twice as well
    /// as is asked of other misfits: nearly any number is some unit's.
    pub(super) fn fits(&self, undone: &Frame) -> bool {
        let concerns = |place: Place| match (self, place) {
            (Self::WindUnit(nodes, ..), Place::Wind { node }) => nodes.contains(&node),
            (Self::StiffnessUnit(of, ..), Place::Line { spring, .. }) => *of == spring,
            (Self::Clock(node, _), place) => about(undone, place).contains(node),
            _ => false,
        };
        undone.misfits().iter().all(|m| m.z < 0.5 * DISAGREES || !concerns(m.place))
    }

    /// Those of this list that come first are believed first where several would do.
    pub(super) fn order(&self) -> usize {
        match self {
            Self::StiffnessUnit(..) | Self::WindUnit(..) => 0,
            Self::Exchanged(pairs) if pairs.len() == 1 => 1,
            Self::Stiffness(..) => 2,
            Self::Exchanged(_) | Self::Clock(..) => 3,
        }
    }
}

/// Nodes that a misfit is about.
pub(super) fn about(frame: &Frame, place: Place) -> Vec<usize> {
    let all = || frame.nodes.iter().enumerate();
    let of = |is: &dyn Fn(&Node) -> bool| -> Vec<usize> {
        all().filter(|(_, node)| is(node)).map(|(index, _)| index).collect()
    };
    match place {
        Place::Line { axis, spring } => {
            of(&|n| (n.axis, n.spring) == (axis, spring) && n.speed_m_s == 0.0)
        }
        Place::Origin { axis } => of(&|n| n.axis == axis && n.speed_m_s == 0.0),
        Place::Axes { spring } => of(&|n| n.spring == spring && n.speed_m_s == 0.0),
        Place::Wind { node } => {
            let Node { spring, axis, .. } = frame.nodes[node];
            let mut about = of(&|n| (n.axis, n.spring) == (axis, spring) && n.speed_m_s == 0.0);
            about.push(node);
            about
        }
        Place::Repeat { node } => vec![node],
    }
}

pub(super) fn candidates(frame: &Frame, flagged: &[&Misfit]) -> Vec<Mistake> {
    let mut nodes: Vec<usize> = flagged.iter().flat_map(|m| about(frame, m.place)).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let mut springs: Vec<usize> = nodes.iter().map(|&node| frame.nodes[node].spring).collect();
    springs.sort_unstable();
    springs.dedup();
    let mut all = Vec::new();
    let condition = |n: &Node| (n.spring, n.axis, n.at, n.speed_m_s.to_bits());
    for &a in nodes.iter().take(MAX_TRIED) {
        for b in 0..frame.nodes.len() {
            let is_known = nodes.iter().take(MAX_TRIED).any(|node| *node == b) && b < a;
            if !is_known && condition(&frame.nodes[a]) != condition(&frame.nodes[b]) {
                all.push(Mistake::Exchanged(vec![(a, b)]));
            }
        }
        all.extend(CLOCKS.map(|factor| Mistake::Clock(a, factor)));
    }
    for &spring in springs.iter().take(MAX_TRIED) {
        for other in (0..frame.springs.len()).filter(|other| *other != spring) {
            all.push(Mistake::Stiffness(spring, other));
            all.extend([0, 1].map(|axis| groups(frame, (spring, axis), (other, axis))));
        }
        all.push(groups(frame, (spring, 0), (spring, 1)));
        for (factor, unit) in STIFFNESS_UNITS {
            all.push(Mistake::StiffnessUnit(spring, factor, unit));
        }
        let on: Vec<usize> = (0..frame.nodes.len())
            .filter(|&k| frame.nodes[k].spring == spring && frame.nodes[k].speed_m_s > 0.0)
            .collect();
        for (factor, unit) in WIND_UNITS {
            all.push(Mistake::WindUnit(on.clone(), factor, unit));
            for axis in [0, 1] {
                let of_axis = on.iter().copied().filter(|&k| frame.nodes[k].axis == axis);
                all.push(Mistake::WindUnit(of_axis.collect(), factor, unit));
            }
            all.extend(on.iter().map(|&node| Mistake::WindUnit(vec![node], factor, unit)));
        }
    }
    let is_one = |mistake: &Mistake| match mistake {
        Mistake::Exchanged(pairs) => !pairs.is_empty(),
        Mistake::WindUnit(nodes, ..) => !nodes.is_empty(),
        _ => true,
    };
    all.retain(is_one);
    all
}

/// All records of one spring and axis exchanged with those of another, wind off and on.
fn groups(frame: &Frame, one: (usize, usize), other: (usize, usize)) -> Mistake {
    let of = |(spring, axis): (usize, usize)| {
        let all = frame.nodes.iter().enumerate();
        all.filter(move |(_, n)| (n.spring, n.axis) == (spring, axis)).map(|(k, _)| k)
    };
    let mut left: Vec<usize> = of(other).collect();
    let mut pairs = Vec::new();
    for a in of(one) {
        let same = |b: &usize| frame.nodes[*b].speed_m_s == frame.nodes[a].speed_m_s;
        let Some(place) = left.iter().position(same) else { continue };
        pairs.push((a, left.remove(place)));
    }
    Mistake::Exchanged(if pairs.len() > 1 { pairs } else { Vec::new() })
}
