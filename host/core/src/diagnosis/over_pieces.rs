//! A set of effects fitted to pieces of a free decay, short ones first, and to the whole over ever longer
//! pieces: a fit that begins far off gets lost in the whole at once.

use crate::effects::{Effect, Scale, Seen};
use crate::fit::fitting::{refitted, reordered, Fitted, Limit, Number, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::pieces::{fit_state, Piece, Pieces};
use crate::fit::segments::{fit_from, fit_pieces, PieceFit, FINE, ROUGH, SETTLED};
use crate::stop::Stop;
use std::sync::Arc;

/// Cycles of the pieces of the first, shortest fit.
const SHORT_CYCLES: f64 = 3.0;
/// Long pieces, on which models are compared, and shorter ones that are predicted; the cycles in one at
/// least.
const LONG_PIECES: f64 = 3.0;
const MAX_PIECES: f64 = 8.0;
const MIN_CYCLES: f64 = 1.5;
/// Cycles in the pieces of one length at most: of a longer record what its effects are is asked here and
/// there, and its numbers are then those of the whole. For speed alone: twelve in each of the eight pieces
/// that are predicted, more than in the longer ones of a shorter record.
const MAX_CYCLES: f64 = 96.0;
/// Effects up to which a set is fitted from short pieces on: beyond, a smaller set's numbers are near.
const FROM_SHORT: usize = 2;

/// A set of effects on short pieces and on those that are predicted.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) short: PieceFit,
    pub(crate) fit: PieceFit,
}

/// Pieces of every length.
pub(crate) struct Lengths {
    pub(crate) short: Pieces,
    pub(crate) longer: Pieces,
    pub(crate) long: Pieces,
    pub(crate) predicted: Pieces,
    pub(crate) scale: Scale,
    pub(crate) stop: Stop,
}

impl Lengths {
    pub(crate) fn new(decay: &FreeDecay) -> Self {
        let cycles = decay.yaw_rad.len() as f64 / decay.per_cycle();
        let count = |most: f64| (cycles / MIN_CYCLES).clamp(2.0, most) as usize;
        let long = count(LONG_PIECES);
        let used = cycles.min(MAX_CYCLES);
        let means = (used * decay.per_cycle()).ceil() as usize;
        let of_cycles = |each: f64| {
            let each = each.min(used / long as f64);
            Pieces::spread(decay, ((used / each) as usize).max(1), means)
        };
        Self {
            short: of_cycles(SHORT_CYCLES),
            longer: of_cycles(LONG_PIECES * SHORT_CYCLES),
            long: Pieces::spread(decay, long, means),
            predicted: Pieces::spread(decay, count(MAX_PIECES), means),
            scale: decay.scale(),
            stop: decay.stop.clone(),
        }
    }

    /// Of several releases, of which those of one number in `modal` have natural frequency and damping ratio in
    /// common; scaled by the first.
    pub(crate) fn of_all(releases: &[&FreeDecay], modal: &[usize]) -> Self {
        let modal: Arc<[usize]> = modal.into();
        let mut each = releases.iter().enumerate().map(|(release, decay)| {
            let mut lengths = Self::new(decay);
            for pieces in lengths.all_mut() {
                for piece in &mut pieces.decays {
                    (piece.release, piece.modal) = (release, modal.clone());
                }
            }
            lengths
        });
        let mut out = each.next().expect("a release");
        for mut lengths in each {
            for (pieces, more) in out.all_mut().into_iter().zip(lengths.all_mut()) {
                pieces.decays.append(&mut more.decays);
            }
        }
        out
    }

    fn all_mut(&mut self) -> [&mut Pieces; 4] {
        [&mut self.short, &mut self.longer, &mut self.long, &mut self.predicted]
    }

    /// Where the numbers of an added effect begin.
    pub(crate) fn starts(&self, effect: &Effect) -> Vec<Vec<f64>> {
        effect.starts(&Seen {
            beats: false,
            scale: self.scale,
            residuals_rad: &[],
            step_s: self.long.decays[0].grid.step_s,
            per_cycle: self.long.decays[0].per_cycle(),
            natural_frequency_rad_s: self.scale.natural_frequency_rad_s,
        })
    }
}

/// Fits `structure` from numbers for short pieces over ever longer ones, and from `near` those of a smaller
/// model where there is one.
pub(crate) fn fitted(
    lengths: &Lengths,
    structure: &Structure,
    short: &[f64],
    near: Option<&[f64]>,
) -> Model {
    let near = near.map(|near| fit_from(&lengths.long, structure, near, SETTLED));
    if let Some(fit) = near.as_ref().filter(|_| structure.effects.len() > FROM_SHORT) {
        return Model {
            short: PieceFit { common: short.to_vec(), ..fit.clone() },
            fit: fit.clone(),
        };
    }
    let first = fit_from(&lengths.short, structure, short, ROUGH);
    let mut common = first.common.clone();
    if lengths.longer.count() < lengths.short.count() {
        common = fit_from(&lengths.longer, structure, &common, ROUGH).common;
    }
    let mut fit = fit_from(&lengths.long, structure, &common, SETTLED);
    if let Some(near) = near.filter(|near| near.sum() < fit.sum()) {
        fit = near;
    }
    Model { short: first, fit }
}

pub(crate) fn with_from(lengths: &Lengths, inner: &Model, effect: &Effect, start: &[f64]) -> Model {
    let structure = inner.fit.structure.with(effect);
    let extended = |common: &[f64]| [common, start].concat();
    let near = extended(&inner.fit.common);
    fitted(lengths, &structure, &extended(&inner.short.common), Some(&near))
}

pub(crate) fn without(lengths: &Lengths, model: &Model, effect: &Effect) -> Model {
    let fit = &model.fit;
    let (from, n) = (fit.start_of(effect), effect.parameters().len());
    let less = |common: &[f64]| [&common[..from], &common[from + n..]].concat();
    let structure = fit.structure.without(effect);
    fitted(lengths, &structure, &less(&model.short.common), Some(&less(&fit.common)))
}

/// The second-order response about a rest angle of its own, taking energy out where the record does, and the
/// shared parameters from which its fit begins.
pub(crate) fn plain_start(decay: &FreeDecay) -> (Structure, [f64; 3]) {
    let middle = decay.yaw_rad.iter().sum::<f64>() / decay.yaw_rad.len() as f64;
    let zeta = decay.mean_of_windows(|w| w.damping_ratio);
    let mut structure = Structure { zero_unknown: true, ..Structure::default() };
    if zeta > 0.0 {
        structure.limits.push(Limit { number: Number::DampingRatio, low: 0.0, high: 0.7 });
    }
    // Where more than noise is left, damping that falls with the amplitude bends to whatever else is missing.
    let losses = Effect::ALL.into_iter().filter(Effect::takes_energy_out);
    structure.limits.extend(losses.map(|effect| Limit {
        number: Number::Of(effect, 0),
        low: 0.0,
        high: f64::INFINITY,
    }));
    (structure, [decay.mean_of_windows(|w| w.natural_frequency_rad_s), zeta, middle])
}

/// `structure`, all of whose effects are strengths of the state, fitted to the whole free decay over ever
/// longer pieces, whatever their order; none where one is another.
pub fn fit_over_pieces(decay: &FreeDecay, structure: &Structure) -> Option<Fitted> {
    if !structure.effects.iter().all(Effect::is_strength_of_state) {
        return None;
    }
    let mut sorted = structure.clone();
    sorted.effects.sort_unstable();
    let (_, [wn_rad_s, zeta, middle_rad]) = plain_start(decay);
    let mut common = vec![wn_rad_s, zeta];
    common.extend(structure.zero_unknown.then_some(middle_rad));
    common.resize(common.len() + sorted.effects.len(), 0.0);
    let lengths = Lengths::new(decay);
    let whole = whole(decay, &lengths, &fitted(&lengths, &sorted, &common, None).fit);
    let fit = refitted(decay, &whole.structure, &whole.numbers(0));
    Some(reordered(decay, &fit, &structure.effects))
}

/// The whole free decay from one state, begun at `fit`'s numbers: over ever longer pieces.
pub(crate) fn whole(decay: &FreeDecay, lengths: &Lengths, fit: &PieceFit) -> PieceFit {
    let mut count = (lengths.long.count() * decay.yaw_rad.len()).div_ceil(lengths.long.means());
    let mut best = fit.clone();
    let mut shorter = &lengths.long.decays;
    let mut pieces;
    while count > 1 {
        count = count.div_ceil(2);
        let longer = Pieces::new(decay, count);
        let state = |piece: &Piece| {
            // A shorter piece that begins there knows the phase; of the longer one it may be missed.
            let same = |s: &(&Piece, &[f64; 2])| s.0.grid.start_s == piece.grid.start_s;
            let known = shorter.iter().zip(&best.states).find(same).map(|(_, state)| *state);
            let start = || piece.begun(&best.structure, &best.common);
            known.unwrap_or_else(|| fit_state(piece, &best.structure, &best.common, start()).0)
        };
        let states: Vec<[f64; 2]> = longer.decays.iter().map(state).collect();
        let all: Vec<&Piece> = longer.decays.iter().collect();
        best = fit_pieces(&all, &best.structure, &best.common, &states, FINE);
        pieces = longer;
        shorter = &pieces.decays;
    }
    best
}
