//! `host/matlab`: its functions, run by `octave-cli`, give what the program prints.

use std::path::Path;
use std::process::Command;
use yawrig_tests::process::{binary, yawrig};

/// What Octave prints of `script` in `folder`.
fn octave(folder: &Path, script: &str) -> String {
    let functions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host/matlab");
    let script = format!("addpath('{}');\n{script}", functions.display());
    std::fs::write(folder.join("script.m"), script).expect("a file");
    let ran = Command::new("octave-cli")
        .args(["--norc", "--no-history", "script.m"])
        .env("YAWRIG", binary())
        .current_dir(folder)
        .output()
        .expect("octave-cli");
    let said = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{said}");
    String::from_utf8(ran.stdout).expect("text")
}

/// Whether a printed line is this number, as far as Octave reads decimals: to the last bit but one.
fn is(line: Option<&str>, expected: f64) {
    let number: f64 = line.expect("a line").parse().expect("a number");
    assert!(
        (number - expected).abs() <= 2.0 * f64::EPSILON * expected.abs(),
        "{number} {expected}"
    );
}

#[test]
fn functions_for_matlab_give_the_numbers_of_the_program() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let of = |arguments: &str| yawrig(arguments).in_folder(at);
    let planted = "--natural-frequency 7 --damping 0.006 --seconds 16 --rate-hz 100 --effect coulomb_friction:c=0.15";
    of(&format!("simulate {planted} --out r.csv")).run().exits(0);
    of("simulate --campaign campaign --rate-hz 100").run().exits(0);
    let printed = octave(
        at,
        "show = @(x) printf('%.17g\\n', x);
[t, y, made] = yawrig.simulate('natural_frequency', 7, 'damping', 0.006, 'seconds', 16, 'rate_hz', 100, 'effect', ...
    {'coulomb_friction:c=0.15'});
show(made.truth.natural_frequency_rad_s);
found = yawrig.identify(t, y, 'from_deg', 9);
show(found.natural_frequency_rad_s.value); show(found.damping_ratio.u); show(found.window.cycles);
all = yawrig.identify('r.csv', 'method', 'all', 'from_deg', 9);
show(all.natural_frequency_rad_s.value);
fitted = yawrig.compare(t, y, 'effect', {'coulomb_friction'});
show(fitted.parameters.coulomb_friction_c.value);
diagnosis = yawrig.diagnose('r.csv');
printf('%s %s\\n', diagnosis.status, diagnosis.effects{1});
[result, points] = yawrig.derivatives('campaign/campaign.toml');
show(points.cn_r(3)); show(points.cn_beta_u(8)); show(numel(points.spring));
law = yawrig.ask('law', {'r.csv'});
show(law.residual_over_noise);
for wrong = {{t, zeros(size(t))}, {'is missing.csv'}, {t, y, 'from_deg', -1}, {t, y(2:end)}}
  try
    yawrig.identify(wrong{1}{:});
    disp('was not refused');
  catch refused
    printf('%s: %s\\n', refused.identifier, strtok(refused.message, char(10)));
  end
end
",
    );
    let mut lines = printed.lines();
    let json = |arguments: &str| of(arguments).run().exits(0).json();
    is(lines.next(), 7.0);
    let record = &json("identify r.csv --from-deg 9 --json")["records"][0];
    let estimate = &record["estimates"][0];
    is(lines.next(), estimate["natural_frequency_rad_s"]["value"].as_f64().unwrap());
    is(lines.next(), estimate["damping_ratio"]["u"].as_f64().unwrap());
    is(lines.next(), record["window"]["cycles"].as_f64().unwrap());
    is(lines.next(), estimate["natural_frequency_rad_s"]["value"].as_f64().unwrap());
    let fitted = json("compare r.csv --effect coulomb_friction --json");
    is(lines.next(), fitted["parameters"]["coulomb_friction.c"]["value"].as_f64().unwrap());
    assert_eq!(lines.next(), Some("explained coulomb_friction"));
    let points = json("derivatives campaign/campaign.toml --json")["points"].clone();

    is(lines.next(), points[2]["cn_r"]["value"].as_f64().unwrap());
    is(lines.next(), points[7]["cn_beta"]["u"].as_f64().unwrap());
    is(lines.next(), 8.0);
    is(lines.next(), json("law r.csv --json")["residual_over_noise"].as_f64().unwrap());
    let refused: Vec<&str> = lines.collect();
    let expected =
        ["no oscillation found", "cannot read is missing.csv", "--from-deg", "1601 times"];
    assert_eq!(refused.len(), expected.len(), "{refused:?}");
    for (line, words) in refused.iter().zip(expected) {
        assert!(line.starts_with("yawrig:refused: ") && line.contains(words), "{line}: {words}");
    }
}
