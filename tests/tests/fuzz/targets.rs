//! The readers, and what must hold of whatever they take.

use crate::run::Target;
use std::path::PathBuf;
use yawrig_campaign::CampaignFile;
use yawrig_firmware::device::Device;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_model::document::Model;
use yawrig_rig::LIBRARY;
use yawrig_shared::blob::{self, ENVELOPE};
use yawrig_shared::checksum::crc32;
use yawrig_shared::features::{Inputs, MAX_INPUTS};
use yawrig_shared::potentiometer;
use yawrig_shared::wire::{
    self, Decoder, Event, HelloReply, Message, Reply, Request, HELLO_KEY, LONGEST_FRAME,
};

fn binary(read: impl Fn(&[u8]) -> String + 'static, longest: usize, executions: u64) -> Target {
    Target { read: Box::new(read), words: &[], text: false, repair: None, longest, executions }
}

fn text(
    read: impl Fn(&[u8]) -> String + 'static,
    words: &'static [&'static str],
    executions: u64,
) -> Target {
    Target { read: Box::new(read), words, text: true, repair: None, longest: 4096, executions }
}

fn said<T, E: std::fmt::Debug>(result: Result<T, E>) -> String {
    match result {
        Ok(_) => "ok".into(),
        Err(e) => format!("{e:?}"),
    }
}

/// What goes for a message goes there and back without a change.
fn read_as<M: Message + PartialEq + std::fmt::Debug>(body: &[u8]) -> String {
    match postcard::from_bytes::<M>(body) {
        Err(e) => format!("{e:?}"),
        Ok(message) => {
            let frame = wire::encode(7, &message).expect("what was read can be written");
            let mut decoder = Decoder::new();
            let again = frame
                .iter()
                .find_map(|&byte| decoder.push(byte).map(|f| f.expect("a frame").message::<M>()));
            let again = again.flatten().expect("its key").expect("the message");
            // By its text: not-a-number is equal to itself there.
            assert_eq!(format!("{again:?}"), format!("{message:?}"));
            format!("{message:?}").chars().take_while(|c| c.is_alphabetic() || *c == '(').collect()
        }
    }
}

/// Bytes of the line cut into frames.
pub fn frames() -> Target {
    let read = |input: &[u8]| {
        let mut decoder = Decoder::new();
        let mut came = String::new();
        for &byte in input {
            match decoder.push(byte) {
                None => {}
                Some(Err(e)) => came += &format!("{e:?} "),
                Some(Ok(frame)) => {
                    let body = frame.body;
                    came += match frame.key {
                        HELLO_KEY => HelloReply::read(body).map_or("hello? ", |_| "hello "),
                        key if key == Request::KEY => "request ",
                        key if key == Reply::KEY => "reply ",
                        key if key == Event::KEY => "event ",
                        _ => "other ",
                    };
                    let _ = (frame.message::<Request>(), frame.message::<Reply>());
                    let _ = frame.message::<Event>();
                }
            }
        }
        came
    };
    binary(read, 2048, 60_000)
}

/// Bodies of frames whose checksum is right: the first byte says of which kind.
pub fn messages() -> Target {
    let read = |input: &[u8]| {
        let Some((kind, body)) = input.split_first() else { return String::new() };
        match kind % 3 {
            0 => read_as::<Request>(body),
            1 => read_as::<Reply>(body),
            _ => read_as::<Event>(body),
        }
    };
    binary(read, LONGEST_FRAME - 11, 60_000)
}

/// A device on the line: bodies of requests, whole frames by the time they reach it, samples between them.
pub fn device() -> Target {
    let read = |input: &[u8]| {
        let mut device = Box::new(Device::new(MemoryFlash::new(), "fuzz"));
        let mut came = 0;
        for (n, piece) in input.chunks(64).enumerate() {
            let (kind, body) = piece.split_first().expect("not empty");
            match kind % 8 {
                0 => device.lost(u32::from(body.first().copied().unwrap_or(0)) << (kind / 8)),
                1 => piece.iter().for_each(|&byte| device.receive(byte)),
                2 => device.overrun(),
                3 | 4 => {
                    for pair in body.chunks(2) {
                        device.sample(
                            u16::from(pair[0]) << 8 | u16::from(*pair.last().expect("one")),
                        );
                        device.work();
                    }
                }
                _ => {
                    if let Ok(frame) = wire::encode_raw(Request::KEY, n as u16, body) {
                        frame.iter().for_each(|&byte| device.receive(byte));
                    }
                }
            }
            while device.transmit().is_some() {
                came += 1;
            }
        }
        while device.idle() {}
        // Whatever was said to it, it answers.
        for byte in wire::encode(60_000, &Request::Status).expect("a frame") {
            device.receive(byte);
        }
        // A frame cut off before may have swallowed the first one.
        for byte in wire::encode(60_001, &Request::Status).expect("a frame") {
            device.receive(byte);
        }
        assert!(device.transmit().is_some(), "it is silent");
        if came > 0 {
            "answers".into()
        } else {
            "says nothing".into()
        }
    };
    binary(read, 2048, 6_000)
}

/// The potentiometer's stream: samples in order, and none counted twice.
pub fn samples() -> Target {
    let read = |input: &[u8]| {
        let mut decoder = potentiometer::Decoder::default();
        let mut came = String::new();
        let (mut index, mut runs) = (None::<u32>, 0);
        for &byte in input {
            if let Some(sample) = decoder.decode(byte) {
                if let Some(last) = index {
                    if sample.lost == 0 {
                        assert_eq!(
                            sample.index,
                            last.wrapping_add(1),
                            "a gap that is not reported"
                        );
                    } else {
                        runs += 1;
                    }
                }
                index = Some(sample.index);
            }
        }
        came += if index.is_some() { "samples " } else { "none " };
        came += ["", "a gap", "gaps"][runs.min(2)];
        came
    };
    binary(read, 2048, 60_000)
}

pub fn blob() -> Target {
    let read = |input: &[u8]| {
        let read = blob::decode(input);
        if let Ok((_, payload)) = &read {
            // What is taken computes, whatever the inputs.
            let inputs = [0.25_f32; MAX_INPUTS];
            let count = usize::from(payload.network.topology[0]);
            assert!(count <= MAX_INPUTS);
            let inputs: Inputs = inputs[..count].iter().copied().collect();
            let _ = payload.network.estimate_inputs(&inputs);
        }
        said(read)
    };
    let repair = |input: &mut Vec<u8>| {
        if let (Some(payload), true) = (input.get(ENVELOPE..), input.len() > ENVELOPE) {
            let (length, crc) = (payload.len() as u32, crc32(payload));
            input[8..12].copy_from_slice(&length.to_le_bytes());
            input[16..20].copy_from_slice(&crc.to_le_bytes());
            let crc = crc32(&input[..20]);
            input[20..24].copy_from_slice(&crc.to_le_bytes());
        }
    };
    Target { repair: Some(repair), ..binary(read, blob::LONGEST + 64, 20_000) }
}

/// A folder with an empty file for each of these names.
fn folder(names: &[&str]) -> PathBuf {
    let folder = tempfile::tempdir().expect("a folder").keep();
    for name in names {
        std::fs::write(folder.join(name), "").expect("room for it");
    }
    folder
}

/// Reads bytes as a record, whatever they are.
fn as_record() -> impl Fn(&[u8]) -> String + 'static {
    let file = folder(&[]).join("record.csv");
    move |input: &[u8]| {
        std::fs::write(&file, input).expect("room for it");
        let record = yawrig_records::read(&file);
        if let Ok(record) = &record {
            assert!(record.time_s.windows(2).all(|t| t[0] < t[1]), "time runs forward");
            assert!(record.yaw_deg.iter().chain(&record.time_s).all(|x| x.is_finite()));
            let _ = (record.timing(), record.noise_rms_deg());
            return match record.resampled(1000.0) {
                Ok(even) => format!("ok, {} ", if even.is_empty() { "empty" } else { "even" }),
                Err(e) => format!("not resampled: {e}"),
            };
        }
        said(record.map_err(|e| e.message))
    }
}

pub fn record() -> Target {
    let words = &["time_s", "yaw_rad", "yaw_deg", ",", "\n", "\r\n", "\u{feff}", "\"", " ", ";"];
    text(as_record(), words, 4000)
}

/// Files of other programs.
pub fn foreign() -> Target {
    let words = &[
        "<channel>",
        "</channel>",
        "<value>",
        "<value />",
        "</values>",
        "&amp;",
        "X_Columns\tNo\r\n",
        "X_Columns\tMulti\r\n",
        "***End_of_Header***",
        "X_Value",
        "\t",
    ];
    text(as_record(), words, 4000)
}

pub fn campaign() -> Target {
    let folder = folder(&["a.csv", "b.csv", "c.csv", "d.csv"]);
    let file = folder.join("campaign.toml");
    let read = move |input: &[u8]| {
        std::fs::write(&file, input).expect("room for it");
        said(CampaignFile::read(&file).map_err(|e| e.message))
    };
    text(
        read,
        &[
            "[[release]]\n",
            "[inertia]\n",
            "[rig]",
            "mid",
            "front",
            "\"",
            "\n",
            "{",
            "}",
            "= ",
            "a.csv",
        ],
        6000,
    )
}

pub fn model() -> Target {
    let file = folder(&["a.csv"]).join("model.toml");
    let read = move |input: &[u8]| {
        let Ok(text) = std::str::from_utf8(input) else { return "not text".into() };
        let model = Model::parse(text, &file);
        if let Ok(model) = &model {
            // Written back with the comments it has, it is the same model.
            let written = model.text(Some(text)).expect("what was read can be written");
            let again = Model::parse(&written, &file).expect("what was written can be read");
            // But for the lines it stands on.
            let without_lines = |model: &Model| {
                let mut model = model.clone();
                model.records.iter_mut().for_each(|record| record.line = 0);
                format!("{model:?}")
            };
            assert_eq!(without_lines(&again), without_lines(model), "{written}");
        }
        said(model.map_err(|e| e.message))
    };
    text(
        read,
        &[
            "[[effect]]\n",
            "[[record]]\n",
            "[modal]\n",
            "free = false",
            "value = ",
            "coulomb_friction",
            "\"",
            "{",
            "}",
            "\n",
        ],
        6000,
    )
}

fn effect_answer(text: &str) -> String {
    let taken: Vec<&str> = LIBRARY.iter().map(|kind| &*kind.id).collect();
    match yawrig_expression::from_text("effect.toml".as_ref(), text, &taken) {
        Ok(effect) => {
            let _ = effect.strength(&effect.starts, 0.1, 7.0);
            format!("ok, {} warnings {:?}", effect.warnings.len(), effect.warnings.first())
        }
        // The message is followed by the place in the text.
        Err(e) => e.to_string().lines().next().unwrap_or_default().to_owned(),
    }
}

const WORDS: &[&str] = &[
    "sign(r)",
    "abs(b)",
    "exp(",
    "tanh(",
    "pow(",
    "atan2(",
    "min(",
    "sqrt(",
    "log10(",
    "asin(",
    "(",
    ")",
    "^",
    "*",
    "/",
    "-",
    "+",
    ",",
    "b",
    "r",
    "t",
    "wn",
    "wind",
    "pi",
    "c",
    "s",
    "v",
    "rad/s2",
    "1/(rad2 s)",
    "unit = ",
    "start = ",
    "min = ",
    "max = ",
    "{",
    "}",
    "\n",
    "\"",
    "((((((((",
    "1e",
    "--",
    "..",
    "µ",
    "é",
];

/// The whole file of an own effect.
pub fn effect() -> Target {
    let read = |input: &[u8]| match std::str::from_utf8(input) {
        Ok(text) => effect_answer(text),
        Err(_) => "not text".into(),
    };
    text(read, WORDS, 6000)
}

/// Its expression alone.
pub fn expression() -> Target {
    let read = |input: &[u8]| {
        let Ok(moment) = std::str::from_utf8(input) else { return "not text".into() };
        let moment = moment.replace(['"', '\\', '\n'], " ");
        effect_answer(&format!(
            "id = \"an_effect\"\ntitle = \"An effect\"\nmoment = \"{moment}\"\n[parameters]\n\
             c = {{ unit = \"rad/s2\", start = 0.05, min = 0.0 }}\n\
             s = {{ unit = \"1\", start = 0.5 }}\nv = {{ unit = \"rad/s\", start = 0.1, min = 0.0 }}\n"
        ))
    };
    text(read, WORDS, 8000)
}
