//! The test of power cuts must fail where the store's safeguards are taken out. It is run on copies of the
//! device's sources: as they are, without checksum and commit word, and with the commit word first and no
//! checksum.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Lines to find, each once, and what stands there instead.
type Mutation = [(&'static str, &'static str, &'static str)];

const NO_ENVELOPE_CRC: (&str, &str, &str) =
    ("shared/src/blob.rs", "if crc32(&head[..20]) != word(head, 20) {", "if false {");
const NO_PAYLOAD_CRC: (&str, &str, &str) = (
    "shared/src/blob.rs",
    "if crc.ok_or(BlobError::Truncated)? != envelope.payload_crc {",
    "if false {",
);
const NO_COMMIT_WORD: (&str, &str, &str) =
    ("firmware/src/slots.rs", "if word(0)? != COMMITTED {", "if false {");
const NO_LENGTH: (&str, &str, &str) = (
    "firmware/src/slots.rs",
    "(length == envelope.blob_length()).then_some(envelope)",
    "Some(envelope)",
);
const COMMIT_WORD_FIRST: (&str, &str, &str) = (
    "firmware/src/slots.rs",
    "        self.update = Some(Update { slot, length, written: 0, verified: false });",
    "        self.program(slot, 0, &COMMITTED)?;
        self.update = Some(Update { slot, length, written: 0, verified: false });",
);
const NO_COMMIT_WORD_LAST: (&str, &str, &str) =
    ("firmware/src/slots.rs", "        self.program(update.slot, 0, &COMMITTED)?;\n", "");

/// A workspace of the two device crates alone.
fn copy(to: &Path, mutation: &Mutation) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    copy_folder(&root.join("shared"), &to.join("shared"));
    for part in ["src", "tests/device/chip", "networks"] {
        copy_folder(&root.join("firmware").join(part), &to.join("firmware").join(part));
    }
    let tests = Path::new("firmware/tests/device");
    let [from, into] = [&root, to].map(|at| at.join(tests));
    fs::copy(from.join("power_cuts.rs"), into.join("power_cuts.rs")).expect("a copy");
    fs::write(into.join("main.rs"), "mod chip;\nmod power_cuts;\n").expect("a program");
    let manifest = fs::read_to_string(root.join("firmware/Cargo.toml")).expect("the device's");
    // The rig is what the other tests of the device use.
    let (alone, _) = manifest.split_once("[dev-dependencies]").expect("the tests' own");
    fs::write(to.join("firmware/Cargo.toml"), alone).expect("a copy");
    fs::copy(root.join("Cargo.lock"), to.join("Cargo.lock")).expect("a copy");
    let manifest = fs::read_to_string(root.join("Cargo.toml")).expect("the workspace");
    fs::write(to.join("Cargo.toml"), device_crates_alone(&manifest)).expect("a copy");
    for (file, from, into) in mutation {
        let file = to.join(file);
        let text = fs::read_to_string(&file).expect("a source");
        assert_eq!(text.matches(from).count(), 1, "{from}");
        fs::write(&file, text.replace(from, into)).expect("a copy");
    }
}

/// The workspace without the members that are not copied.
fn device_crates_alone(manifest: &str) -> String {
    let (before, list) = manifest.split_once("members = [").expect("members");
    let (_, after) = list.split_once(']').expect("their end");
    let after = after.replace("\ndefault-members = [\"host\"]", "");
    format!("{before}members = [\"shared\", \"firmware\"]{after}")
}

fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder") {
        let entry = entry.expect("an entry");
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).expect("a copy");
        }
    }
}

fn power_cuts(at: &Path, target: &Path) -> Output {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["test", "--release", "--offline", "-p", "yawrig-firmware", "--test", "device"])
        .arg("::pages_and_4_kib")
        .current_dir(at)
        .env("CARGO_TARGET_DIR", target)
        .output()
        .expect("cargo")
}

#[test]
fn the_power_cut_test_fails_without_the_safeguards_at_full_size() {
    let folder = tempfile::tempdir().expect("a folder");
    let target: PathBuf = folder.path().join("target");
    let run = |name: &str, mutation: &Mutation| {
        let at = folder.path().join(name);
        copy(&at, mutation);
        let output = power_cuts(&at, &target);
        let said = [output.stdout, output.stderr].concat();
        (output.status.success(), String::from_utf8_lossy(&said).into_owned())
    };
    let (passed, said) = run("whole", &[]);
    assert!(passed, "as it is: {said}");
    // What fails is the device's start, or its writing a word twice; not the build.
    let mutants: [(&str, &Mutation, &str); 3] = [
        (
            "bare",
            &[NO_ENVELOPE_CRC, NO_PAYLOAD_CRC, NO_COMMIT_WORD, NO_LENGTH],
            "runs after a cut where",
        ),
        (
            "early",
            &[NO_ENVELOPE_CRC, NO_PAYLOAD_CRC, NO_LENGTH, COMMIT_WORD_FIRST, NO_COMMIT_WORD_LAST],
            "runs after a cut where",
        ),
        ("twice", &[COMMIT_WORD_FIRST], "verified: FlashWrite"),
    ];
    for (name, mutation, how) in mutants {
        let (passed, said) = run(name, mutation);
        assert!(!passed, "{name}: the test does not notice");
        assert!(said.contains(how), "{name}: {said}");
    }
}
