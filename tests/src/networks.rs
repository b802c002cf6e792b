//! Network files, sound and spoilt.

use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob::{self, Payload, ENVELOPE, LONGEST};
use yawrig_shared::checksum::crc32;

/// A sound network: the one compiled into the device.
pub fn sound() -> Vec<u8> {
    BUILT_IN.to_vec()
}

/// Another sound network, so that the two can be distinguished.
pub fn another() -> Vec<u8> {
    let mut payload = payload();
    payload.network.weights[0] += 0.001;
    remake(payload)
}

/// The number a device shows for a network, eight hexadecimal digits.
pub fn id(blob: &[u8]) -> String {
    format!("{:08x}", blob::Envelope::read(blob).expect("an envelope").payload_crc)
}

fn payload() -> Payload {
    blob::decode(BUILT_IN).expect("the compiled-in network").1
}

/// A blob whose checksums and golden vectors fit these contents, whatever they are.
fn remake(mut payload: Payload) -> Vec<u8> {
    for golden in &mut payload.golden {
        if payload.network.topology.as_slice() == [41, 6, 2] {
            let inputs: Vec<f32> = golden.inputs.iter().map(|bits| f32::from_bits(*bits)).collect();
            *golden = blob::golden(&payload.network, &inputs);
        }
    }
    if payload.network.check().is_ok() {
        payload.from_counts = Some(blob::from_counts(&payload.network));
    }
    let mut bytes = vec![0; LONGEST];
    let length = blob::encode(&payload, 0, &mut bytes).expect("a blob");
    bytes.truncate(length);
    bytes
}

/// A spoilt network file and what must be said of it.
pub struct Spoilt {
    pub what: String,
    pub bytes: Vec<u8>,
    pub said: &'static str,
}

/// Every way a network file may be wrong, those that only a look inside finds included.
pub fn spoilt() -> Vec<Spoilt> {
    let mut all = Vec::new();
    let mut add = |what: &str, bytes: Vec<u8>, said| {
        all.push(Spoilt { what: what.to_owned(), bytes, said });
    };
    let sound = sound();
    for length in [0, 1, ENVELOPE - 1, ENVELOPE, ENVELOPE + 1, sound.len() / 2, sound.len() - 1] {
        add(&format!("cut to {length} bytes"), sound[..length].to_vec(), "cut short");
    }
    for at in (0..sound.len()).step_by(37) {
        let mut bytes = sound.clone();
        bytes[at] ^= 0xFF;
        let said = match at {
            0..4 => "another kind of file",
            4..ENVELOPE => "its envelope's checksum is wrong",
            _ => "its checksum is wrong",
        };
        add(&format!("byte {at} turned over"), bytes, said);
    }
    add("a text", b"time_s,yaw_deg\n0.000,1.0\n0.001,1.1\n".to_vec(), "another kind of file");

    for (what, format, said) in [
        ("an earlier format", 1_u16, "it is of format 1, this version knows 2 and 3"),
        ("a later format", 4, "it is of format 4, this version knows 2 and 3"),
    ] {
        let mut other = sound.clone();
        other[4..6].copy_from_slice(&format.to_le_bytes());
        let crc = crc32(&other[..20]);
        other[20..ENVELOPE].copy_from_slice(&crc.to_le_bytes());
        add(what, other, said);
    }

    let mut changed = |what: &str, said, change: &dyn Fn(&mut Payload)| {
        let mut payload = payload();
        change(&mut payload);
        all.push(Spoilt { what: what.to_owned(), bytes: remake(payload), said });
    };
    let not_finite = "a weight or scale is not a finite number";
    changed("a weight that is no number", not_finite, &|p| p.network.weights[100] = f32::NAN);
    changed("an endless weight", not_finite, &|p| p.network.weights[265] = f32::INFINITY);
    changed("an endless input scale", not_finite, &|p| p.network.inputs.shape_gain = f32::INFINITY);
    changed("an output scale of zero", not_finite, &|p| p.network.outputs[1].gain = 0.0);
    changed("three outputs", "topology", &|p| p.network.topology[2] = 3);
    changed("forty inputs", "topology", &|p| p.network.topology[0] = 40);
    changed("an empty layer", "topology", &|p| p.network.topology[1] = 0);
    changed("too few weights", "number of weights", &|p| p.network.topology[1] = 7);
    changed("no golden vectors", "golden vectors are missing", &|p| p.golden.clear());

    // Its features were others: made by another version's.
    let mut payload = self::payload();
    payload.from_counts.as_mut().expect("bits").0[0] ^= 1;
    let mut bytes = vec![0; LONGEST];
    let length = blob::encode(&payload, 0, &mut bytes).expect("a blob");
    bytes.truncate(length);
    all.push(Spoilt {
        what: "features it was not trained on".to_owned(),
        bytes,
        said: "golden vector 4 does not come out",
    });

    // The golden vectors are of other weights: arithmetic that differs looks like this.
    let mut payload = self::payload();
    payload.network.weights[7] += 0.5;
    let mut bytes = vec![0; LONGEST];
    let length = blob::encode(&payload, 0, &mut bytes).expect("a blob");
    bytes.truncate(length);
    all.push(Spoilt {
        what: "weights its golden vectors are not of".to_owned(),
        bytes,
        said: "golden vector 0 does not come out",
    });
    all
}
