//! What a model predicts of pieces of the record that it was not fitted to, their states alone estimated
//! anew.
//!
//! Where the misfit is deterministic, likelihood buys any effect that bends; what counts then is prediction.

use crate::fit::pieces::{fit_state, Piece, Pieces};
use crate::fit::segments::{fit_pieces, PieceFit, FIRST};

/// Standard errors by which the larger model has to predict better.
pub(crate) const ONE_STANDARD_ERROR: f64 = 1.0;
/// Share by which it has to predict better, too, in the mean over the pieces: of their logarithms, for the
/// few cycles in which a hammer's other modes ring would outweigh all that follows.
pub const MIN_GAIN: f64 = 0.05;

/// Errors of prediction, an item for each piece predicted in each split.
#[derive(Clone, Debug)]
pub(crate) struct Prediction {
    /// Sum of squares (rad2) and number of means.
    errors: Vec<(f64, f64)>,
}

/// Predicts with `model`, which was fitted to all of the record: `short` pieces alternately, where frequency
/// and shape show, and of the `long` ones the last and the middle one from the others, where damping shows.
pub(crate) fn predict(short: &Pieces, long: &Pieces, model: &PieceFit) -> Prediction {
    let mut out = Prediction::alternately(short, model, 0);
    let last = long.count() - 1;
    for left_out in [last, last / 2].into_iter().take(last) {
        out.split(long, model, &model.states, &|k| k == left_out);
    }
    out
}

/// Predicts every piece of `short` but the first, whose amplitudes no other reaches, from those beside it:
/// what a law that is known over the amplitudes reached can be asked for.
pub(crate) fn predict_within(short: &Pieces, model: &PieceFit) -> Prediction {
    Prediction::alternately(short, model, 1)
}

impl Prediction {
    /// Of pieces with these sums of squares and numbers of means.
    pub(crate) fn new(errors: Vec<(f64, f64)>) -> Self {
        Self { errors }
    }

    /// Of the `pieces` from the first on that is predicted at all.
    fn alternately(pieces: &Pieces, model: &PieceFit, first: usize) -> Self {
        let mut out = Self::new(Vec::new());
        let states = pieces.states(&model.structure, &model.common);
        for odd in [1, 0] {
            out.split(pieces, model, &states, &|k| k >= first && k % 2 == odd);
        }
        out
    }

    /// Whether it is better than `other`, which a smaller model makes, by more than chance and by a share
    /// that counts.
    pub(crate) fn is_better_than(&self, other: &Self) -> bool {
        let (gain, u) = self.logarithmic_gain(other);
        gain > ONE_STANDARD_ERROR * u && gain > -2.0 * (1.0 - MIN_GAIN).ln()
    }

    /// Fits all pieces that are not `predicted`, and predicts those.
    fn split(
        &mut self,
        pieces: &Pieces,
        model: &PieceFit,
        states: &[[f64; 2]],
        predicted: &dyn Fn(usize) -> bool,
    ) {
        let (those, others): (Vec<usize>, Vec<usize>) =
            (0..pieces.count()).partition(|k| predicted(*k));
        let fitted: Vec<&Piece> = others.iter().map(|&k| &pieces.decays[k]).collect();
        let begin: Vec<[f64; 2]> = others.iter().map(|&k| states[k]).collect();
        let fit = fit_pieces(&fitted, &model.structure, &model.common, &begin, FIRST);
        for k in those {
            let piece = &pieces.decays[k];
            let (_, squares) = fit_state(piece, &fit.structure, &fit.common, states[k]);
            // As of the noise of the first.
            let squares = squares * (pieces.decays[0].noise_rad / piece.noise_rad).powi(2);
            let n = piece.yaw_rad.len() as f64;
            // An error as large as the motion is no prediction, however large it is.
            self.errors.push((squares.min(n * piece.reading_rad().powi(2)), n));
        }
    }

    pub(crate) fn rms_rad(&self) -> f64 {
        let (sum, n) = self.errors.iter().fold((0.0, 0.0), |s, e| (s.0 + e.0, s.1 + e.1));
        f64::sqrt(sum / f64::max(n, 1.0))
    }

    /// How much smaller the errors are than those of `other`, in standard errors over the pieces.
    pub(crate) fn gain_over(&self, other: &Self) -> f64 {
        let (gain, u) = self.logarithmic_gain(other);
        gain / u
    }

    /// The mean over the pieces of the logarithm of the squares of `other` over these, longer pieces weighing
    /// more, and its standard error.
    fn logarithmic_gain(&self, other: &Self) -> (f64, f64) {
        let floor = 1e-6 * other.rms_rad().powi(2);
        let mean = |e: &(f64, f64)| e.0 / e.1 + floor;
        let gains: Vec<(f64, f64)> = self
            .errors
            .iter()
            .zip(&other.errors)
            .map(|(a, b)| ((mean(b) / mean(a)).ln(), a.1))
            .collect();
        let weight: f64 = gains.iter().map(|g| g.1).sum();
        let average = gains.iter().map(|g| g.0 * g.1).sum::<f64>() / weight;
        let scatter: f64 = gains.iter().map(|g| (g.1 * (g.0 - average)).powi(2)).sum();
        (average, (scatter.sqrt() / weight).max(1e-12))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Gain by a coefficient `z` standard uncertainties from zero that every second of ten pieces tells the others.
    fn gain(z: f64, rng: &mut ChaCha8Rng) -> f64 {
        let slope = 400f64.sqrt().recip();
        let mut reading = || {
            let noise: f64 = StandardNormal.sample(rng);
            z * slope + noise
        };
        let pieces: Vec<Vec<f64>> = (0..10).map(|_| (0..40).map(|_| reading()).collect()).collect();
        let of = |odd: usize| -> f64 {
            let those = pieces.iter().enumerate().filter(|(k, _)| k % 2 == odd);
            those.flat_map(|(_, piece)| piece).sum::<f64>() / 200.0
        };
        let means = [of(0), of(1)];
        let errors = |told: [f64; 2]| {
            let square = |k: usize| pieces[k].iter().map(|y| (y - told[1 - k % 2]).powi(2)).sum();
            Prediction::new((0..10).map(|k| (square(k), 40.0)).collect())
        };
        errors(means).gain_over(&errors([0.0, 0.0]))
    }

    /// One that is zero gains a standard error in 20 of 400, give or take 4.4, as it is two standard uncertainties
    /// from it by chance; one eight of them away gains four.
    #[test]
    fn a_standard_error_of_prediction_is_two_standard_uncertainties() {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let by_chance = (0..400).filter(|_| gain(0.0, &mut rng) > ONE_STANDARD_ERROR).count();
        let mean = (0..400).map(|_| gain(8.0, &mut rng)).sum::<f64>() / 400.0;
        println!("{by_chance} of 400 by chance; at 8 u {mean:.2} standard errors");
        assert!((7..=33).contains(&by_chance), "{by_chance}");
        assert!((3.7..5.0).contains(&mean), "{mean}");
    }
}
