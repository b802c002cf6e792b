//! What the example for embassy does, without its board: its sensor, its queue, its text.

#[path = "../../boards/pico2-embassy/src/shown.rs"]
mod shown;

use yawrig_firmware::device::Device;
use yawrig_firmware::input::Input;
use yawrig_firmware::queue::Queue;
use yawrig_firmware::sensors::as5600::{As5600, Filter};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_rig::{End, Motion, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;

#[test]
fn a_release_is_shown_as_it_was_planted() {
    let truth = Modal { natural_frequency_rad_s: 12.0, damping_ratio: 0.02 };
    let end = End::Below { amplitude_deg: 0.5, at_most_s: 60.0 };
    let start = Start { amplitude_deg: 15.0, hold_s: 2.0, end };
    let sensor = Sensor { noise_deg: 0.02, adc_step_deg: 0.0, ..Sensor::default() };
    let mut queue = Queue::<[u8; 3], 1024>::new();
    let (mut readings, mut waiting) = queue.split();
    let mut input = Input::new(As5600::new(1000, Filter::default()));
    let mut device = Device::new(MemoryFlash::new(), "pico2, embassy");
    device.set_sensor(&input.about());
    let mut texts = Vec::new();
    let samples = Samples::new(Motion::new(&truth), &start, &sensor, 1);
    for (k, sample) in samples.chain(rest(2000)).enumerate() {
        let share = (sample.yaw_deg / 360.0).rem_euclid(1.0);
        let [high, low] = ((share * 4096.0) as u16 % 4096).to_be_bytes();
        readings.put(Some([0x20, high, low]));
        // The program comes round now and then, and was away for half a second.
        if k % 5 == 0 && !(6000..6500).contains(&k) {
            waiting.give(&mut input, &mut device);
            texts.extend(device.events().filter_map(|event| shown::text(&event)));
        }
    }
    println!("{texts:?}");
    assert_eq!(texts.first().map(|text| text.as_str()), Some("let go"));
    let result = texts.iter().find(|text| text.contains("rad/s")).expect("a result");
    let figure = |line: usize, word: usize| -> f64 {
        let word = result.lines().nth(line).and_then(|line| line.split(' ').nth(word));
        word.expect("a figure").parse().expect("a number")
    };
    assert!((figure(0, 0) - 12.0).abs() < 0.002, "{result}");
    assert!((figure(1, 1) - 0.02).abs() < 3.0 * figure(2, 1) + 1e-5, "{result}");
}

/// After it the model hangs still.
fn rest(count: usize) -> impl Iterator<Item = yawrig_rig::Sample> {
    let sample = yawrig_rig::Sample { time_s: 0.0, yaw_deg: 0.0, counts: None };
    std::iter::repeat_n(sample, count)
}
