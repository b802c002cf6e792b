use super::*;
use crate::motion::simulate::Motion;

fn moment(effect: &Effect, p: &[f64], wind_speed_m_s: f64) -> f64 {
    let plain = Terms::in_wind(wind_speed_m_s);
    let mut with = plain.clone();
    effect.write(p, &mut with);
    let [with, plain] = [with, plain].map(|terms| {
        let (natural_frequency_rad_s, damping_ratio) = (1.0, 0.0);
        Motion { natural_frequency_rad_s, damping_ratio, yaw_rad: 0.2, rate_rad_s: 0.0, terms }
            .acceleration_rad_s2(0.2, 0.5)
    });
    with - plain
}

fn aerodynamic(effect: &Effect) -> Effect {
    effect.from_source(Source::Aerodynamic { reference_m_s: 10.0 }).unwrap()
}

#[test]
fn the_powers_of_the_speed_are_those_of_the_dimensions() {
    use Effect::{CubicDamping, CubicStiffness, OddQuadraticStiffness, PowerDamping};
    use Effect::{QuadraticDamping, QuinticStiffness, StaticOffset};
    for (effect, power) in [
        (StaticOffset, 2.0),
        (OddQuadraticStiffness, 2.0),
        (CubicStiffness, 2.0),
        (QuinticStiffness, 2.0),
        (CubicDamping, 1.0),
        (QuadraticDamping, 0.0),
    ] {
        assert_eq!(effect.wind_power(&[]), Some(power), "{effect}");
        let blown = aerodynamic(&effect);
        assert_eq!((blown.id(), &blown), (effect.id(), &effect));
        let at = |wind| moment(&blown, &[-3.0], wind);
        assert_eq!(at(0.0), 0.0, "{effect}");
        assert_eq!(at(10.0), moment(&effect, &[-3.0], 10.0), "{effect}");
        assert!((at(20.0) / at(10.0) - f64::powf(2.0, power)).abs() < 1e-12, "{effect}");
        assert!(!blown.acts_at(0, 0.0) && blown.acts_at(0, 5.0));
    }
    let drag = aerodynamic(&PowerDamping);
    let at = |wind| moment(&drag, &[3.0, 0.5], wind);
    assert!((at(20.0) / at(10.0) - f64::powf(2.0, 1.5)).abs() < 1e-12);
    let unblown = [Effect::FreePlay, Effect::SensorNonlinearity, Effect::StiffnessDrift];
    for effect in unblown.into_iter().chain([Effect::SecondMode, Effect::Buffeting]) {
        let source = Source::Aerodynamic { reference_m_s: 10.0 };
        assert!(effect.from_source(source).is_none(), "{effect}");
    }
}

#[test]
fn each_wind_has_its_own_strength_and_the_rest_in_common() {
    let speeds_m_s = vec![0.0, 10.0, 12.5];
    let each = Effect::EndStop.from_source(Source::EachWind { speeds_m_s }).unwrap();
    let names: Vec<&str> = each.parameters().iter().map(|p| &*p.name).collect();
    assert_eq!(names, ["k_at_0", "k_at_10", "k_at_12_5", "g"]);
    let p = [1.0, 2.0, 3.0, 0.1];
    for (wind, k) in [(0.0, 1.0), (10.1, 2.0), (12.5, 3.0)] {
        assert_eq!(moment(&each, &p, wind), moment(&Effect::EndStop, &[k, 0.1], wind));
        assert!(each.is_known_at(wind));
    }
    assert_eq!(moment(&each, &p, 20.0), 0.0);
    assert!(!each.is_known_at(20.0) && !each.acts_at(3, 20.0));
    assert_eq!([0, 1, 2, 3].map(|k| each.acts_at(k, 10.0)), [false, true, false, true]);
    assert_eq!(each.from_source(Source::Mechanical).unwrap().parameters().len(), 2);
}

/// Of a wake, size and rate by their dimensions, without wind nothing: in numbers and in the equation.
#[test]
fn a_lag_of_the_air_is_quicker_in_a_faster_wind() {
    let lag = Effect::Own(yawrig_expression::ready_made("first_order_lag").unwrap());
    assert_eq!(lag.wind_powers(&[]), Some(vec![2.0, 1.0]));
    let blown = aerodynamic(&lag);
    assert_eq!(blown.in_wind(&[4.0, 3.0], 20.0).unwrap().as_ref(), [16.0, 6.0]);
    assert_eq!(blown.in_wind(&[4.0, 3.0], 0.0), None);
    let Some(Equation::Remembered { moment, states }) = blown.equation() else { panic!() };
    assert_eq!(moment, "sign(wind) * (wind / 10.0)^2 * (-a * x)");
    assert_eq!(states, [["x", "r - (rate * (wind / 10.0)^1) * x"]]);
    // One that is written with a time; and what is in no proportion to its strength, as that is in the rate, too.
    let late = |rate: &str| {
        let text = format!(
            "id = \"late\"\ntitle = \"x\"\nmoment = \"-c * z\"\n[[state]]\nname = \"z\"\nunit = \"rad/s\"\n\
             rate = \"{rate}\"\n[parameters]\nc = {{ unit = \"1/s\", start = 0.5, min = 0.0 }}\n\
             T = {{ unit = \"s\", start = 0.1, min = 0.001 }}\n"
        );
        Effect::Own(Arc::new(
            yawrig_expression::from_text("late.toml".as_ref(), &text, &[]).unwrap(),
        ))
    };
    let timed = aerodynamic(&late("(r - z) / T"));
    let Some(Equation::Remembered { states, .. }) = timed.equation() else { panic!() };
    assert_eq!(states[0][1], "(r - z) / (T * ((wind + 1 - sign(wind)) / 10.0)^-1)");
    let source = Source::Aerodynamic { reference_m_s: 10.0 };
    assert!(late("(r - z) / T - c * z").from_source(source).is_none());
}

/// As text, too: the moment of the exported equation.
#[test]
fn its_equation_says_the_same() {
    let source = Source::EachWind { speeds_m_s: vec![0.0, 10.0] };
    let each = Effect::CubicStiffness.from_source(source).unwrap();
    let text = |effect: &Effect| match effect.equation() {
        Some(Equation::Moment(text)) => text.into_owned(),
        _ => String::new(),
    };
    let blown = text(&aerodynamic(&Effect::CubicStiffness));
    assert_eq!(blown, "sign(wind) * (wind / 10.0)^2 * (-b * b * (k3 * b))");
    let each = text(&each);
    assert!(each.contains("k3_at_0 * max(0, sign(") && each.contains("k3_at_10 * "), "{each}");
    assert!(!each.contains("(k3 *"), "{each}");
}
