//! Times of day, dates with one, and how long something has taken, as programs write them.

/// 2020-03-01, in days from the year 0 on.
const SPRING_2020: i64 = 737_791;
const DAY_S: f64 = 86_400.0;
const MONTHS: [&str; 12] =
    ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];

/// Seconds of `12:03:04.125`, of a date with such a time behind it, from spring 2020 on, or of `0 days
/// 00:00:00.040`. Of `5/7/2021` the month stands first unless it cannot.
pub fn clock_s(text: &str) -> Option<f64> {
    let text = text.trim();
    // What holds no colon is none; most words are told by that.
    text.contains(':').then_some(())?;
    let (text, half) = without_half(text.trim_end_matches('Z').trim_end());
    if let Some((days, time)) = text.split_once(" day") {
        let days: f64 = days.trim().parse().ok()?;
        let time = time.trim_start_matches('s').trim_start_matches(',').trim();
        return Some(DAY_S * days + time_s(time.trim_start_matches('+'), None)?);
    }
    let (date, time) = match text.rsplit_once(['T', ' ']) {
        Some((date, time)) => (Some(date.trim()), time),
        None => (None, text),
    };
    let (time, zone_s) = without_zone(time);
    let days = date.map_or(Some(0.0), |date| days(date).map(|days| days as f64))?;
    Some(DAY_S * days + time_s(time, half)? - zone_s)
}

/// Whether it is the date that may stand before a time.
pub fn is_date(text: &str) -> bool {
    days(text).is_some()
}

/// Whether it is what stands behind the hours of half a day.
pub fn is_half(text: &str) -> bool {
    ["am", "pm"].iter().any(|half| text.eq_ignore_ascii_case(half))
}

/// `text` without its AM or PM, and the hour at which that half begins.
fn without_half(text: &str) -> (&str, Option<u32>) {
    let Some(at) = text.len().checked_sub(2).filter(|at| text.is_char_boundary(*at)) else {
        return (text, None);
    };
    match &text[at..] {
        half if half.eq_ignore_ascii_case("am") => (text[..at].trim_end(), Some(0)),
        half if half.eq_ignore_ascii_case("pm") => (text[..at].trim_end(), Some(12)),
        _ => (text, None),
    }
}

/// `time` without its `+02:00`, and that in seconds.
fn without_zone(time: &str) -> (&str, f64) {
    let zone = || {
        let at = time.rfind(['+', '-']).filter(|at| *at > 0)?;
        let digits: String = time[at + 1..].chars().filter(|c| *c != ':').collect();
        let number = |part: Option<&str>| part?.parse::<f64>().ok();
        let minutes = if digits.len() == 2 { 0.0 } else { number(digits.get(2..4))? };
        let s = 3600.0 * number(digits.get(..2))? + 60.0 * minutes;
        Some((&time[..at], if time[at..].starts_with('-') { -s } else { s }))
    };
    zone().unwrap_or((time, 0.0))
}

/// Seconds of `12:03:04.125`, `12:03:04,125`, `12:03:04:125` and `12:03:04::125`; of `3:04.125`, too, whose
/// fraction says that the last are seconds.
fn time_s(time: &str, half: Option<u32>) -> Option<f64> {
    let mut parts: Vec<&str> = time.split(':').collect();
    let joined;
    if let [_, _, seconds, .., thousandths] = parts[..]
        && (parts.len() == 4 || parts.len() == 5 && parts[3].is_empty())
    {
        // Two digits may be the pictures of a film.
        let whole = |text: &str| text.bytes().all(|b| b.is_ascii_digit());
        let decimals = thousandths.len() % 3 == 0 && !thousandths.is_empty();
        (decimals && whole(thousandths) && whole(seconds)).then_some(())?;
        joined = format!("{seconds}.{thousandths}");
        parts.truncate(2);
        parts.push(&joined);
    }
    let (hours, minutes, seconds) = match parts[..] {
        [hours, minutes, seconds] => (hours, minutes, seconds),
        [minutes, seconds] if seconds.contains(['.', ',']) => ("0", minutes, seconds),
        _ => return None,
    };
    let hours: u32 = hours.parse().ok().filter(|h| *h < 24)?;
    let hours = match half {
        None => hours,
        Some(begins) => begins + (1..=12).contains(&hours).then_some(hours % 12)?,
    };
    let minutes: u32 = minutes.parse().ok().filter(|m| *m < 60)?;
    let seconds: f64 =
        seconds.replace(',', ".").parse().ok().filter(|s| (0.0..61.0).contains(s))?;
    Some(3600.0 * f64::from(hours) + 60.0 * f64::from(minutes) + seconds)
}

/// Days of `2026-03-01`, `01.03.2026`, `3/1/2026` or `1-Mar-2026`, counted from a day so near that their
/// seconds keep their digits.
fn days(date: &str) -> Option<i64> {
    let sign = ['-', '/', '.'].into_iter().find(|sign| date.contains(*sign))?;
    let parts: Vec<&str> = date.split(sign).collect();
    let [first, second, third] = parts[..] else { return None };
    let number = |text: &str| text.trim().parse::<i64>().ok();
    let (year, month, day) = if let Some(month) = month_named(second) {
        (number(third)?, month, number(first)?)
    } else {
        let (first_is_year, a, b, c) =
            (first.len() == 4, number(first)?, number(second)?, number(third)?);
        match (first_is_year, sign) {
            (true, _) => (a, b, c),
            (false, '/') if a <= 12 => (c, a, b),
            (false, _) => (c, b, a),
        }
    };
    let year = if (0..100).contains(&year) { year + 2000 } else { year };
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // March is the first month, so that a leap day is a year's last.
    let (year, month) = if month < 3 { (year - 1, month + 9) } else { (year, month - 3) };
    let since_year_0 =
        365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    Some(since_year_0 + (153 * month + 2) / 5 + day - SPRING_2020)
}

fn month_named(text: &str) -> Option<i64> {
    let begins = text.get(..3)?.to_lowercase();
    MONTHS.iter().position(|month| *month == begins).map(|at| at as i64 + 1)
}

/// Seconds of a column of clocks that have no date go on over midnight.
pub fn over_midnight(clock_s: &mut [f64]) {
    if !clock_s.iter().all(|s| s.is_nan() || (0.0..DAY_S).contains(s)) {
        return;
    }
    let (mut read, mut days) = (f64::NAN, 0.0);
    for s in clock_s.iter_mut().filter(|s| !s.is_nan()) {
        if *s < read - 0.5 * DAY_S {
            days += 1.0;
        }
        read = *s;
        *s += DAY_S * days;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_instant_is_read_however_it_is_written() {
        let at = clock_s("2021-05-07 12:32:06.020").expect("a date");
        for same in [
            "2021-05-07T12:32:06.020Z",
            "2021/05/07 12:32:06,020",
            "07.05.2021 12:32:06.020",
            "5/7/2021  12:32:06.020",
            "5/7/2021 12:32:06.020 PM",
            "7-May-2021 12:32:06.020",
            "2021/05/07 12:32:06::020",
            "2021/05/07 12:32:06:020",
            "2021-05-07T14:32:06.020+02:00",
            "2021-05-07 07:02:06.020-05:30",
        ] {
            assert_eq!(clock_s(same), Some(at), "{same}");
        }
        assert_eq!(clock_s("0 days 00:00:00.040000"), Some(0.04));
        assert_eq!(clock_s("-1 days +23:59:59.5"), Some(-0.5));
        assert_eq!((clock_s("12:00:01 AM"), clock_s("1:04.5")), (Some(1.0), Some(64.5)));
        for none in ["12:30", "10:00:00:12", "13:00:00 PM", "a:b:c", "1:2:3:4:5", "noon"] {
            assert_eq!(clock_s(none), None, "{none}");
        }
    }

    #[test]
    fn a_time_of_day_goes_on_over_midnight_and_a_date_does_so_itself() {
        let mut clock = vec![86_399.5, f64::NAN, 0.0, 0.5, 3.0];
        over_midnight(&mut clock);
        assert_eq!((clock[0], clock[2], clock[4]), (86_399.5, 86_400.0, 86_403.0));
        let mut dated = vec![2e8, 1e8];
        over_midnight(&mut dated);
        assert_eq!(dated, [2e8, 1e8]);
    }
}
