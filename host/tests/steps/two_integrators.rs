//! The rig that makes records and the motion that is fitted to them share no code: every effect of the
//! library with a definite course gives the same record in both.

use yawrig_core::effects::{Effect, Terms};
use yawrig_core::motion::simulate::{Grid, Motion};
use yawrig_rig::{Effects, End, Samples, Sensor, Start, LIBRARY};
use yawrig_shared::modal::Modal;

const WN: f64 = 7.0;
const ZETA: f64 = 0.01;
const RELEASE_DEG: f64 = 12.0;
const RATE_HZ: f64 = 200.0;
const SECONDS: f64 = 8.0;

#[test]
fn every_effect_is_the_same_motion_in_both() {
    for effect in Effect::ALL.into_iter().filter(|e| !e.is_random()) {
        let kind = LIBRARY.iter().find(|kind| kind.id == effect.id()).expect("in the rig too");
        let text = format!("{}:{}", kind.id, kind.example);
        let of_rig: yawrig_rig::Effect = text.parse().unwrap();
        let names: Vec<(&str, &str)> =
            effect.parameters().iter().map(|p| (&*p.name, &*p.unit)).collect();
        let rig_names: Vec<(&str, &str)> =
            of_rig.parameters().map(|(p, _)| (&*p.name, &*p.unit)).collect();
        assert_eq!(names, rig_names, "{effect}");
        let values: Vec<f64> = of_rig.parameters().map(|(_, value)| value).collect();
        let modal = Modal { natural_frequency_rad_s: WN, damping_ratio: ZETA };
        let start = Start { amplitude_deg: RELEASE_DEG, hold_s: 0.0, end: End::After(SECONDS) };
        let sensor =
            Sensor { noise_deg: 0.0, adc_step_deg: 0.0, rate_hz: RATE_HZ, ..Sensor::default() };
        let effects = Effects::new(vec![of_rig]).unwrap();
        let rig: Vec<f64> = Samples::with_effects(&modal, &effects, &start, &sensor, 1)
            .unwrap()
            .map(|sample| sample.yaw_deg.to_radians())
            .collect();
        let motion = Motion {
            natural_frequency_rad_s: WN,
            damping_ratio: ZETA,
            yaw_rad: RELEASE_DEG.to_radians(),
            rate_rad_s: 0.0,
            terms: Terms::new([(effect.clone(), &values[..])]),
        };
        let grid =
            Grid { start_s: 0.0, step_s: 1.0 / RATE_HZ, count: rig.len(), mean_width_s: 0.0 };
        let core = motion.readings(&grid);
        let plain = Motion { terms: Terms::default(), ..motion.clone() };
        let without = plain.readings(&grid);
        let rms = |other: &[f64]| {
            let sum: f64 = rig.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum();
            (sum / rig.len() as f64).sqrt()
        };
        let (apart, of_effect) = (rms(&core), rms(&without));
        println!("{effect}: {:.1e} of what it does", apart / of_effect);
        assert!(
            apart < 3e-3 * of_effect,
            "{effect}: {apart:.1e} rad apart, it does {of_effect:.1e}"
        );
    }
}
