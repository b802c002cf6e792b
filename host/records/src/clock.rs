//! Time stamps that are repeated: the sample's number is the better clock where they come in bursts.

use yawrig_core::record::Record;

/// Share of stamps that repeat the one before, beyond which they are a clock too coarse for the rate.
const COARSE: f64 = 0.1;
/// Ticks of the clock by which an evenly spread sample may be off its stamp.
const MOST_OFF: f64 = 1.5;

/// Leaves out rows with a number missing.
pub fn leave_out_gaps(record: &mut Record) {
    let kept = |(t, y): &(f64, f64)| t.is_finite() && y.is_finite();
    let rows = record.time_s.iter().copied().zip(record.yaw_deg.iter().copied()).filter(kept);
    (record.time_s, record.yaw_deg) = rows.unzip();
}

/// Spreads samples evenly where many have the stamp of the one before; of a few that do, the first stands for all.
///
/// Time does not run backwards in `record`.
pub fn spread(record: &mut Record) {
    let time_s = &record.time_s;
    let repeated = time_s.windows(2).filter(|t| t[0] == t[1]).count();
    if repeated as f64 > COARSE * time_s.len() as f64 {
        if let Some(even) = even(time_s) {
            record.time_s = even;
            return;
        }
    }
    if repeated > 0 {
        let n = record.time_s.len();
        let is_new: Vec<bool> =
            (0..n).map(|k| k == 0 || record.time_s[k] != record.time_s[k - 1]).collect();
        let (mut time, mut yaw) = (is_new.iter(), is_new.iter());
        record.time_s.retain(|_| *time.next().expect("as long"));
        record.yaw_deg.retain(|_| *yaw.next().expect("as long"));
    }
}

/// A straight line through the stamps against their number, where none is far off it.
fn even(time_s: &[f64]) -> Option<Vec<f64>> {
    let n = time_s.len();
    let middle = 0.5 * (n - 1) as f64;
    let mean = time_s.iter().sum::<f64>() / n as f64;
    let (products, squares) = time_s.iter().enumerate().fold((0.0, 0.0), |(p, s), (k, t)| {
        let off = k as f64 - middle;
        (p + off * (t - mean), s + off * off)
    });
    let step_s = products / squares;
    let even: Vec<f64> = (0..n).map(|k| mean + (k as f64 - middle) * step_s).collect();
    let tick_s =
        time_s.windows(2).map(|t| t[1] - t[0]).filter(|step| *step > 0.0).fold(f64::MAX, f64::min);
    let is_near = |(even, t): (&f64, &f64)| (even - t).abs() < MOST_OFF * tick_s;
    even.iter().zip(time_s).all(is_near).then_some(even)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(stamp: impl Fn(usize) -> f64) -> Record {
        let yaw_deg = (0..400).map(|k| k as f64).collect();
        Record { file: "r".into(), time_s: (0..400).map(stamp).collect(), yaw_deg }
    }

    #[test]
    fn stamps_in_bursts_are_spread_and_no_sample_is_lost() {
        let mut r = record(|k| (k / 8) as f64 * 0.08);
        spread(&mut r);
        assert_eq!(r.yaw_deg.len(), 400);
        let steps = r.time_s.windows(2).map(|t| t[1] - t[0]);
        assert!(steps.into_iter().all(|step| (step - 0.01).abs() < 1e-4));
    }

    #[test]
    fn of_a_few_repeated_stamps_the_first_stands_for_all() {
        let mut r = record(|k| if k == 7 { 0.06 } else { k as f64 * 0.01 });
        spread(&mut r);
        assert_eq!((r.time_s.len(), r.yaw_deg[6], r.yaw_deg[7]), (399, 6.0, 8.0));
    }
}
