//! Which of two modes is the model's own: the one that lasts.

use crate::effects::Effect;
use crate::fit::fitting::{refitted, Fitted};
use crate::fit::free_decay::FreeDecay;
use crate::fit::structure::PLAIN;
use crate::motion::oscillator::damped_rad_s;
use crate::record::Derivative;

/// Share by which the sum of squares may be larger with the modes exchanged: a minimum that is not quite reached.
const AS_GOOD: f64 = 0.05;

/// `model`, or where nothing distinguishes its own mode from the second one that is its `line`, and that lasts
/// longer, the two exchanged.
pub fn with_lasting_mode(decay: &FreeDecay, model: Fitted, line: &Effect) -> Fitted {
    let is_linear = model.structure.effects.iter().all(|e| e.is_line() || e.moves_rest());
    let is_angle = decay.measurand.derivative() == Derivative::None;
    let own = model.motion();
    let own_decay = own.damping_ratio * own.natural_frequency_rad_s;
    let varied = model.varied(line).unwrap_or_default();
    let second = line.line_of(varied).filter(|(_, decay)| *decay < own_decay);
    let Some((damped, slower)) = second.filter(|_| line.dies_out() && is_linear && is_angle) else {
        return model;
    };
    // Of a line cosine and sine part are at the release, of the own mode angle and rate at the first instant.
    let start_s = decay.grid.start_s;
    let turned = |parts: [f64; 2], damped: f64, decay: f64, by_s: f64| {
        line.turned(&parts, -damped * by_s, (-decay * by_s).exp())
    };
    let [cosine, sine] = turned([varied[0], varied[1]], damped, slower, start_s)[..] else {
        return model;
    };
    let rest = own.rest_rad();
    let own_damped = damped_rad_s(own.natural_frequency_rad_s, own_decay);
    let angle = own.yaw_rad - rest;
    let parts = [angle, (own.rate_rad_s + own_decay * angle) / own_damped];
    let mut p = model.parameters.clone();
    let w = damped.hypot(slower);
    p[..PLAIN].copy_from_slice(&[w, slower / w, cosine + rest, damped * sine - slower * cosine]);
    let at = model.start_of(line);
    p[at..at + 2].copy_from_slice(&turned(parts, own_damped, own_decay, -start_s));
    p[at + 2..at + 4].copy_from_slice(&[own.natural_frequency_rad_s, own.damping_ratio]);
    let other = refitted(decay, &model.structure, &p);
    let as_good = other.sum_of_squares < (1.0 + AS_GOOD) * model.sum_of_squares;
    if other.converged && as_good {
        other
    } else {
        model
    }
}
