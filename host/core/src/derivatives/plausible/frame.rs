//! What each release's natural frequency has to be by the others, and by how much it is not.

use super::super::at::At;
use super::super::campaign::Campaign;
use super::super::condition::{damping_rad_s, is_same_speed, Identified};
use crate::quantity::Quantity;
use crate::statistics::median;
use yawrig_shared::derivatives::torsional_stiffness_nm;

/// Relative standard uncertainty of a stiffness that states none, and the least of one that does: what
/// springs bought as equal differ by, and what a rig's friction and nonlinearity move the softest spring's
/// frequency by.
pub(super) const STIFFNESS_U: f64 = 0.02;
const STIFFNESS_MIN_U: f64 = 0.01;
/// Other stiffness than the springs', over the softest spring's.
const OTHER_STIFFNESS: f64 = 0.3;
/// Relative, of the ratio of both axes' squared frequencies from spring to spring.
const AXES_U: f64 = 0.01;
/// Relative, of Cn_beta from spring to spring (the thesis's Table 3.3 has 0.09); and absolute.
const WIND_U: f64 = 0.15;
const CN_BETA_U: f64 = 0.02;
/// Relative, of squared frequencies between two releases of one spring, and of repeats.
const FREQUENCY_U: f64 = 5e-4;
const REPEAT_U: f64 = 3e-3;
/// A misfit of so many standard uncertainties does not go with the others.
pub(super) const DISAGREES: f64 = 5.0;

/// A release's squared natural frequency and damping, and what it was made under.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) release: usize,
    pub(super) spring: usize,
    pub(super) axis: usize,
    /// In [`Frame::ats`].
    pub(super) at: usize,
    /// 0: wind off. In air of the campaign's density: the speed of the same dynamic pressure.
    pub(super) speed_m_s: f64,
    /// wn^2 and its standard uncertainty, rad2/s2.
    pub(super) square: f64,
    pub(super) u: f64,
    /// 2 zeta wn, rad/s.
    pub(super) damping: Quantity,
}

/// A campaign as numbers that can be exchanged.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub(super) nodes: Vec<Node>,
    pub(super) springs: Vec<String>,
    /// What else the releases were made under.
    ats: Vec<At>,
    /// Kr of each spring, N m/rad, and its relative standard uncertainty.
    pub(super) stiffness_nm: Vec<f64>,
    stiffness_u: Vec<f64>,
    /// The moment at 1 m/s and a coefficient of 1, N m.
    pub(super) moment_nm: f64,
}

/// What does not go together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// A spring's stiffness and its frequencies about this axis with the wind off.
    Line { axis: usize, spring: usize },
    /// Stiffness besides the springs'.
    Origin { axis: usize },
    /// The frequencies of the two axes.
    Axes { spring: usize },
    /// What the wind does, by node.
    Wind { node: usize },
    /// A node against its repeats.
    Repeat { node: usize },
}

/// By how many standard uncertainties, and by what factor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Misfit {
    pub(super) place: Place,
    pub(super) z: f64,
    /// What it is over what it should be.
    pub(super) ratio: f64,
}

/// Kr = other + inertia wn^2 about an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) other_nm: f64,
    pub(super) inertia_kg_m2: f64,
    pub(super) springs: usize,
}

/// Releases of one spring and axis at one wind speed.
struct Group {
    spring: usize,
    axis: usize,
    at: usize,
    speed_m_s: f64,
    nodes: Vec<usize>,
    square: f64,
}

impl Frame {
    pub(super) fn new(campaign: &Campaign, identified: &[Identified]) -> Self {
        let (model, air) = (&campaign.model, &campaign.air);
        let mut frame = Self {
            nodes: Vec::new(),
            springs: Vec::new(),
            ats: Vec::new(),
            stiffness_nm: Vec::new(),
            stiffness_u: Vec::new(),
            moment_nm: 0.5 * air.density_kg_m3 * model.frontal_area_m2 * model.length_m,
        };
        for (release, (entry, found)) in campaign.release.iter().zip(identified).enumerate() {
            let known = frame.springs.iter().position(|name| *name == entry.spring);
            let spring = known.unwrap_or_else(|| {
                let stiffness = entry.spring_stiffness_n_per_m;
                let stiffness_nm = torsional_stiffness_nm(stiffness, campaign.rig.spring_arm_m);
                frame.springs.push(entry.spring.clone());
                frame.stiffness_nm.push(stiffness_nm);
                let u = entry.spring_stiffness_u_n_per_m.map(|u| u / stiffness);
                frame.stiffness_u.push(u.map_or(STIFFNESS_U, |u| u.hypot(STIFFNESS_MIN_U)));
                frame.springs.len() - 1
            });
            let at = frame.ats.iter().position(|at| *at == entry.at).unwrap_or_else(|| {
                frame.ats.push(entry.at.clone());
                frame.ats.len() - 1
            });
            let density_ratio = campaign.density_kg_m3(entry) / air.density_kg_m3;
            let wn = found.natural_frequency_rad_s;
            frame.nodes.push(Node {
                release,
                spring,
                axis: entry.axis as usize,
                at,
                speed_m_s: entry.wind_speed_m_s * density_ratio.sqrt(),
                square: wn.value * wn.value,
                u: 2.0 * wn.value * wn.u,
                damping: damping_rad_s(found),
            });
        }
        frame
    }

    fn groups(&self) -> Vec<Group> {
        let mut groups: Vec<Group> = Vec::new();
        for (index, node) in self.nodes.iter().enumerate() {
            let Node { spring, axis, at, speed_m_s, .. } = *node;
            let is_it = |g: &&mut Group| {
                (g.spring, g.axis, g.at) == (spring, axis, at)
                    && is_same_speed(g.speed_m_s, speed_m_s)
            };
            match groups.iter_mut().find(is_it) {
                Some(group) => group.nodes.push(index),
                None => {
                    let nodes = vec![index];
                    groups.push(Group { spring, axis, at, speed_m_s, nodes, square: 0.0 });
                }
            }
        }
        for group in &mut groups {
            let squares = group.nodes.iter().map(|&k| self.nodes[k].square);
            group.square = median(&mut squares.collect::<Vec<_>>());
        }
        groups
    }

    /// Squared frequency of a spring about an axis with the wind off.
    fn off(groups: &[Group], axis: usize, spring: usize) -> Option<f64> {
        let is_it = |g: &&Group| (g.axis, g.spring) == (axis, spring) && g.speed_m_s == 0.0;
        groups.iter().find(is_it).map(|group| group.square)
    }

    /// The wind-off group that a wind-on one is held against.
    fn reference<'a>(&self, groups: &'a [Group], on: &Group) -> Option<&'a Group> {
        let is_its =
            |off: &&Group| (off.axis, off.spring, off.speed_m_s) == (on.axis, on.spring, 0.0);
        let offs = groups.iter().filter(is_its).map(|off| (off, &self.ats[off.at]));
        self.ats[on.at].reference(offs)
    }

    /// The line that most springs are on.
    pub(super) fn line(&self, axis: usize) -> Option<Line> {
        self.line_of(&self.groups(), axis)
    }

    fn points(&self, groups: &[Group], axis: usize) -> Vec<(usize, f64)> {
        let of = |spring| Some((spring, Self::off(groups, axis, spring)?));
        (0..self.springs.len()).filter_map(of).collect()
    }

    /// Misfits of the springs, and of no other stiffness, from a line.
    fn off_line(&self, points: &[(usize, f64)], line: &Line) -> (Vec<(usize, f64, f64)>, f64) {
        let of = |&(spring, square): &(usize, f64)| {
            let by_line = (line.other_nm + line.inertia_kg_m2 * square).max(f64::MIN_POSITIVE);
            let ratio = self.stiffness_nm[spring] / by_line;
            (spring, ratio.ln().abs() / self.stiffness_u[spring], ratio)
        };
        (points.iter().map(of).collect(), line.other_nm.abs() / self.other_u_nm(points))
    }

    /// Standard uncertainty of there being no stiffness but the springs', N m/rad.
    fn other_u_nm(&self, points: &[(usize, f64)]) -> f64 {
        let of_springs = points.iter().map(|(spring, _)| self.stiffness_nm[*spring]);
        OTHER_STIFFNESS * of_springs.fold(f64::INFINITY, f64::min)
    }

    fn line_of(&self, groups: &[Group], axis: usize) -> Option<Line> {
        let points = self.points(groups, axis);
        if points.len() < 2 {
            return None;
        }
        let cost = |line: &Line| {
            let (springs, origin) = self.off_line(&points, line);
            let all = springs.iter().map(|(_, z, _)| *z).chain([origin]);
            all.map(|z| (z * z).ln_1p()).sum::<f64>()
        };
        let ends: Vec<(f64, f64)> = std::iter::once((0.0, 0.0))
            .chain(points.iter().map(|&(spring, square)| (square, self.stiffness_nm[spring])))
            .collect();
        let through = |i: usize, j: usize| {
            let ((x0, y0), (x1, y1)) = (ends[i], ends[j]);
            let inertia_kg_m2 = (y1 - y0) / (x1 - x0);
            let other_nm = y0 - inertia_kg_m2 * x0;
            Line { other_nm, inertia_kg_m2, springs: points.len() }
        };
        let pairs = (0..ends.len()).flat_map(|i| (i + 1..ends.len()).map(move |j| (i, j)));
        let lines = pairs.map(|(i, j)| through(i, j));
        let can_be = |l: &Line| l.inertia_kg_m2.is_finite() && l.inertia_kg_m2 > 0.0;
        let best = lines.filter(can_be).min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
        let refined = self.refined(&points, &best);
        Some(refined.filter(|line| can_be(line) && cost(line) < cost(&best)).unwrap_or(best))
    }

    /// The line fitted to those that are near `line`.
    fn refined(&self, points: &[(usize, f64)], line: &Line) -> Option<Line> {
        let (springs, _) = self.off_line(points, line);
        let near = points.iter().zip(&springs).filter(|(_, (_, z, _))| *z < DISAGREES);
        let origin = ([self.other_u_nm(points).recip(), 0.0], 0.0);
        let rows = near.map(|(&(spring, square), _)| {
            let weight = (self.stiffness_u[spring] * self.stiffness_nm[spring]).recip();
            ([weight, weight * square], weight * self.stiffness_nm[spring])
        });
        let [other_nm, inertia_kg_m2] = crate::solver::linear_fit(rows.chain([origin]))?;
        Some(Line { other_nm, inertia_kg_m2, ..*line })
    }

    /// wn_off^2 about the middle axis over that about the front one, as most springs have it.
    pub(super) fn axes_ratio(&self) -> Option<f64> {
        let ratios = self.axes_ratios(&self.groups());
        (!ratios.is_empty()).then(|| most(&ratios))
    }

    fn axes_ratios(&self, groups: &[Group]) -> Vec<(usize, f64)> {
        let of = |spring| {
            let [mid, front] = [0, 1].map(|axis| Self::off(groups, axis, spring));
            Some((spring, mid? / front?))
        };
        (0..self.springs.len()).filter_map(of).collect()
    }

    /// By how much the wind lowers wn^2 about `axis` at 1 m/s, as on most springs, and whether it damps on
    /// most of them.
    pub(super) fn wind(&self, axis: usize) -> Option<(f64, bool)> {
        let groups = self.groups();
        let shifts = self.shifts(&groups, axis, |_| true);
        let damped =
            groups.iter().filter(|g| g.axis == axis && g.speed_m_s > 0.0).filter_map(|on| {
                let off = self.reference(&groups, on)?;
                let [on, off] = [on, off].map(|group| self.nodes[group.nodes[0]].damping.value);
                Some(on > off)
            });
        let (yes, no): (Vec<bool>, Vec<bool>) = damped.partition(|is| *is);
        (!shifts.is_empty()).then(|| (most(&shifts), yes.len() >= no.len()))
    }

    /// Of each wind-on group with its wind-off one: the group, and the shift of wn^2 at 1 m/s.
    fn shifts(
        &self,
        groups: &[Group],
        axis: usize,
        which: impl Fn(usize) -> bool,
    ) -> Vec<(usize, f64)> {
        let is_on = |g: &Group| g.axis == axis && g.speed_m_s > 0.0 && which(g.at);
        let on = groups.iter().enumerate().filter(|(_, g)| is_on(g));
        let of = |(index, g): (usize, &Group)| {
            let off = self.reference(groups, g)?.square;
            Some((index, (off - g.square) / g.speed_m_s.powi(2)))
        };
        on.filter_map(of).collect()
    }

    /// Everything that is held against something else.
    pub(super) fn misfits(&self) -> Vec<Misfit> {
        let groups = self.groups();
        let mut all = Vec::new();
        for axis in [0, 1] {
            if let Some(line) = self.line_of(&groups, axis) {
                let (springs, origin) = self.off_line(&self.points(&groups, axis), &line);
                let of =
                    |(spring, z, ratio)| Misfit { place: Place::Line { axis, spring }, z, ratio };
                all.extend(scaled(springs.into_iter().map(of).collect()));
                all.push(Misfit { place: Place::Origin { axis }, z: origin, ratio: 1.0 });
            }
            for at in 0..self.ats.len() {
                all.extend(scaled(self.of_wind(&groups, axis, at)));
            }
        }
        let ratios = self.axes_ratios(&groups);
        if ratios.len() > 1 {
            let usual = most(&ratios);
            let of = |(spring, ratio): (usize, f64)| {
                let ratio = ratio / usual;
                Misfit { place: Place::Axes { spring }, z: ratio.ln().abs() / AXES_U, ratio }
            };
            all.extend(scaled(ratios.into_iter().map(of).collect()));
        }
        let mut repeats = Vec::new();
        for group in groups.iter().filter(|group| group.nodes.len() > 1) {
            for &node in &group.nodes {
                let Node { square, u, .. } = self.nodes[node];
                let ratio = square / group.square;
                let z = ratio.ln().abs() / (u / square).hypot(2.0 * REPEAT_U);
                repeats.push(Misfit { place: Place::Repeat { node }, z, ratio });
            }
        }
        all.extend(scaled(repeats));
        all
    }

    /// Of the springs at one setting: at another the wind does something else.
    fn of_wind(&self, groups: &[Group], axis: usize, at: usize) -> Vec<Misfit> {
        let shifts = self.shifts(groups, axis, |of| of == at);
        if shifts.len() < 2 {
            return Vec::new();
        }
        let usual = most(&shifts);
        let mut all = Vec::new();
        for (index, _) in shifts {
            let Group { spring, speed_m_s, ref nodes, .. } = groups[index];
            let off = self.reference(groups, &groups[index]).map_or(f64::NAN, |off| off.square);
            let speed2 = speed_m_s * speed_m_s;
            // 1 / Izz by this spring.
            let per_moment = off / self.stiffness_nm[spring];
            for &node in nodes {
                let Node { square, u, .. } = self.nodes[node];
                let shift = (off - square) / speed2;
                let u = (WIND_U * usual)
                    .hypot(CN_BETA_U * self.moment_nm * per_moment)
                    .hypot(u.hypot(FREQUENCY_U * off) / speed2);
                let z = (shift - usual).abs() / u;
                all.push(Misfit { place: Place::Wind { node }, z, ratio: shift / usual });
            }
        }
        all
    }

    /// How many places do not go together, and how badly everything does not, together with the springs that
    /// the wind would have to feed.
    pub(super) fn cost(&self) -> (usize, f64) {
        let misfits = self.misfits();
        let flagged = misfits.iter().filter(|m| m.z > DISAGREES).count();
        let groups = self.groups();
        let fed = groups.iter().filter(|g| g.speed_m_s > 0.0).filter(|on| {
            let Some(off) = self.reference(&groups, on) else { return false };
            let [on, off] = [on, off].map(|group| self.nodes[group.nodes[0]].damping);
            off.value - on.value > DISAGREES * off.u.hypot(on.u)
        });
        let total: f64 = misfits.iter().map(|m| (0.25 * m.z * m.z).ln_1p()).sum();
        (flagged, total + 2.0 * fed.count() as f64)
    }
}

/// The middle of the closest half of their values, at least of two.
fn most(values: &[(usize, f64)]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().map(|(_, value)| *value).collect();
    sorted.sort_by(f64::total_cmp);
    let half = (sorted.len().div_ceil(2)).max(2).min(sorted.len());
    let width = |k: &usize| sorted[k + half - 1] - sorted[*k];
    let best = (0..=sorted.len() - half).min_by(|a, b| width(a).total_cmp(&width(b))).unwrap_or(0);
    sorted[best..best + half].iter().sum::<f64>() / half as f64
}

/// In units of how much sound ones scatter, where that is more than stated.
fn scaled(mut misfits: Vec<Misfit>) -> Vec<Misfit> {
    if misfits.len() < 3 {
        return misfits;
    }
    let mut sizes: Vec<f64> = misfits.iter().map(|m| m.z).collect();
    sizes.sort_by(f64::total_cmp);
    // The 0.4 quantile, which is one of sound ones; a normal's is 0.524 sigma.
    let scatter = sizes[((sizes.len() - 1) as f64 * 0.4) as usize] / 0.524;
    misfits.iter_mut().for_each(|m| m.z /= scatter.max(1.0));
    misfits
}
