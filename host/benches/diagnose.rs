//! Time of a diagnosis with the whole library, all cores: `cargo bench -p yawrig --bench diagnose`.
//!
//! Records of 40 s at 1 kHz from the virtual rig, each hiding the effects named; the verdict is printed
//! beside the time.

use std::path::PathBuf;
use std::slice::from_ref;
use std::time::Instant;
use yawrig_core::diagnosis::diagnose::{diagnose, Grouping, Options};
use yawrig_core::record::Record;
use yawrig_rig::{Effects, End, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;

const HIDDEN: [&[&str]; 18] = [
    &[],
    &["coulomb_friction:c=0.08"],
    &["quadratic_damping:d=0.1"],
    &["cubic_damping:c=1.5"],
    &["cubic_stiffness:k3=-15"],
    &["quadratic_stiffness:k2=4"],
    &["static_offset:m=0.3"],
    &["free_play:g=0.002"],
    &["harmonic_forcing:f=0.2,w=11,phi=0.5"],
    &["stiffness_drift:e=0.0005"],
    &["buffeting:q=0.0005"],
    &["second_mode:amplitude=0.01,phase=0.4,w2=23,zeta2=0.01"],
    &["sensor_nonlinearity:s=0.3"],
    &["baseline_drift:d=0.0002"],
    &["coulomb_friction:c=0.08", "cubic_stiffness:k3=-15"],
    &["quadratic_damping:d=0.1", "static_offset:m=0.3"],
    &["free_play:g=0.002", "stiffness_drift:e=0.0005"],
    &["second_mode:amplitude=0.01,phase=0.4,w2=23,zeta2=0.01", "cubic_damping:c=1.5"],
];

fn main() {
    println!("seconds  hidden -> verdict");
    for (k, hidden) in HIDDEN.iter().enumerate() {
        let effects = hidden.iter().map(|text| text.parse().expect("an effect")).collect();
        let effects = Effects::new(effects).expect("each once");
        let modal = Modal { natural_frequency_rad_s: 7.5, damping_ratio: 0.008 };
        let start = Start { amplitude_deg: 15.0, hold_s: 1.0, end: End::After(39.0) };
        let sensor = Sensor::default();
        let (time_s, yaw_deg) = Samples::with_effects(&modal, &effects, &start, &sensor, k as u64)
            .expect("a swing")
            .map(|s| (s.time_s, s.yaw_deg))
            .unzip();
        let record = Record::new(PathBuf::from("release"), time_s, yaw_deg);
        let begin = Instant::now();
        let found = diagnose(from_ref(&record), &Grouping::default(), &Options::default())
            .expect("a swing")
            .diagnosis;
        let seconds = begin.elapsed().as_secs_f64();
        let names: Vec<&str> = found.effects.iter().map(|e| e.id()).collect();
        println!("{seconds:7.2}  {} -> {:?} {}", hidden.join(" "), found.status, names.join(", "));
    }
}
