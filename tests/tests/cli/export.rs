//! `export`: programs in other languages give the readings that `compare` holds against the record.
//!
//! Run by Debian's `python3` (with numpy and scipy), by `octave-cli` and by the C compiler.

use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;
use yawrig_tests::process::{yawrig, Yawrig};

/// Readings asked of Octave, which takes half a minute for some laws over the whole record.
const FOR_OCTAVE: usize = 400;
/// Largest difference from the program's own readings, of the amplitude.
const MAX: f64 = 1e-6;

struct Bench {
    folder: TempDir,
}

/// Numbers of effects of the library, small enough for a model that still swings as its record does.
const SMOOTH: &str = "
quadratic_damping d=0.02
cubic_damping c=0.3
cubic_stiffness k3=20.0
quadratic_stiffness k2=4.0
quintic_stiffness k5=-80.0
pendulum_gravity g=9.0
odd_quadratic_stiffness k=-1.5
static_offset m=0.3
stiffness_drift e=0.0004
harmonic_forcing f=0.2 w=3.1 phi=0.4
second_mode amplitude=0.004 phase=0.3 w2=31.0 zeta2=0.01
sensor_nonlinearity s=0.05
baseline_drift d=0.0002
end_stop k=200.0 g=0.12
";
/// Held at rest in the end, and moved again by the forcing.
const CORNERS: &str = "
coulomb_friction c=0.25
free_play g=0.004
harmonic_forcing f=0.4 w=2.3 phi=1.0
power_damping c=0.05 n=1.5
";
const HYSTERESIS: &str = "
hysteresis h=4.0 y=0.02
coulomb_friction c=0.02
cubic_stiffness k3=20.0
";
const OWN: &str = r#"
id = "stribeck_friction"
title = "Stribeck friction"
moment = """-c * tanh(r / 0.01) * (1 + s * exp(-abs(r) / v))
    - k * max(abs(b) - 0.05, 0)^1.5 * sign(b) - c/4 * sign(r)"""
[parameters]
c = { unit = "rad/s2", start = 0.05, min = 0.0 }
s = { unit = "1", start = 0.5, min = 0.0 }
v = { unit = "rad/s", start = 0.1, min = 0.0 }
k = { unit = "rad/s2", start = 1.0, min = 0.0 }
"#;

impl Bench {
    /// A folder with a record and a second-order model of it.
    fn new() -> Self {
        let bench = Self::with_record("r.csv", 7.0);
        bench.of("fit r.csv").run().exits(0);
        bench
    }

    fn with_record(name: &str, wn: f64) -> Self {
        let bench = Self { folder: tempfile::tempdir().expect("a folder") };
        bench.record(name, wn);
        bench
    }

    fn record(&self, name: &str, wn: f64) {
        let rig = format!("--natural-frequency {wn} --damping 0.006 --seconds 8 --rate-hz 100");
        self.of(&format!("simulate {rig} --out {name}")).run().exits(0);
    }

    fn of(&self, arguments: &str) -> Yawrig {
        yawrig(arguments).in_folder(self.path())
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path().join(name), text).expect("room for it");
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path().join(name)).expect(name)
    }

    /// The model with `effects` written into its file by hand.
    fn with(&self, effects: &str) {
        let mut text = self.read("model.toml");
        for line in effects.lines().filter(|line| !line.is_empty()) {
            let mut words = line.split(' ');
            let id = words.next().expect("an id");
            text += &format!("\n[[effect]]\nid = \"{id}\"\n[effect.parameters]\n");
            for word in words {
                let (name, value) = word.split_once('=').expect("a number");
                text += &format!("{name} = {{ value = {value}, u = 0.001 }}\n");
            }
        }
        self.write("model.toml", &text);
    }

    fn export(&self, to: &str, out: &str) {
        self.of(&format!("export model.toml --to {to} --out {out}")).run().exits(0);
    }

    /// What `program` prints, run in the folder.
    fn run(&self, program: &Path, arguments: &[&str]) -> String {
        let output = Command::new(program)
            .args(arguments)
            .current_dir(self.path())
            .output()
            .unwrap_or_else(|e| panic!("{}: {e}", program.display()));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{} {arguments:?}: {said}", program.display());
        String::from_utf8(output.stdout).expect("text")
    }

    /// How far the readings that the exported programs print for the times of the table are from the table's
    /// model.
    fn agrees(&self, what: &str) {
        self.export("csv", "table.csv");
        let table = self.read("table.csv");
        let mut lines = table.lines();
        assert_eq!(lines.next(), Some("time_s,yaw_deg,model_yaw_deg,residual_deg,file"));
        let rows: Vec<[f64; 4]> = lines
            .map(|line| {
                let mut fields = line.split(',');
                std::array::from_fn(|_| fields.next().expect("a field").parse().expect("a number"))
            })
            .collect();
        assert!(rows.len() > 500, "{}", rows.len());
        assert!(rows.iter().all(|r| (r[2] - r[1] - r[3]).abs() < 1e-8));
        self.export("python", "taken.py");
        self.export("matlab", "taken_m.m");
        self.export("c", "taken_c.h");
        let times: String = rows.iter().map(|r| format!("{}\n", r[0])).collect();
        self.write("times.txt", &times);
        for (language, printed) in
            [("python", self.python()), ("octave", self.octave()), ("c", self.c())]
        {
            let amplitude = rows.iter().map(|r| r[2].abs()).fold(0.0, f64::max);
            let yaw: Vec<f64> =
                printed.lines().map(|l| l.trim().parse().expect("a number")).collect();
            let wanted = if language == "octave" { FOR_OCTAVE } else { rows.len() };
            assert_eq!(yaw.len(), wanted, "{what}, {language}");
            let worst = yaw.iter().zip(&rows).map(|(y, r)| (y - r[2]).abs()).fold(0.0, f64::max)
                / amplitude;
            println!("{what}, {language}: {worst:.1e} of the amplitude");
            assert!(worst < MAX, "{what}, {language}: {worst:e}");
        }
    }

    fn python(&self) -> String {
        self.write(
            "run.py",
            "import numpy as np, taken\nrelease = taken.RELEASES[0]\n\
             t = np.loadtxt('times.txt') - release['release_time_s']\n\
             for yaw in np.degrees(taken.simulate(release, t)):\n    print(repr(float(yaw)))\n",
        );
        self.run(&python(), &["run.py"])
    }

    fn octave(&self) -> String {
        let script = format!(
            "m = taken_m(); release = m.releases(1);\nt = load('times.txt') - release.release_time_s;\n\
             printf('%.12g\\n', m.simulate(release, t(1:{FOR_OCTAVE})) * 180 / pi);\n"
        );
        self.write("run_m.m", &script);
        self.run(Path::new("octave-cli"), &["--norc", "--no-history", "run_m.m"])
    }

    /// The program in the header's comment, which goes on from sample to sample, at the times of the table.
    fn c(&self) -> String {
        let header = self.read("taken_c.h");
        let (_, rest) = header.split_once("A program:\n").expect("a program in a comment");
        let (program, _) = rest.split_once("*/").expect("its end");
        let program: String = program
            .lines()
            .map(|l| format!("{}\n", l.trim_start().trim_start_matches('*')))
            .collect();
        self.write("as_it_stands.c", &program);
        let compiler = Path::new("cc");
        let strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2"];
        let compile = |name: &str| {
            let source = format!("{name}.c");
            self.run(compiler, &[&strict[..], &[&source, "-o", name, "-lm"]].concat());
        };
        compile("as_it_stands");
        let printed = self.run(&self.path().join("as_it_stands"), &[]);
        assert!(printed.starts_with("time_s,yaw_deg\n") && printed.lines().count() > 500);
        let at_times = program
            .replace("puts(\"time_s,yaw_deg\");", "double t;")
            .replace(
                "for (double t = release->start_s; t < release->end_s; t += release->step_s) {",
                "while (scanf(\"%lf\", &t) == 1) {\n t -= release->release_time_s;",
            )
            .replace("\"%.9f,%.9f\\n\", release->release_time_s + t, ", "\"%.12f\\n\", ");
        self.write("at_times.c", &at_times);
        compile("at_times");
        self.run(Path::new("sh"), &["-c", "./at_times < times.txt"])
    }
}

/// The Python that has scipy.
fn python() -> PathBuf {
    let has = |path: &&str| {
        let probe = Command::new(path).args(["-c", "import numpy, scipy"]).output();
        probe.is_ok_and(|o| o.status.success())
    };
    let found = ["/usr/bin/python3", "python3"].into_iter().find(has);
    PathBuf::from(
        found.expect("python3 with numpy and scipy: Debian's python3-numpy python3-scipy"),
    )
}

#[test]
fn every_smooth_effect_and_every_reading_is_the_same_elsewhere() {
    let bench = Bench::new();
    bench.with(SMOOTH);
    bench.agrees("smooth effects and readings");
}

#[test]
fn what_holds_the_model_at_rest_holds_it_elsewhere() {
    let bench = Bench::new();
    bench.with(CORNERS);
    bench.agrees("dry friction, free play and forcing");
}

#[test]
fn an_effect_of_the_users_own_is_the_same_elsewhere() {
    let bench = Bench::new();
    bench.with("stribeck_friction c=0.05 s=0.8 v=0.3 k=2");
    let text = bench.read("model.toml");
    let definition = format!("id = \"stribeck_friction\"\ndefinition = '''\n{OWN}'''");
    bench.write("model.toml", &text.replace("id = \"stribeck_friction\"", &definition));
    bench.agrees("an effect of one's own");
}

/// A state whose name and whose rate's are no z, followed by all; what no program has a place for is refused.
#[test]
fn a_state_of_ones_own_is_the_same_elsewhere() {
    let bench = Bench::new();
    let lag = r#"
id = "wake"
title = "A wake"
moment = "-c * late"
[[state]]
name = "late"
unit = "rad/s"
rate = "(r * (1 + abs(b)) - late) / T"
[parameters]
c = { unit = "1/s", start = 0.05 }
T = { unit = "s", start = 0.1, min = 0.001 }
"#;
    bench.with("wake c=0.4 T=0.3");
    let text = bench.read("model.toml");
    let of = |lag: &str| {
        text.replace("id = \"wake\"", &format!("id = \"wake\"\ndefinition = '''\n{lag}'''"))
    };
    bench.write("model.toml", &of(lag));
    bench.agrees("a state of one's own");
    let second = "[[state]]\nname = \"y\"\nunit = \"1\"\nrate = \"(b - y) / T\"\n[parameters]";
    let two = lag.replace("-c * late", "-c * (late + y * 0.1)").replace("[parameters]", second);
    let sticking = lag.replace("-c * late", "-c * late - 0.01 * sign(r)");
    for (text, why) in [(two, "this model has 2"), (sticking, "goes on while friction holds")] {
        bench.write("model.toml", &of(&text));
        bench.of("export model.toml --to c --out no.h").run().exits(2).says(why);
    }
}

#[test]
fn hysteresis_is_the_same_elsewhere() {
    let bench = Bench::new();
    bench.with(HYSTERESIS);
    bench.agrees("hysteresis and dry friction");
}

/// Curves on both sides, and dry friction.
#[test]
fn a_measured_law_is_the_same_elsewhere() {
    let bench = Bench::with_record("r.csv", 7.0);
    let rig = "--natural-frequency 7 --damping 0.006 --seconds 16 --rate-hz 100 --seed 2";
    let effects =
        "--effect coulomb_friction:c=0.05 --effect cubic_stiffness:k3=80 --effect quadratic_stiffness:k2=9";
    bench.of(&format!("simulate {rig} {effects} --out r.csv --force")).run().exits(0);
    bench.of("fit r.csv").run().exits(0);
    bench.of("add measured_law").run().exits(0);
    bench.agrees("a measured law");
}

/// Records of two conditions, the sensor's zero unknown: each with its numbers and its initial condition.
#[test]
fn every_record_of_a_model_is_in_the_program() {
    let bench = Bench::with_record("r.csv", 7.0);
    bench.record("other.csv", 9.0);
    bench.of("fit r.csv other.csv --unknown-zero").run().exits(0);
    bench.export("python", "both.py");
    let printed = bench.run(&python(), &["both.py", "2"]);
    assert!(printed.starts_with("time_s,yaw_deg\n") && printed.lines().count() > 300, "{printed}");
    let text = bench.read("both.py");
    let zeros: Vec<&str> = text.split("\"zero_rad\": ").skip(1).collect();
    assert_eq!(zeros.len(), 4, "{text}");
    assert!(zeros.iter().all(|z| !z.starts_with("0.0,") && !z.starts_with("0.0}")), "{text}");
    bench.export("csv", "both.csv");
    let table = bench.read("both.csv");
    assert!(table.contains("r.csv\n") && table.contains("other.csv\n"));
}

/// As `compare` gives it for the same numbers; none of a model that was edited since.
#[test]
fn the_covariance_of_the_fit_is_in_the_program() {
    let bench = Bench::with_record("r.csv", 7.0);
    bench.of("fit r.csv").run().exits(0);
    let added = bench.of("add cubic_stiffness --json").run().exits(0).json();
    let fitted = &added["covariance"];
    assert_eq!(fitted["names"][2], "cubic_stiffness.k3", "{added}");
    let fitted: Vec<Vec<f64>> = serde_json::from_value(fitted["matrix"].clone()).expect("a matrix");
    let shown = |file: &str| {
        let script = format!(
            "import json, {file} as m\nu = m.RELEASES[0]['u']\n\
             print(json.dumps([m.COVARIANCE_OF, m.COVARIANCE, [u[n] for n in m.COVARIANCE_OF]]))"
        );
        let said = bench.run(&python(), &["-c", &script]);
        serde_json::from_str::<(Vec<String>, Vec<Vec<f64>>, Vec<f64>)>(&said).expect("three lists")
    };
    bench.export("python", "fitted.py");
    let (names, matrix, u) = shown("fitted");
    assert_eq!(names, ["wn", "zeta", "cubic_stiffness_k3"]);
    assert_eq!(matrix, fitted);
    // The model's file has them to four digits.
    for (at, u) in u.iter().enumerate() {
        assert!((matrix[at][at].sqrt() / u - 1.0).abs() < 1e-3, "{}: {u}", names[at]);
    }
    bench.export("matlab", "fitted_m.m");
    let script = "m = fitted_m(); printf('%.17g\\n', m.covariance');";
    let said = bench.run(Path::new("octave-cli"), &["--norc", "--eval", script]);
    let said: Vec<f64> = said.lines().map(|l| l.trim().parse().expect("a number")).collect();
    assert_eq!(said, matrix.concat());
    bench.export("c", "fitted_c.h");
    let header = bench.read("fitted_c.h");
    assert!(header.contains("#define fitted_c_COVARIANCE_OF {\"wn\", \"zeta\","), "{header}");
    let program = "#include <stdio.h>\n#include \"fitted_c.h\"\n\
        int main(void) { double c[3][3] = fitted_c_COVARIANCE; printf(\"%.17g\", c[2][0]); return 0; }";
    bench.write("covariance.c", program);
    bench.run(Path::new("cc"), &["-std=c99", "covariance.c", "-o", "covariance", "-lm"]);
    let said = bench.run(&bench.path().join("covariance"), &[]);
    assert_eq!(said.parse::<f64>().expect("a number"), matrix[2][0]);
    let text = bench.read("model.toml");
    bench.write("model.toml", &format!("# looked at\n{text}"));
    bench.export("python", "edited.py");
    assert_eq!(shown("edited").0, [""; 0]);
}

#[test]
fn what_cannot_be_exported_is_refused_with_the_reason() {
    let bench = Bench::new();
    let out = |out: &str| bench.of(&format!("export model.toml --to matlab --out {out}")).run();
    out("my-model.m").exits(2).says("my_model.m").helps();
    out("model.py").exits(2).says("model.m").helps();
    out("model.m").exits(0);
    out("model.m").exits(2).says("is there already").helps();
    bench.of("export none.toml --to c --out c.h").run().exits(3).helps();
    bench.with("buffeting q=0.001");
    let refused = bench.of("export model.toml --to c --out c.h").run().exits(3);
    refused.says("buffeting is random and cannot be simulated").helps();
    assert!(!bench.path().join("c.h").exists());
}
