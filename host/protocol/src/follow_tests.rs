use super::*;
use serde_json::json;

#[test]
fn every_flag_has_its_sentence() {
    for (flag, name) in Flags::NAMES {
        let said: Vec<_> = flag_advice(flag).collect();
        assert_eq!(said.len(), 1, "{name}");
        assert!(said[0].starts_with(&format!("{name}: ")) && said[0].contains(';'), "{}", said[0]);
    }
}
#[test]
fn a_start_after_a_panic_says_where_it_was() {
    let crash = |file: &str, line| Crash { file: file.try_into().expect("short"), line };
    for (cause, crash, text, json) in [
        (
            Cause::Software,
            Some(crash("src/main.rs", 61)),
            "the firmware restarted after a panic at src/main.rs:61; please report it",
            json!({"cause": "software", "crash": {"file": "src/main.rs", "line": 61}}),
        ),
        (
            Cause::Watchdog,
            Some(crash("", 0x0801_2344)),
            "or no sample came for seconds after a fault of the processor at 0x08012344; please report it",
            json!({"cause": "watchdog", "crash": {"file": "", "line": 0x0801_2344}}),
        ),
        (Cause::Power, None, "power came", json!({"cause": "power", "crash": null})),
    ] {
        let start = Start { cause, crash };
        assert!(start_text(&start).ends_with(text), "{}", start_text(&start));
        assert_eq!(start_json(&start), json);
    }
}
