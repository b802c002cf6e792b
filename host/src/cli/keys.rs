//! Lines typed while a verb runs.

use std::io::BufRead;
use std::sync::mpsc::{self, Receiver};
use std::time::Duration;

/// Lines of stdin from now on, read by a thread of its own until stdin ends.
pub fn lines() -> Receiver<String> {
    let (sender, lines) = mpsc::channel();
    std::thread::spawn(move || {
        let stdin = std::io::stdin();
        let mut line = String::new();
        loop {
            while !is_typed_for_us() {
                std::thread::sleep(Duration::from_millis(200));
            }
            line.clear();
            match stdin.lock().read_line(&mut line) {
                Ok(1..) if sender.send(line.trim().to_owned()).is_ok() => {}
                _ => return,
            }
        }
    });
    lines
}

/// Whether there is something to read that is meant for this program: the system stops a program in
/// the background that reads what is typed for another.
#[cfg(unix)]
fn is_typed_for_us() -> bool {
    use nix::poll::{poll, PollFd, PollFlags, PollTimeout};
    use std::io::IsTerminal;
    use std::os::fd::AsFd;
    const WAIT_MS: u16 = 200;
    let stdin = std::io::stdin();
    if !stdin.is_terminal() {
        return true;
    }
    let foreground = rustix::termios::tcgetpgrp(&stdin);
    if !foreground.is_ok_and(|group| group == rustix::process::getpgrp()) {
        return false;
    }
    let mut typed = [PollFd::new(stdin.as_fd(), PollFlags::POLLIN)];
    poll(&mut typed, PollTimeout::from(WAIT_MS)).is_ok_and(|count| count > 0)
}

#[cfg(not(unix))]
fn is_typed_for_us() -> bool {
    true
}
