//! Which release would tell rival models apart.
//!
//! Each rival in turn is taken for the truth and simulated at every release that the rig can make; every
//! other rival is fitted to that within what the records so far leave open to it. With the noise sigma of the
//! new release and the covariance C of the numbers p that rival j shares with the records there are,
//!
//! ```text
//! S^2 = min over p of  |y_j(p) - y_i|^2 / sigma^2  +  (p - p_j)' C^-1 (p - p_j)
//! ```
//!
//! is by how much j's sum of squares over old and new records will exceed i's if i is true: the release parts
//! them by S standard deviations. Noise makes of that difference a normal variable of mean S^2 and standard
//! deviation 2 S (A. C. Atkinson, V. V. Fedorov, Biometrika 62, 1975, with the errors of the numbers so far).
//! All is counted over the noise as the best rival leaves it, residuals that are correlated for fewer.
//!
//! A measured law takes the shape of any formula within its range and says nothing beyond: it is a truth that
//! formulas are held to, at releases within its range; that it can follow a formula refutes neither.

mod possible;
mod precision;
mod tied;

pub use possible::{Possible, Rival};
pub use precision::{precision, Narrowed};

use crate::bic::MARGIN;
use crate::error::Result;
use crate::fit::free_decay::{FreeDecay, MEANS_PER_CYCLE};
use crate::fit::structure::WN;
use crate::motion::simulate::Grid;
use crate::par_map::ParMap;
use possible::numbers;
use serde::Serialize;
use std::f64::consts::TAU;
use tied::least_squares;

/// A possible release, and what it would tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ranked {
    /// What to do at the rig.
    #[serde(flatten)]
    pub release: Possible,
    /// S of [`crate::plan`] for the pair that it parts least, in standard deviations.
    pub separation_sigma: f64,
    /// Probability that it leaves the right rival alone, whichever that is: every other's BIC is worse by
    /// [`MARGIN`].
    pub chance_to_decide: f64,
}

/// Ranks `possible`, best first; those in which a rival does not stay finite, or is a measured law that ends
/// before, are left out. `decays` are the releases that the rivals were fitted to, `done` hears of each
/// release that is through.
///
/// # Errors
/// A rival whose numbers have no errors; or interrupted.
pub fn rank(
    rivals: &[Rival],
    decays: &[&FreeDecay],
    possible: &[Possible],
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Ranked>> {
    let judge = |release: &Possible| {
        let judged = judged(rivals, decays[release.like], release);
        done();
        judged
    };
    let all: Vec<Option<Ranked>> = possible.iter().par_map(judge).collect::<Result<_>>()?;
    let mut ranked: Vec<Ranked> = all.into_iter().flatten().collect();
    let key = |r: &Ranked| (r.chance_to_decide, r.separation_sigma);
    ranked.sort_by(|a, b| key(b).partial_cmp(&key(a)).unwrap_or(std::cmp::Ordering::Equal));
    Ok(ranked)
}

fn judged(rivals: &[Rival], like: &FreeDecay, release: &Possible) -> Result<Option<Ranked>> {
    if !rivals.iter().all(|rival| rival.reaches(release)) {
        return Ok(None);
    }
    let level = rivals.iter().map(|r| r.fit.over_noise()).fold(f64::INFINITY, f64::min).max(1.0);
    let inflation =
        rivals.iter().map(|r| r.fit.fits[release.like].inflation).fold(f64::INFINITY, f64::min);
    let (mut least, mut chances, mut truths) = (f64::INFINITY, 0.0, 0);
    for (i, truth) in rivals.iter().enumerate() {
        let Some(decay) = simulated(truth, like, release, level) else { return Ok(None) };
        let can_fail = |j: usize| j != i && (rivals[j].law().is_none() || truth.law().is_some());
        let others: Vec<&Rival> =
            (0..rivals.len()).filter(|j| can_fail(*j)).map(|j| &rivals[j]).collect();
        if others.is_empty() {
            continue;
        }
        let mut chance = 1.0f64;
        for other in others {
            like.stop.check()?;
            let squares = least_squares(&decay, other, release)?;
            like.stop.check()?;
            let separation = (squares / inflation.max(1.0)).sqrt();
            least = least.min(separation);
            chance = chance.min(chance_of(separation));
        }
        chances += chance;
        truths += 1;
    }
    Ok(Some(Ranked {
        release: release.clone(),
        separation_sigma: least,
        chance_to_decide: chances / f64::from(truths),
    }))
}

/// What the sensor would show without its noise, and the noise of that; none where the model runs away.
fn simulated(rival: &Rival, like: &FreeDecay, release: &Possible, level: f64) -> Option<FreeDecay> {
    let fit = &rival.fit.fits[release.like];
    let mut model = fit.clone();
    model.parameters = numbers(rival, release);
    let wn = model.parameters[WN];
    let sample_s = like.grid.step_s / like.block as f64;
    let block = (TAU / wn / MEANS_PER_CYCLE / sample_s).floor().max(1.0);
    let step_s = block * sample_s;
    let count = (release.seconds / step_s) as usize;
    let grid = Grid { start_s: 0.0, step_s, count, mean_width_s: 0.0 };
    let yaw_rad = model.readings(&grid);
    let finite = yaw_rad.iter().all(|y| y.is_finite() && y.abs() < std::f64::consts::PI);
    (finite && count > 0).then(|| FreeDecay {
        grid,
        smooth: yaw_rad.len(),
        yaw_rad,
        block: block as usize,
        noise_rad: level * like.noise_rad * (like.grid.step_s / step_s).sqrt(),
        frequency_rad_s: wn,
        amplitude_rad: release.amplitude_deg.to_radians(),
        release_time_s: 0.0,
        windows: Vec::new(),
        ..like.clone()
    })
}

/// That a difference of squares of mean S^2 and standard deviation 2 S exceeds the margin.
fn chance_of(separation: f64) -> f64 {
    if separation > 0.0 {
        normal((separation * separation - MARGIN) / (2.0 * separation))
    } else {
        0.0
    }
}

/// Share of a normal variable below `x` of its standard deviations: within 7.5e-8 (M. Abramowitz, I. A.
/// Stegun, Handbook of mathematical functions, 26.2.17).
fn normal(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
    let polynomial = [1.330_274_429, -1.821_255_978, 1.781_477_937, -0.356_563_782, 0.319_381_530]
        .iter()
        .fold(0.0, |sum, c| (sum + c) * t);
    let above = (-0.5 * x * x).exp() / TAU.sqrt() * polynomial;
    if x < 0.0 {
        above
    } else {
        1.0 - above
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_distribution_is_that_of_its_tables() {
        for (x, share) in
            [(0.0, 0.5), (1.0, 0.841_344_75), (-2.0, 0.022_750_13), (3.0, 0.998_650_1)]
        {
            assert!((normal(x) - share).abs() < 1e-7, "{x}: {}", normal(x));
        }
        assert!(chance_of(0.0) == 0.0 && chance_of(2.0) < 0.1 && chance_of(6.0) > 0.98);
    }
}
