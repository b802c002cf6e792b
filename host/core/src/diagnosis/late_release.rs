//! The release where a second mode has hidden it.
//!
//! The search for the release looks for a free motion of one mode, and finds it late where a second one is
//! strong at first. Numbers that count from the release (amplitude and phase of that mode) are then off by
//! its decay. With the model known the record is fitted again from where the model was let go.

use crate::discrepancy::ABOVE_NOISE;
use crate::fit::fitting::{refitted, Fitted};
use crate::fit::free_decay::FreeDecay;
use crate::record::Record;

/// `model` of `decay` fitted from the very release of `record`; none where that is where it begins already,
/// or where the earlier part is no free motion of the model.
pub(crate) fn from_release(record: &Record, decay: &FreeDecay, model: &Fitted) -> Option<Fitted> {
    if !model.structure.effects.iter().any(|e| e.dies_out()) {
        return None;
    }
    let (mut longer, held) = decay.begun_at_release(record)?;
    let earlier_s = decay.release_time_s - longer.release_time_s;
    let begin = |s: &FreeDecay| s.release_time_s + s.grid.start_s;
    let mut p = shifted(model, earlier_s);
    (p[2], p[3]) = model.motion().linear_state(begin(&longer) - begin(decay));
    let mut fitted = refitted(&longer, &model.structure, &p);
    let same = |f: &Fitted| f.converged && f.rms_rad() <= ABOVE_NOISE * model.rms_rad();
    if !same(&fitted) {
        return None;
    }
    if held {
        // Let go at rest: at the turning point of the motion.
        let (wn, b, r) = (fitted.parameters[0], fitted.parameters[2], fitted.parameters[3]);
        let since_s = (-r / (wn * b)).atan() / wn;
        let later_s = begin(&longer) - since_s - longer.release_time_s;
        longer.release_time_s += later_s;
        longer.grid.start_s -= later_s;
        let p = shifted(&fitted, -later_s);
        fitted = refitted(&longer, &model.structure, &p);
    }
    same(&fitted).then_some(fitted)
}

/// Parameters with the clock begun `earlier_s` earlier.
fn shifted(model: &Fitted, earlier_s: f64) -> Vec<f64> {
    let mut p = model.parameters.clone();
    for effect in &model.structure.effects {
        let varied = model.varied(effect).expect("an effect of the model");
        let Some((damped_rad_s, decay_per_s)) = effect.line_of(varied) else { continue };
        let (turn, growth) = (damped_rad_s * earlier_s, (decay_per_s * earlier_s).exp());
        let at = model.start_of(effect);
        let turned = effect.turned(varied, turn, growth);
        p[at..at + turned.len()].copy_from_slice(&turned);
    }
    p
}
