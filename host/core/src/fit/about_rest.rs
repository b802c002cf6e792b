//! What acts beside a constant moment: about the sensor's zero, or about the angle of rest, as where the
//! sensor was not zeroed. The numbers are as many; which it is, the record says.

use crate::effects::Effect;
use crate::fit::fitting::{fit_added, fit_near, fit_removed, Fitted, Structure};
use crate::fit::free_decay::FreeDecay;

/// `inner` with `effect`, about the sensor's zero or the angle of rest.
pub(crate) fn added(decay: &FreeDecay, inner: &Fitted, effect: &Effect) -> Fitted {
    about_nearer(decay, fit_added(decay, inner, effect))
}

/// `model` less `effect`, likewise.
pub(crate) fn removed(decay: &FreeDecay, model: &Fitted, effect: &Effect) -> Fitted {
    about_nearer(decay, fit_removed(decay, model, effect))
}

/// `model`, or with the same numbers and effects the one whose effects act about the angle of rest in place
/// of the sensor's zero, or the other way round, where that is nearer.
fn about_nearer(decay: &FreeDecay, model: Fitted) -> Fitted {
    let effects = &model.structure.effects;
    let alone = |e: &Effect| e.moves_rest() || e.line().is_some();
    if !effects.iter().any(Effect::moves_rest) || effects.iter().all(alone) {
        return model;
    }
    let about_rest = !model.structure.about_rest;
    let structure = Structure { about_rest, ..model.structure.clone() };
    let start = model.numbers_for(&structure).expect("effects of the model");
    let other = fit_near(decay, &structure, &start, model.count);
    let nearer = other.converged && other.sum_of_squares < model.sum_of_squares;
    if nearer {
        other
    } else {
        model
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fitting::fit_plain;
    use crate::fit::free_decay::Around;
    use crate::motion::simulate::Grid;
    use crate::record::Record;

    /// A cubic spring whose sensor was not zeroed, and one under a constant moment: of either the model that
    /// was planted is taken, and its numbers are found.
    #[test]
    fn effects_act_about_what_the_record_says() {
        let effects = [Effect::CubicStiffness, Effect::StaticOffset];
        let (wn, cube, moment) = (6.0f64, -60.0, 0.9);
        let grid = Grid { start_s: 0.0, step_s: 0.01, count: 2500, mean_width_s: 0.0 };
        for about_rest in [true, false] {
            let structure =
                Structure { effects: effects.to_vec(), about_rest, ..Structure::default() };
            let planted = [wn, 0.01, 0.2, 0.0, cube, moment];
            let (motion, zero) = structure.motion(&planted, Around::default());
            let noise_deg = |k: usize| 0.02 * (3.88 * (k * k % 997) as f64).sin();
            let read = |(k, y): (usize, &f64)| (y + zero).to_degrees() + noise_deg(k);
            let yaw_deg = motion.readings(&grid).iter().enumerate().map(read).collect();
            let time_s = (0..grid.count).map(|k| grid.time_s(k)).collect();
            let decay = FreeDecay::from_record(&Record::new("planted", time_s, yaw_deg)).unwrap();
            let plain = fit_plain(&decay, false, decay.yaw_rad.len());
            let one = added(&decay, &plain, &Effect::StaticOffset);
            let both = added(&decay, &one, &Effect::CubicStiffness);
            assert_eq!(both.structure.about_rest, about_rest, "{}", both.over_noise(&decay));
            let [m, c] = [0, 1].map(|k| both.effect_parameters()[k].1);
            println!("about rest {about_rest}: moment {m}, cube {c}, rest {:?}", both.rest_rad());
            assert!((c.value / cube - 1.0).abs() < 0.02 && (m.value / moment - 1.0).abs() < 0.02);
            assert_eq!(both.rest_rad().is_some(), about_rest);
            let near = |r: crate::quantity::Quantity| (r.value * wn * wn / moment - 1.0).abs();
            assert!(both.rest_rad().is_none_or(|r| near(r) < 0.02 && r.u > 0.0));
            let less = removed(&decay, &both, &Effect::StaticOffset);
            assert_eq!(less.structure.effects, effects[..1]);
        }
    }
}
