use super::*;
use crate::motion::simulate::Grid;
use crate::solver::check::jacobian_error;

fn decay(wn: f64, c: f64) -> FreeDecay {
    let grid = Grid { start_s: 0.0, step_s: 0.02, count: 900, mean_width_s: 0.0 };
    let terms = crate::effects::Terms::new([
        (Effect::CubicDamping, &[c][..]),
        (Effect::StaticOffset, &[0.1]),
    ]);
    let motion = crate::motion::simulate::Motion {
        natural_frequency_rad_s: wn,
        damping_ratio: 0.01,
        yaw_rad: 0.2,
        rate_rad_s: 0.0,
        terms,
    };
    let yaw_rad = motion.readings(&grid);
    FreeDecay {
        lines: Vec::new(),
        warnings: Vec::new(),
        stop: Default::default(),
        grid,
        smooth: yaw_rad.len(),
        yaw_rad,
        block: 1,
        noise_rad: 1e-3,
        sample_noise_rad: 1e-3,
        spectrum: Default::default(),
        colour: None,
        frequency_rad_s: wn,
        amplitude_rad: 0.2,
        release_time_s: 0.0,
        begins: Default::default(),
        ends: Default::default(),
        measurand: Default::default(),
        rate_u: 0.0,
        windows: Vec::new(),
        wind_speed_m_s: 0.0,
    }
}

/// One release that a second-order model explains, and one that it does not.
#[test]
fn what_is_explained_worse_is_known_less_well() {
    let decays = [decay(6.0, 0.0), decay(7.0, 8.0)];
    let structure = Structure { effects: vec![Effect::StaticOffset], ..Structure::default() };
    let starts = [vec![6.0, 0.01, 0.2, 0.0, 0.1], vec![7.0, 0.02, 0.2, 0.0, 0.1]];
    let releases = decays.each_ref().map(Release::whole);
    let apart = Sharing::none(2, 1);
    let together = fit(&releases, &structure, &apart, &starts);
    for k in 0..2 {
        let alone = fit(&releases[k..=k], &structure, &Sharing::none(1, 1), &starts[k..=k]);
        let (a, t) = (alone.fits[0].damping_ratio(), together.fits[k].damping_ratio());
        assert!((a.value - t.value).abs() < 1e-6, "{a} {t}");
        assert!(t.u > 0.99 * a.u, "release {k}: alone {a}, together {t}");
    }
    let bad = together.fits[1].damping_ratio().u;
    let alone = fit(&releases[1..], &structure, &Sharing::none(1, 1), &starts[1..]);
    assert!(bad < 1.05 * alone.fits[0].damping_ratio().u);
}

/// Shared, grouped, own and absent numbers each get their derivative where they belong.
#[test]
fn the_jacobian_of_shared_numbers_agrees_with_differences() {
    let decays = [decay(6.0, 0.0), decay(6.0, 2.0), decay(7.0, 2.0)];
    let releases = decays.each_ref().map(Release::whole);
    let structure = Structure {
        effects: vec![Effect::CubicDamping, Effect::StaticOffset, Effect::BaselineDrift],
        ..Structure::default()
    };
    let sharing = Sharing {
        modal: vec![0, 0, 1],
        effects: vec![
            vec![None, Some(0), Some(0)],
            vec![Some(0), Some(1), Some(1)],
            vec![Some(0); 3],
        ],
    };
    let starts = [
        vec![6.02, 0.011, 0.19, 0.02, 0.08, 1e-4],
        vec![6.02, 0.011, 0.21, 0.01, 1.5, 0.12, -1e-4],
        vec![7.02, 0.009, 0.21, 0.03, 1.5, 0.12, 2e-4],
    ];
    let together = JointProblem::new(&releases, &structure, &sharing, &starts);
    // Two modal pairs, three states, one coefficient, two offsets, three drifts.
    assert_eq!(together.layout.count(), 4 + 6 + 1 + 2 + 3);
    let p = together.gathered(&starts);
    assert!(jacobian_error(&together, &p) < 1e-4);
    let fitted = fit(&releases, &structure, &sharing, &starts);
    assert!(fitted.converged);
    let c = fitted.quantity(fitted.place(&Effect::CubicDamping, 0, 2).unwrap());
    assert!((c.value - 2.0).abs() < 1e-6, "{c}");
    assert_eq!(fitted.place(&Effect::CubicDamping, 0, 0), None);
}

/// What two releases share is told from zero in the numbers that they have in common; nothing is less known for it.
#[test]
fn a_shared_number_is_told_from_zero() {
    let decays = [decay(6.0, 2.0), decay(7.0, 8.0)];
    let releases = decays.each_ref().map(Release::whole);
    let effects = vec![Effect::CubicDamping, Effect::StaticOffset];
    let structure = Structure { effects, ..Structure::default() };
    let sharing = Sharing { modal: vec![0, 1], effects: vec![vec![Some(0); 2]; 2] };
    let starts = [vec![6.0, 0.01, 0.2, 0.0, 3.0, 0.1], vec![7.0, 0.01, 0.2, 0.0, 3.0, 0.1]];
    let before = fit(&releases, &structure, &sharing, &starts);
    let at = before.place(&Effect::CubicDamping, 0, 0).expect("an effect of both");
    let own = before.quantity(at);
    let k = 10.0 * own.value.abs() / own.u;
    let mut after = before.clone();
    after.known_from_zero(&Effect::CubicDamping, k);
    assert!((after.quantity(at).u * 10.0 / own.u - 1.0).abs() < 1e-6, "{}", after.quantity(at));
    for j in 0..before.parameters.len() {
        assert!(after.quantity(j).u <= before.quantity(j).u * (1.0 + 1e-9), "{j}");
    }
    // It is that far already.
    after.known_from_zero(&Effect::CubicDamping, 0.5 * k);
    assert!((after.quantity(at).u * 10.0 / own.u - 1.0).abs() < 1e-6);
}
