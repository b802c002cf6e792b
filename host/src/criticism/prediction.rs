//! What a model predicts of pieces of the swing that it was not fitted to, their states alone estimated anew.
//!
//! Where the misfit is deterministic, likelihood buys any effect that bends; what counts then is prediction.

use super::segments::{fit_pieces, fit_state, PieceFit, Pieces, ROUGH};
use super::swing::Swing;

/// Steps of a fit to a part of the pieces, from the fit to all.
const STEPS: usize = 8;
/// Error at which a prediction counts as lost, as a share of the amplitude.
const LOST: f64 = 1.0;

/// Errors of prediction, an item for each piece predicted in each split.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// Sum of squares (rad2) and number of means.
    errors: Vec<(f64, usize)>,
    /// What is common, as fitted in each split.
    pub common: Vec<Vec<f64>>,
}

/// Which pieces are fitted and which are predicted: alternately, and the later part from the earlier.
fn splits(count: usize) -> Vec<(Vec<usize>, Vec<usize>)> {
    let split =
        |fitted: &dyn Fn(usize) -> bool| (0..count).partition::<Vec<usize>, _>(|k| fitted(*k));
    let later = (0.65 * count as f64).round() as usize;
    vec![split(&|k| k % 2 == 0), split(&|k| k % 2 == 1), split(&|k| k < later)]
}

/// Predicts each split of `pieces` from `model`, which was fitted to all of them.
pub fn predict(pieces: &Pieces, model: &PieceFit) -> Prediction {
    let mut out = Prediction { errors: Vec::new(), common: Vec::new() };
    let lost = (LOST * pieces.swings[0].amplitude_rad).powi(2);
    for (fitted, predicted) in splits(pieces.len()) {
        let those: Vec<&Swing> = fitted.iter().map(|&k| &pieces.swings[k]).collect();
        let states: Vec<[f64; 2]> = fitted.iter().map(|&k| model.states[k]).collect();
        let fit = fit_pieces(&those, &model.structure, &model.common, &states, ROUGH, STEPS);
        for k in predicted {
            let piece = &pieces.swings[k];
            let (_, squares) = fit_state(piece, &fit.structure, &fit.common, model.states[k]);
            let n = piece.yaw_rad.len();
            out.errors.push((squares.min(n as f64 * lost), n));
        }
        out.common.push(fit.common);
    }
    out
}

impl Prediction {
    pub fn rms_rad(&self) -> f64 {
        let (sum, n) = self.errors.iter().fold((0.0, 0.0), |s, e| (s.0 + e.0, s.1 + e.1 as f64));
        f64::sqrt(sum / f64::max(n, 1.0))
    }

    /// How much smaller the errors are than those of `other`, in standard errors over the pieces: the mean of
    /// the logarithm of their ratio.
    pub fn gain_over(&self, other: &Self) -> f64 {
        let floor = 1e-6 * other.rms_rad().powi(2);
        let gains: Vec<f64> = self
            .errors
            .iter()
            .zip(&other.errors)
            .map(|(a, b)| {
                let mean = |e: &(f64, usize)| e.0 / e.1 as f64 + floor;
                (mean(b) / mean(a)).ln()
            })
            .collect();
        let n = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / n;
        let variance = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (n - 1.0);
        mean / (variance / n).sqrt().max(1e-12)
    }
}
