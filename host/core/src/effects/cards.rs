//! What a user is told about an effect.

use crate::effects::Effect;

/// Formula, usual cause on a yaw rig, fingerprint, how to confirm it, how to remove it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Card {
    pub title: &'static str,
    pub formula: &'static str,
    pub cause: &'static str,
    pub fingerprint: &'static str,
    pub confirm: &'static str,
    pub remove: &'static str,
    /// The release that would tell it from those it resembles.
    pub release: &'static str,
}

/// The card of `effect`.
pub fn of(effect: Effect) -> Card {
    match effect {
        Effect::CoulombFriction => Card {
            title: "Dry friction",
            formula: "- c sign(r); sticks at r = 0 while the other moment is below c",
            cause: "bearing seals, a rubbing cable, the potentiometer's wiper",
            fingerprint: "damping rises as 1/amplitude; peaks fall along a straight line; stops off centre",
            confirm: "release with the wind off: it stays the same; it is the same on every spring",
            remove: "free or replace the bearing, lead the cable along the axis, use a contactless sensor",
            release: "a smaller amplitude, where friction dominates",
        },
        Effect::QuadraticDamping => Card {
            title: "Damping with the square of the rate",
            formula: "- d |r| r",
            cause: "separated flow, still-air drag of the model's sides",
            fingerprint: "damping ratio rises in proportion to amplitude; frequency does not change",
            confirm: "release from twice the amplitude: the added damping doubles",
            remove: "shield parts of the rig that are not the model; it cannot be had off the model itself",
            release: "a larger amplitude, where it parts from damping with the square of the angle",
        },
        Effect::CubicDamping => Card {
            title: "Damping with the square of the angle",
            formula: "- c b^2 r",
            cause: "yaw moment derivative that changes with sideslip, stall at large yaw",
            fingerprint: "damping ratio rises (c > 0) or falls with the square of amplitude",
            confirm: "compare releases with the wind on and off: with the wind off it goes",
            remove: "stay at small amplitudes",
            release: "a larger amplitude, where it parts from damping with the rate's square",
        },
        Effect::CubicStiffness => Card {
            title: "Hardening or softening restoring moment",
            formula: "- k3 b^3",
            cause: "springs pulled out of line at large yaw, stops, a yaw moment that bends with sideslip",
            fingerprint: "natural frequency changes with the square of amplitude; no mid-line shift",
            confirm: "static moment against angle; with the wind off it is the springs'",
            remove: "longer springs, smaller amplitude",
            release: "a larger amplitude",
        },
        Effect::QuadraticStiffness => Card {
            title: "Lopsided restoring moment",
            formula: "- k2 b^2",
            cause: "springs of unlike stiffness or preload, an asymmetric model",
            fingerprint: "mid-line moves with the square of amplitude; a second harmonic",
            confirm: "release to the other side: the mid-line moves the same way",
            remove: "match the springs and their preload",
            release: "one to the other side, and one with another spring: a bent sensor scale keeps its size",
        },
        Effect::StaticOffset => Card {
            title: "Constant moment",
            formula: "+ m",
            cause: "crooked flow, a bent spring, a model that is not symmetric; or a sensor that was not zeroed",
            fingerprint: "the swing is about another angle than the sensor's nought, the same at every amplitude",
            confirm: "reading at rest with the wind off and on: a sensor not zeroed shows it in both, on every spring",
            remove: "zero the sensor with the wind off, align the springs",
            release: "wind off, and another spring: a moment's offset falls with stiffness, the sensor's stays",
        },
        Effect::FreePlay => Card {
            title: "Free play",
            formula: "the spring acts on b beyond a dead zone of +-g",
            cause: "slack spring hooks, a loose joint between model and shaft",
            fingerprint: "natural frequency falls as amplitude falls towards g",
            confirm: "rock the model by hand about nought; preload the springs and release again",
            remove: "preload the springs, shim the joint",
            release: "a smaller amplitude, down to a few g",
        },
        Effect::HarmonicForcing => Card {
            title: "Periodic moment",
            formula: "+ f cos(w t + phi)",
            cause: "vortex shedding, the tunnel fan, a motor nearby",
            fingerprint: "a line in the residual's spectrum that does not decay",
            confirm: "watch the model at rest; change the wind speed: shedding moves with it, a fan line with its speed",
            remove: "isolate the rig, move away from that wind speed, break up the shedding",
            release: "a longer record, in which a line sharpens and a decaying mode does not",
        },
        Effect::StiffnessDrift => Card {
            title: "Stiffness drifting in time",
            formula: "wn^2 (1 + e t)",
            cause: "wind speed drifting, springs warming or creeping",
            fingerprint: "natural frequency changes with time whatever the amplitude",
            confirm: "log the wind speed; release twice in a row: the second starts where the first ended",
            remove: "let the tunnel settle before releasing",
            release: "one of half the amplitude: a drift keeps its size, a hardening falls to a quarter",
        },
        Effect::Buffeting => Card {
            title: "Random moment",
            formula: "+ white random moment of intensity q",
            cause: "turbulence of the stream, the wake of something upstream",
            fingerprint: "phase and amplitude wander; residual grows in time, different on every repeat",
            confirm: "repeat the release: what is random does not repeat; with the wind off it goes",
            remove: "screens, another position in the stream; else average repeats",
            release: "a repeat under the same conditions",
        },
        Effect::SecondMode => Card {
            title: "A second mode in the reading",
            formula: "reading + a exp(-zeta2 w2 t) cos(w2 t + phase)",
            cause: "flexible support or shaft, sensor mount shaking",
            fingerprint: "a line in the residual's spectrum away from the swing, dying out after the release",
            confirm: "tap the support with the model clamped",
            remove: "stiffen the support or the sensor's mount",
            release: "a longer record, in which it dies out and forcing does not",
        },
        Effect::SensorNonlinearity => Card {
            title: "Bent sensor scale",
            formula: "reading = b + s b^2",
            cause: "potentiometer or linkage off its straight range",
            fingerprint: "second harmonic and mid-line shift with the square of amplitude, frequency unchanged",
            confirm: "calibrate the sensor against a protractor",
            remove: "calibrate, or use the middle of its range",
            release: "one on another spring: the sensor's coefficient stays, a moment's changes",
        },
        Effect::BaselineDrift => Card {
            title: "Zero drifting in time",
            formula: "reading = b + d t",
            cause: "sensor or amplifier warming up, a creeping spring mount",
            fingerprint: "mid-line moves steadily in time",
            confirm: "record the model at rest for as long",
            remove: "let the electronics warm up",
            release: "a record of the model at rest",
        },
        Effect::Own(own) => Card {
            title: &own.title,
            formula: &own.formula,
            cause: "whoever wrote it knows: an effect from a file of your own",
            fingerprint: "where its moment is large: compare residuals over the phase plane with and without it",
            confirm: "fit it to releases of other sizes, on other springs, with the wind off: its numbers stay",
            remove: "depends on what it stands for",
            release: "another amplitude, another spring, wind off: whichever moves the two moments apart",
        },
    }
}
