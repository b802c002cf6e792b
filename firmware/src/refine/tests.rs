use super::*;

const TRUTH: Parameters =
    Parameters { cosine: 9000.0, sine: -4000.0, offset: 300.0, decay: 0.002, frequency: 0.31 };

fn points(p: &Parameters, count: usize) -> [i16; POINTS] {
    core::array::from_fn(|k| {
        let t = k as f64;
        let swing = p.cosine * libm::cos(p.frequency * t) + p.sine * libm::sin(p.frequency * t);
        let y = p.offset + libm::exp(-p.decay * t) * swing;
        if k < count {
            libm::round(y) as i16
        } else {
            0
        }
    })
}

fn fitted(points: &[i16], decay: f64, frequency: f64) -> (Progress, Fit) {
    let mut fit = Fit::new(points.len(), decay, frequency);
    loop {
        let progress = fit.work(points);
        if progress != Progress::Going {
            return (progress, fit);
        }
    }
}

fn sums(points: &[i16], at: &Parameters) -> Sums {
    let mut fit = Fit { count: points.len(), horizon: points.len(), tried: *at, ..Fit::NONE };
    fit.work(points);
    while fit.next == Next::Look {
        fit.work(points);
    }
    fit.sums
}

/// J'r is minus half the gradient of the sum of squares: central differences agree to what single precision
/// leaves.
#[test]
fn the_jacobian_is_the_model_s() {
    let all = points(&TRUTH, 1000);
    let points = &all[..1000];
    let near = Parameters { cosine: 8800.0, decay: 0.0021, frequency: 0.3102, ..TRUTH };
    let gradient = sums(points, &near).gradient();
    for (i, h) in [20.0, 20.0, 20.0, 5e-3, 5e-3].into_iter().enumerate() {
        let mut step = [0.0; N];
        step[i] = h;
        let squares = |share| sums(points, &near.moved(&step, share, 1000.0)).squares();
        let by_difference = -(squares(1.0) - squares(-1.0)) / (4.0 * h);
        let error = (gradient[i] / by_difference - 1.0).abs();
        assert!(error < 2e-3, "{i}: {} {by_difference}", gradient[i]);
    }
}

/// From two per mille off, over hundreds of cycles, to what rounding to whole numbers leaves.
#[test]
fn the_minimum_is_found_from_afar() {
    for (decay, frequency, count) in
        [(0.0005, 0.55, 4096), (-0.0002, 0.02, 4000), (0.002, 0.31, 300), (0.0004, 2.0, 4096)]
    {
        let truth = Parameters { decay, frequency, ..TRUTH };
        let all = points(&truth, count);
        let (progress, fit) = fitted(&all[..count], 1.1 * decay, 1.002 * frequency);
        assert_eq!(progress, Progress::Done, "{frequency}");
        let [ss, _, ww] = fit.covariance().map(libm::sqrt);
        let p = fit.parameters();
        assert!((p.frequency - frequency).abs() < 4.0 * ww, "{p:?} {ww}");
        assert!((p.decay - decay).abs() < 4.0 * ss, "{p:?} {ss}");
    }
}

#[test]
fn what_does_not_swing_is_not_fitted() {
    let (progress, _) = fitted(&[0; 500], 0.001, 0.3);
    assert_eq!(progress, Progress::Failed);
}

#[test]
fn complex_exponentials_are_right() {
    for (re, im) in [(-0.002, 0.31), (0.1, 2.2), (-0.5, 1e-3)] {
        let z = Complex(re, im).exp();
        let e = libm::exp(re);
        assert!((z.0 - e * libm::cos(im)).abs() < 1e-14 && (z.1 - e * libm::sin(im)).abs() < 1e-14);
    }
}
