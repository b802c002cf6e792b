//! What the model may lack, by the envelope of what it leaves.
//!
//! The residual, turned back by the motion's phase and summed over half cycles, is the motion's envelope times
//! what is missing in the logarithm of its amplitude and in its phase, beside noise. The fit takes a constant
//! and a straight line out of both. Left may be
//!
//! - a law: amplitude and phase go on otherwise than straight, with one over the amplitude (dry friction),
//!   with the amplitude (drag) or with its square (a spring that is not straight);
//! - a random moment: each half cycle adds to the envelope what decays with the motion, a first-order process;
//! - a transient: something that decays with the motion and has a phase of its own.
//!
//! Laws in either, with and without a process, of each size, and none of them have the evidence of these sums
//! with the straight lines and the noise's size integrated out (MacKay, Neural Computation 4, 1992). The
//! expected square of what they put into decay and frequency is added to their variances.

use crate::refine::Parameters;

/// Sums that are kept: one look at all of them is one piece of work.
const MAX: usize = 48;
/// Fewest that tell anything of what is missing.
const MIN: usize = 8;
/// Half cycles in a sum at least.
const HALVES: f32 = 1.0;
/// How much likelier it is beforehand that nothing is missing than that something is, as a logarithm.
const NONE: f32 = 3.0;
/// And how much likelier it has to be that something is.
const SAID: f32 = 3.0;
/// Sizes of a process that are tried: variance that it adds to decay and frequency over that of noise.
const SIZES: [f32; 9] = [1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0, 16384.0, 65536.0];
/// Those of a law: its strength's variance over that of noise.
const STRENGTHS: [f32; 5] = [1.0, 10.0, 100.0, 1e3, 1e4];
/// Laws that are tried: the power of the amplitude that they put into the envelope.
const LAWS: [u8; 3] = [0, 2, 3];
/// A law takes at most this share of what the lines leave: the rest is rounding.
const CERTAIN: f32 = 0.999_99;
/// Columns: the two lines and the laws.
const COLUMNS: usize = 2 + LAWS.len();
/// Amplitude and phase.
const SERIES: usize = 2;

/// One logarithm is taken of many factors: whenever their product is larger than this. Instructions of the
/// largest piece of work without an FPU: 493 000 with libm's logarithm of each, 460 000 with micromath's, 418
/// 000 so, and no error; with an FPU micromath's cost more than libm's.
const MANY: f32 = 1e18;

/// What is found of decay and frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Missing {
    /// Variance that what is missing adds, as white noise of such a density would.
    pub added: [f32; SERIES],
    /// Something is missing rather than nothing.
    pub likely: bool,
}

/// Evidence (as a logarithm) of all that was tried, and what it adds on the average of it.
#[derive(Clone, Copy, Debug)]
struct Average<const N: usize> {
    evidence: f32,
    added: [f32; N],
}

impl<const N: usize> Average<N> {
    const NONE: Self = Self { evidence: f32::NEG_INFINITY, added: [0.0; N] };

    fn take(&mut self, evidence: f32, added: [f32; N]) {
        let most = self.evidence.max(evidence);
        let [a, b] = [self.evidence, evidence].map(|each| libm::expf(each - most));
        let share = b / (a + b);
        for (all, added) in self.added.iter_mut().zip(added) {
            *all += share * (added - *all);
        }
        self.evidence = most + libm::logf(a + b);
    }
}

/// Sums under way, then what is made of them.
#[derive(Clone, Debug)]
pub struct Envelope {
    /// Of the logarithm of amplitude, and of phase, times the amplitude.
    sums: [[f32; SERIES]; MAX],
    count: usize,
    coming: [f32; 2],
    /// Points in a sum, and those that came since the last one was complete.
    per_sum: f32,
    since: f32,
    /// The motion's phase where it begins.
    direction: [f32; 2],
    /// Decay from one sum to the next, and what it leaves.
    decay: f32,
    left: f32,
    /// Which process of which size is next, or has been whitened.
    next: usize,
    whitened: bool,
    products: Products,
    unwhitened: Products,
    logs: f32,
    none: f32,
    all: Average<SERIES>,
}

/// Sums of products of columns and series.
#[derive(Clone, Copy, Debug)]
struct Products {
    columns: [[f32; COLUMNS]; 2],
    squares: [f32; COLUMNS],
    by_series: [[f32; COLUMNS]; SERIES],
    series: [f32; SERIES],
}

impl Products {
    const NONE: Self = Self {
        columns: [[0.0; COLUMNS]; 2],
        squares: [0.0; COLUMNS],
        by_series: [[0.0; COLUMNS]; SERIES],
        series: [0.0; SERIES],
    };

    #[inline(always)]
    fn add(&mut self, columns: &[f32; COLUMNS], series: &[f32; SERIES], weight: f32) {
        for (j, column) in columns.iter().enumerate() {
            let weighted = weight * column;
            self.columns[0][j] += weighted * columns[0];
            self.columns[1][j] += weighted * columns[1];
            self.squares[j] += weighted * column;
            for (products, y) in self.by_series.iter_mut().zip(series) {
                products[j] += weighted * y;
            }
        }
        for (square, y) in self.series.iter_mut().zip(series) {
            *square += weight * y * y;
        }
    }

    fn determinant(&self) -> f32 {
        self.squares[0] * self.squares[1] - self.columns[0][1] * self.columns[0][1]
    }

    /// The two lines' shares in something of which the products with them are known.
    fn shares(&self, [a, b]: [f32; 2]) -> [f32; 2] {
        let ([aa, bb, ..], ab) = (self.squares, self.columns[0][1]);
        let per = 1.0 / self.determinant();
        [per * (bb * a - ab * b), per * (aa * b - ab * a)]
    }

    /// The lines' shares in a column.
    fn in_column(&self, j: usize) -> [f32; 2] {
        self.shares([self.columns[0][j], self.columns[1][j]])
    }

    /// What the lines leave of a series' squares.
    fn left(&self, series: usize) -> f32 {
        let [a, b, ..] = self.by_series[series];
        let [x, y] = self.shares([a, b]);
        (self.series[series] - x * a - y * b).max(f32::MIN_POSITIVE)
    }

    /// A column beyond the lines: its strength in a series, and what that takes of what they leave.
    fn beyond(&self, j: usize, series: usize) -> [f32; 2] {
        let [x, y] = self.in_column(j);
        let products = &self.by_series[series];
        let rest = self.squares[j] - x * self.columns[0][j] - y * self.columns[1][j];
        let along = products[j] - x * products[0] - y * products[1];
        [along / rest, along * along / rest]
    }
}

impl Envelope {
    /// None yet.
    pub const NONE: Self = Self {
        sums: [[0.0; SERIES]; MAX],
        count: 0,
        coming: [0.0; 2],
        per_sum: f32::INFINITY,
        since: 0.0,
        direction: [0.0; 2],
        decay: 0.0,
        left: 1.0,
        next: 0,
        whitened: false,
        products: Products::NONE,
        unwhitened: Products::NONE,
        logs: 0.0,
        none: 0.0,
        all: Average::NONE,
    };

    /// Of `count` points about `model`.
    pub fn new(model: &Parameters, count: usize) -> Self {
        let half = core::f32::consts::PI / model.frequency as f32;
        let halves = libm::ceilf(count as f32 / (half * MAX as f32)).max(HALVES);
        let per_sum = half * halves;
        let (a, b) = (model.cosine as f32, model.sine as f32);
        let per = 1.0 / libm::hypotf(a, b);
        let decay = model.decay as f32 * per_sum;
        Self {
            per_sum,
            direction: [a * per, b * per],
            decay,
            left: libm::expf(-decay),
            ..Self::NONE
        }
    }

    /// Takes the product of the next residual with the turn of the motion.
    #[inline(always)]
    pub fn add(&mut self, re: f32, im: f32) {
        self.coming[0] += re;
        self.coming[1] += im;
        self.since += 1.0;
        if self.since >= self.per_sum {
            self.since -= self.per_sum;
            let [x, y] = core::mem::take(&mut self.coming);
            let [a, b] = self.direction;
            if self.count < MAX {
                self.sums[self.count] = [a * x + b * y, b * x - a * y];
                self.count += 1;
            }
        }
    }

    /// Goes on by one piece; true where that was the last.
    #[inline(never)]
    pub fn work(&mut self) -> bool {
        if self.count < MIN {
            return true;
        }
        // None, then those of the random moment, then those of the transient.
        let (moment, size) = match self.next {
            0 => (false, 0.0),
            next => (next <= SIZES.len(), SIZES[(next - 1) % SIZES.len()]),
        };
        if !self.whitened {
            self.whiten(moment, size);
        } else {
            self.weigh(size);
            self.next += 1;
        }
        self.whitened = !self.whitened;
        self.next > 2 * SIZES.len()
    }

    /// Variance of a process that one sum gains over that of noise, by the motion's amplitude there, where it
    /// adds so much more than noise to decay and frequency.
    fn gained(&self, moment: bool, size: f32) -> f32 {
        if size == 0.0 {
            return 0.0;
        }
        let memory = if moment { self.left } else { 0.0 };
        // Backwards: what one adds to the second line's share.
        let [x, y] = self.unwhitened.shares([0.0, 1.0]);
        let per = 1.0 / self.count as f32;
        let mut amplitude = libm::expf(-self.decay * (self.count as f32 - 0.5));
        let growth = 1.0 / self.left;
        let (mut adjoint, mut sum) = (0.0, 0.0);
        for k in (0..self.count).rev() {
            let t = (k as f32 + 0.5) * per;
            adjoint = memory * adjoint + (x + t * y) * amplitude;
            let gained = if moment { 1.0 } else { amplitude * amplitude };
            sum += gained * adjoint * adjoint;
            amplitude *= growth;
        }
        size * y / sum
    }

    /// Makes white what a process adds to the noise, by its Kalman filter.
    fn whiten(&mut self, moment: bool, size: f32) {
        let gained = self.gained(moment, size);
        let memory = if moment { self.left } else { 0.0 };
        let per = 1.0 / self.count as f32;
        let (mut amplitude, mut t) = (libm::expf(-0.5 * self.decay), 0.5 * per);
        let mut products = Products::NONE;
        let (mut columns_states, mut states) = ([0.0; COLUMNS], [0.0; SERIES]);
        let (mut known, mut logs, mut factors) = (0.0_f32, 0.0_f32, 1.0_f32);
        for series in &self.sums[..self.count] {
            let mut columns = [amplitude, t * amplitude, 0.0, 0.0, 0.0];
            for (column, power) in columns[2..].iter_mut().zip(LAWS) {
                *column = (0..power).fold(1.0, |product, _| product * amplitude);
            }
            let more = if moment { gained } else { gained * amplitude * amplitude };
            let before = memory * memory * known + more;
            let weight = 1.0 / (before + 1.0);
            let gain = before * weight;
            for (column, state) in columns.iter_mut().zip(&mut columns_states) {
                *column -= memory * *state;
                *state = memory * *state + gain * *column;
            }
            let mut innovations = *series;
            for (innovation, state) in innovations.iter_mut().zip(&mut states) {
                *innovation -= memory * *state;
                *state = memory * *state + gain * *innovation;
            }
            products.add(&columns, &innovations, weight);
            factors *= before + 1.0;
            if factors > MANY {
                logs += libm::logf(factors);
                factors = 1.0;
            }
            known = gain;
            amplitude *= self.left;
            t += per;
        }
        self.products = products;
        self.logs = logs + libm::logf(factors);
        if size == 0.0 {
            self.unwhitened = products;
        }
    }

    /// The evidence of what has been made white, without and with laws.
    fn weigh(&mut self, size: f32) {
        let freedom = self.count as f32 - 2.0;
        let lines = libm::logf(self.products.determinant() / self.unwhitened.determinant());
        let lefts = [0, 1].map(|series| self.products.left(series));
        let by_noise = 0.5 * freedom * (libm::logf(lefts[0]) + libm::logf(lefts[1]));
        let evidence = -self.logs - lines - by_noise;
        let density = 2.0 / self.per_sum;
        let process = density * size * 0.5 * (lefts[0] + lefts[1]) / freedom;
        let [amplitude, phase] = [0, 1].map(|series| self.laws(series, lefts[series], freedom));
        let [by_amplitude, by_phase] =
            [amplitude, phase].map(|law| density * law.added[0] + process);
        let mut all = self.all;
        let mut prior = 0.0;
        if size == 0.0 {
            self.none = evidence + NONE;
        } else {
            prior = libm::logf(SIZES.len() as f32);
            all.take(evidence - prior, [process; SERIES]);
        }
        let beside = evidence - prior;
        all.take(beside + amplitude.evidence, [by_amplitude, process]);
        all.take(beside + phase.evidence, [process, by_phase]);
        all.take(beside + amplitude.evidence + phase.evidence, [by_amplitude, by_phase]);
        self.all = all;
    }

    /// How much likelier laws are than none in one series, as a logarithm, and what they are expected to add.
    fn laws(&self, series: usize, left: f32, freedom: f32) -> Average<1> {
        let own = self.unwhitened.shares([0.0, 1.0])[1];
        let mut laws = Average::NONE;
        for j in 2..COLUMNS {
            let [strength, taken] = self.products.beyond(j, series);
            let off = self.unwhitened.in_column(j)[1] * strength;
            let added = [off * off / own];
            let gains = STRENGTHS.map(|size| {
                let taken = (taken / left).min(CERTAIN) * size / (1.0 + size);
                let gain = libm::logf(1.0 - taken) * freedom + libm::logf(1.0 + size);
                -0.5 * gain
            });
            let most = gains.into_iter().fold(f32::NEG_INFINITY, f32::max);
            let sum: f32 = gains.iter().map(|gain| libm::expf(gain - most)).sum();
            let each = sum / (LAWS.len() * STRENGTHS.len()) as f32;
            laws.take(most + libm::logf(each), added);
        }
        laws
    }

    /// What is found, once the work is done.
    pub fn missing(&self) -> Missing {
        let odds = libm::expf((self.none - self.all.evidence).min(80.0));
        let share = 1.0 / (1.0 + odds);
        Missing { added: self.all.added.map(|added| share * added), likely: SAID * odds < 1.0 }
    }
}
