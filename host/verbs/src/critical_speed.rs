//! Where the model swings by itself, as `derivatives` says it.

use super::common::{bare, wrapped};
use yawrig_core::derivatives::critical::CriticalSpeed;

/// A paragraph for each spring and axis; none where damping falls to zero nowhere.
pub fn lines(all: &[CriticalSpeed]) -> Vec<String> {
    all.iter().flat_map(of).collect()
}

fn of(critical: &CriticalSpeed) -> Vec<String> {
    let mut lines = vec![String::new(), critical.sentence()];
    lines.extend(wrapped(&critical.law(), 80, "  "));
    let mut rows = bare(&["V m/s", "zeta at rest", "limit cycle deg"]);
    for (speed, zeta, cycle) in critical.rows() {
        rows.add_row([
            short(speed),
            zeta.map_or("not measured".to_owned(), |zeta| zeta.to_string()),
            cycle.map_or("-".to_owned(), |amplitude| amplitude.to_string()),
        ]);
    }
    lines.push(rows.trim_fmt());
    lines.extend(critical.narrowed_by.map(|by| {
        let (speed, u) = (short(by.wind_speed_m_s), by.u_m_s);
        format!("A release at {speed} m/s would narrow it most, to ± {u:.0$} m/s.", digits(u))
    }));
    lines
}

/// Decimals of an uncertainty with two digits.
fn digits(u: f64) -> usize {
    (1.0 - u.log10().floor()).clamp(0.0, 9.0) as usize
}

fn short(speed: f64) -> String {
    format!("{speed:.4}").trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use yawrig_core::derivatives::at::At;
    use yawrig_core::derivatives::critical::{DampingAtRest, LimitCycle, NarrowedBy};
    use yawrig_core::quantity::Quantity;
    use yawrig_shared::axis::Axis;

    #[test]
    fn what_is_said_of_a_rig_that_swings_by_itself() {
        let damping = |wind_speed_m_s, zeta| DampingAtRest {
            wind_speed_m_s,
            damping_ratio: Quantity::new(zeta, 0.0002),
        };
        let cycle = |wind_speed_m_s, amplitude| LimitCycle {
            wind_speed_m_s,
            amplitude_deg: Quantity::new(amplitude, 0.4),
        };
        let critical = CriticalSpeed {
            spring: "K3".to_owned(),
            axis: Axis::Mid,
            at: At::default(),
            wind_speed_m_s: Quantity::new(11.31, 0.21),
            damping: vec![damping(0.0, 0.0211), damping(12.0, -0.0011)],
            terms: ["1", "V", "A^2"].map(str::to_owned).to_vec(),
            limit_cycle: vec![cycle(12.0, 5.2), cycle(13.0, 8.1)],
            narrowed_by: Some(NarrowedBy { wind_speed_m_s: 10.0, u_m_s: 0.123 }),
        };
        let said = lines(&[critical]).join("\n");
        println!("{said}");
        for part in [
            "Swings by itself from 11.31 ± 0.21 m/s on (spring K3, axis mid).",
            "zeta wn is fitted by 1, V, A^2;",
            "-0.00110 ± 0.00020",
            "not measured",
            "A release at 10 m/s would narrow it most, to ± 0.12 m/s.",
        ] {
            assert!(said.contains(part), "{part} in\n{said}");
        }
        assert!(lines(&[]).is_empty());
    }
}
