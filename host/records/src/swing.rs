//! What a channel's numbers do: whether they swing and die away, and a picture of it in text.

use super::names;
use super::quantity::{self, Quantity};
use super::table::{Channel, MIN_SAMPLES};
use super::times;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::record::Record;

/// What a picture's clock is; nothing of it is shown.
const SAMPLES_HZ: f64 = 1000.0;
/// Share of its amplitude down to which what is left to itself is seen to fall.
const DECAYS_TO: f64 = 0.9;
/// Of more samples, means are looked at.
const MAX_SAMPLES: usize = 50_000;
/// Of two channels in one unit that swing, both leave so small a share of it unexplained: the larger is
/// meant.
const CLEARLY: f64 = 0.1;
/// Bars of a picture.
const BARS: usize = 24;

/// The numbers of a channel without its gaps.
pub(super) fn finite(channel: &Channel) -> Vec<f64> {
    let values = channel.values.as_deref().unwrap_or_default();
    values.iter().copied().filter(|value| value.is_finite()).collect()
}

/// The unit that a channel says it is in.
pub(super) fn unit_of(channel: &Channel) -> Option<&str> {
    let by_name = channel.own_name().rsplit_once('_').map(|(_, unit)| unit);
    let by_name = by_name.filter(|unit| quantity::angular(unit).is_some());
    by_name.or(channel.unit.as_deref()).map(str::trim).filter(|unit| !unit.is_empty())
}

pub(super) fn increases(channel: &Channel) -> bool {
    let values = finite(channel);
    values.len() > 2
        && values.windows(2).all(|v| v[1] >= v[0])
        && values.windows(2).filter(|v| v[1] > v[0]).count() > values.len() / 4
}

/// How far from what is wanted, by its name and by what its unit says: an angle, what may be one, a place, a
/// rate, an acceleration.
fn rank(channel: &Channel) -> (u8, u8) {
    let name = channel.own_name();
    let by_name = names::as_yaw(name).or_else(|| names::as_angle(name)).unwrap_or(u8::MAX);
    let by_unit = match unit_of(channel) {
        None if names::says_no_angle(name) => 2,
        None => 1,
        Some(unit) if quantity::meant(Some(Quantity::Angle), Some(unit)).is_ok() => 0,
        Some(unit) => match quantity::meant(None, Some(unit)) {
            Ok(meant) if meant.measurand.quantity() == "acceleration" => 4,
            Ok(_) => 3,
            Err(_) => match Quantity::likely(unit) {
                Quantity::Acceleration => 4,
                Quantity::Rate => 3,
                _ => 2,
            },
        },
    };
    (by_name, by_unit)
}

/// The channels that may be meant, the likeliest first: what swings and dies away, best by its name, then by
/// its unit, then by how well it does so, or of one unit how far; then what is called an angle, or is alone.
pub(super) fn likely<'a>(table: &'a [Channel], time: Option<&Channel>) -> Vec<&'a Channel> {
    let is_other = |c: &&Channel| {
        time.is_none_or(|time| !std::ptr::eq(time, *c))
            && times::rank(c) != Some(0)
            && !increases(c)
            && finite(c).len() > 2
    };
    let others: Vec<&Channel> = table.iter().filter(is_other).collect();
    let mut swings: Vec<(&Channel, f64)> =
        others.iter().filter_map(|c| Some((*c, misfit(c)?))).collect();
    swings.sort_by(|(a, of_a), (b, of_b)| {
        let clear = *of_a < CLEARLY && *of_b < CLEARLY && unit_of(a) == unit_of(b);
        rank(a).cmp(&rank(b)).then(match clear {
            true => range(b).total_cmp(&range(a)),
            false => of_a.total_cmp(of_b),
        })
    });
    let mut all: Vec<&Channel> = swings.into_iter().map(|(channel, _)| channel).collect();
    let mut named: Vec<&Channel> =
        others.iter().copied().filter(|c| rank(c) < (u8::MAX, 1)).collect();
    named.sort_by_key(|c| rank(c));
    all.extend(named);
    if let [one] = others[..] {
        all.push(one);
    }
    all
}

fn range(channel: &Channel) -> f64 {
    let ends = |(low, high): (f64, f64), v: &f64| (low.min(*v), high.max(*v));
    let (low, high) = finite(channel).iter().fold((f64::MAX, f64::MIN), ends);
    high - low
}

/// Share of its amplitude that a damped oscillation leaves of a channel; none where it is none.
fn misfit(channel: &Channel) -> Option<f64> {
    let values = finite(channel);
    let each = values.len() / MAX_SAMPLES + 1;
    let means = values.chunks(each).map(|part| part.iter().sum::<f64>() / part.len() as f64);
    let values: Vec<f64> = means.collect();
    if values.len() < MIN_SAMPLES {
        return None;
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let largest = values.iter().map(|value| (value - mean).abs()).fold(0.0, f64::max);
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    // Neither its size nor its clock matters.
    let scaled = values.iter().map(|value| (value - mean) / largest * 10.0).collect();
    let time_s = (0..values.len()).map(|k| k as f64 / SAMPLES_HZ).collect();
    let record = Record::new("", time_s, scaled);
    let settings = Settings { from_deg: 360.0, to_deg: 1e-3, ..Settings::default() };
    let found = identify(&record, &[Method::LeastSquares], &settings).ok()?;
    let decays = found.window.to_deg < DECAYS_TO * found.window.from_deg;
    let estimate = found.estimates.first().filter(|_| decays)?;
    Some(estimate.residual_rms_deg / found.window.from_deg)
}

/// Whether a decay is found in what was read.
pub(super) fn is_found(record: &Record) -> bool {
    identify(record, &[Method::LeastSquares], &Settings::default()).is_ok()
}

/// Share of all it counts by which an encoder jumps where it begins anew, as no motion does between samples.
const JUMP: f64 = 0.75;

/// After how many counts, a power of two, whole numbers begin anew; none where they do not.
pub(super) fn counts_a_turn(channel: &Channel) -> Option<u64> {
    let values = finite(channel);
    let whole = values.iter().all(|v| v.fract() == 0.0 && (0.0..1e9).contains(v));
    let most = values.iter().copied().fold(0.0, f64::max);
    let turn = (most as u64 + 1).next_power_of_two();
    let jumps = values.windows(2).any(|v| (v[1] - v[0]).abs() > JUMP * turn as f64);
    (whole && jumps).then_some(turn)
}

/// How far a channel swings from its beginning to its end, as bars; none of what does not swing to and fro.
pub(super) fn picture(channel: &Channel) -> Option<String> {
    const HEIGHTS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let values = finite(channel);
    if values.len() < 2 * BARS || increases(channel) {
        return None;
    }
    let each = values.len() / BARS;
    let ends = |(low, high): (f64, f64), v: &f64| (low.min(*v), high.max(*v));
    let far: Vec<f64> = values
        .chunks_exact(each)
        .take(BARS)
        .map(|part| part.iter().fold((f64::MAX, f64::MIN), ends))
        .map(|(low, high)| high - low)
        .collect();
    let most = far.iter().copied().fold(0.0, f64::max);
    let top = (HEIGHTS.len() - 1) as f64;
    let bar = |far: &f64| HEIGHTS[(far / most * top).round() as usize];
    (most > 0.0 && most.is_finite()).then(|| far.iter().map(bar).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_encoder_counts_a_turn_where_it_begins_anew() {
        let of = |zero: i32| Channel {
            name: "x".to_owned(),
            unit: None,
            step_s: None,
            values: Ok((0..400)
                .map(|k| (100.0 * (f64::from(k) * 0.1).cos()).round() as i32 + zero)
                .map(|counts| f64::from(counts.rem_euclid(4096)))
                .collect()),
        };
        assert_eq!((counts_a_turn(&of(30)), counts_a_turn(&of(500))), (Some(4096), None));
    }

    #[test]
    fn a_picture_shows_what_dies_away() {
        let channel = |of: fn(f64) -> f64| Channel {
            name: "x".to_owned(),
            unit: None,
            step_s: None,
            values: Ok((0..480).map(|k| of(f64::from(k) / 40.0)).collect()),
        };
        let decay = picture(&channel(|t| (-0.3 * t).exp() * (9.0 * t).cos())).expect("bars");
        assert_eq!(decay.chars().count(), BARS);
        assert!(decay.starts_with('█') && decay.ends_with('▁'), "{decay}");
        assert_eq!(picture(&channel(|t| t)), None);
        assert_eq!(picture(&channel(|_| 1.0)), None);
    }
}
