use super::super::law::testing::at;
use super::*;

/// Where the knots of `part` are, rad or rad/s.
fn knots(law: &MeasuredLaw, part: Part) -> impl Iterator<Item = f64> {
    let reach = law.reach(part);
    law.knots[part as usize].into_iter().map(move |x| x * reach)
}

fn law() -> Arc<MeasuredLaw> {
    let parts = Part::ALL.map(|part| (part, 1.0)).to_vec();
    Arc::new(MeasuredLaw::new(0.5, 4.0, parts, true, false))
}

/// An odd stiffness, an odd damping, and friction.
fn values(law: &MeasuredLaw, k: impl Fn(f64) -> f64, d: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut p: Vec<f64> = knots(law, Part::Stiffness).map(k).collect();
    p.extend([0.0; KNOTS]);
    p.extend(knots(law, Part::Damping).map(|r| 0.3 + d(r)));
    p.extend([0.0; KNOTS]);
    p.push(0.3);
    p
}

#[test]
fn goes_through_its_knots_and_on_at_its_end_slope() {
    let law = law();
    let p = values(&law, |b| -20.0 * b.powi(3), |r| 0.02 * r * r);
    let curves = law.curves(&p);
    for (b, r) in [(0.5, 4.0), (-0.3, 1.0), (0.05, -0.04), (-0.11, 2.2)] {
        let wanted = 20.0f64 * f64::powi(b, 3) - 0.02 * r * f64::abs(r);
        assert!((curves.moment(b, r) - wanted).abs() < 0.02, "{b} {r}");
        let [k, d] = law.rows(b, r);
        let p = DVector::from_column_slice(&p);
        let by_rows = -k.dot(&p) - d.dot(&p) + 0.3 * f64::signum(r);
        assert!((curves.moment(b, r) - by_rows).abs() < 1e-12, "{b} {r}");
    }
    let beyond = |b: f64| curves.moment(b, 0.0);
    assert!((beyond(0.8) - 2.0 * beyond(0.7) + beyond(0.6)).abs() < 1e-12);
}

#[test]
fn a_rough_curve_costs_and_a_missing_one_does_not() {
    let law = law();
    let scale = Scale {
        amplitude_rad: 1.0,
        reading_rad: 1.0,
        natural_frequency_rad_s: 1.0,
        duration_s: 1.0,
    };
    assert_eq!(Law::sizes(&law, &scale).len(), law.parameters.len());
    let cost = |p: &[f64]| (law.penalty() * DVector::from_column_slice(p)).norm_squared();
    let smooth = values(&law, |b| b.powi(3), |_| 0.0);
    let mut rough = smooth.clone();
    rough[4] += 0.02;
    assert!(cost(&values(&law, |_| 0.0, |_| 0.0)) < 1e-20 && cost(&rough) > 10.0 * cost(&smooth));
}

#[test]
fn its_friction_is_left_to_the_integration() {
    let law = law();
    let mut terms = Terms::default();
    let p = values(&law, |_| 0.0, |_| 0.0);
    law.write(&p, &mut terms);
    assert_eq!((terms.dry_friction_rad_s2, terms.smooth_moment(&at(0.1, 0.2), 0.0)), (0.3, 0.0));
}

#[test]
fn it_holds_what_its_parts_bend_to() {
    let law = |parts: &[Part], friction| {
        let parts = parts.iter().map(|part| (*part, 1e-3)).collect();
        MeasuredLaw::new(0.3, 2.0, parts, friction, true)
    };
    let held = |law: &MeasuredLaw| -> Vec<&str> {
        let all = Effect::ALL.iter().filter(|e| law.holds(e));
        all.map(|e| e.id()).collect()
    };
    let odd =
        ["cubic_stiffness", "quintic_stiffness", "pendulum_gravity", "odd_quadratic_stiffness"];
    let of_stiffness = held(&law(&[Part::Stiffness], false));
    assert!(odd.iter().all(|id| of_stiffness.contains(id)), "{of_stiffness:?}");
    assert_eq!(of_stiffness.len(), odd.len(), "{of_stiffness:?}");
    assert_eq!(held(&law(&[Part::UnevenStiffness], false)), ["quadratic_stiffness"]);
    assert_eq!(held(&law(&[Part::Damping], false)), ["quadratic_damping"]);
    let mut rubbing = held(&law(&[Part::Damping], true));
    rubbing.sort_unstable();
    assert_eq!(rubbing, ["coulomb_friction", "quadratic_damping"]);
}
