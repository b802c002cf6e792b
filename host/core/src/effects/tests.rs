use super::*;

#[test]
fn identifiers_are_those_of_files_and_command_line() {
    for effect in Effect::ALL {
        assert_eq!(serde_json::to_string(&effect).unwrap(), format!("\"{}\"", effect.id()));
        assert_eq!(Effect::from_id(effect.id()), Some(effect));
    }
}

#[test]
fn users_numbers_and_fitted_ones_are_the_same_motion() {
    for (effect, users) in [
        (Effect::HarmonicForcing, vec![0.3, 5.0, 0.7]),
        (Effect::SecondMode, vec![0.01, -1.2, 30.0, 0.02]),
        (Effect::CoulombFriction, vec![0.1]),
    ] {
        let varied = effect.varied(&users);
        let (back, jacobian) = effect.published(&varied);
        for (a, b) in users.iter().zip(&back) {
            assert!((a - b).abs() < 1e-12);
        }
        for j in 0..varied.len() {
            let mut moved = varied.clone();
            moved[j] += 1e-7;
            let (there, _) = effect.published(&moved);
            for i in 0..users.len() {
                let slope = (there[i] - back[i]) / 1e-7;
                assert!((slope - jacobian[i][j]).abs() < 1e-3 * (1.0 + slope.abs()));
            }
        }
    }
}
