//! Effects that predict as well in the place of one that survives: what a record cannot distinguish.

use crate::diagnosis::over_pieces::Model;
use crate::diagnosis::prediction::MIN_GAIN;
use crate::diagnosis::survivors::{judged, PredictedModel, Survivors};
use crate::effects::Effect;
use crate::error::Result;
use crate::par_map::ParMap;

/// For an effect that survives, every other that predicts as well in its place and is `allowed`.
///
/// # Errors
/// Interrupted, once somebody asked for it.
pub(super) fn alike(
    survivors: &Survivors,
    allowed: impl Fn(&PredictedModel) -> bool + Sync,
) -> Result<Vec<[Effect; 2]>> {
    let last = survivors.path.last().expect("the plain model");
    let effects = &last.model.fit.structure.effects;
    let swapped = |model: &Model| -> Option<[Effect; 2]> {
        let others = &model.fit.structure.effects;
        let mut new = others.iter().filter(|e| !effects.contains(e));
        let mut old = effects.iter().filter(|e| !others.contains(e));
        let pair = [old.next()?.clone(), new.next()?.clone()];
        (old.next().is_none() && new.next().is_none()).then_some(pair)
    };
    let rivals: Vec<([Effect; 2], &Model)> = survivors
        .sets
        .iter()
        .filter(|model| !fits_worse(model.fit.sum(), last.model.fit.sum()))
        .filter_map(|model| Some((swapped(model)?, model)))
        .collect();
    let mut found: Vec<[Effect; 2]> = rivals
        .into_iter()
        .par_map(|(pair, model)| {
            let rival = judged(&survivors.lengths, model.clone());
            (!last.predicts_better_than(&rival) && allowed(&rival)).then_some(pair)
        })
        .flatten()
        .collect();
    survivors.lengths.stop.check()?;
    found.sort_unstable();
    found.dedup();
    Ok(found)
}

/// Whether a set fits so much worse than the one that survives that it does not predict as well.
fn fits_worse(sum: f64, survivor: f64) -> bool {
    sum * (1.0 - MIN_GAIN).powi(2) > survivor
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::survivors;
    use crate::effects::Terms;
    use crate::fit::free_decay::FreeDecay;
    use crate::fit::structure::Structure;
    use crate::motion::simulate::{Grid, Motion};
    use crate::record::Record;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Cubic stiffness, released at this angle.
    fn release(seed: u64, amplitude_deg: f64, damping_ratio: f64) -> Record {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let grid = Grid { start_s: 0.0, step_s: 0.02, count: 1000, mean_width_s: 0.0 };
        let motion = Motion {
            natural_frequency_rad_s: 6.0,
            damping_ratio,
            yaw_rad: amplitude_deg.to_radians(),
            rate_rad_s: 0.0,
            terms: Terms::new([(Effect::CubicStiffness, &[-25.0][..])]),
        };
        let yaw_rad = motion.readings(&grid);
        let noise = |z: f64| 0.1 * z;
        Record::new(
            "a.csv",
            (0..grid.count).map(|i| grid.time_s(i)).collect(),
            yaw_rad
                .iter()
                .map(|y| y.to_degrees() + noise(StandardNormal.sample(&mut rng)))
                .collect(),
        )
    }

    fn group(record: &Record) -> (Vec<Effect>, Vec<[Effect; 2]>) {
        let decay = FreeDecay::from_record(record).unwrap();
        let survivors = survivors::search(&decay, &[], &Structure::default()).unwrap();
        let last = &survivors.path.last().unwrap().model.fit.structure.effects;
        (last.clone(), alike(&survivors, |_| true).unwrap())
    }

    /// Over few amplitudes a cube and an odd square soften alike; over many they part.
    #[test]
    fn laws_that_one_amplitude_cannot_separate_are_a_group() {
        let (effects, pairs) = group(&release(1, 12.0, 0.004));
        println!("{effects:?} {pairs:?}");
        let laws = [Effect::CubicStiffness, Effect::OddQuadraticStiffness];
        assert!(effects.iter().any(|e| laws.contains(e)), "{effects:?}");
        assert!(pairs.iter().any(|pair| laws.iter().all(|law| pair.contains(law))), "{pairs:?}");
        let (effects, pairs) = group(&release(2, 35.0, 0.02));
        println!("{effects:?} {pairs:?}");
        let near = [Effect::CubicStiffness, Effect::PendulumGravity];
        assert!(effects.iter().any(|e| near.contains(e)), "{effects:?}");
        assert!(!pairs.iter().flatten().any(|e| *e == laws[1]), "{pairs:?}");
    }
}
