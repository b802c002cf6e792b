//! What likelihood says of a fitted model.

use crate::bic;
use crate::discrepancy::ABOVE_NOISE;
use crate::effects::Effect;
use crate::fit::fitting::Fitted;
use crate::fit::free_decay::FreeDecay;
use crate::fit::linear_gain::Screen;

/// Models that are gone on with in each round of a search, best first; effects that are tried beside one.
pub(crate) const BREADTH: usize = 3;
/// Effects of a model, at most.
pub(super) const MAX_EFFECTS: usize = 6;
/// Variance of the ratio of a residual to its floor over that of the residual alone: third differences of the
/// same readings, from which the floor is known, have 924/400 of it, and the readings in common. Of means of
/// several readings it is less.
const OF_RATIO: f64 = 924.0 / 400.0 - 1.0;
/// Residual over noise up to which a model is near it: what it leaves may sharpen the floor of coloured
/// noise, what explains predicts the later part so well, and a flexible effect is tried beside others.
pub(crate) const NEAR_NOISE: f64 = 1.5;
/// Evidence by which one effect is ahead of another, in linear steps from near the noise, for the other not
/// to be tried. For speed alone: three times what an effect needs to be believed, as a linear step tells less
/// well than a fit.
pub(super) const DECISIVE: f64 = 3.0 * bic::MARGIN;
/// Sum of squares that a linear step from farther off leaves, over that of a model, for it to be tried in
/// that model's place.
const FROM_AFAR: f64 = 3.0;

/// Difference of BIC in favour of `larger`, on `effective` independent residuals.
pub(crate) fn delta_bic(smaller: &Fitted, larger: &Fitted, effective: f64) -> f64 {
    let more = larger.parameters.len() as f64 - smaller.parameters.len() as f64;
    bic::gain(smaller.sum_of_squares, larger.sum_of_squares, effective, more)
}

/// Residual over noise up to which so many independent residuals agree with their floor: of few the ratio
/// scatters more.
pub(super) fn explained_up_to(independent: f64) -> f64 {
    up_to((OF_RATIO / (2.0 * independent)).sqrt())
}

fn up_to(scatter: f64) -> f64 {
    ABOVE_NOISE.max(1.0 + (3.0 * scatter).min(0.3))
}

/// Whether residual and noise floor agree.
pub fn is_explained(fitted: &Fitted, decay: &FreeDecay) -> bool {
    let up_to = match &decay.colour {
        // The residual scatters with its floor, and less.
        Some(colour) => up_to(colour.u_share),
        None => explained_up_to(fitted.effective_count()),
    };
    fitted.over_noise(decay) <= up_to
}

/// The same of every release.
pub(super) fn are_explained(fits: &[Fitted], decays: &[FreeDecay]) -> bool {
    fits.iter().zip(decays).all(|(fit, decay)| is_explained(fit, decay))
}

/// Whether one linear step with `effect` from the model of `screen` says that it may be as good as `model`.
pub(super) fn may_rival(screen: &Screen, effect: &Effect, model: &Fitted) -> bool {
    may_rival_leaving(screen, screen.left_with(effect), model)
}

/// The same of a step that leaves so much of the sum of squares and takes so many numbers more.
pub(super) fn may_rival_leaving(
    screen: &Screen,
    (left, more): (f64, usize),
    model: &Fitted,
) -> bool {
    // From near the noise a linear step is to be believed.
    if screen.inner.over_noise(screen.decay) >= NEAR_NOISE {
        return left < FROM_AFAR * model.sum_of_squares;
    }
    let numbers = screen.inner.parameters.len() + more;
    let fewer = model.parameters.len() as f64 - numbers as f64;
    bic::gain(left, model.sum_of_squares, screen.inner.effective_count(), fewer) < DECISIVE
}

/// What `model` holds beyond `plain`, whose effects come first in it.
pub(crate) fn beyond<'a>(plain: &Fitted, model: &'a Fitted) -> &'a [Effect] {
    &model.structure.effects[plain.structure.effects.len()..]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::rms_of_thirds;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Of 4000 records of 250 white residuals, whose scatter is then known to 1.1 %.
    #[test]
    fn residual_over_floor_scatters_as_both_do() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let ratio = |_| {
            let noise: Vec<f64> = (0..250).map(|_| StandardNormal.sample(&mut rng)).collect();
            let squares: f64 = noise.iter().map(|z| z * z).sum();
            (squares / 250.0).sqrt() / rms_of_thirds(&noise)
        };
        let ratios: Vec<f64> = (0..4000).map(ratio).collect();
        let mean = ratios.iter().sum::<f64>() / 4000.0;
        let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 4000.0;
        let of_both = (OF_RATIO / 500.0).sqrt();
        println!(
            "{:.5}, of both {of_both:.5}, of the residual {:.5}",
            variance.sqrt(),
            500f64.sqrt().recip()
        );
        assert!((variance.sqrt() / of_both - 1.0).abs() < 0.05);
    }
}
