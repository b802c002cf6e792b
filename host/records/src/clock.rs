//! The clock behind time stamps: where these are coarser than it, the sample's number is the better clock,
//! and its rate is known as well as the stamps tell it.

use yawrig_core::record::Record;

/// Share of stamps that repeat the one before, beyond which they are a clock too coarse for the rate.
const COARSE: f64 = 0.1;
/// Ticks of the clock by which an evenly spread sample may be off its stamp.
const MAX_OFF: f64 = 1.5;
/// The same where each stamp is the sample's time, rounded or cut, and a tick at most this share of a step:
/// half a step off is a lost sample.
const ROUNDED_OFF: f64 = 0.7;
const FINE: f64 = 0.61;
/// Decimals of a stamp in s, at most.
const MAX_DECIMALS: i32 = 7;
/// Share of the rows that may be out of order and be left out: fewer than are lost to no harm, and no second
/// recording.
const FEW: f64 = 0.01;
/// Halvings of an interval of rates, down to the digits of a number.
const HALVINGS: usize = 50;

/// Leaves out rows with a number missing; how many.
pub fn leave_out_gaps(record: &mut Record) -> usize {
    let before = record.len();
    let kept = |(t, y): &(f64, f64)| !t.is_nan() && !y.is_nan();
    let rows = record.time_s.iter().copied().zip(record.yaw_deg.iter().copied()).filter(kept);
    (record.time_s, record.yaw_deg) = rows.unzip();
    before - record.len()
}

/// Leaves out the fewest rows whose stamps run backwards, where these are few; how many.
pub fn leave_out_stragglers(record: &mut Record) -> usize {
    let time_s = &record.time_s;
    if time_s.windows(2).all(|t| t[0] <= t[1]) {
        return 0;
    }
    let kept = longest_rising(time_s);
    let left_out = time_s.len() - kept.len();
    if left_out as f64 > FEW * time_s.len() as f64 {
        return 0;
    }
    let of = |values: &[f64]| kept.iter().map(|k| values[*k]).collect();
    (record.time_s, record.yaw_deg) = (of(&record.time_s), of(&record.yaw_deg));
    left_out
}

/// The numbers of the most of `values` of which none is less than the one before.
fn longest_rising(values: &[f64]) -> Vec<usize> {
    // The last of the best row of each length, and what stands before each.
    let (mut ends, mut before): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
    for (k, value) in values.iter().enumerate() {
        let at = ends.partition_point(|end| values[*end] <= *value);
        before.push(at.checked_sub(1).map_or(k, |at| ends[at]));
        match ends.get_mut(at) {
            Some(end) => *end = k,
            None => ends.push(k),
        }
    }
    let mut row = Vec::with_capacity(ends.len());
    let mut at = ends.last().copied();
    for _ in 0..ends.len() {
        row.extend(at);
        at = at.map(|k| before[k]);
    }
    row.reverse();
    row
}

/// Spreads samples evenly where many have the stamp of the one before, or all are even but for their
/// rounding, and says how well their rate is known then; of a few that have the stamp of the one before, the
/// first stands for all.
///
/// # Errors
/// In words, where many have the stamp of the one before and no even clock has such stamps.
pub fn spread(record: &mut Record) -> Result<(), String> {
    let time_s = &record.time_s;
    if time_s.len() < 3 || time_s.windows(2).any(|t| t[0] > t[1]) {
        return Ok(());
    }
    let repeated = time_s.windows(2).filter(|t| t[0] == t[1]).count();
    let in_bursts = repeated as f64 > COARSE * time_s.len() as f64;
    let even = if in_bursts {
        let mut steps: Vec<f64> =
            time_s.windows(2).map(|t| t[1] - t[0]).filter(|step| *step > 0.0).collect();
        let middle = steps.len() / 2;
        let no_even = || {
            format!(
                "{repeated} of {} samples have the time of the one before, and no even clock has such times",
                time_s.len()
            )
        };
        if steps.is_empty() {
            return Err(no_even());
        }
        let tick_s = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        Some(Even::new(time_s, tick_s, MAX_OFF).ok_or_else(no_even)?)
    } else {
        let step_s = (time_s[time_s.len() - 1] - time_s[0]) / (time_s.len() as f64 - 1.0);
        let fine = decimal_tick_s(time_s).filter(|tick_s| *tick_s < FINE * step_s);
        fine.and_then(|tick_s| Even::new(time_s, tick_s, ROUNDED_OFF))
    };
    if let Some(Even { first_s, step_s, u_s, .. }) = even {
        record.time_s = (0..record.len()).map(|k| first_s + k as f64 * step_s).collect();
        record.stamps_spread = in_bursts;
        record.rate_u = u_s / step_s;
    } else if repeated > 0 {
        let n = record.time_s.len();
        let is_new: Vec<bool> =
            (0..n).map(|k| k == 0 || record.time_s[k] != record.time_s[k - 1]).collect();
        let (mut time, mut yaw) = (is_new.iter(), is_new.iter());
        record.time_s.retain(|_| *time.next().expect("as long"));
        record.yaw_deg.retain(|_| *yaw.next().expect("as long"));
    }
    Ok(())
}

/// The power of ten, s, of which all stamps are multiples.
fn decimal_tick_s(time_s: &[f64]) -> Option<f64> {
    // Stamps of a calendar's seconds have ten digits before the point.
    let whole = |ticks: f64| (ticks - ticks.round()).abs() < f64::max(1e-4, 1e-15 * ticks.abs());
    (0..=MAX_DECIMALS)
        .map(|decimals| 10f64.powi(decimals))
        .find(|per_s| time_s.iter().all(|t| whole(t * per_s)))
        .map(f64::recip)
}

/// An even clock, of which the stamps are what a coarser one shows.
struct Even {
    first_s: f64,
    step_s: f64,
    /// Standard uncertainty of the step: any in an interval may be.
    u_s: f64,
}

impl Even {
    /// Of a clock that ticks every `tick_s`, from whose stamps no sample is farther than `most_off` ticks;
    /// none either where the stamps are even as they are.
    fn new(time_s: &[f64], tick_s: f64, most_off: f64) -> Option<Self> {
        let last = (time_s.len() - 1) as f64;
        let chord_s = (time_s[time_s.len() - 1] - time_s[0]) / last;
        // Only the first and the last sample of a stamp bind its clock.
        let ends: Vec<(f64, f64)> = (0..time_s.len())
            .filter(|k| {
                let same = |other: Option<&f64>| other == Some(&time_s[*k]);
                !(same(time_s.get(k + 1)) && same(k.checked_sub(1).and_then(|k| time_s.get(k))))
            })
            .map(|k| (k as f64, time_s[k] - time_s[0]))
            .collect();
        let range = |step_s: f64| {
            let off = ends.iter().map(|(k, t)| t - k * step_s);
            off.fold((f64::MAX, f64::MIN), |(low, high), off| (low.min(off), high.max(off)))
        };
        // How far apart stamps are from one even clock: convex in its step.
        let width_s = |step_s: f64| {
            let (low, high) = range(step_s);
            high - low
        };
        let reach_s = width_s(chord_s) / last;
        let (mut low_s, mut high_s) = (chord_s - reach_s, chord_s + reach_s);
        for _ in 0..2 * HALVINGS {
            let third_s = (high_s - low_s) / 3.0;
            match width_s(low_s + third_s) < width_s(high_s - third_s) {
                true => high_s -= third_s,
                false => low_s += third_s,
            }
        }
        let best_s = 0.5 * (low_s + high_s);
        let least_s = width_s(best_s);
        if least_s <= 2e-6 * best_s || least_s > 2.0 * most_off * tick_s {
            return None;
        }
        // Any clock does whose samples are within a tick; where none is, what is more may be as much again.
        let allowed_s = least_s.max(tick_s) + (least_s - tick_s).max(0.0);
        let end = |towards: f64| {
            let (mut inside, mut outside) = (best_s, chord_s + towards * allowed_s / last);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (inside + outside);
                match width_s(middle) <= allowed_s {
                    true => inside = middle,
                    false => outside = middle,
                }
            }
            inside
        };
        let (shortest_s, longest_s) = (end(-1.0), end(1.0));
        let step_s = 0.5 * (shortest_s + longest_s);
        let (low, high) = range(step_s);
        let u_s = 0.5 * (longest_s - shortest_s) / 3f64.sqrt();
        Some(Self { first_s: time_s[0] + 0.5 * (low + high), step_s, u_s })
    }
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
        spread(&mut r).unwrap();
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
                    spread(&mut r).unwrap();
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
            spread(&mut r).unwrap();
            assert!(r == record(stamp));
        }
    }

    #[test]
    fn of_a_few_repeated_stamps_the_first_stands_for_all() {
        let mut r = record(|k| if k == 7 { 0.06 } else { k as f64 * 0.01 });
        spread(&mut r).unwrap();
        assert_eq!((r.time_s.len(), r.yaw_deg[6], r.yaw_deg[7]), (399, 6.0, 8.0));
    }

    #[test]
    fn the_true_rate_is_within_what_coarse_stamps_tell_of_it() {
        for (rate_hz, from_s) in [(25.0, 0.3), (30.0, 0.0), (29.97, 0.77), (60.0, 0.1)] {
            let mut r = record(|k| (from_s + k as f64 / rate_hz).floor());
            spread(&mut r).unwrap();
            let found = 399.0 / (r.time_s[399] - r.time_s[0]);
            assert!(r.stamps_spread && r.rate_u > 0.0 && r.rate_u < 0.2, "{}", r.rate_u);
            // Evenly likely in an interval, it is at most so many standard deviations off.
            let off = (found / rate_hz - 1.0).abs() / r.rate_u;
            assert!(off < 1.75, "{found} of {rate_hz}: {off}");
        }
    }

    #[test]
    fn stamps_of_no_even_clock_are_refused_and_a_few_stragglers_left_out() {
        let mut slowing = record(|k| (1e-3 * (k * k) as f64 / 8.0).floor());
        assert!(spread(&mut slowing).unwrap_err().contains("no even clock"));
        let stamp = |k: usize| match k {
            70 => 0.1,
            200 => 9.0,
            _ => k as f64 * 0.01,
        };
        let mut r = record(stamp);
        assert_eq!(leave_out_stragglers(&mut r), 2);
        assert_eq!((r.len(), r.yaw_deg[70], r.yaw_deg[199]), (398, 71.0, 201.0));
        let mut two = record(|k| (k % 300) as f64);
        assert_eq!((leave_out_stragglers(&mut two), two.len()), (0, 400));
    }
}
