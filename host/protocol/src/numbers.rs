//! Numbers of effects that a device's network says beside natural frequency and damping ratio: their names
//! and their JSON.

use serde_json::{json, Value};
use yawrig_shared::numbers::Numbers;
use yawrig_shared::wire::{Measured, NetworkStatus};

/// A number of an effect that a device says: `coulomb_friction.c`, and its unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    pub name: String,
    pub unit: String,
}

/// Those of a device's network.
pub fn named(network: &NetworkStatus) -> Vec<Named> {
    let effects: Vec<&str> = network.effects.split_whitespace().collect();
    let named = |line: &str| {
        let (number, unit) = line.split_once(' ')?;
        let (effect, number) = number.split_once('.')?;
        let effect = effects.get(effect.parse::<usize>().ok()?)?;
        Some(Named { name: format!("{effect}.{number}"), unit: unit.to_owned() })
    };
    network.numbers.lines().filter_map(named).collect()
}

/// A device's `f32` as the shortest decimal that means it.
pub(crate) fn number(x: f32) -> Value {
    if !x.is_finite() {
        return Value::Null;
    }
    // Through its own shortest text: 0.0061 and not 0.006099999882280827.
    x.to_string().parse::<f64>().map_or(Value::Null, |x| json!(x))
}

/// Numbers with their names, as a list of objects to which `add` gives the values.
fn numbers_json<T>(names: &[Named], numbers: &[T], add: impl Fn(&mut Value, &T)) -> Value {
    let one = |(Named { name, unit }, of): (&Named, &T)| {
        let mut object = json!({"name": name, "unit": unit});
        add(&mut object, of);
        object
    };
    names.iter().zip(numbers).map(one).collect()
}

/// The numbers of a window.
pub(crate) fn window_numbers(names: &[Named], numbers: &Numbers<f32>) -> Value {
    numbers_json(names, numbers, |object, value| object["value"] = number(*value))
}

/// The numbers of a release.
pub fn release_numbers(names: &[Named], numbers: &Numbers<Measured>) -> Value {
    numbers_json(names, numbers, |object, measured| {
        object["value"] = number(measured.value);
        object["u"] = number(measured.u);
    })
}

/// The names of the numbers of such an object, in their order.
pub fn names_from_json(object: &Value) -> Vec<Named> {
    let text = |of: &Value, key: &str| of[key].as_str().map(str::to_owned);
    let named = |of: &Value| Some(Named { name: text(of, "name")?, unit: text(of, "unit")? });
    object["numbers"].as_array().into_iter().flatten().filter_map(named).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::follow::{event_from_json, event_json, event_text};
    use yawrig_shared::wire::{Event, Flags, ReleaseResult, WindowResult};

    fn names() -> Vec<Named> {
        named(&NetworkStatus {
            id: 0,
            generation: 0,
            topology: heapless::Vec::new(),
            slot: None,
            on_trial: false,
            effects: "static_offset coulomb_friction".try_into().unwrap(),
            numbers: "1.c rad/s2\n0.m rad/s2".try_into().unwrap(),
        })
    }

    #[test]
    fn they_are_named_in_text_and_json_and_come_back_from_it() {
        let names = names();
        let called: Vec<&str> = names.iter().map(|named| named.name.as_str()).collect();
        assert_eq!(called, ["coulomb_friction.c", "static_offset.m"]);
        let measured = |value, u| Measured { value, u };
        let release = Event::Release(ReleaseResult {
            release: 2,
            release_sample: 10,
            finished_sample: 2000,
            windows: 4,
            natural_frequency_rad_s: measured(7.5, 0.01),
            damping_ratio: measured(0.012, 0.0001),
            numbers: [measured(0.125, 0.002), measured(-0.5, 0.1)].into_iter().collect(),
            derivatives: None,
            flags: Flags::default(),
        });
        let window = Event::Window(WindowResult {
            release: 2,
            window: 1,
            start_sample: 10,
            end_sample: 900,
            sent_sample: 901,
            amplitude_deg: 5.0,
            midline_deg: 0.5,
            natural_frequency_rad_s: 7.5,
            damping_ratio: 0.012,
            numbers: [0.125, -0.5].into_iter().collect(),
            flags: Flags::default(),
        });
        for (event, said) in [
            (release, "\n  coulomb_friction.c 0.1250 ± 0.0020 rad/s2\n  static_offset.m"),
            (window, "   coulomb_friction.c 0.12500 rad/s2   static_offset.m -0.50000 rad/s2"),
        ] {
            let text = event_text(&event, "r.csv", &names).unwrap();
            assert!(text.contains(said), "{text}");
            let object = event_json(&event, &names);
            assert_eq!(event_from_json(&object), Some(event));
            assert_eq!(names_from_json(&object), names);
        }
    }
}
