//! The device's main loop.

use crate::uart::Uart;
use crate::{flash, say};
use cortex_m::asm::wfi;
use yawrig_firmware::device::Device;
use yawrig_firmware::serial::{receive, receive_sample, send};
use yawrig_shared::potentiometer::Decoder;

/// Empty looks at the UARTs before the core sleeps. Waking costs the emulator more than some looks,
/// but every look takes the lock under which it hands over bytes: thousands of looks halve the
/// throughput on a busy machine, and on an idle one 5 to 200 000 make no difference.
const LOOKS_BEFORE_SLEEP: u32 = 50;
/// Samples that are taken, if so many wait, before the host is heard again.
const SAMPLES_A_ROUND: u32 = 64;

/// Serves samples and the line for good, without a watchdog: the emulator's clock goes on while its host lets
/// it wait, and a board that waits for its host has not hung. `after_round` is called after each time both
/// have been served.
pub fn run(mut after_round: impl FnMut(u32)) -> ! {
    // Nothing may run a handler: interrupts only end `wfi`.
    cortex_m::interrupt::disable();
    // SAFETY: the only owners, and PRIMASK is set for good.
    let (mut link, mut potentiometer) = unsafe { (Uart::new(0), Uart::new(1)) };
    // This board has no flash: a restart begins with the network compiled in.
    // SAFETY: main runs once.
    let slots = unsafe { flash::erased() };
    // Without the lock, which would be gone with the next start.
    let mut device = Device::without_lock(slots, "mps2-an386");
    device.set_commit(option_env!("YAWRIG_COMMIT").unwrap_or_default());
    device.start();
    let mut decoder = Decoder::default();
    let mut idle = 0;
    // To QEMU's output, not to the link: the host waits for this line.
    say(&["yawrig runs"]);
    loop {
        let mut busy = receive(&mut link, &mut device);
        for _ in 0..SAMPLES_A_ROUND {
            // A byte for each sample: one for each round falls behind where samples come as fast
            // as the emulator takes them, and then events find no room.
            busy |= send(&mut link, &mut device);
            if !receive_sample(&mut potentiometer, &mut decoder, &mut device) {
                break;
            }
            busy = true;
        }

        after_round(device.samples());

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
