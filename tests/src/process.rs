//! The built program, run and watched: nothing here waits for ever.

pub use crate::ended::Ended;
pub use crate::program::binary;
use crate::PATIENCE;
use nix::fcntl::{open, OFlag};
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use nix::sys::signal::{kill, Signal};
use nix::sys::stat::Mode;
use nix::unistd::{geteuid, Pid};
use std::ffi::OsStr;
use std::io::Read;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

const SLICE: Duration = Duration::from_millis(5);

/// A command about to be run.
pub struct Yawrig {
    command: Command,
    line: String,
    /// Our end of the terminal on which it draws.
    drawn: Option<std::fs::File>,
}

/// A terminal: our end of it, and what opens the other.
fn terminal() -> (std::fs::File, impl Fn() -> Stdio) {
    // No other program that is started meanwhile may hold an end of it.
    let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_CLOEXEC;
    let near = posix_openpt(flags).expect("a pseudo-terminal");
    grantpt(&near).and_then(|()| unlockpt(&near)).expect("its other end");
    let path = ptsname_r(&near).expect("its path");
    let end =
        move || Stdio::from(open(path.as_str(), flags, Mode::empty()).expect("its other end"));
    (std::fs::File::from(OwnedFd::from(near)), end)
}

/// `yawrig` with these arguments, parted by blanks.
pub fn yawrig(arguments: &str) -> Yawrig {
    Yawrig::new(Command::new(binary()), arguments)
}

/// The same without the rights of the superuser, to whom nothing is forbidden.
pub fn yawrig_as_anybody(arguments: &str) -> Yawrig {
    if !geteuid().is_root() {
        return yawrig(arguments);
    }
    let mut command = Command::new("setpriv");
    command.args(["--bounding-set=-all", "--inh-caps=-all", "--"]).arg(binary());
    Yawrig::new(command, arguments)
}

impl Yawrig {
    fn new(mut command: Command, arguments: &str) -> Self {
        command.args(arguments.split_whitespace());
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Self { command, line: format!("yawrig {arguments}"), drawn: None }
    }

    /// One more argument.
    pub fn and(mut self, argument: impl AsRef<OsStr>) -> Self {
        self.line.push(' ');
        self.line.push_str(&argument.as_ref().to_string_lossy());
        self.command.arg(argument);
        self
    }

    pub fn in_folder(mut self, folder: &Path) -> Self {
        self.command.current_dir(folder);
        self
    }

    /// With a stdin to type into.
    pub fn typing(mut self) -> (Self, std::fs::File) {
        let (theirs, ours) = nix::unistd::pipe().expect("a pipe");
        self.command.stdin(Stdio::from(theirs));
        (self, ours.into())
    }

    /// With a stderr that nobody reads.
    pub fn unheard(mut self) -> Self {
        let (theirs, _) = UnixStream::pair().expect("two ends");
        self.command.stderr(Stdio::from(OwnedFd::from(theirs)));
        self
    }

    /// With a terminal for its stderr, where it draws how far it is.
    pub fn drawing(mut self) -> Self {
        let (near, end) = terminal();
        self.command.stderr(end()).env("TERM", "xterm").env_remove("CI");
        self.drawn = Some(near);
        self
    }

    /// With a stdout that the test reads itself.
    pub fn printing_to(mut self, stdout: OwnedFd) -> Self {
        self.command.stdout(stdout);
        self
    }

    /// With this in its environment, or without it.
    pub fn with_env(mut self, name: &str, value: Option<&str>) -> Self {
        match value {
            Some(value) => self.command.env(name, value),
            None => self.command.env_remove(name),
        };
        self
    }

    /// Runs it to its end.
    pub fn run(self) -> Ended {
        self.start().ends()
    }

    /// Runs it to its end on a terminal; all that it writes there is its stdout.
    pub fn run_on_terminal(self) -> Ended {
        let Self { mut command, line, .. } = self;
        let (near, end) = terminal();
        let child = command.stdin(end()).stdout(end()).stderr(end()).spawn();
        let child = child.unwrap_or_else(|e| panic!("{line}: {e}"));
        // The last of our copies of that end.
        drop(command);
        let stdout = Heard::new(near);
        let until = Instant::now() + PATIENCE;
        Running { child, stdout, stderr: Heard::none(), line, until }.ends()
    }

    /// Starts it.
    pub fn start(mut self) -> Running {
        let mut child = self.command.spawn().unwrap_or_else(|e| panic!("{}: {e}", self.line));
        // The last of our copies of its ends.
        drop(self.command);
        let stdout = child.stdout.take().map_or_else(Heard::none, Heard::new);
        let stderr = child.stderr.take().map_or_else(Heard::none, Heard::new);
        let stderr = self.drawn.map_or(stderr, Heard::new);
        Running { child, stdout, stderr, line: self.line, until: Instant::now() + PATIENCE }
    }

    /// Starts it with a stdout that nobody reads after the first `bytes` bytes, as `| head` does.
    pub fn start_with_short_reader(mut self, bytes: usize) -> Running {
        let mut child = self.command.spawn().unwrap_or_else(|e| panic!("{}: {e}", self.line));
        let mut stdout = child.stdout.take().expect("its stdout");
        let stderr = child.stderr.take().map_or_else(Heard::none, Heard::new);
        let heard = Heard::none();
        let text = heard.text.clone();
        std::thread::spawn(move || {
            let mut first = vec![0; bytes];
            if stdout.read_exact(&mut first).is_ok() {
                text.lock().unwrap_or_else(PoisonError::into_inner).extend(first);
            }
        });
        Running { child, stdout: heard, stderr, line: self.line, until: Instant::now() + PATIENCE }
    }
}

/// What a process has said on one of its streams, gathered by a thread.
struct Heard {
    text: Arc<Mutex<Vec<u8>>>,
    thread: Option<JoinHandle<()>>,
}

impl Heard {
    fn none() -> Self {
        Self { text: Arc::default(), thread: None }
    }

    fn new(mut stream: impl Read + Send + 'static) -> Self {
        let mut heard = Self::none();
        let text = heard.text.clone();
        heard.thread = Some(std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(count @ 1..) = stream.read(&mut buffer) {
                let mut text = text.lock().unwrap_or_else(PoisonError::into_inner);
                text.extend_from_slice(&buffer[..count]);
            }
        }));
        heard
    }

    fn text(&self) -> String {
        let text = self.text.lock().unwrap_or_else(PoisonError::into_inner);
        String::from_utf8_lossy(&text).into_owned()
    }

    fn all(&mut self) -> String {
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        self.text()
    }
}

/// A command that runs; killed when it is forgotten or out of time.
pub struct Running {
    child: Child,
    stdout: Heard,
    stderr: Heard,
    line: String,
    until: Instant,
}

impl Running {
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Waits until a whole line on stderr holds these words, and returns it.
    pub fn says(&mut self, words: &str) -> String {
        self.wait_for(words, |running| running.stderr.text())
    }

    /// Waits until a whole line on stdout holds these words, and returns it.
    pub fn prints(&mut self, words: &str) -> String {
        self.wait_for(words, |running| running.stdout.text())
    }

    /// Whether these words are on its stdout by now; a program that has ended says no more.
    pub fn has_printed(&mut self, words: &str) -> bool {
        self.has_printed_times(words, 1)
    }

    /// How often these words are on its stdout by now.
    pub fn printed_times(&self, words: &str) -> usize {
        self.stdout.text().matches(words).count()
    }

    pub fn has_printed_times(&mut self, words: &str, times: usize) -> bool {
        let is_there = self.printed_times(words) >= times;
        assert!(is_there || self.runs(), "{} ended: {}", self.line, self.report());
        is_there
    }

    /// Whether these words are on its stderr by now.
    pub fn has_said(&mut self, words: &str) -> bool {
        let is_there = self.stderr.text().contains(words);
        assert!(is_there || self.runs(), "{} ended: {}", self.line, self.report());
        is_there
    }

    fn wait_for(&mut self, words: &str, text: impl Fn(&Self) -> String) -> String {
        loop {
            let ended = self.child.try_wait().expect("its state").is_some();
            let text = text(self);
            let whole = text.rsplit_once('\n').map_or("", |(lines, _)| lines);
            if let Some(line) = whole.lines().find(|line| line.contains(words)) {
                return line.to_owned();
            }
            assert!(!ended, "{} ended and never said {words:?}: {}", self.line, self.report());
            self.check_time(words);
            std::thread::sleep(SLICE);
        }
    }

    /// Waits until its bar stands at so many steps.
    pub fn draws_step(&mut self, wanted: u64) {
        let step = |rest: &str| rest.split('/').next().and_then(|n| n.trim().parse::<u64>().ok());
        let is_there = |drawn: String| drawn.split("] ").filter_map(step).any(|n| n >= wanted);
        while !is_there(self.stderr.text()) {
            let ended = self.child.try_wait().expect("its state");
            assert!(ended.is_none(), "{} ended already: {}", self.line, self.report());
            self.check_time("its steps");
            std::thread::sleep(SLICE);
        }
    }

    /// Where another process finds its emulated device: `/dev/pts/7`.
    pub fn shared_path(&mut self) -> String {
        let line = self.says("--device /dev/");
        line.rsplit_once("--device ").expect("a path").1.trim().to_owned()
    }

    /// Waits until it catches SIGINT: before that a signal would end it as it does any program.
    pub fn catches_interrupts(&mut self) {
        let caught = |status: String| {
            let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"))?;
            let mask = u64::from_str_radix(mask.trim(), 16).ok()?;
            Some(mask & (1 << (Signal::SIGINT as u32 - 1)) != 0)
        };
        let status = format!("/proc/{}/status", self.pid());
        while std::fs::read_to_string(&status).ok().and_then(caught) != Some(true) {
            let ended = self.child.try_wait().expect("its state");
            assert!(ended.is_none(), "{} ended already: {}", self.line, self.report());
            self.check_time("it catches SIGINT");
            std::thread::sleep(SLICE);
        }
    }

    pub fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.pid() as i32), signal).expect("a signal to a process of ours");
    }

    /// Whether it still runs.
    pub fn runs(&mut self) -> bool {
        self.child.try_wait().expect("its state").is_none()
    }

    /// Waits for its end.
    pub fn ends(mut self) -> Ended {
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("its state") {
                break status;
            }
            self.check_time("its end");
            std::thread::sleep(SLICE);
        };
        Ended {
            code: status.code().unwrap_or_else(|| -status.signal().unwrap_or(0)),
            stdout: self.stdout.all(),
            stderr: self.stderr.all(),
            line: std::mem::take(&mut self.line),
        }
    }

    fn check_time(&mut self, what: &str) {
        if Instant::now() > self.until {
            let _ = self.child.kill();
            let _ = self.child.wait();
            panic!("{}: out of patience for {what:?}, killed: {}", self.line, self.report());
        }
    }

    fn report(&self) -> String {
        format!("\n-- stdout\n{}\n-- stderr\n{}", self.stdout.text(), self.stderr.text())
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Fails where it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
