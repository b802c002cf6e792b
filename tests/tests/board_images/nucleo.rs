//! ST's NUCLEO-F446RE.

use crate::each_board;
use crate::harness::{Board, Both, Memory};

pub struct Nucleo;

impl Board for Nucleo {
    const NAME: &'static str = "nucleo-f446re";
    const CLOCK_U_PPM: f32 = 29.0;
    type Flash = Memory<4, 16_384>;
}

// Behind the sectors that hold networks.
each_board!(Nucleo, 0x0801_0000..0x0806_0000);

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn its_registers_give_the_rates() {
    let mut both = Both::<Nucleo>::start();
    let state = both.machine.ask("state");
    // TIM2's registers give sixteen conversions a millisecond of the clock that RCC's give; the line's rate is off by less than UART's 2 %.
    assert!(state.contains(" rate_hz=16000.0 ") && state.contains(" latency=2"), "{state}");
    let baud = state.split("baud=").nth(1).and_then(|text| text.split(' ').next());
    let baud: f64 = baud.expect("a rate").parse().expect("a number");
    assert!((baud / 115_200.0 - 1.0).abs() < 0.005, "{state}");
}

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn below_the_supply_at_which_flash_is_written_well_the_chip_holds_itself_in_reset() {
    let mut both = Both::<Nucleo>::start();
    assert_eq!(both.status().samples, 0);
    // As the option bytes come, but for the level of the brown-out reset: 2.7 V.
    let options = |both: &mut Both<Nucleo>| {
        let state = both.machine.ask("state");
        state.split_whitespace().find_map(|pair| pair.strip_prefix("options=")).map(str::to_owned)
    };
    assert_eq!(options(&mut both).as_deref(), Some("0xfffaae1"));
    both.power_cycle();
    assert_eq!(both.status().samples, 0);
    assert_eq!(options(&mut both).as_deref(), Some("0xfffaae1"));
}
