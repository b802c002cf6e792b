//! What a device's flags and states are called, and what flags mean for the user.

use yawrig_shared::wire::{Flags, Forgotten, Phase, Refined, Sensor, SensorKind};

/// Names of the flags that are set.
pub fn flag_names(flags: Flags) -> Vec<&'static str> {
    Flags::NAMES.iter().filter(|(flag, _)| flags.has(*flag)).map(|(_, name)| *name).collect()
}

/// What the flags that are set mean for the user, and what to do: a sentence each.
pub fn flag_advice(flags: Flags) -> impl Iterator<Item = &'static str> {
    ADVICE.iter().filter(move |(flag, _)| flags.has(*flag)).map(|(_, text)| *text)
}

const ADVICE: [(Flags, &str); Flags::NAMES.len()] = [
    (Flags::TOO_SMALL, "too_small: the oscillation never rose above the lower end of the network's range; a refined estimate stands; for the network's, release it from further out"),
    (
        Flags::TOO_FEW_CYCLES,
        "too_few_cycles: the network found no three clean cycles within the range, at 2.5 rad/s or more; a refined estimate \
         needs one alone, and stands; for the network's, widen the range or release from further out",
    ),
    (
        Flags::SATURATED,
        "saturated: the converter was at one of its ends; centre the potentiometer, release from less far out, \
         or see that its wire is not off",
    ),
    (
        Flags::LOST_SAMPLES,
        "lost_samples: samples were lost on the way to the device; see to the line or its load, and release again",
    ),
    (
        Flags::OUT_OF_RANGE,
        "out_of_trained_range: the network was not trained there, and its result does not count; the refined estimate, \
         which needs none, does; train one with a wider range, or check the settings",
    ),
    (
        Flags::MID_SWING,
        "started_in_mid_swing: it was oscillating already when first seen; hold it still for two seconds before letting go",
    ),
    (
        Flags::CUT_SHORT,
        "cut_short: the release ended before the lower end of the range; wait until the oscillation has died down",
    ),
    (Flags::NO_NETWORK, "no_network: no network passed its checks; write one with `yawrig flash`"),
    (
        Flags::STUCK,
        "stuck: the reading did not change while the model should have moved; check the potentiometer and its coupling",
    ),
    (
        Flags::NOISY,
        "noisy: more noise or hum than 0.25 deg rms; check shielding, ground and supply of the potentiometer",
    ),
    (Flags::SPIKES, "spikes: outlying readings were left out; look for a loose contact or a worn potentiometer track"),
    (
        Flags::MISFIT,
        "misfit: the second-order model does not explain the record; look at it on the host with `yawrig diagnose`; without a \
         table for its converter (`yawrig device` says) the converter may be the cause: `yawrig device linearity`",
    ),
    (
        Flags::NOT_REFINED,
        "not_refined: no damped oscillation fits the whole record; the estimate from its windows, if there is one, stands",
    ),
    (
        Flags::NO_REFERENCE,
        "no_reference: there is no good wind-off release of this spring and axis; make one, then this one again",
    ),
    (
        Flags::MAGNET,
        "magnet: the encoder sees no magnet, or one too weak or too strong; mount it 0.5 to 3 mm away, in the middle",
    ),
    (
        Flags::LOST_COUNTS,
        "lost_counts: the encoder's index did not come after whole turns; check its supply, its cable and how fast it turns",
    ),
    (
        Flags::WIDENED,
        "widened: the model may lack something, a law, a second mode or a random moment; what that may do is in the \
         uncertainties; `yawrig diagnose` of a record tells which",
    ),
    (
        Flags::WINDOWS_DIFFER,
        "windows_differ: the mean over the windows contradicts the refined estimate, which counts; train a network for \
         this rig, or look at a record with `yawrig diagnose`",
    ),
    (Flags::NO_SENSOR, "no_sensor: this is no potentiometer's signal; check that it is connected"),
    (
        Flags::DISTURBED,
        "disturbed: part of it is not one damped oscillation: a touch, a gust, a drifting zero; release again, and \
         if it stays, look for the cause in a record with `yawrig diagnose`",
    ),
];

pub(super) const PHASES: [Phase; 5] =
    [Phase::Waiting, Phase::Held, Phase::Released, Phase::Ringing, Phase::Finished];

pub(super) fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Waiting => "waiting",
        Phase::Held => "held",
        Phase::Released => "released",
        Phase::Ringing => "ringing",
        Phase::Finished => "finished",
    }
}

/// Whether the refined values are there.
pub fn is_refined(refined: &Refined) -> bool {
    !refined.flags.has(Flags::NOT_REFINED)
}

pub(super) fn sensor_name(sensor: &Sensor) -> &'static str {
    match sensor.kind {
        SensorKind::Potentiometer => "potentiometer",
        SensorKind::As5600 => "as5600",
        SensorKind::Quadrature => "quadrature",
        SensorKind::Absolute => "absolute",
    }
}

/// Why the device forgot what it had learnt, as JSON names it.
pub fn forgotten_name(why: Forgotten) -> &'static str {
    match why {
        Forgotten::Rig => "rig",
        Forgotten::Network => "network",
        Forgotten::Contradicted => "contradicted",
        Forgotten::Damaged => "damaged",
    }
}

/// What has this name.
pub fn forgotten_of(name: &str) -> Option<Forgotten> {
    let all = [Forgotten::Rig, Forgotten::Network, Forgotten::Contradicted, Forgotten::Damaged];
    all.into_iter().find(|why| forgotten_name(*why) == name)
}
