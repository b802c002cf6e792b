//! Time stamps coarser than the clock behind them: the sample's number is the better clock where they come in
//! bursts, or are even but for their own rounding.

use yawrig_core::record::Record;

/// Share of stamps that repeat the one before, beyond which they are a clock too coarse for the rate.
const COARSE: f64 = 0.1;
/// Ticks of the clock by which an evenly spread sample may be off its stamp.
const MOST_OFF: f64 = 1.5;
/// The same where each stamp is the sample's time, rounded or cut, and a tick at most this share of a step:
/// half a step off is a lost sample.
const ROUNDED_OFF: f64 = 0.7;
const FINE: f64 = 0.61;
/// Decimals of a stamp in s, at most.
const MOST_DECIMALS: i32 = 7;

/// Leaves out rows with a number missing.
pub fn leave_out_gaps(record: &mut Record) {
    let kept = |(t, y): &(f64, f64)| t.is_finite() && y.is_finite();
    let rows = record.time_s.iter().copied().zip(record.yaw_deg.iter().copied()).filter(kept);
    (record.time_s, record.yaw_deg) = rows.unzip();
}

/// Spreads samples evenly where many have the stamp of the one before, or all are even but for their
/// rounding; of a few that have the stamp of the one before, the first stands for all.
///
/// Time does not run backwards in `record`.
pub fn spread(record: &mut Record) {
    let time_s = &record.time_s;
    let repeated = time_s.windows(2).filter(|t| t[0] == t[1]).count();
    let in_bursts = repeated as f64 > COARSE * time_s.len() as f64;
    let even = if in_bursts {
        let steps = time_s.windows(2).map(|t| t[1] - t[0]);
        even(time_s, MOST_OFF * steps.filter(|step| *step > 0.0).fold(f64::MAX, f64::min))
    } else {
        let span_s = time_s.last().zip(time_s.first()).map_or(0.0, |(last, first)| last - first);
        let step_s = span_s / (time_s.len() as f64 - 1.0);
        decimal_tick_s(time_s)
            .filter(|tick_s| *tick_s < FINE * step_s)
            .and_then(|tick_s| even(time_s, ROUNDED_OFF * tick_s))
    };
    if let Some(even) = even {
        record.time_s = even;
        record.stamps_spread = in_bursts;
    } else if repeated > 0 {
        let n = record.time_s.len();
        let is_new: Vec<bool> =
            (0..n).map(|k| k == 0 || record.time_s[k] != record.time_s[k - 1]).collect();
        let (mut time, mut yaw) = (is_new.iter(), is_new.iter());
        record.time_s.retain(|_| *time.next().expect("as long"));
        record.yaw_deg.retain(|_| *yaw.next().expect("as long"));
    }
}

/// The power of ten, s, of which all stamps are multiples.
fn decimal_tick_s(time_s: &[f64]) -> Option<f64> {
    // Stamps of a calendar's seconds have ten digits before the point.
    let whole = |ticks: f64| (ticks - ticks.round()).abs() < f64::max(1e-4, 1e-15 * ticks.abs());
    (0..=MOST_DECIMALS)
        .map(|decimals| 10f64.powi(decimals))
        .find(|per_s| time_s.iter().all(|t| whole(t * per_s)))
        .map(f64::recip)
}

/// A straight line through the stamps against their number, where none is farther off it; none either where
/// the stamps are even as they are.
fn even(time_s: &[f64], most_off_s: f64) -> Option<Vec<f64>> {
    let n = time_s.len();
    let middle = 0.5 * (n - 1) as f64;
    let mean = time_s.iter().sum::<f64>() / n as f64;
    let (products, squares) = time_s.iter().enumerate().fold((0.0, 0.0), |(p, s), (k, t)| {
        let off = k as f64 - middle;
        (p + off * (t - mean), s + off * off)
    });
    let step_s = products / squares;
    let even: Vec<f64> = (0..n).map(|k| mean + (k as f64 - middle) * step_s).collect();
    let off_s = even.iter().zip(time_s).map(|(e, t)| (e - t).abs()).fold(0.0, f64::max);
    (1e-6 * step_s < off_s && off_s < most_off_s).then_some(even)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(stamp: impl Fn(usize) -> f64) -> Record {
        let yaw_deg = (0..400).map(|k| k as f64).collect();
        Record::new("r", (0..400).map(stamp).collect(), yaw_deg)
    }

    #[test]
    fn stamps_in_bursts_are_spread_and_no_sample_is_lost() {
        let mut r = record(|k| (k / 8) as f64 * 0.08);
        spread(&mut r);
        assert_eq!(r.yaw_deg.len(), 400);
        assert!(r.stamps_spread);
        let steps = r.time_s.windows(2).map(|t| t[1] - t[0]);
        assert!(steps.into_iter().all(|step| (step - 0.01).abs() < 1e-4));
    }

    #[test]
    fn stamps_even_but_for_their_rounding_are_spread() {
        for (rate_hz, decimals) in [(240.0, 1e4), (60.0, 1e2), (30.0, 1e3)] {
            for rounded in [f64::round, f64::floor] {
                for from_s in [0.0, 1.7e9] {
                    let mut r =
                        record(|k| from_s + rounded(k as f64 * decimals / rate_hz) / decimals);
                    spread(&mut r);
                    assert!(!r.stamps_spread);
                    let steps = r.time_s.windows(2).map(|t| t[1] - t[0]);
                    assert!(steps.into_iter().all(|step| (step * rate_hz - 1.0).abs() < 2e-3));
                }
            }
        }
    }

    #[test]
    fn stamps_off_an_even_clock_and_those_on_it_stay_as_they_are() {
        let jittered = |k: usize| k as f64 * 0.01 + if k % 7 == 3 { 0.002 } else { 0.0 };
        let lost = |k: usize| (k + usize::from(k > 200)) as f64 * 0.01;
        for stamp in [&jittered as &dyn Fn(usize) -> f64, &lost, &|k| k as f64 * 0.01] {
            let mut r = record(stamp);
            spread(&mut r);
            assert!(r == record(stamp));
        }
    }

    #[test]
    fn of_a_few_repeated_stamps_the_first_stands_for_all() {
        let mut r = record(|k| if k == 7 { 0.06 } else { k as f64 * 0.01 });
        spread(&mut r);
        assert_eq!((r.time_s.len(), r.yaw_deg[6], r.yaw_deg[7]), (399, 6.0, 8.0));
    }
}
