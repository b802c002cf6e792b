//! A board's image on its drive.

use std::fs;
use std::path::Path;
use std::time::Duration;
use yawrig_tests::process::yawrig;

/// An image as a linker makes it: 300 bytes at the beginning of the flash, and 10 from byte 400 on.
fn elf() -> Vec<u8> {
    const START: u32 = 0x1000_0000;
    let parts: [(u32, Vec<u8>); 2] =
        [(START, (0..300).map(|k| k as u8).collect()), (START + 400, vec![7; 10])];
    let mut at = 52 + 32 * parts.len() as u32;
    let mut heads = Vec::new();
    let mut data = Vec::new();
    for (address, bytes) in &parts {
        let length = bytes.len() as u32;
        // Where it is to lie is its second address.
        let head = [1, at, 0x2000_0000, *address, length, length, 5, 4];
        heads.extend(head.iter().flat_map(|word: &u32| word.to_le_bytes()));
        data.extend(bytes);
        at += length;
    }
    let mut out = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
    out.extend([2_u8, 0, 40, 0, 1, 0, 0, 0]);
    out.extend([START, 52, 0, 0].iter().flat_map(|word| word.to_le_bytes()));
    out.extend(
        [52_u16, 32, parts.len() as u16, 40, 0, 0].iter().flat_map(|half| half.to_le_bytes()),
    );
    [out, heads, data].concat()
}

/// What flash holds of it.
fn flash() -> Vec<u8> {
    let mut flash: Vec<u8> = (0..300).map(|k| k as u8).collect();
    flash.resize(400, 0xff);
    flash.extend([7; 10]);
    flash
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().expect("four"))).collect()
}

#[test]
fn an_image_is_what_the_drive_of_its_board_takes() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    fs::write(folder.join("board.elf"), elf()).expect("room");
    let install = |rest: &str| yawrig(&format!("device install {rest}")).in_folder(folder).run();
    let made = install("nucleo-f446re --image board.elf --out n.bin").exits(0);
    assert!(made.stdout.contains("410 bytes"), "{}", made.report());
    assert_eq!(fs::read(folder.join("n.bin")).expect("it"), flash());
    for (board, family) in [("pico", 0xe48b_ff56), ("pico2", 0xe48b_ff59)] {
        install(&format!("{board} --image board.elf --out {board}.uf2 --json")).exits(0);
        let blocks = fs::read(folder.join(format!("{board}.uf2"))).expect("it");
        assert_eq!(blocks.len(), 2 * 512);
        let mut held: Vec<u8> = Vec::new();
        for (k, block) in blocks.chunks(512).enumerate() {
            let at = 0x1000_0000 + 256 * k as u32;
            let head = [0x0a32_4655, 0x9e5d_5157, 0x2000, at, 256, k as u32, 2, family];
            assert_eq!(words(&block[..32]), head);
            assert_eq!(words(&block[508..]), [0x0ab1_6f30]);
            held.extend(&block[32..288]);
        }
        assert_eq!(held[..410], flash());
        assert!(held[410..].iter().all(|byte| *byte == 0xff));
    }
    install("pico --image pico.uf2 --out other.uf2")
        .exits(3)
        .says("is no image of a board")
        .helps();
    install("pico --image none.elf --out other.uf2").exits(3).says("cannot read none.elf");
    install("arduino --out other.uf2").exits(2).says("'arduino'").helps();
    install("pico2 --image board.elf").exits(4).says("no drive of a pico2 is there").helps();
}

fn drive(folder: &Path, name: &str, files: &[(&str, &str)]) -> String {
    let drive = folder.join(name);
    fs::create_dir(&drive).expect("a folder");
    for (file, text) in files {
        fs::write(drive.join(file), text).expect("room");
    }
    name.to_owned()
}

#[test]
fn an_image_is_written_to_its_board_s_drive_and_to_no_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    fs::write(folder.join("board.elf"), elf()).expect("room");
    let about = "UF2 Bootloader v3.0\nModel: Raspberry Pi RP2\nBoard-ID: RPI-RP2\n";
    let pico = drive(folder, "pico", &[("INFO_UF2.TXT", about)]);
    let probe = drive(folder, "probe", &[("MBED.HTM", "")]);
    let failing = drive(folder, "failing", &[("MBED.HTM", ""), ("FAIL.TXT", "SWD ERROR\n")]);
    let install = |board: &str, drive: &str| {
        yawrig(&format!("device install {board} --image board.elf --drive {drive}"))
            .in_folder(folder)
            .run()
    };
    install("pico2", &pico).exits(2).says("no INFO_UF2.TXT with Board-ID: RP2350").helps();
    install("nucleo-f446re", &pico).exits(2).says("no MBED.HTM").helps();
    assert_eq!(fs::read_dir(folder.join(&pico)).expect("it").count(), 1);
    // A Pico begins with its last byte, and its drive is gone.
    let place = folder.join(&pico);
    let board = std::thread::spawn(move || {
        let image = place.join("yawrig-pico.uf2");
        while !fs::metadata(&image).is_ok_and(|file| file.len() == 1024) {
            std::thread::sleep(Duration::from_millis(5));
        }
        fs::remove_file(place.join("INFO_UF2.TXT")).expect("it");
    });
    let written = install("pico", &pico).exits(0);
    assert!(written.stdout.contains("1024 bytes written"), "{}", written.report());
    board.join().expect("a board");
    install("nucleo-f446re", &probe).exits(0);
    assert_eq!(
        fs::read(folder.join(&probe).join("yawrig-nucleo-f446re.bin")).expect("it"),
        flash()
    );
    install("nucleo-f446re", &failing).exits(4).says("SWD ERROR").helps();
}
