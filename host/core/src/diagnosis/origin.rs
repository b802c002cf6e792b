//! Where an effect comes from: the rig, the air, or undecided; and which releases share its coefficient.

use crate::derivatives::campaign::ReleaseEntry;
use crate::derivatives::condition::is_same_speed;
use crate::effects::Effect;
use crate::quantity::{chi_squared, weighted_mean, Quantity, CHANCE};
use serde::Serialize;
use std::fmt;
use yawrig_shared::axis::Axis;

/// The condition of a campaign's release.
#[derive(Clone, Debug, Serialize)]
pub struct Condition {
    /// Name of the springs.
    pub spring: String,
    /// The axis that the model turns about.
    pub axis: Axis,
    /// 0: wind off.
    pub wind_speed_m_s: f64,
}

impl Condition {
    pub(super) fn new(release: &ReleaseEntry) -> Self {
        let ReleaseEntry { spring, axis, wind_speed_m_s, .. } = release;
        Self { spring: spring.clone(), axis: *axis, wind_speed_m_s: *wind_speed_m_s }
    }
}

/// A coefficient this many standard uncertainties from zero is there.
const THERE: f64 = 5.0;
/// A relative difference as small as this is the same coefficient, however well both are known: the model of
/// an effect is not exact.
const SAME_STRENGTH: f64 = 0.10;
/// Wind off, a coefficient that is not known to be there, and is smaller than this share of the wind-on one, is not.
const ABSENT: f64 = 0.5;

/// Where an effect comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// There with the wind off, and the same with it on.
    Mechanical,
    /// Not there with the wind off, there with it on, and at several speeds growing, or as its dimension asks.
    Aerodynamic,
    /// Neither shows.
    Undecided,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mechanical => "mechanical",
            Self::Aerodynamic => "aerodynamic",
            Self::Undecided => "undecided",
        })
    }
}

/// An effect's coefficient in one condition.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    pub(super) condition: Condition,
    pub(super) coefficient: Quantity,
}

impl Seen {
    pub(super) fn is_on(&self) -> bool {
        self.condition.wind_speed_m_s > 0.0
    }
    pub(super) fn is_of(&self, condition: &Condition) -> bool {
        let (a, b) = (&self.condition, condition);
        a.spring == b.spring
            && a.axis == b.axis
            && is_same_speed(a.wind_speed_m_s, b.wind_speed_m_s)
    }
    fn is_partner(&self, other: &Self) -> bool {
        let (a, b) = (&self.condition, &other.condition);
        a.spring == b.spring && a.axis == b.axis
    }
    pub(super) fn is_as_fast(&self, other: &Self) -> bool {
        is_same_speed(self.condition.wind_speed_m_s, other.condition.wind_speed_m_s)
    }
}

/// Off and on of the same springs and axes, weighted by how well each pair's difference is known; and the
/// difference, its uncertainty widened where the pairs scatter more than theirs.
fn paired(seen: &[Seen]) -> Option<[Quantity; 3]> {
    let pairs: Vec<(Quantity, Quantity)> = seen
        .iter()
        .filter(|on| on.is_on())
        .flat_map(|on| {
            seen.iter()
                .filter(|off| !off.is_on() && off.is_partner(on))
                .map(|off| (off.coefficient, on.coefficient))
        })
        .filter(|(off, on)| Quantity::new(0.0, off.u.hypot(on.u)).is_known())
        .collect();
    let weights: Vec<f64> =
        pairs.iter().map(|(off, on)| 1.0 / (off.u * off.u + on.u * on.u)).collect();
    let total: f64 = weights.iter().sum();
    let mean = |of: fn(&(Quantity, Quantity)) -> Quantity| {
        let both = || pairs.iter().map(of).zip(&weights);
        let value = both().map(|(q, w)| w * q.value).sum::<f64>() / total;
        let u = both().map(|(q, w)| (w * q.u).powi(2)).sum::<f64>().sqrt() / total;
        Quantity::new(value, u)
    };
    let (off, on) = (mean(|p| p.0), mean(|p| p.1));
    let value = on.value - off.value;
    let chi: f64 = pairs
        .iter()
        .zip(&weights)
        .map(|((off, on), w)| w * (on.value - off.value - value).powi(2))
        .sum();
    let freedom = pairs.len().saturating_sub(1).max(1) as f64;
    let u = total.sqrt().recip() * (chi / freedom).sqrt().max(1.0);
    (!pairs.is_empty()).then(|| [off, on, Quantity::new(value, u)])
}

fn is_there(q: Quantity) -> bool {
    q.value.abs() > THERE * q.u
}

fn is_absent(off: Quantity, on: Quantity) -> bool {
    !is_there(off) && off.value.abs() + 2.0 * off.u < ABSENT * on.value.abs()
}

/// Where `effect` with these coefficients comes from, and why.
pub(super) fn decide(effect: &Effect, seen: &[Seen]) -> (Origin, String) {
    let unit = &effect.parameters()[0].unit;
    let undecided = |why: String| (Origin::Undecided, why);
    if seen.iter().all(|s| s.is_on()) {
        let without = "there is no release with the wind off".to_owned();
        let by_dimension = growth(effect, seen).filter(|growth| growth.off.value.is_finite());
        let Some(Growth { fast, off, words, .. }) = by_dimension else {
            return undecided(without);
        };
        let by_it = format!("{without}; {words}: by its dimension {off} {unit} without wind");
        let is_aerodynamic = is_absent(off, fast) && is_there(fast);
        return (if is_aerodynamic { Origin::Aerodynamic } else { Origin::Undecided }, by_it);
    }
    if !seen.iter().any(Seen::is_on) {
        return undecided("there is no release with the wind on".into());
    }
    let Some([off, on, difference]) = paired(seen) else {
        return undecided("no spring and axis was released with the wind off and on".into());
    };
    let both = format!("{off} {unit} with the wind off, {on} with it on");
    if is_absent(off, on) && is_there(on) {
        return match growth(effect, seen) {
            None => (Origin::Aerodynamic, format!("{both}; one wind speed: growth is not tested")),
            Some(Growth { grows: true, words, .. }) => {
                (Origin::Aerodynamic, format!("{both}; it grows with speed: {words}"))
            }
            Some(Growth { by_dimension: true, words, .. }) => {
                let goes = "within its uncertainty it goes with speed as its dimension asks";
                (Origin::Aerodynamic, format!("{both}; {goes}: {words}"))
            }
            Some(Growth { words, .. }) => {
                undecided(format!("{both}; but it does not grow with speed: {words}"))
            }
        };
    }
    if !is_there(off) {
        return undecided(format!("{both}: too uncertain"));
    }
    let change = 100.0 * difference.value / off.value;
    if !changes_with_wind(seen) {
        return (Origin::Mechanical, format!("{both}: the same ({change:+.1} %)"));
    }
    undecided(format!("{both}: there in both, but not the same ({change:+.1} %)"))
}

/// Whether the same springs and axes have another coefficient with the wind on than with it off.
pub(super) fn changes_with_wind(seen: &[Seen]) -> bool {
    paired(seen).is_some_and(|[off, _, difference]| {
        difference.value.abs() > (CHANCE * difference.u).max(SAME_STRENGTH * off.value.abs())
    })
}

/// A coefficient from the lowest to the highest wind speed.
struct Growth {
    /// Whether it is known to grow.
    grows: bool,
    /// Whether it may go with the power of the speed that its dimension asks for.
    by_dimension: bool,
    /// At the highest speed.
    fast: Quantity,
    /// What it would be without wind, growing by that power: not known where that is none.
    off: Quantity,
    words: String,
}

/// Over the springs and axes released at several speeds; `None` without one.
fn growth(effect: &Effect, seen: &[Seen]) -> Option<Growth> {
    let several = |s: &&Seen| {
        let other = |o: &Seen| o.is_on() && o.is_partner(s) && !o.is_as_fast(s);
        s.is_on() && seen.iter().any(other)
    };
    let on: Vec<&Seen> = seen.iter().filter(several).collect();
    let speeds = || on.iter().map(|s| s.condition.wind_speed_m_s);
    let (slow_m_s, fast_m_s) =
        (speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max));
    let at = |speed: f64| {
        let same = on.iter().filter(|s| is_same_speed(s.condition.wind_speed_m_s, speed));
        weighted_mean(same.map(|s| s.coefficient))
    };
    let (slow, fast) = (at(slow_m_s)?, at(fast_m_s)?);
    let grown = fast.value.abs() - slow.value.abs();
    let one_sign = fast.value * slow.value >= 0.0 || slow.value.abs() < CHANCE * slow.u;
    let grows = grown > CHANCE * fast.u.hypot(slow.u) && one_sign;
    let asked = effect.wind_power(&[]).map_or(f64::NAN, |p| (fast_m_s / slow_m_s).powf(p));
    let off_it = (fast.value - asked * slow.value).abs();
    let by_dimension = off_it <= CHANCE * fast.u.hypot(asked * slow.u);
    let off = Quantity::new(
        (asked * slow.value - fast.value) / (asked - 1.0),
        (asked * slow.u).hypot(fast.u) / (asked - 1.0).abs(),
    );
    let words = format!("{slow} at {slow_m_s:.3} m/s, {fast} at {fast_m_s:.3} m/s");
    Some(Growth { grows, by_dimension, fast, off, words })
}

/// Which releases have one coefficient.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    /// In words.
    pub(super) name: &'static str,
    /// Of each release; `None`: without the effect.
    pub(super) groups: Vec<Option<usize>>,
}

/// The sharing where no two releases have a coefficient in common.
pub(super) const OWN: &str = "each release its own";
/// Those where all have one: of the rig, or of the wind.
const ONE: &str = "one for all releases";
const ONE_WIND_ON: &str = "one for all wind-on releases";
/// Those where all at one wind speed have one.
const EACH_SPEED_ON: &str = "one for each wind speed, none with it off";

impl Plan {
    /// One for all releases, or of an aerodynamic effect for those with the wind on. What belongs to a
    /// release is its own in any group.
    pub(super) fn of_all(origin: Origin, is_on: impl Iterator<Item = bool>) -> Self {
        let aerodynamic = origin == Origin::Aerodynamic;
        let groups = is_on.map(|is_on| (is_on || !aerodynamic).then_some(0)).collect();
        Self { name: if aerodynamic { ONE_WIND_ON } else { ONE }, groups }
    }

    /// One for each wind speed and axis, none with the wind off.
    pub(super) fn of_each_wind(releases: &[ReleaseEntry]) -> Self {
        let groups = groups(
            releases,
            |release| release.wind_speed_m_s > 0.0,
            |a, b| a.axis == b.axis && is_same_speed(a.wind_speed_m_s, b.wind_speed_m_s),
        );
        Self { name: EACH_SPEED_ON, groups }
    }

    /// The same releases with nothing in common.
    pub(super) fn of_each(&self) -> Self {
        let groups = self.groups.iter().enumerate().map(|(i, group)| group.map(|_| i)).collect();
        Self { name: OWN, groups }
    }
}

/// Of `all` those that are in, by the first that is the same.
fn groups<T>(
    all: &[T],
    is_in: impl Fn(&T) -> bool,
    same: impl Fn(&T, &T) -> bool,
) -> Vec<Option<usize>> {
    let mut firsts: Vec<&T> = Vec::new();
    let mut group = |one| {
        firsts.iter().position(|first| same(first, one)).unwrap_or_else(|| {
            firsts.push(one);
            firsts.len() - 1
        })
    };
    all.iter().map(|one| is_in(one).then(|| group(one))).collect()
}

/// The fewest coefficients that tell the releases' own (in the order of `seen`, one for each) apart no worse
/// than many do: sum of squared misfits over their uncertainties, and ln(`effective`) for each coefficient.
/// An aerodynamic effect is left out of the wind-off releases.
pub(super) fn plan(origin: Origin, seen: &[Seen], effective: f64) -> Plan {
    let aerodynamic = origin == Origin::Aerodynamic;
    type Same = fn(&Seen, &Seen) -> bool;
    let levels: [(&str, &str, Same); 5] = [
        (ONE, ONE_WIND_ON, |_, _| true),
        ("one for each axis", "one for each axis with the wind on", |a, b| {
            a.condition.axis == b.condition.axis
        }),
        ("one for each wind speed", EACH_SPEED_ON, Seen::is_as_fast),
        (
            "one for each spring and axis",
            "one for each spring and axis with the wind on",
            Seen::is_partner,
        ),
        ("one for each condition", "one for each condition with the wind on", |a, b| {
            a.is_partner(b) && a.is_as_fast(b)
        }),
    ];
    let cost = |groups: &[Option<usize>]| {
        let count = groups.iter().flatten().max().map_or(0, |g| g + 1);
        let misfit = (0..count).map(|g| {
            let its = seen.iter().zip(groups).filter(|(_, k)| **k == Some(g));
            let its: Vec<Quantity> = its.map(|(s, _)| s.coefficient).collect();
            let mean = weighted_mean(its.iter().copied()).map_or(0.0, |q| q.value);
            chi_squared(its, mean)
        });
        crate::bic::of_deviance(misfit.sum(), effective, count)
    };
    let plans = levels.into_iter().map(|(name, on_name, same)| {
        let groups = groups(seen, |s| s.is_on() || !aerodynamic, same);
        Plan { name: if aerodynamic { on_name } else { name }, groups }
    });
    plans
        .map(|plan| (cost(&plan.groups), plan))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, plan)| plan)
        .expect("five plans")
}

#[cfg(test)]
mod tests {
    use super::*;
    use yawrig_shared::axis::Axis;

    fn seen(spring: &str, axis: Axis, wind_speed_m_s: f64, value: f64, u: f64) -> Seen {
        let condition = Condition { spring: spring.into(), axis, wind_speed_m_s };
        Seen { condition, coefficient: Quantity::new(value, u) }
    }

    /// Off, at 10 m/s and at 14 m/s on two springs and both axes.
    fn campaign(off: f64, slow: f64, fast: f64, u: f64) -> Vec<Seen> {
        let mut all = Vec::new();
        for (spring, wiggle) in [("K1", 0.6), ("K5", -0.5)] {
            for axis in Axis::BOTH {
                all.push(seen(spring, axis, 0.0, off + wiggle * u, u));
                all.push(seen(spring, axis, 10.0, slow - wiggle * u, u));
                all.push(seen(spring, axis, 14.0, fast + 0.5 * wiggle * u, u));
            }
        }
        all
    }

    #[test]
    fn each_origin_is_recognised_by_its_own_sign() {
        let origin = |seen: &[Seen]| decide(&Effect::CubicStiffness, seen).0;
        assert_eq!(origin(&campaign(0.1, 0.1, 0.1, 0.002)), Origin::Mechanical);
        assert_eq!(origin(&campaign(0.0, 0.1, 0.14, 0.002)), Origin::Aerodynamic);
        let one_speed: Vec<Seen> = campaign(0.0, 0.1, 0.0, 0.002)
            .into_iter()
            .filter(|s| s.condition.wind_speed_m_s < 14.0)
            .collect();
        assert_eq!(origin(&one_speed), Origin::Aerodynamic);
        // Growing as its dimension asks, though not known to grow at all.
        assert_eq!(origin(&campaign(0.0, 0.1, 0.14, 0.019)), Origin::Aerodynamic);
        // Not growing; in both but changed; too uncertain; off only; on only; never on one spring.
        assert_eq!(origin(&campaign(0.0, 0.1, 0.1, 0.002)), Origin::Undecided);
        assert_eq!(origin(&campaign(0.1, 0.15, 0.2, 0.002)), Origin::Undecided);
        assert_eq!(origin(&campaign(0.1, 0.1, 0.1, 0.08)), Origin::Undecided);
        assert_eq!(origin(&[seen("K1", Axis::Mid, 0.0, 0.1, 0.001)]), Origin::Undecided);
        assert_eq!(origin(&[seen("K1", Axis::Mid, 9.0, 0.1, 0.001)]), Origin::Undecided);
        // Of two speeds on, where the square of the speed leaves nothing without wind, and where it leaves more.
        let on = |fast| campaign(0.0, 0.1, fast, 0.002).into_iter().filter(Seen::is_on);
        assert_eq!(origin(&on(0.196).collect::<Vec<_>>()), Origin::Aerodynamic);
        assert_eq!(origin(&on(0.14).collect::<Vec<_>>()), Origin::Undecided);
        assert_eq!(origin(&on(0.1).collect::<Vec<_>>()), Origin::Undecided);
        let apart =
            [seen("K1", Axis::Mid, 9.0, 0.1, 0.001), seen("K2", Axis::Mid, 0.0, 0.1, 0.001)];
        assert_eq!(origin(&apart), Origin::Undecided);
    }

    #[test]
    fn a_negative_coefficient_is_judged_alike() {
        assert_eq!(
            decide(&Effect::CubicStiffness, &campaign(-0.1, -0.1, -0.1, 0.002)).0,
            Origin::Mechanical
        );
        assert_eq!(
            decide(&Effect::CubicStiffness, &campaign(0.0, -0.1, -0.14, 0.002)).0,
            Origin::Aerodynamic
        );
    }

    #[test]
    fn releases_share_as_much_as_their_coefficients_allow() {
        let groups = |origin, seen: &[Seen]| plan(origin, seen, 1e4);
        let same = groups(Origin::Mechanical, &campaign(0.1, 0.1, 0.1, 0.002));
        assert!(same.groups.iter().all(|g| *g == Some(0)), "{same:?}");
        let mut axes = campaign(0.1, 0.1, 0.1, 0.001);
        let front = axes.iter_mut().filter(|s| s.condition.axis == Axis::Front);
        front.for_each(|s| s.coefficient.value /= 1.2);
        assert_eq!(groups(Origin::Mechanical, &axes).name, "one for each axis");
        let wind = groups(Origin::Aerodynamic, &campaign(0.0, 0.1, 0.14, 0.001));
        assert_eq!(wind.name, "one for each wind speed, none with it off");
        assert_eq!(wind.groups[..3], [None, Some(0), Some(1)]);
        let mut springs = campaign(0.1, 0.1, 0.1, 0.001);
        let soft = springs.iter_mut().filter(|s| s.condition.spring == "K5");
        soft.for_each(|s| s.coefficient.value *= 3.0);
        assert_eq!(groups(Origin::Mechanical, &springs).name, "one for each spring and axis");
    }
}
