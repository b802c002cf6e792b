//! What a campaign says that cannot be, or hardly: a unit mistaken, two records exchanged.

use super::computed::Computed;
use super::inputs::axis_index;
use super::line::{self, Point};
use yawrig_shared::axis::Axis;

/// Mean density in kg/m3 that no model has: lighter than air, denser than any metal.
const POSSIBLE_DENSITY: [f64; 2] = [1.2, 22_600.0];
/// That few have: foam, and steel all through.
const USUAL_DENSITY: [f64; 2] = [8.0, 6000.0];
/// Two springs' Kr / wn^2 that differ by more do not belong to one model.
const LARGEST_RATIO: f64 = 10.0;
/// A spring this far, relative, from the line through the others, and so many times as far as those, disagrees.
const DISAGREES: f64 = 0.1;
const DISAGREES_TIMES: f64 = 5.0;
/// Standard uncertainties by which the wind must have taken damping away.
const SIGNIFICANT: f64 = 5.0;

/// Something that the campaign's numbers do not go with.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubt {
    /// The release whose entry it is about, by index.
    pub release: Option<usize>,
    /// One sentence for the user, without a full stop.
    pub what: String,
    /// No table can come of it.
    pub is_impossible: bool,
}

/// A spring released with the wind off.
struct Spring<'a> {
    name: &'a str,
    release: usize,
    point: Point,
}

impl Spring<'_> {
    /// Kr / wn^2 in kg m2: the inertia if there were no other stiffness.
    fn inertia_kg_m2(&self) -> f64 {
        self.point.y / self.point.x
    }
}

impl Computed<'_> {
    /// Doubts about the campaign, what is impossible first.
    pub fn doubts(&self) -> Vec<Doubt> {
        let mut all: Vec<Doubt> = Vec::new();
        for axis in Axis::BOTH {
            let springs = self.springs(axis);
            all.extend(self.inertia(axis, &springs));
            all.extend(outlier(axis, &springs));
        }
        all.extend(self.damping());
        all.sort_by_key(|doubt| !doubt.is_impossible);
        all
    }

    fn springs(&self, axis: Axis) -> Vec<Spring<'_>> {
        let of = |(condition, point): (usize, Point)| {
            let condition = &self.conditions[condition];
            Spring { name: &condition.spring, release: condition.releases[0], point }
        };
        self.layout.points(&self.inputs, axis).into_iter().map(of).collect()
    }

    /// An inertia that no body has, or hardly any of the model's size.
    fn inertia(&self, axis: Axis, springs: &[Spring]) -> Option<Doubt> {
        let known = self.campaign.inertia.clone().unwrap_or_default();
        if [known.mid_kg_m2, known.front_kg_m2][axis_index(axis)].is_some() {
            return None;
        }
        let inertia = self.layout.inertia_kg_m2(&self.inputs, axis)?;
        let farthest = farthest(springs);
        if inertia.is_nan() || inertia <= 0.0 {
            let spring = farthest.map_or(String::new(), |(spring, middle)| {
                format!(
                    ": the stiffness of spring {} and its frequency with the wind off go with {:.3e} kg m2, the others \
                     with {middle:.3e}",
                    spring.name,
                    spring.inertia_kg_m2()
                )
            });
            return Some(Doubt {
                release: farthest.map(|(spring, _)| spring.release),
                what: format!(
                    "Izz about the {axis} axis comes out as {inertia:.4} kg m2, which no body has{spring}"
                ),
                is_impossible: true,
            });
        }
        // A body of even density over the model's length and frontal area.
        let model = self.inputs.model();
        let density = 12.0 * inertia / (model.length_m.powi(3) * model.frontal_area_m2);
        let outside = |[least, most]: [f64; 2]| !(least..=most).contains(&density);
        let is_impossible = outside(POSSIBLE_DENSITY);
        let like = match density < USUAL_DENSITY[0] {
            true if is_impossible => "lighter than air",
            true => "lighter than most foam",
            false if is_impossible => "denser than any metal",
            false => "as heavy as solid metal",
        };
        outside(USUAL_DENSITY).then(|| Doubt {
            release: None,
            what: format!(
                "Izz about the {axis} axis comes out as {inertia:.3e} kg m2; a body of length {} m and frontal area {} m2 \
                 would have a mean density of {density:.3e} kg/m3, {like}: are spring_arm_m in m and \
                 spring_stiffness_n_per_m in N/m?",
                model.length_m, model.frontal_area_m2
            ),
            is_impossible,
        })
    }

    /// Wind-off releases that are damped more than their wind-on ones.
    fn damping(&self) -> Vec<Doubt> {
        let mut all = Vec::new();
        for place in &self.layout.places {
            for pair in [Some(place.mid), place.front].into_iter().flatten() {
                let (on, off) = (&self.conditions[pair.on], &self.conditions[pair.off]);
                let (damped, free) = (on.damping_rad_s, off.damping_rad_s);
                if free.value - damped.value <= SIGNIFICANT * free.u().hypot(damped.u()) {
                    continue;
                }
                let file = |release: usize| &self.campaign.release[release].file;
                all.push(Doubt {
                    release: Some(off.releases[0]),
                    what: format!(
                        "{}, with the wind off, is damped more than {}, with the wind on: were the two exchanged? (Else \
                         the wind feeds the oscillation: Cn_r > 0.)",
                        file(off.releases[0]),
                        file(on.releases[0])
                    ),
                    is_impossible: false,
                });
            }
        }
        all
    }
}

fn middle(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The spring whose Kr / wn^2 is farthest from the middle of the others, and that middle.
fn farthest<'a>(springs: &'a [Spring<'a>]) -> Option<(&'a Spring<'a>, f64)> {
    if springs.len() < 2 {
        return None;
    }
    let others = |k: usize| {
        let rest = springs.iter().enumerate().filter(|(j, _)| *j != k);
        middle(rest.map(|(_, spring)| spring.inertia_kg_m2()))
    };
    let all = springs.iter().enumerate().map(|(k, spring)| (spring, others(k)));
    let off = |(spring, others): &(&Spring, f64)| (spring.inertia_kg_m2() / others).ln().abs();
    all.max_by(|a, b| off(a).total_cmp(&off(b)))
}

/// A spring that does not go with the others.
fn outlier(axis: Axis, springs: &[Spring]) -> Option<Doubt> {
    let (spring, others) = farthest(springs)?;
    let ratio = spring.inertia_kg_m2() / others;
    let doubt = |spring: &Spring, what: String| {
        Some(Doubt { release: Some(spring.release), what, is_impossible: false })
    };
    if !(1.0 / LARGEST_RATIO..=LARGEST_RATIO).contains(&ratio) {
        return doubt(spring, format!(
            "the stiffness of spring {} is {ratio:.3e} times what its frequency about the {axis} axis and the other \
             springs say: is it in N/m?",
            spring.name
        ));
    }
    if springs.len() < 4 {
        return None;
    }
    // The one without which the others agree best: how far they are from their line, and it.
    let without = |k: usize| {
        let rest =
            || springs.iter().enumerate().filter(move |(j, _)| *j != k).map(|(_, s)| s.point);
        let line = line::fit(&rest().collect::<Vec<_>>())?;
        let miss = |p: Point| (line.intercept + line.slope * p.x) / p.y - 1.0;
        Some((k, miss(springs[k].point), middle(rest().map(|p| miss(p).abs()))))
    };
    let all = (0..springs.len()).filter_map(without);
    let (worst, miss, usual) = all.min_by(|a, b| a.2.total_cmp(&b.2))?;
    if miss.abs() <= DISAGREES.max(DISAGREES_TIMES * usual) {
        return None;
    }
    doubt(&springs[worst], format!(
        "spring {} disagrees with the others about the {axis} axis: by them its stiffness would be {:+.0} % off what is \
         stated",
        springs[worst].name,
        100.0 * miss
    ))
}
