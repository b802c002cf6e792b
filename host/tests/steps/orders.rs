//! Hidden pairs whose effects are added in either order: YAWRIG_ORDERS says how many, YAWRIG_SEED which.

use crate::hidden::{hidden, number, plant, Plan};
use rayon::prelude::*;
use yawrig_core::effects::Effect;
use yawrig_model::comparison::{compare, Comparison};

/// A forcing that is looked for before drag is there is found where the drag is missed.
const FORCING_FIRST: (u64, u64) = (1, 31);

#[test]
fn a_pair_fits_alike_in_either_order() {
    let n = number("YAWRIG_ORDERS", 6);
    let definite: Vec<Effect> = hidden().into_iter().filter(|e| *e != Effect::Buffeting).collect();
    let folder = tempfile::tempdir().unwrap();
    let residuals = |(i, shift): (u64, u64)| {
        let k = i as usize;
        let (a, b) = (k % 12, (k % 12 + 1 + 5 * k % 11) % 12);
        let effects = [a, b].map(|k| definite[k].clone());
        let seed = 250_000 + i + 1_000_000 * shift;
        let planted = plant(&Plan { effects: effects.to_vec(), seed, ..Plan::default() });
        let file = folder.path().join(format!("{seed}.csv"));
        let rows = planted.record.time_s.iter().zip(&planted.record.yaw_deg);
        let rows: String = rows.map(|(t, y)| format!("{t},{y}\n")).collect();
        std::fs::write(&file, format!("time_s,yaw_deg\n{rows}")).unwrap();
        let [a, b] = effects;
        let both = [vec![a.clone(), b.clone()], vec![b, a]].map(|effects| {
            let said = format!("{effects:?}");
            let asked = Comparison { files: vec![file.clone()], effects, ..Comparison::default() };
            let found = compare(&asked).unwrap_or_else(|e| panic!("{said}: {e}"));
            found.appraisal.residuals.residual_over_noise
        });
        (planted.described, both)
    };
    let mut plans: Vec<(u64, u64)> = (0..n).map(|i| (i, number("YAWRIG_SEED", 0))).collect();
    plans.push(FORCING_FIRST);
    let n = plans.len() as u64;
    let all: Vec<(String, [f64; 2])> = plans.into_par_iter().map(residuals).collect();
    let apart = |r: &[f64; 2]| (r[0] / r[1] - 1.0).abs() > 0.01;
    for (described, both) in all.iter().filter(|(_, r)| apart(r)) {
        println!("{both:.3?}: {described}");
    }
    let alike = all.iter().filter(|(_, r)| !apart(r)).count();
    println!("pairs that fit alike in either order, to 1 %: {alike} of {n}");
    assert_eq!(alike as u64, n);
}
