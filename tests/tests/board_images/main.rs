//! The images that go on the boards, unmodified, executed: `tests/boards` are the microcontrollers. Beside
//! each the same firmware in this process, given the same bytes and readings: what both send must be the
//! same, bit for bit.

mod accuracy;
mod cases;
mod harness;
mod nucleo;
mod pico;
mod pico2;
mod rp;

/// What is tried on each board alike; the code of its image, where it crashes, is there.
macro_rules! each_board {
    ($board:ty, $code:expr) => {
        #[test]
        #[ignore = "needs unicorn: tests/run runs it"]
        fn a_network_is_written_verified_committed_and_kept_while_it_samples() {
            crate::cases::a_network_is_written_and_kept::<$board>();
        }

        #[test]
        #[ignore = "needs unicorn: tests/run runs it"]
        fn where_the_converter_stands_still_the_watchdog_starts_it_again() {
            crate::cases::the_watchdog_starts_it_again::<$board>();
        }

        #[test]
        #[ignore = "needs unicorn: tests/run runs it"]
        fn where_the_converter_is_overrun_what_is_lost_is_said_and_the_next_ones_are_right() {
            crate::cases::an_overrun_is_said::<$board>();
        }

        #[test]
        #[ignore = "needs unicorn: tests/run runs it"]
        fn after_a_fault_or_a_panic_it_starts_again_and_says_where_it_was() {
            crate::cases::a_crash_is_said::<$board>($code);
        }

        #[test]
        #[ignore = "needs unicorn: tests/run runs it"]
        fn after_three_starts_that_nobody_asked_for_it_only_answers() {
            crate::cases::a_loop_of_restarts_ends::<$board>();
        }

        #[test]
        #[ignore = "needs unicorn: tests/run runs it"]
        fn what_is_refined_is_what_was_planted_wherever_the_rig_rests() {
            crate::accuracy::what_is_refined_is_what_was_planted::<$board>();
        }

        #[test]
        #[ignore = "needs unicorn: tests/run runs it"]
        fn what_is_refined_is_what_was_planted_on_sixty_rigs_at_full_size() {
            crate::accuracy::what_is_refined_is_what_was_planted_on_sixty_rigs::<$board>();
        }
    };
}
pub(crate) use each_board;

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn a_campaign_s_releases_are_the_same_bits_emulated_and_executed_on_each_board() {
    let nucleo = cases::a_campaign_s_releases::<nucleo::Nucleo>();
    let pico2 = cases::a_campaign_s_releases::<pico2::Pico2>();
    assert_eq!(nucleo, pico2);
    let pico = cases::a_campaign_s_releases::<pico::Pico>();
    assert_eq!(nucleo, pico);
}
