//! A phone as the sensor of the page that needs no server: its gyroscope's events, made from another integrator
//! than the fit's.

use crate::bench::pictures;
use crate::still::{printed, Served};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use yawrig_tests::browser::Window;

/// What a phone's gyroscope says of a pendulum that is held for two seconds and let go, and its small natural
/// frequency: time, s, and three rates, deg/s. The motion by fourth-order steps of its own, a hundred a sample; the
/// clock of a browser, which is uneven by a millisecond and told in tenths of one; noise of 0.05 deg/s.
fn pendulum() -> (Vec<[f64; 4]>, f64) {
    const W: f64 = 3.9;
    const ZETA: f64 = 0.006;
    let mut random = ChaCha8Rng::seed_from_u64(66);
    let acceleration = |y: f64, r: f64| -W * W * y.sin() - 2.0 * ZETA * W * r;
    let (mut y, mut r, mut at) = (15f64.to_radians(), 0.0, 0.0);
    let mut samples = Vec::new();
    for k in 0..60 * 62 {
        let time_s = f64::from(k) / 60.0 + random.random_range(-0.001..0.001);
        let step = (time_s - 2.0).max(at) - at;
        let h = step / 100.0;
        for _ in 0..100 {
            let k1 = [r, acceleration(y, r)];
            let k2 = [r + h / 2.0 * k1[1], acceleration(y + h / 2.0 * k1[0], r + h / 2.0 * k1[1])];
            let k3 = [r + h / 2.0 * k2[1], acceleration(y + h / 2.0 * k2[0], r + h / 2.0 * k2[1])];
            let k4 = [r + h * k3[1], acceleration(y + h * k3[0], r + h * k3[1])];
            y += h / 6.0 * (k1[0] + 2.0 * k2[0] + 2.0 * k3[0] + k4[0]);
            r += h / 6.0 * (k1[1] + 2.0 * k2[1] + 2.0 * k3[1] + k4[1]);
        }
        at += step;
        let mut noise = || Normal::new(0.0, 0.05).expect("a spread").sample(&mut random);
        let rate = r.to_degrees();
        let rates = [0.02 * rate + noise(), rate + noise(), 0.3 + noise()];
        samples.push([(time_s * 1e4).round() / 1e4, rates[0], rates[1], rates[2]]);
    }
    (samples, W)
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_phone_is_the_sensor() {
    let served = Served::start();
    let mut browser = served.opened();
    browser.resize(Window { width: 390, height: 844, is_dark: false });
    browser.click("#phone-button");
    browser.wait("document.querySelector('#phone-dialog').open");
    browser.click("#phone-begin");
    browser.wait("document.querySelector('#phone-begin').textContent === 'Stop'");
    let (samples, small_rad_s) = pendulum();
    // Each at its own time: those of events that a script makes are when it makes them.
    let told = "for (const [t, alpha, beta, gamma] of samples) { \
        const event = new DeviceMotionEvent('devicemotion', { rotationRate: { alpha, beta, gamma }, interval: 16 }); \
        Object.defineProperty(event, 'timeStamp', { value: 5000 + 1000 * t }); dispatchEvent(event); }";
    let samples = serde_json::to_string(&samples).expect("numbers");
    browser.value(&format!("(() => {{ const samples = {samples}; {told} return 1; }})()"));
    browser
        .wait("document.querySelector('#phone-told').textContent.includes('60 samples a second')");
    browser.picture(&pictures().join("static-phone-recording.png"));
    browser.click("#phone-begin");
    browser.wait("document.querySelector('#diagnosis').textContent.includes('explained by') && document.body.dataset.busy === undefined");
    browser.picture(&pictures().join("static-phone.png"));

    // It swings about the axis that swings, from where it was let go on.
    let found = printed(&mut browser, "diagnose", 0)["json"].clone();
    assert_eq!(found["status"], "explained", "{found}");
    let number = &found["modal"]["natural_frequency_rad_s"];
    let [value, u] = ["value", "u"].map(|of| number[of].as_f64().expect(of));
    assert!((value - small_rad_s).abs() < 4.0 * u && u < 0.002, "{value} ± {u}");
    // The record can be had as a file.
    browser.click("#save-button");
    browser.wait("document.querySelector('#save-dialog').open");
    let names =
        browser.value("[...document.querySelectorAll('[data-save]')].map(b => b.dataset.save)");
    assert!(names[0].as_str().is_some_and(|name| name.starts_with("phone-")), "{names}");
    browser.is_clean(&served.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_device_without_a_gyroscope_is_told() {
    let served = Served::start();
    let mut browser = served.opened();
    browser.click("#phone-button");
    browser.click("#phone-begin");
    browser.wait("document.querySelector('#phone-told').textContent.startsWith('The browser reports no motion')");
    browser.key("Escape");
    browser.wait("!document.querySelector('#phone-dialog').open");
    browser.is_clean(&served.origin);
}
