//! Inertias, given and measured, against each other, the model's size and the distance of the axes; and what
//! the wind does against what it does to any body.

use super::super::campaign::Campaign;
use super::super::doubt::{Doubt, Kind};
use super::frame::{Frame, Line, STIFFNESS_U};
use super::mistake::is_impossible;
use yawrig_shared::axis::Axis;
use yawrig_shared::derivatives::side_force;

/// Mean density in kg/m3 that no model has: lighter than air, denser than any metal.
const POSSIBLE_DENSITY: [f64; 2] = [1.2, 22_600.0];
/// That few have: foam, and steel all through.
const USUAL_DENSITY: [f64; 2] = [25.0, 6000.0];
/// Relative standard uncertainty of a spring arm, and of an inertia, that states none.
const ARM_U: f64 = 0.005;
const INERTIA_U: f64 = 0.01;
/// Of what one spring says, which knows of no other stiffness.
const ONE_SPRING_U: f64 = 0.1;
/// Standard uncertainties by which a given inertia disagrees.
const INERTIA_DISAGREES: f64 = 4.0;
/// Radius of gyration over length: of a needle's middle, and of two weights at its ends.
const GYRATION: [f64; 2] = [0.03, 1.0];
/// Cn_beta below which, with Cy_beta below ten times it, no body is usual; and beyond which none is.
const USUAL_COEFFICIENT: [f64; 2] = [0.05, 10.0];

/// kg m2 in one of the unit.
const UNITS: [(f64, &str); 8] = [
    (1e7, "g cm2"),
    (1e6, "kg mm2"),
    (1e9, "g mm2"),
    (1e4, "kg cm2"),
    (1e3, "g m2"),
    (1.0 / 9.806_65, "kgf m s2"),
    (23.730_4, "lb ft2"),
    (0.737_56, "slug ft2"),
];

/// Measured about an axis, with its relative standard uncertainty.
#[derive(Clone, Copy)]
struct Measured {
    kg_m2: f64,
    u: f64,
}

pub(super) fn doubts(campaign: &Campaign, frame: &Frame) -> Vec<Doubt> {
    let given = campaign.known_inertia();
    let measured = [0, 1].map(|axis| measured(campaign, frame, axis));
    let inertia = [0, 1].map(|axis| given[axis].0.or(measured[axis].map(|m| m.kg_m2)));
    let mut all = Vec::new();
    let exchanged = exchanged(&given, &measured);
    all.extend(exchanged.iter().cloned());
    for (axis, name) in Axis::BOTH.into_iter().enumerate() {
        if let ((Some(value), u), Some(by), None) = (given[axis], measured[axis], &exchanged) {
            all.extend(disagreeing(name, value, u, by));
        }
        let is_told = all.iter().any(|doubt| doubt.is_error);
        if let Some(inertia) = inertia[axis].filter(|_| !is_told) {
            all.extend(of_no_body(campaign, name, inertia));
        }
    }
    if all.is_empty() {
        all.extend(apart(campaign, frame, inertia));
        all.extend(coefficients(campaign, frame, inertia));
    }
    all
}

fn measured(campaign: &Campaign, frame: &Frame, axis: usize) -> Option<Measured> {
    let rig = &campaign.rig;
    let arm = rig.spring_arm_u_m.map_or(ARM_U, |u| u / rig.spring_arm_m);
    if let Some(Line { inertia_kg_m2, springs, .. }) = frame.line(axis) {
        let u = 1.5 * STIFFNESS_U / (springs as f64).sqrt();
        // Two springs are no check on other stiffness.
        let u = if springs == 2 { u.hypot(0.5 * ONE_SPRING_U) } else { u };
        return Some(Measured { kg_m2: inertia_kg_m2, u: u.hypot(2.0 * arm) });
    }
    let node = frame.nodes.iter().find(|n| n.axis == axis && n.speed_m_s == 0.0)?;
    let u = ONE_SPRING_U.hypot(2.0 * arm);
    Some(Measured { kg_m2: frame.stiffness_nm[node.spring] / node.square, u })
}

fn field(axis: Axis) -> String {
    format!("inertia.{axis}_kg_m2")
}

fn off(value: f64, u: Option<f64>, by: Measured) -> f64 {
    let own = u.map_or(INERTIA_U, |u| u / value);
    (value / by.kg_m2).ln().abs() / own.hypot(by.u)
}

fn exchanged(
    given: &[(Option<f64>, Option<f64>); 2],
    measured: &[Option<Measured>; 2],
) -> Option<Doubt> {
    let ([(Some(mid), u_mid), (Some(front), u_front)], [Some(by_mid), Some(by_front)]) =
        (*given, *measured)
    else {
        return None;
    };
    let as_given = off(mid, u_mid, by_mid).max(off(front, u_front, by_front));
    let other = off(front, u_front, by_mid).max(off(mid, u_mid, by_front));
    let is_it =
        mid > front && by_mid.kg_m2 < by_front.kg_m2 && other < 0.5 * as_given && as_given > 2.0;
    is_it.then(|| {
        Doubt::new(
            Kind::InertiaExchanged,
            format!(
                "mid_kg_m2 and front_kg_m2 are exchanged, it seems: {mid} and {front} are given, and the wind-off releases say \
                 {:.4} and {:.4}",
                by_mid.kg_m2, by_front.kg_m2
            ),
            format!("{as_given:.1} standard uncertainties as it stands, {other:.1} the other way round"),
        )
        .field(&field(Axis::Mid))
    })
}

fn disagreeing(axis: Axis, value: f64, u: Option<f64>, by: Measured) -> Option<Doubt> {
    let sigma = off(value, u, by);
    if sigma <= INERTIA_DISAGREES {
        return None;
    }
    let ratio = value / by.kg_m2;
    let unit =
        UNITS.iter().find(|(factor, _)| (ratio / factor).ln().abs() < INERTIA_DISAGREES * by.u);
    let is_impossible = is_impossible(ratio);
    let (kind, why) = match unit.filter(|_| is_impossible) {
        Some((_, unit)) => (Kind::InertiaUnit, format!("it is in {unit}, it seems")),
        None => (Kind::InertiaDisagrees, format!("{:+.1} %", 100.0 * (ratio - 1.0))),
    };
    Some(
        Doubt::new(
            kind,
            format!(
                "{axis}_kg_m2 is given as {value}, and the wind-off releases about the {axis} axis say {:.4} kg m2: {why}",
                by.kg_m2
            ),
            format!("{ratio:.4e} times, {sigma:.1} standard uncertainties"),
        )
        .field(&field(axis))
        .error_if(is_impossible),
    )
}

/// An inertia that no body of the model's size has, or hardly any.
fn of_no_body(campaign: &Campaign, axis: Axis, inertia: f64) -> Option<Doubt> {
    // A body of even density over the model's length and frontal area.
    let model = &campaign.model;
    let density = 12.0 * inertia / (model.length_m.powi(3) * model.frontal_area_m2);
    let outside = |[least, most]: [f64; 2]| !(least..=most).contains(&density);
    let is_impossible = outside(POSSIBLE_DENSITY);
    let like = match density < USUAL_DENSITY[0] {
        true if is_impossible => "lighter than air",
        true => "lighter than most foam",
        false if is_impossible => "denser than any metal",
        false => "as heavy as solid metal",
    };
    outside(USUAL_DENSITY).then(|| {
        Doubt::new(
            Kind::InertiaOfNoBody,
            format!(
                "Izz about the {axis} axis comes out as {inertia:.3e} kg m2; a body of length {} m and frontal area {} m2 \
                 would have a mean density of {density:.3e} kg/m3, {like}: are spring_arm_m in m and \
                 spring_stiffness_n_per_m in N/m, not in kgf/m or N/mm?",
                model.length_m, model.frontal_area_m2
            ),
            format!("usual are {} to {} kg/m3", USUAL_DENSITY[0], USUAL_DENSITY[1]),
        )
        .field("rig.spring_arm_m")
        .error_if(is_impossible)
    })
}

/// Izz about the front axis exceeds that about the middle one by m d^2.
fn apart(campaign: &Campaign, frame: &Frame, inertia: [Option<f64>; 2]) -> Option<Doubt> {
    let [Some(mid), Some(front)] = inertia else { return None };
    let length = campaign.model.length_m;
    let offset2 = campaign.rig.axis_offset_m.powi(2);
    // The two axes share their springs: their ratio is known better than either.
    let known = campaign.inertia.is_some() || frame.axes_ratio().is_none();
    let ratio = if known { front / mid } else { frame.axes_ratio()? };
    let u = if known { 0.03 } else { 0.01 };
    let gyration = |ratio: f64| (offset2 / (ratio - 1.0).max(1e-9)).sqrt() / length;
    let (least, most) = (gyration(ratio + 4.0 * u), gyration(ratio - 4.0 * u));
    let is_usual = least <= GYRATION[1] && most >= GYRATION[0];
    (!is_usual && ratio > 1.0).then(|| {
        let mass = mid * (ratio - 1.0) / offset2;
        Doubt::new(
            Kind::OffsetDisagrees,
            format!(
                "Izz about the front axis is {:.4} kg m2 more than about the middle one, which is a mass of {mass:.3e} kg over \
                 the axes' distance of {} m: its radius of gyration would be {:.3} times the model's length; is axis_offset_m right?",
                mid * (ratio - 1.0),
                campaign.rig.axis_offset_m,
                gyration(ratio)
            ),
            format!("usual are {} to {} times the length", GYRATION[0], GYRATION[1]),
        )
        .field("rig.axis_offset_m")
    })
}

/// Coefficients smaller or larger than those of any body.
fn coefficients(campaign: &Campaign, frame: &Frame, inertia: [Option<f64>; 2]) -> Option<Doubt> {
    let of = |axis: usize| {
        let (shift, _) = frame.wind(axis)?;
        Some(shift * inertia[axis]? / frame.moment_nm)
    };
    let mid = of(0)?;
    let [least, most] = USUAL_COEFFICIENT;
    let side = of(1)
        .map(|front| side_force(mid, front, campaign.model.length_m, campaign.rig.axis_offset_m));
    let is_small = mid.abs() < least && side.is_some_and(|side| side.abs() < 10.0 * least);
    (is_small || mid.abs() > most).then(|| {
        let on = frame.nodes.iter().find(|node| node.speed_m_s > 0.0);
        let (first, speed) = on.map_or((0, 0.0), |node| (node.release, node.speed_m_s));
        let side = side.map_or(String::new(), |side| format!(" and Cy_beta as {side:.3}"));
        Doubt::new(
            Kind::CoefficientsUnusual,
            format!(
                "Cn_beta comes out as {mid:.4}{side} per rad, {} than of any usual body: is the wind {speed} m/s and not \
                 km/h, the density in kg/m3, the area in m2?",
                if is_small { "less" } else { "more" }
            ),
            format!("usual is |Cn_beta| from {least} to {most}"),
        )
        .at(first, "wind_speed_m_s")
    })
}
