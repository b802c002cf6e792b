//! The yawrig device on QEMU's mps2-an386: UART0 is the host link, UART1 the potentiometer.
#![no_std]
#![no_main]

use cortex_m::asm::wfi;
use cortex_m_rt::{entry, exception, ExceptionFrame};
use yawrig_firmware::device::Device;
use yawrig_mps2_an386::uart::Uart;
use yawrig_mps2_an386::{digits, flash, say};
use yawrig_shared::potentiometer::Decoder;

/// Empty looks at the UARTs before the core sleeps. Waking costs the emulator more than some looks,
/// but every look takes the lock under which it hands over bytes: thousands of looks halve the
/// throughput on a busy machine, and on an idle one 5 to 200 000 make no difference.
const LOOKS_BEFORE_SLEEP: u32 = 50;

#[entry]
fn main() -> ! {
    // Nothing may run a handler: interrupts only end `wfi`.
    cortex_m::interrupt::disable();
    // SAFETY: the only owners, and PRIMASK is set for good.
    let (mut link, mut potentiometer) = unsafe { (Uart::new(0), Uart::new(1)) };
    // This board has no flash: a restart begins with the network compiled in.
    // SAFETY: main runs once.
    let slots = unsafe { flash::erased() };
    let mut device = Device::stopped(slots, "mps2-an386");
    device.start();
    let mut decoder = Decoder::default();
    let mut to_send = None;
    let mut idle = 0;
    // To QEMU's output, not to the link: the host waits for this line.
    say(&["yawrig runs"]);
    loop {
        let mut busy = false;

        let state = link.state();
        if state.can_read() {
            busy = true;
            device.receive(link.read());
        }
        to_send = to_send.or_else(|| device.transmit());
        if let (Some(byte), true) = (to_send, state.can_write()) {
            busy = true;
            link.write(byte);
            to_send = None;
        }

        for _ in 0..64 {
            let state = potentiometer.state();
            if !state.can_read() {
                break;
            }
            busy = true;
            if state.overrun() {
                potentiometer.clear_overrun();
                decoder.overrun();
            }
            if let Some(sample) = decoder.decode(potentiometer.read()) {
                if sample.lost > 0 {
                    device.lost(sample.lost);
                }
                device.sample(sample.counts);
                device.work();
            }
        }

        if busy || device.idle() {
            idle = 0;
            continue;
        }
        idle += 1;
        if idle == LOOKS_BEFORE_SLEEP {
            // One more look comes after this: whatever it misses wakes the core.
            link.arm();
            potentiometer.arm();
        } else if idle > LOOKS_BEFORE_SLEEP {
            wfi();
            idle = 0;
        }
    }
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    say(&["hard fault at 0x", digits(frame.pc(), 16, &mut [0; 10])]);
    panic!();
}
