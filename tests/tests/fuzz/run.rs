//! Runs a target on its corpus and on mutations of it.

use crate::mutate::mutate;
use crate::MEMORY;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::collections::HashSet;
use std::fs;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use yawrig_shared::checksum::crc32;

/// Reads an input; says what came of it in a few words.
pub type Reader = dyn Fn(&[u8]) -> String;

/// A reader under test.
pub struct Target {
    pub read: Box<Reader>,
    /// Pieces that mean something to it.
    pub words: &'static [&'static str],
    /// Text: numbers in it are replaced by others.
    pub text: bool,
    /// Makes an input's checksums right again.
    pub repair: Option<fn(&mut Vec<u8>)>,
    pub longest: usize,
    /// Inputs of a short run.
    pub executions: u64,
}

/// Memory that reading an input of some kilobytes may take: what it holds, many times over.
const MAX_BYTES: usize = 32 << 20;
/// One input may take this long on a machine that is busy with other things, where it takes microseconds.
const HANGS_S: u64 = yawrig_tests::PATIENCE.as_secs();
/// Inputs that joined are at most so many.
const MAX_JOINED: usize = 4000;

/// Allocation is counted for the whole program: one target at a time.
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn folder(of: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz").join(of)
}

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

/// The corpus, oldest name first.
fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = folder("corpus").join(target);
    let entries = fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files.iter().map(|file| fs::read(file).expect("a file of the corpus")).collect()
}

fn keep(folder_name: &str, target: &str, input: &[u8]) -> PathBuf {
    let folder = folder(folder_name).join(target);
    fs::create_dir_all(&folder).expect("a folder for it");
    let file = folder.join(format!("{:08x}", crc32(input)));
    fs::write(&file, input).expect("room for it");
    file
}

/// What is being read, for the one who watches that it ends.
struct Watched {
    input: Mutex<Vec<u8>>,
    begun: AtomicU64,
    over: AtomicBool,
}

fn watch(watched: &Watched, target: &str, start: Instant) {
    while !watched.over.load(Ordering::Relaxed) {
        std::thread::sleep(Duration::from_millis(200));
        let begun = watched.begun.load(Ordering::Relaxed);
        if begun != 0 && start.elapsed().as_secs().saturating_sub(begun) > HANGS_S {
            let input = watched.input.lock().unwrap_or_else(PoisonError::into_inner);
            let file = keep("found", target, &input);
            eprintln!("{target}: hangs on {}", file.display());
            std::process::abort();
        }
    }
}

/// Digits and quoted text differ from input to input; the rest of an answer tells its kind.
fn kind(answer: &str) -> u32 {
    let mut plain = String::new();
    let mut quoted = false;
    for c in answer.chars() {
        match c {
            '"' | '`' | '\'' => quoted = !quoted,
            _ if quoted || c.is_ascii_digit() => {}
            c => plain.push(c),
        }
    }
    plain.truncate(plain.char_indices().nth(160).map_or(plain.len(), |(at, _)| at));
    crc32(plain.as_bytes())
}

pub fn run(name: &str, target: &Target) {
    let _alone = alone();
    let seconds = number("YAWRIG_FUZZ_SECONDS").map(Duration::from_secs);
    let seed = number("YAWRIG_FUZZ_SEED").unwrap_or(1);
    let keeps = number("YAWRIG_FUZZ_KEEP") == Some(1);
    let mut inputs = corpus(name);
    assert!(!inputs.is_empty(), "{name} has no corpus");
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ u64::from(crc32(name.as_bytes())));
    let start = Instant::now();
    let watched =
        Watched { input: Mutex::default(), begun: AtomicU64::new(0), over: AtomicBool::new(false) };
    let (mut executions, mut joined, mut most) = (0_u64, 0, 0);
    let mut kinds = HashSet::new();
    let given = inputs.len() as u64;
    let failed = std::thread::scope(|scope| {
        scope.spawn(|| watch(&watched, name, start));
        let failed = loop {
            let input = match inputs.get(executions as usize) {
                // The corpus itself first.
                Some(input) if executions < given => input.clone(),
                _ => mutate(&inputs, target, &mut random),
            };
            watched.input.lock().unwrap_or_else(PoisonError::into_inner).clone_from(&input);
            watched.begun.store(start.elapsed().as_secs().max(1), Ordering::Relaxed);
            let before = MEMORY.current_usage();
            MEMORY.reset_peak_usage();
            let answer = catch_unwind(AssertUnwindSafe(|| (target.read)(&input)));
            let taken = MEMORY.peak_usage().saturating_sub(before);
            watched.begun.store(0, Ordering::Relaxed);
            executions += 1;
            most = most.max(taken);
            match answer {
                Err(_) => break Some((input, "panics".to_owned())),
                Ok(_) if taken > MAX_BYTES => {
                    break Some((input, format!("takes {taken} bytes of memory")));
                }
                Ok(answer) => {
                    if kinds.insert(kind(&answer)) && executions > given && joined < MAX_JOINED {
                        if keeps {
                            keep("corpus", name, &input);
                        }
                        inputs.push(input);
                        joined += 1;
                    }
                }
            }
            let done = match seconds {
                Some(seconds) => executions >= given && start.elapsed() >= seconds,
                None => executions >= given + target.executions,
            };
            if done {
                break None;
            }
        };
        watched.over.store(true, Ordering::Relaxed);
        failed
    });
    println!(
        "{name:12} {executions:10} executions in {:6.1} s, {} of them kept, {} kinds of answer, at most {} KiB",
        start.elapsed().as_secs_f64(),
        given,
        kinds.len(),
        most / 1024
    );
    if let Some((input, what)) = failed {
        let file = keep("found", name, &input);
        panic!("{name} {what} on {}", file.display());
    }
}
