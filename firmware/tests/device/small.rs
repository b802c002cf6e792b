//! Releases of half a degree and more are refined, whatever the range is set to.

use crate::desk::{Desk, Swing};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::wire::{Flags, Reply, Request, Settings};

#[test]
fn small_releases_are_refined_in_any_range() {
    let (mut complaints, mut all, mut widened) = (Vec::new(), 0, 0);
    for [range_from_deg, to_deg] in [[10.0, 1.0], [1.0, 0.1], [0.5, 0.05], [20.0, 0.2]] {
        for from_deg in [0.5, 0.7, 0.9, 1.1, 2.0] {
            for (wn, zeta) in [(2.5, 0.02), (3.0, 0.02), (7.5, 0.012), (15.0, 0.03), (26.5, 0.006)]
            {
                for noise_deg in [0.005, 0.02] {
                    all += 1;
                    let mut desk = Desk::new(MemoryFlash::new());
                    let settings =
                        Settings { from_deg: range_from_deg, to_deg, ..Settings::default() };
                    assert_eq!(desk.ask(&Request::Configure(settings)), Reply::Done);
                    let seconds = 12.0 + (from_deg / 0.02_f64).ln() / (zeta * wn);
                    let swing = Swing { noise_deg, from_deg, seconds, ..Swing::new(wn, zeta) };
                    desk.play(swing.counts(all));
                    let release = format!(
                        "range {range_from_deg} to {to_deg}, {from_deg} deg, wn {wn} noise {noise_deg}: {:?} {:?}",
                        desk.releases.iter().map(|r| (r.windows, r.flags)).collect::<Vec<_>>(),
                        desk.phases
                    );
                    let Some(refined) = desk.refined.first() else {
                        complaints.push(format!("{release}: no refined"));
                        continue;
                    };
                    let misses = [
                        (refined.natural_frequency_rad_s.value - wn)
                            / f64::from(refined.natural_frequency_rad_s.u),
                        (f64::from(refined.damping_ratio.value) - zeta)
                            / f64::from(refined.damping_ratio.u),
                    ];
                    widened += u32::from(refined.flags.has(Flags::WIDENED));
                    // The end of the slowest may be taken for rest.
                    let chance = Flags::CUT_SHORT.0 | Flags::WIDENED.0;
                    if refined.flags.of_record().0 & !chance != 0
                        || misses.iter().any(|miss| miss.abs() > 4.0)
                        || desk.releases.len() > 1
                    {
                        complaints.push(format!("{release}: {misses:.1?} {:?}", refined.flags));
                    }
                }
            }
        }
    }
    // Chance does it once in sixty at most.
    assert!(widened * 60 <= all, "{widened}");
    assert!(complaints.is_empty(), "{} of {all}:\n{complaints:#?}", complaints.len());
}
