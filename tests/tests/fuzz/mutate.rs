//! New inputs from old ones.

use crate::run::Target;
use rand::seq::IndexedRandom;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

const BYTES: [u8; 10] = [0, 1, 0x7f, 0x80, 0x81, 0xfe, 0xff, b'\n', b'"', b'.'];
const NUMBERS: [&str; 24] = [
    "0",
    "-0",
    "1",
    "-1",
    "0.0",
    "1e308",
    "-1e308",
    "1e-320",
    "1e999",
    "nan",
    "inf",
    "-inf",
    "NaN",
    "9223372036854775808",
    "-9223372036854775809",
    "4294967296",
    "65536",
    "0.1",
    "3.5",
    "1e-9",
    "1_000",
    "0x7f",
    "1e",
    "+.5",
];

/// A mutation of one of the inputs.
pub fn mutate(inputs: &[Vec<u8>], target: &Target, random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut input = inputs.choose(random).cloned().unwrap_or_default();
    // Mostly few changes, now and then many.
    let changes = 1 + (random.random::<f64>().powi(3) * 12.0) as usize;
    for _ in 0..changes {
        change(&mut input, inputs, target, random);
    }
    input.truncate(target.longest);
    if let Some(repair) = target.repair
        && random.random_bool(0.7)
    {
        repair(&mut input);
    }
    input
}

/// A stretch of the input, often a short one.
fn stretch(length: usize, random: &mut ChaCha8Rng) -> std::ops::Range<usize> {
    if length == 0 {
        return 0..0;
    }
    let from = random.random_range(0..length);
    let most = if random.random_bool(0.7) { 8 } else { length };
    let to = (from + 1 + random.random_range(0..most)).min(length);
    from..to
}

fn change(input: &mut Vec<u8>, inputs: &[Vec<u8>], target: &Target, random: &mut ChaCha8Rng) {
    let length = input.len();
    let at = random.random_range(0..=length);
    match random.random_range(0..if target.text { 13 } else { 10 }) {
        0 if length > 0 => input[at.min(length - 1)] ^= 1 << random.random_range(0..8),
        1 if length > 0 => input[at.min(length - 1)] = random.random(),
        2 if length > 0 => input[at.min(length - 1)] = *BYTES.choose(random).expect("some"),
        3 => {
            let new: Vec<u8> = (0..random.random_range(1..9)).map(|_| random.random()).collect();
            input.splice(at..at, new);
        }
        4 => drop(input.drain(stretch(length, random))),
        5 => {
            let copied = input[stretch(length, random)].to_vec();
            let times = if random.random_bool(0.1) { 300 } else { 1 };
            let copied = copied.repeat(times);
            input.splice(at..at, copied.into_iter().take(4 * target.longest));
        }
        6 => {
            let other = inputs.choose(random).expect("some");
            let piece = other[stretch(other.len(), random)].to_vec();
            let replaced = stretch(length, random);
            input.splice(replaced, piece);
        }
        7 => input.truncate(at),
        8 | 9 => {
            if let Some(word) = target.words.choose(random) {
                let replaced =
                    if random.random_bool(0.5) { at..at } else { stretch(length, random) };
                input.splice(replaced, word.bytes());
            }
        }
        10..=12 => other_number(input, random),
        _ => {}
    }
}

/// Puts another number in the place of one.
fn other_number(input: &mut Vec<u8>, random: &mut ChaCha8Rng) {
    let is_part = |byte: &u8| byte.is_ascii_digit() || b".+-".contains(byte);
    let mut numbers = Vec::new();
    let mut from = None;
    for (at, byte) in input.iter().enumerate() {
        match (is_part(byte), from) {
            (true, None) => from = Some(at),
            (false, Some(begun)) => {
                numbers.push(begun..at);
                from = None;
            }
            _ => {}
        }
    }
    if let Some(place) = numbers.choose(random) {
        input.splice(place.clone(), NUMBERS.choose(random).expect("some").bytes());
    }
}
