//! What the fits of a transfer function say, in sentences.

use super::chance::in_words;
use super::fit::Fitted;

/// Why so few different reduced frequencies say nothing, and what to do.
pub(super) fn too_few(different: &[f64], fewest: usize) -> (String, &'static str) {
    let each: Vec<String> = different.iter().map(|km| format!("{km:.3}")).collect();
    let there = match each.len() {
        0 => "no point of the table has a known error".to_owned(),
        1 => format!("all points are at one reduced frequency, km {}", each[0]),
        n => format!("the points are at {n} reduced frequencies only, km {}", each.join(" and ")),
    };
    let why = format!(
        "{there}: how the derivatives go with it shows from {fewest} on, 2 % and more apart"
    );
    (why, "release on at least three springs, or at three wind speeds, with the wind off and on")
}

/// Whether constant derivatives would do, and whether one causal moment does.
pub(super) fn sentences(all: &[Fitted], lags: usize, one_cause: bool) -> Vec<String> {
    let of = |fitted: &Fitted| {
        format!(
            "chi squared {:.1} on {} degrees of freedom, which chance exceeds {}",
            fitted.chi_squared,
            fitted.degrees,
            in_words(fitted.chance())
        )
    };
    let with = |lags: usize| match lags {
        1 => "one lag".to_owned(),
        n => format!("{n} lags"),
    };
    let chosen = &all[lags];
    let mut said = vec![match (lags, one_cause) {
        (0, true) => format!("Quasi-steady derivatives would do: {}.", of(chosen)),
        (0, false) => {
            format!(
                "Quasi-steady derivatives would not do, and no lag does better: {}.",
                of(chosen)
            )
        }
        _ => format!(
            "Quasi-steady derivatives would not do: {}; with {}: {}.",
            of(&all[0]),
            with(lags),
            of(chosen)
        ),
    }];
    if !one_cause {
        said.push(
            "One causal moment does not hold both columns within their uncertainties: these are too small, or the \
             moment is not linear in the angle, or not the same on all springs. The parameters mean little."
                .to_owned(),
        );
    }
    let beyond = (0..lags).filter(|k| chosen.at_end[2 * k + 3]).count();
    if beyond > 0 {
        said.push(format!(
            "{} slower or quicker than what the reduced frequencies measured can show: only a limit is seen.",
            if beyond == 1 { "One lag is" } else { "Both lags are" }
        ));
    }
    said
}
