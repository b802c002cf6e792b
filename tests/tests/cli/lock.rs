//! Who may write: keys, a locked device, signed networks.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use yawrig_tests::line::Board;
use yawrig_tests::networks;
use yawrig_tests::process::{yawrig, Ended};

fn keygen(folder: &Path, name: &str) -> Ended {
    yawrig("keygen").and(name).in_folder(folder).run()
}

#[test]
fn a_locked_device_takes_signed_networks_only_until_it_is_opened() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    keygen(folder, "ours").exits(0);
    keygen(folder, "theirs").exits(0);
    std::fs::write(folder.join("n.yrn"), networks::another()).expect("room for it");
    let board = Board::default();
    let on_it = |arguments: &str| {
        // Each from a plug of its own, as programs that come one after the other.
        let line = board.plug();
        yawrig(arguments).and("--device").and(line.path()).in_folder(folder).run()
    };
    assert!(on_it("device --json").exits(0).json()["lock"].is_null());

    on_it("device lock --key ours").exits(2).says("add --yes");
    let locked = on_it("device lock --key ours --yes").exits(0);
    assert!(locked.stdout.contains("only networks signed with"), "{}", locked.report());
    let locked = on_it("device --json").exits(0).json()["lock"].as_str().expect("a key").to_owned();
    assert_eq!(locked.len(), 64);
    on_it("device lock --key theirs --yes").exits(5).says("it is locked already").helps();

    let before = board.status().network;
    on_it("flash n.yrn").exits(5).says(&locked).says("sign with --sign KEY").helps();
    on_it("flash n.yrn --sign theirs").exits(5).says(&locked).says("the given one is").helps();
    assert_eq!(board.status().network, before);
    let written = on_it("flash n.yrn --sign ours --json").exits(0).json();
    assert_eq!(written["network"]["id"], networks::id(&networks::another()));
    board.restart();
    assert_eq!(board.status().network.generation, 1);
    on_it("flash n.yrn").exits(5);

    on_it("device unlock --key theirs").exits(5).says("locked with another key").helps();
    let opened = on_it("device unlock --key ours --json").exits(0).json();
    assert!(opened["lock"].is_null());
    on_it("device unlock --key ours").exits(5).says("it is not locked");
    on_it("flash n.yrn").exits(0);
    // By its digits alone.
    on_it(&format!("device lock --yes --key {locked}")).exits(0);
    assert_eq!(on_it("device --json").exits(0).json()["lock"], locked);
}

#[test]
fn a_lock_that_is_lost_is_said_and_so_is_the_way_out() {
    use embedded_storage::nor_flash::NorFlash;
    use yawrig_firmware::slots::{MemoryFlash, Sector};
    let mut flash = MemoryFlash::with_log();
    // Two copies, in both of which a bit is wrong: of nothing the checksum is not zero.
    let mut copy = [0; 48];
    copy[4..8].copy_from_slice(b"LOCK");
    let at = Sector::Lock.start::<MemoryFlash>() as u32;
    flash.write(at, &[copy, copy].concat()).expect("erased");
    let board = Board::new(flash);

    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    keygen(folder, "ours").exits(0);
    std::fs::write(folder.join("n.yrn"), networks::another()).expect("room for it");
    let on_it = |arguments: &str| {
        let line = board.plug();
        yawrig(arguments).and("--device").and(line.path()).in_folder(folder).run()
    };
    let shown = on_it("device").exits(0);
    assert!(shown.stdout.contains("lock      lost"), "{}", shown.report());
    assert!(shown.stdout.contains("erase its whole flash"), "{}", shown.report());
    let json = on_it("device --json").exits(0).json();
    assert_eq!((&json["lock_lost"], &json["lock"]), (&true.into(), &"0".repeat(64).into()));
    for verb in ["device lock --key ours --yes", "device unlock --key ours"] {
        on_it(verb).exits(5).says("nobody's").says("erase its whole flash").helps();
    }
    for verb in ["flash n.yrn", "flash n.yrn --sign ours"] {
        on_it(verb).exits(5).says("nobody's").says("erase its whole flash").helps();
    }
}

#[test]
fn a_key_is_readable_by_its_owner_alone_and_never_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = keygen(folder.path(), "key").exits(0);
    assert!(made.stdout.contains("public key"), "{}", made.report());
    let path = folder.path().join("key");
    let before = std::fs::read(&path).expect("the key");
    let mode = std::fs::metadata(&path).expect("the key").permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    keygen(folder.path(), "key").exits(3).says("never overwritten").helps();
    assert_eq!(std::fs::read(&path).expect("the key"), before);
    keygen(folder.path(), "no/such/folder").exits(3).helps();
}

#[test]
fn what_is_no_key_signs_and_locks_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("n.yrn"), networks::sound()).expect("room for it");
    let run = |arguments: &str| yawrig(arguments).in_folder(folder.path()).run();
    run("flash n.yrn --sign n.yrn").exits(3).helps();
    run("flash n.yrn --sign absent").exits(3).says("absent").helps();
    run("device lock --yes --key n.yrn").exits(3).helps();
    let none = "0".repeat(64);
    run(&format!("device lock --yes --key {none}")).exits(3).says("not a public key").helps();
}
