//! The release is found where it is, whatever comes before it and after it.

use crate::planted_releases;
use planted_releases::{planted, Kind};
use yawrig_core::identify::{identify, Identification, Method, Settings};

/// Share of releases that are found within a cycle.
const FOUND: f64 = 0.98;
/// Share of records with two releases in which the other is mentioned.
const MENTIONED: f64 = 0.8;

fn identified(kind: Kind, seed: u64) -> Option<(Identification, planted_releases::Planted)> {
    let settings = Settings { from_deg: 360.0, to_deg: 1e-3, ..Settings::default() };
    let planted = planted(kind, seed);
    identify(&planted.record, &[Method::LeastSquares], &settings).ok().map(|found| (found, planted))
}

/// So many records of each kind, from `seed` on.
fn found_of_each(seed: u64, each: u64) {
    let mut wrong = Vec::new();
    let mut driven_as_free = Vec::new();
    let mut mentioned = 0;
    for kind in Kind::ALL {
        for seed in seed..seed + each {
            let Some((found, planted)) = identified(kind, seed) else {
                wrong.push(format!("{kind:?} {seed}: refused"));
                continue;
            };
            let off = |at: &f64| (found.release_time_s - at) / planted.period_s;
            let nearest = planted.releases_s.iter().map(off).fold(f64::INFINITY, |best, off| {
                if off.abs() < best.abs() {
                    off
                } else {
                    best
                }
            });
            if nearest.abs() > 1.0 {
                wrong.push(format!("{kind:?} {seed}: {nearest:.1} cycles off"));
            }
            let analysed_s = found.window.from_s;
            if kind.is_driven() && analysed_s < planted.releases_s[0] - planted.period_s {
                driven_as_free.push(format!("{kind:?} {seed}: from {analysed_s}"));
            }
            mentioned += u64::from(kind == Kind::Restarted && !found.other_releases.is_empty());
        }
    }
    let records = each as usize * Kind::ALL.len();
    println!("{} of {records} within a cycle; {wrong:?}", records - wrong.len());
    println!("the other release of two mentioned in {mentioned} of {each}");
    assert!(mentioned as f64 >= MENTIONED * each as f64, "{mentioned} of {each}");
    assert!(driven_as_free.is_empty(), "{driven_as_free:?}");
    assert!(wrong.len() as f64 <= (1.0 - FOUND) * records as f64, "{wrong:?}");
}

#[test]
fn releases_are_found_within_a_cycle() {
    found_of_each(1000, 7);
}

#[test]
fn releases_are_found_within_a_cycle_at_full_size() {
    found_of_each(2000, 25);
}
