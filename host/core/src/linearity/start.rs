//! A release's amplitude and phase as polynomials of the time: what they are before a fit.

use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Terms of a polynomial of the time, for ln A and for the phase, and for the offset.
pub(super) const TERMS: usize = 6;
pub(super) const DRIFT: usize = 2;
/// A release's own parameters: the offset's, those of ln A, those of the phase.
pub(super) const OWN: usize = DRIFT + 2 * TERMS;

/// Terms that they begin with, of which so few cycles say enough.
const FIRST_TERMS: usize = 4;
/// Cycles at least.
pub(super) const MIN_CYCLES: usize = 8;
/// What is below this share of the largest amplitude is left out: no polynomial follows how friction ends it.
const SMALLEST: f64 = 0.06;

/// A release from its second half cycle on, down to where it is small.
#[derive(Clone, Debug)]
pub(super) struct Swing {
    /// Times in -1..1, and readings in deg.
    pub(super) samples: Vec<(f64, f64)>,
    pub(super) own: [f64; OWN],
}

/// Legendre's polynomials of -1..1.
pub(super) fn legendre(x: f64) -> [f64; TERMS] {
    let mut p = [1.0; TERMS];
    p[1] = x;
    for n in 2..TERMS {
        let k = n as f64;
        p[n] = ((2.0 * k - 1.0) * x * p[n - 1] - (k - 1.0) * p[n - 2]) / k;
    }
    p
}

fn value(terms: &[f64], polynomials: &[f64; TERMS]) -> f64 {
    terms.iter().zip(polynomials).map(|(term, polynomial)| term * polynomial).sum()
}

/// Offset, amplitude and phase at a time.
pub(super) fn at(own: &[f64; OWN], polynomials: &[f64; TERMS]) -> [f64; 3] {
    let (offset, rest) = own.split_at(DRIFT);
    let (amplitude, phase) = rest.split_at(TERMS);
    [value(offset, polynomials), value(amplitude, polynomials).exp(), value(phase, polynomials)]
}

/// One cycle: time, amplitude, phase and mean.
struct Cycle {
    time_s: f64,
    amplitude_deg: f64,
    phase_rad: f64,
    mean_deg: f64,
}

/// Amplitude and phase of each cycle, by its first harmonic.
fn cycles(samples: &[(f64, f64)], frequency: f64) -> Vec<Cycle> {
    let start_s = samples[0].0;
    let of = |time_s: f64| ((time_s - start_s) * frequency / TAU) as usize;
    let mut found: Vec<Cycle> = Vec::new();
    for cycle in samples.chunk_by(|a, b| of(a.0) == of(b.0)) {
        let n = cycle.len() as f64;
        let mean_deg = cycle.iter().map(|s| s.1).sum::<f64>() / n;
        let (mut re, mut im) = (0.0, 0.0);
        for (time_s, deg) in cycle {
            let (sin, cos) = (frequency * (time_s - start_s)).sin_cos();
            (re, im) = (re + (deg - mean_deg) * cos, im - (deg - mean_deg) * sin);
        }
        let mut phase_rad = im.atan2(re);
        if let Some(last) = found.last() {
            phase_rad += TAU * ((last.phase_rad - phase_rad) / TAU).round();
        }
        let time_s = cycle.iter().map(|s| s.0).sum::<f64>() / n;
        found.push(Cycle { time_s, amplitude_deg: 2.0 * re.hypot(im) / n, phase_rad, mean_deg });
    }
    // The last one is not whole.
    found.pop();
    found
}

impl Swing {
    /// Of time and reading; none where it has too few cycles.
    pub(super) fn new(samples: &[(f64, f64)], frequency: f64) -> Option<Self> {
        let half_s = 0.5 * TAU / frequency;
        let first = samples.partition_point(|s| s.0 < samples[0].0 + half_s);
        let samples = samples.get(first..).filter(|left| !left.is_empty())?;
        let mut cycles = cycles(samples, frequency);
        let largest = cycles.iter().map(|c| c.amplitude_deg).fold(0.0, f64::max);
        let large = cycles.iter().take_while(|c| c.amplitude_deg > SMALLEST * largest).count();
        cycles.truncate(large);
        let last = cycles.last().filter(|_| large >= MIN_CYCLES)?;
        let (from_s, to_s) = (samples[0].0, last.time_s + half_s);
        let tau = |time_s: f64| 2.0 * (time_s - from_s) / (to_s - from_s) - 1.0;
        // Weighted by the amplitude, as their noise is.
        let fitted = |terms: usize, value: &dyn Fn(&Cycle) -> f64| -> Option<Vec<f64>> {
            let rows = cycles.len();
            let weighted = |k: usize, x: f64| cycles[k].amplitude_deg * x;
            let a = DMatrix::from_fn(rows, terms, |k, term| {
                weighted(k, legendre(tau(cycles[k].time_s))[term])
            });
            let b = DVector::from_fn(rows, |k, _| weighted(k, value(&cycles[k])));
            Some(a.svd(true, true).solve(&b, 1e-12).ok()?.iter().copied().collect())
        };
        let carrier = |cycle: &Cycle| cycle.phase_rad + frequency * (cycle.time_s - from_s);
        let own: Vec<f64> = [
            fitted(DRIFT, &|cycle| cycle.mean_deg)?,
            fitted(FIRST_TERMS, &|cycle| cycle.amplitude_deg.ln())?,
            vec![0.0; TERMS - FIRST_TERMS],
            fitted(FIRST_TERMS, &carrier)?,
            vec![0.0; TERMS - FIRST_TERMS],
        ]
        .concat();
        let samples: Vec<_> = samples
            .iter()
            .take_while(|s| s.0 < to_s)
            .map(|(time_s, deg)| (tau(*time_s), *deg))
            .collect();
        Some(Self { samples, own: own.try_into().ok()? })
    }

    /// At its beginning.
    pub(super) fn amplitude_deg(&self) -> f64 {
        at(&self.own, &legendre(-1.0))[1]
    }

    pub(super) fn offset_deg(&self) -> f64 {
        self.own[0]
    }
}
