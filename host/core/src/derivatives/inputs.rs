//! Everything the derivatives are computed from, as numbers that can each be changed to see what follows.

use super::alike::alike;
use super::campaign::Campaign;
use super::condition::{Condition, Setting};
use super::line::{self, Point, StraightLine};
use super::repeats::Mean;
use super::table::{Budget, PARTNER_SPEED};
use std::collections::HashMap;
use yawrig_shared::axis::Axis;
use yawrig_shared::derivatives::{
    inertia_kg_m2, reduced_frequency, side_force, torsional_stiffness_nm, Model, Wind,
    YawDerivatives,
};
use yawrig_shared::modal::Modal;

/// Where a standard uncertainty comes from: its share in the budget.
type Source = fn(&mut Budget) -> &mut f64;

/// What is computed for each point: per radian, NaN where the front axis was not measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointValues {
    pub(crate) reduced_frequency: f64,
    pub(crate) mid: YawDerivatives,
    pub(crate) front: YawDerivatives,
    pub(crate) cy_beta: f64,
    pub(crate) cy_r: f64,
}

/// What is computed from the numbers.
pub(super) struct Outputs {
    /// By axis; NaN where it is not known.
    pub(super) inertia_kg_m2: [f64; 2],
    /// One for each place.
    pub(super) points: Vec<PointValues>,
}

/// Which conditions belong together, as indices into the list of conditions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(crate) on: usize,
    pub(crate) off: usize,
}

/// A wind-on condition at the middle axis and, where there is one, its partner at the front axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(crate) mid: Pair,
    pub(crate) front: Option<Pair>,
}

/// The numbers.
#[derive(Clone, Debug)]
pub(super) struct Inputs {
    /// wn in rad/s and 2 zeta wn in rad/s of each condition.
    natural_frequency_rad_s: Vec<f64>,
    damping_rad_s: Vec<f64>,
    wind_speed_m_s: Vec<f64>,
    /// Of each spring, in the order of `springs`.
    stiffness_n_per_m: Vec<f64>,
    spring_arm_m: f64,
    axis_offset_m: f64,
    /// Of the campaign, and of each condition over it.
    density_kg_m3: f64,
    density_ratio: Vec<f64>,
    model: Model,
    /// By axis: given in the campaign instead of taken from the line.
    known_inertia_kg_m2: [Option<f64>; 2],
    /// By axis: added to the line's slope for the points' scatter beyond their uncertainties.
    slope_shift_kg_m2: [f64; 2],
}

/// A change of one number by so much.
type Change = Box<dyn Fn(&mut Inputs, f64)>;

/// One number's standard uncertainty and how to change it.
pub(super) struct Uncertain {
    pub(crate) source: Source,
    pub(crate) u: f64,
    pub(crate) change: Change,
}

impl Uncertain {
    fn new(source: Source, u: f64, change: impl Fn(&mut Inputs, f64) + 'static) -> Self {
        Self { source, u, change: Box::new(change) }
    }
}

/// The campaign's structure, which no uncertainty changes.
pub(super) struct Layout {
    pub(crate) places: Vec<Place>,
    /// Name of each spring.
    springs: Vec<String>,
    /// By axis, for each wind-off condition: the condition, its spring, u(wn^2) and u(Kr).
    lines: [Vec<(usize, usize, f64, f64)>; 2],
}

impl Layout {
    pub(super) fn new(campaign: &Campaign, conditions: &[Condition]) -> Self {
        // The nearest speed: the coefficients are made with each condition's own.
        let settings: Vec<&Setting> = conditions.iter().map(|c| &c.setting).collect();
        let find = |like: &Setting, axis: Axis| {
            let off = |i: usize| (settings[i].wind_speed_m_s - like.wind_speed_m_s).abs();
            (0..settings.len())
                .filter(|&i| settings[i].spring == like.spring && settings[i].axis == axis)
                .filter(|&i| off(i) <= PARTNER_SPEED * like.wind_speed_m_s)
                .filter(|&i| settings[i].at == like.at)
                .min_by(|&i, &j| off(i).total_cmp(&off(j)))
        };
        let pair = |on: usize| {
            let c = settings[on];
            let is_its = |(_, off): &(usize, &&Setting)| {
                (&off.spring, off.axis, off.wind_speed_m_s) == (&c.spring, c.axis, 0.0)
            };
            let offs = settings.iter().enumerate().filter(is_its);
            Some(Pair { on, off: c.at.reference(offs.map(|(i, off)| (i, &off.at)))? })
        };
        let places = (0..settings.len())
            .filter(|&i| settings[i].axis == Axis::Mid && settings[i].wind_speed_m_s > 0.0)
            .filter_map(|on| {
                let front = find(settings[on], Axis::Front).and_then(pair);
                Some(Place { mid: pair(on)?, front })
            })
            .collect();
        let mut springs: Vec<String> = Vec::new();
        let mut lines = [Vec::new(), Vec::new()];
        let arm2 = campaign.rig.spring_arm_m.powi(2);
        for (index, condition) in conditions.iter().enumerate() {
            let c = &condition.setting;
            if c.wind_speed_m_s != 0.0 {
                continue;
            }
            let spring = springs.iter().position(|name| *name == c.spring).unwrap_or_else(|| {
                springs.push(c.spring.clone());
                springs.len() - 1
            });
            let entry = &campaign.release[c.releases[0]];
            let wn = condition.natural_frequency_rad_s;
            // A fit of noise-free data claims to be exact; the line needs something to weigh by.
            let u_x = (2.0 * wn.value * wn.u()).max(1e-9 * wn.value * wn.value);
            let u_y = 2.0 * arm2 * entry.spring_stiffness_u_n_per_m.unwrap_or(0.0);
            lines[c.axis as usize].push((index, spring, u_x, u_y));
        }
        Self { places, springs, lines }
    }

    /// The line of Kr in N m/rad against wn_off^2 about an axis; `None` for fewer than two springs.
    pub(super) fn line(&self, inputs: &Inputs, axis: Axis) -> Option<StraightLine> {
        let point = |&(condition, spring, u_x, u_y): &(usize, usize, f64, f64)| {
            let x = inputs.modal(condition).stiffness_rad2_s2();
            Point { x, u_x, y: inputs.torsional_stiffness_nm(spring), u_y }
        };
        line::fit(&self.lines[axis as usize].iter().map(point).collect::<Vec<_>>())
    }

    /// Izz about an axis; `None` where it is neither given nor was the model released with the wind off.
    pub(super) fn inertia_kg_m2(&self, inputs: &Inputs, axis: Axis) -> Option<f64> {
        let index = axis as usize;
        if inputs.known_inertia_kg_m2[index].is_some() {
            return inputs.known_inertia_kg_m2[index];
        }
        let slope = self.line(inputs, axis).map(|line| line.slope).or_else(|| {
            // One spring only: (3.13), as if the line went through the origin.
            let &(condition, spring, ..) = self.lines[index].first()?;
            Some(inertia_kg_m2(inputs.torsional_stiffness_nm(spring), &inputs.modal(condition)))
        })?;
        Some(slope + inputs.slope_shift_kg_m2[index])
    }

    pub(super) fn outputs(&self, inputs: &Inputs) -> Outputs {
        let inertia = |axis| self.inertia_kg_m2(inputs, axis).unwrap_or(f64::NAN);
        let inertia_kg_m2 = Axis::BOTH.map(inertia);
        let values = |place: &Place| inputs.values(place, inertia_kg_m2);
        Outputs { inertia_kg_m2, points: self.places.iter().map(values).collect() }
    }
}

impl Inputs {
    pub(super) fn new(campaign: &Campaign, conditions: &[Condition], layout: &Layout) -> Self {
        let stiffness = |name: &String| campaign.stiffness_of(name).value;
        let each = |of: &dyn Fn(&Condition) -> f64| conditions.iter().map(of).collect();
        Self {
            natural_frequency_rad_s: each(&|c| c.natural_frequency_rad_s.value),
            damping_rad_s: each(&|c| c.damping_rad_s.value),
            wind_speed_m_s: each(&|c| c.setting.wind_speed_m_s),
            stiffness_n_per_m: layout.springs.iter().map(stiffness).collect(),
            spring_arm_m: campaign.rig.spring_arm_m,
            axis_offset_m: campaign.rig.axis_offset_m,
            density_kg_m3: campaign.air.density_kg_m3,
            density_ratio: each(&|c| c.setting.density_kg_m3 / campaign.air.density_kg_m3),
            model: Model {
                length_m: campaign.model.length_m,
                frontal_area_m2: campaign.model.frontal_area_m2,
            },
            known_inertia_kg_m2: campaign.known_inertia().map(|(inertia, _)| inertia),
            slope_shift_kg_m2: [0.0; 2],
        }
    }

    /// Everything there is to compute at one place.
    fn values(&self, place: &Place, inertia_kg_m2: [f64; 2]) -> PointValues {
        let derive = |pair: &Pair, axis: Axis| {
            YawDerivatives::from_releases(
                &self.modal(pair.on),
                &self.modal(pair.off),
                inertia_kg_m2[axis as usize],
                &self.wind(pair.on),
                &self.model,
            )
        };
        let mid = derive(&place.mid, Axis::Mid);
        let nothing = YawDerivatives { cn_beta: f64::NAN, cn_r: f64::NAN };
        let front = place.front.as_ref().map_or(nothing, |pair| derive(pair, Axis::Front));
        let side = |mid, front| side_force(mid, front, self.model.length_m, self.axis_offset_m);
        let on = place.mid.on;
        PointValues {
            reduced_frequency: reduced_frequency(&self.modal(on), &self.wind(on), &self.model),
            mid,
            front,
            cy_beta: side(mid.cn_beta, front.cn_beta),
            cy_r: side(mid.cn_r, front.cn_r),
        }
    }

    pub(super) fn modal(&self, condition: usize) -> Modal {
        let natural_frequency_rad_s = self.natural_frequency_rad_s[condition];
        let damping_ratio = self.damping_rad_s[condition] / (2.0 * natural_frequency_rad_s);
        Modal { natural_frequency_rad_s, damping_ratio }
    }

    pub(super) fn set_modal(&mut self, condition: usize, modal: &Modal) {
        self.natural_frequency_rad_s[condition] = modal.natural_frequency_rad_s;
        self.damping_rad_s[condition] = modal.damping_rad_s();
    }

    pub(super) fn wind(&self, condition: usize) -> Wind {
        Wind {
            density_kg_m3: self.density_kg_m3 * self.density_ratio[condition],
            speed_m_s: self.wind_speed_m_s[condition],
        }
    }

    pub(super) fn model(&self) -> &Model {
        &self.model
    }

    fn torsional_stiffness_nm(&self, spring: usize) -> f64 {
        torsional_stiffness_nm(self.stiffness_n_per_m[spring], self.spring_arm_m)
    }
}

/// Of a condition with wind: the one without that it is held against, and what of what each lacks is alike.
type Alike = HashMap<usize, (usize, [f64; 2])>;

/// Every uncertain number. Those of different conditions are independent of each other, but for a law that
/// the linear model lacks with the wind on and off, the wind speed's too; air density, geometry, springs and
/// arm are common to all they enter.
pub(super) fn uncertain(
    campaign: &Campaign,
    conditions: &[Condition],
    layout: &Layout,
    inputs: &Inputs,
) -> Vec<Uncertain> {
    let pairs = layout.places.iter().flat_map(|place| [Some(place.mid), place.front]).flatten();
    let alike: Alike = pairs
        .map(|Pair { on, off }| (on, (off, alike(&conditions[on], &conditions[off]))))
        .collect();
    let of_conditions = (0..conditions.len()).flat_map(|i| of_condition(conditions, &alike, i));
    let mut all: Vec<Uncertain> = of_conditions.collect();
    all.extend(of_stiffness(campaign, layout, inputs));
    all.extend(of_all_releases(campaign));
    all.retain(|uncertain| uncertain.u > 0.0);
    all
}

/// The numbers of one condition.
fn of_condition(conditions: &[Condition], alike: &Alike, i: usize) -> Vec<Uncertain> {
    let c = &conditions[i];
    let (wn, damping) = (c.natural_frequency_rad_s, c.damping_rad_s);
    // What of a law that the linear model lacks is not in the release without wind as well.
    let own = |mean: Mean, which: usize| {
        let alike = match (c.setting.wind_speed_m_s > 0.0, alike.get(&i)) {
            (true, known) => known.map_or(0.0, |(_, alike)| alike[which]),
            (false, _) => 1.0,
        };
        (mean.u_fit.powi(2) - (alike * mean.u_lacking).powi(2)).max(0.0).sqrt()
    };
    let add_wn = move |x: &mut Inputs, d: f64| x.natural_frequency_rad_s[i] += d;
    let add_damping = move |x: &mut Inputs, d: f64| x.damping_rad_s[i] += d;
    let add_speed = move |x: &mut Inputs, d: f64| x.wind_speed_m_s[i] += d;
    let mut all = vec![
        Uncertain::new(|b| &mut b.fit, own(wn, 0), add_wn),
        Uncertain::new(|b| &mut b.fit, own(damping, 1), add_damping),
    ];
    if c.setting.wind_speed_m_s == 0.0 {
        all.extend([0, 1].map(|which| lacking(conditions, alike, i, which)));
    }
    all.extend([
        Uncertain::new(|b| &mut b.repeatability, wn.u_repeatability, add_wn),
        Uncertain::new(|b| &mut b.repeatability, damping.u_repeatability, add_damping),
        Uncertain::new(|b| &mut b.wind_speed, c.setting.wind_speed_u_m_s, add_speed),
    ]);
    all
}

/// What a wind-off condition and those with wind that are held against it lack of the same law, of wn (0) or
/// 2 zeta wn (1).
fn lacking(conditions: &[Condition], alike: &Alike, off: usize, which: usize) -> Uncertain {
    let u_of = |k: usize| {
        let Condition { natural_frequency_rad_s, damping_rad_s, .. } = &conditions[k];
        [natural_frequency_rad_s, damping_rad_s][which].u_lacking
    };
    let with_wind = alike.iter().filter(|(_, (its, _))| *its == off);
    let together: Vec<(usize, f64)> = with_wind
        .map(|(&on, (_, alike))| (on, alike[which] * u_of(on)))
        .chain([(off, u_of(off))])
        .filter(|(_, u)| *u > 0.0)
        .collect();
    let any = if together.is_empty() { 0.0 } else { 1.0 };
    let add = move |x: &mut Inputs, d: f64| {
        let rates = [&mut x.natural_frequency_rad_s, &mut x.damping_rad_s];
        together.iter().for_each(|(k, u)| rates[which][*k] += d * u);
    };
    Uncertain::new(|b| &mut b.fit, any, add)
}

/// The springs' stiffness and the inertia.
fn of_stiffness(campaign: &Campaign, layout: &Layout, inputs: &Inputs) -> Vec<Uncertain> {
    let of_spring = |(k, name): (usize, &String)| {
        let u = campaign.stiffness_of(name).u;
        Uncertain::new(|b| &mut b.inertia, u, move |x, d| x.stiffness_n_per_m[k] += d)
    };
    let mut all: Vec<Uncertain> = layout.springs.iter().enumerate().map(of_spring).collect();
    let known_u = campaign.known_inertia().map(|(_, u)| u);
    for axis in Axis::BOTH {
        let a = axis as usize;
        if inputs.known_inertia_kg_m2[a].is_some() {
            let add = move |x: &mut Inputs, d: f64| {
                x.known_inertia_kg_m2[a] = x.known_inertia_kg_m2[a].map(|inertia| inertia + d);
            };
            all.push(Uncertain::new(|b| &mut b.inertia, known_u[a].unwrap_or(0.0), add));
        } else if let Some(line) = layout.line(inputs, axis) {
            let excess = (line.scatter_ratio().powi(2) - 1.0).sqrt();
            let add = move |x: &mut Inputs, d: f64| x.slope_shift_kg_m2[a] += d;
            all.push(Uncertain::new(|b| &mut b.inertia, line.u_slope * excess, add));
        }
    }
    all
}

/// What all releases share.
fn of_all_releases(campaign: &Campaign) -> [Uncertain; 6] {
    let Campaign { model, air, rig, .. } = campaign;
    let new = |source: Source, u: Option<f64>, change: fn(&mut Inputs, f64)| {
        Uncertain::new(source, u.unwrap_or(0.0), change)
    };
    // One clock for all releases: every frequency and every damping goes with it.
    let faster = |x: &mut Inputs, d: f64| {
        let rates = x.natural_frequency_rad_s.iter_mut().chain(&mut x.damping_rad_s);
        rates.for_each(|rate| *rate *= 1.0 + d);
    };
    [
        new(|b| &mut b.inertia, rig.spring_arm_u_m, |x, d| x.spring_arm_m += d),
        new(|b| &mut b.air_density, air.density_u_kg_m3, |x, d| x.density_kg_m3 += d),
        new(|b| &mut b.geometry, model.length_u_m, |x, d| x.model.length_m += d),
        new(|b| &mut b.geometry, model.frontal_area_u_m2, |x, d| x.model.frontal_area_m2 += d),
        new(|b| &mut b.geometry, rig.axis_offset_u_m, |x, d| x.axis_offset_m += d),
        new(|b| &mut b.clock, rig.clock_u_ppm.map(|ppm| 1e-6 * ppm), faster),
    ]
}
