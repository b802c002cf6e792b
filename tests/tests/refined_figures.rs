//! The device's refined estimate: its errors against the Cramer-Rao bound, its uncertainties, and its flag.
//!
//! The releases are the virtual rig's, integrated step by step and read through its sensor and converter; the bound is
//! that of every sample of the same stretch, with the converter's own noise in it.

use rayon::prelude::*;
use yawrig::identify::damped_sinusoid::Mode;
use yawrig::identify::samples::Samples as Readings;
use yawrig::identify::uncertainty::{cramer_rao, Bound};
use yawrig::rig::{Effects, End, Samples, Sensor, Start};
use yawrig_firmware::device::Device;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{
    self, Decoder, Event, Flags, Message, Refined, Reply, Request, Settings,
};

const AMPLITUDE_DEG: f64 = 15.0;
const HOLD_S: f64 = 2.0;

/// What the device makes of one release.
fn refined(truth: &Modal, effects: &Effects, sensor: &Sensor, seed: u64) -> Vec<Refined> {
    let mut device = Box::new(Device::new(MemoryFlash::new(), "memory"));
    let settings =
        Settings { degrees_per_count: sensor.adc_step_deg as f32, ..Settings::default() };
    for byte in wire::encode(1, &Request::Configure(settings)).unwrap() {
        device.receive(byte);
    }
    let end = End::Below { amplitude_deg: 0.7, at_most_s: 1800.0 };
    let start = Start { amplitude_deg: AMPLITUDE_DEG, hold_s: HOLD_S, end }.limited(truth, effects);
    let mut decoder = Decoder::new();
    let mut found = Vec::new();
    let mut listen = |device: &mut Device<MemoryFlash>| {
        while let Some(byte) = device.transmit() {
            let Some(Ok(frame)) = decoder.push(byte) else { continue };
            if frame.key == Reply::KEY {
                continue;
            }
            if let Some(Ok(Event::Refined(refined))) = frame.message::<Event>() {
                found.push(refined);
            }
        }
    };
    let samples = Samples::with_effects(truth, effects, &start, sensor, seed).unwrap();
    for sample in samples {
        device.sample(sample.counts.unwrap());
        device.work();
        listen(&mut device);
    }
    for byte in wire::encode(2, &Request::EndRelease { after_samples: 0 }).unwrap() {
        device.receive(byte);
    }
    while device.idle() {}
    listen(&mut device);
    found
}

/// Cramer-Rao bound over all samples of the stretch the device refined.
fn bound(truth: &Modal, refined: &Refined, sensor: &Sensor) -> Bound {
    let wd = truth.damped_frequency_rad_s();
    let mode = Mode {
        origin_s: 0.0,
        cosine_deg: AMPLITUDE_DEG,
        sine_deg: AMPLITUDE_DEG * truth.decay_rate_per_s() / wd,
        offset_deg: 0.0,
        decay_rate_1_s: truth.decay_rate_per_s(),
        damped_frequency_rad_s: wd,
    };
    let from_s = f64::from(refined.from_sample) * 1e-3 - HOLD_S;
    let time: Vec<f64> = (0..refined.samples).map(|k| from_s + f64::from(k) * 1e-3).collect();
    let zeros = vec![0.0; time.len()];
    let noise = sensor.noise_deg.hypot(sensor.adc_step_deg / 12.0_f64.sqrt());
    cramer_rao(&mode, &Readings::new(&time, &zeros).all(), noise).unwrap()
}

#[test]
fn errors_are_near_the_bound_and_uncertainties_hold() {
    let seeds: u64 = std::env::var("SEEDS").map_or(20, |s| s.parse().unwrap());
    println!("   wn   zeta  noise | rms/bound wn zeta | inside 1u wn zeta (%) | u/bound | misfit");
    let mut total = [0.0; 4];
    let mut count = 0.0;
    for noise_deg in [0.02, 0.2] {
        for wn in [2.5, 7.5, 15.5, 26.5] {
            for zeta in [0.001, 0.003, 0.01, 0.03, 0.1] {
                let truth = Modal { natural_frequency_rad_s: wn, damping_ratio: zeta };
                let sensor =
                    Sensor { noise_deg, adc_step_deg: 0.02, offset_deg: 1.5, ..Sensor::default() };
                let outcomes: Vec<[f64; 7]> = (0..seeds)
                    .into_par_iter()
                    .map(|seed| {
                        let found = refined(&truth, &Effects::default(), &sensor, seed);
                        let [r] = found[..] else { panic!("{wn} {zeta} {seed}: {found:?}") };
                        assert!(!r.flags.has(Flags::NOT_REFINED), "{wn} {zeta} {seed}");
                        let b = bound(&truth, &r, &sensor);
                        let e = [
                            r.natural_frequency_rad_s.value - wn,
                            f64::from(r.damping_ratio.value) - zeta,
                        ];
                        let u = [r.natural_frequency_rad_s.u, r.damping_ratio.u].map(f64::from);
                        let b = [b.natural_frequency_rad_s, b.damping_ratio];
                        [
                            (e[0] / b[0]).powi(2),
                            (e[1] / b[1]).powi(2),
                            f64::from(u8::from(e[0].abs() <= u[0])),
                            f64::from(u8::from(e[1].abs() <= u[1])),
                            (u[0] / b[0] + u[1] / b[1]) / 2.0,
                            f64::from(u8::from(r.flags.has(Flags::MISFIT))),
                            f64::from(r.residual_over_noise),
                        ]
                    })
                    .collect();
                let mean = |i: usize| outcomes.iter().map(|o| o[i]).sum::<f64>() / seeds as f64;
                println!(
                    "{wn:5} {zeta:6} {noise_deg:6} | {:6.3} {:6.3} | {:5.1} {:5.1} | {:5.3} | {:5.3} {:6.3}",
                    mean(0).sqrt(),
                    mean(1).sqrt(),
                    100.0 * mean(2),
                    100.0 * mean(3),
                    mean(4),
                    mean(5),
                    mean(6)
                );
                for i in 0..4 {
                    total[i] += mean(i);
                }
                count += 1.0;
            }
        }
    }
    println!("{:?}", total.map(|t| t / count));
}
