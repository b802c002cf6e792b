//! What a user's own effect costs beside one of the library, all cores:
//! `cargo bench -p yawrig-core --bench own_effect`.
//!
//! The 32 releases of a campaign of the virtual rig, each pair of effects added to their plain models as
//! `yawrig add` does. Wanted: a ratio of at most 5, and at most 10 s for a steep one.

use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{fit_added, fit_plain, Fitted, Structure};
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::fit::joint::{self, JointFit, Release, Sharing};
use yawrig_core::fit::own;
use yawrig_core::record::Record;
use yawrig_rig::{Effects, Rig, Sensor, Start};

/// What the rig hides, the library's effect, and the user's.
const PAIRS: [(&str, Effect, &str); 4] = [
    ("quadratic_damping:d=0.1", Effect::QuadraticDamping, QUADRATIC),
    ("cubic_stiffness:k3=-15", Effect::CubicStiffness, CUBIC),
    ("coulomb_friction:c=0.05", Effect::CoulombFriction, STEEP),
    ("coulomb_friction:c=0.05", Effect::CoulombFriction, STRIBECK),
];
const QUADRATIC: &str = r#"id = "own_quadratic"
title = "Quadratic damping"
moment = "-d * r * abs(r)"
[parameters]
d = { unit = "1/rad", start = 0.05, min = 0.0 }
"#;
const CUBIC: &str = r#"id = "own_cubic"
title = "Cubic stiffness"
moment = "-k * b^3"
[parameters]
k = { unit = "1/(s2 rad2)", start = 5.0 }
"#;
const STEEP: &str = r#"id = "steep"
title = "Steep friction"
moment = "-c * tanh(r / 0.002)"
[parameters]
c = { unit = "rad/s2", start = 0.05, min = 0.0 }
"#;
const STRIBECK: &str = r#"id = "stribeck_friction"
title = "Stribeck friction"
moment = "-c * tanh(r / 0.002) * (1 + s * exp(-abs(r) / v))"
[parameters]
c = { unit = "rad/s2", start = 0.05, min = 0.0 }
s = { unit = "1", start = 0.5, min = 0.0 }
v = { unit = "rad/s", start = 0.1, min = 0.0 }
"#;

fn campaign(hidden: &str) -> Vec<FreeDecay> {
    let effects = Effects::new(vec![hidden.parse().expect("an effect")]).expect("one");
    let rig = Rig::default();
    let decay = |(k, condition)| {
        let (time_s, yaw_deg) = rig
            .release_with(&condition, &effects, &Start::default(), &Sensor::default(), k as u64)
            .expect("a swing")
            .samples
            .map(|s| (s.time_s, s.yaw_deg))
            .unzip();
        let record = Record::new(PathBuf::from("release"), time_s, yaw_deg);
        let mut decay = FreeDecay::from_record(&record).expect("a free decay");
        decay.wind_speed_m_s = condition.wind_speed_m_s;
        decay
    };
    rig.conditions(10.0).enumerate().map(decay).collect()
}

fn plain(releases: &[Release]) -> JointFit {
    let sharing = Sharing::none(releases.len(), 0);
    let fits: Vec<Fitted> =
        releases.par_iter().map(|r| fit_plain(r.decay, false, r.count)).collect();
    joint::fit_from(releases, &Structure::default(), &sharing, &fits.iter().collect::<Vec<_>>())
}

fn of_library(
    releases: &[Release],
    sharing: &Sharing,
    inner: &JointFit,
    effect: &Effect,
) -> JointFit {
    let singles: Vec<Fitted> = releases
        .par_iter()
        .zip(&inner.fits)
        .map(|(release, fit)| fit_added(release.decay, fit, effect))
        .collect();
    let structure = inner.structure.with(effect);
    let quick = joint::fit_from(releases, &structure, sharing, &singles.iter().collect::<Vec<_>>());
    let numbers: Vec<Vec<f64>> = quick.fits.iter().map(|fit| fit.parameters.clone()).collect();
    joint::fit(releases, &structure.precisely(), sharing, &numbers)
}

fn main() {
    println!("library s    own s  ratio  residual/noise  own");
    for (hidden, library, text) in PAIRS {
        let decays = campaign(hidden);
        let releases: Vec<Release> = decays.iter().map(Release::whole).collect();
        let inner = plain(&releases);
        let sharing = Sharing::none(releases.len(), 0).with(vec![Some(0); releases.len()]);
        let timed = |add: &dyn Fn() -> JointFit| {
            let begin = Instant::now();
            let fit = add();
            (begin.elapsed().as_secs_f64(), fit)
        };
        let own = yawrig_expression::from_text(Path::new("own.toml"), text, &[]).expect("valid");
        let own = Effect::Own(Arc::new(own));
        let (library_s, _) = timed(&|| of_library(&releases, &sharing, &inner, &library));
        let (own_s, fit) = timed(&|| own::added(&releases, &sharing, &inner, &own));
        println!(
            "{library_s:9.2} {own_s:8.2} {:6.1} {:15.4}  {own}",
            own_s / library_s,
            fit.over_noise()
        );
    }
}
