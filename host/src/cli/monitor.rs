//! `yawrig monitor`: follow a device as it measures, store it, and show again what was stored.

mod shown;

use super::condition::ConditionArgs;
use super::device_arg::DeviceArg;
use super::keys;
use clap::Args;
use shown::Shown;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_link::bench::{Bench, Target};
use yawrig_link::live::built_in_rig::BuiltInRig;
use yawrig_link::live::disk;
use yawrig_link::live::item::{time_s, Item};
use yawrig_link::live::recording::Recording;
use yawrig_link::live::session::{Follow, Session};
use yawrig_link::live::stored::Stored;
use yawrig_measuring::Measuring;
use yawrig_shared::wire::{Event, Request, Settings};
use yawrig_verbs::common::within;

/// How long a device may take no sample before the last ones of the last release are no longer waited for.
const LAST_SAMPLES: Duration = Duration::from_secs(2);

/// Follow a device as it measures; --record keeps its trace and results
#[derive(Args, Debug)]
pub struct Monitor {
    #[command(flatten)]
    device: DeviceArg,
    /// Print a JSON object a line
    #[arg(long)]
    jsonl: bool,
    /// End after so many releases
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    releases: Option<u32>,
    /// End after so many seconds; exit code 7 if --releases were not reached by then, 4 where the device was
    /// unplugged and is not there again
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// How many times faster than real time the built-in rig swings (emulated devices only), or a stored
    /// session is shown
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true)]
    speed: f64,
    /// Store the trace at 1 kHz, the results and each release: in a folder under the time of day, or
    /// in NAME.csv and files beside it. Meanwhile a line typed is a mark, /stop and /start end and
    /// begin a recording
    #[arg(long, value_name = "FOLDER|NAME.csv")]
    record: Option<PathBuf>,
    /// Show a stored session again instead of following a device
    #[arg(long, value_name = "SESSION", conflicts_with_all = ["record", "device", "campaign", "condition", "spring"])]
    replay: Option<PathBuf>,
    #[command(flatten)]
    condition: ConditionArgs,
    /// Angle between the ends of the potentiometer's track; devices on a port only, which else take it for
    /// 328
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    travel_deg: Option<f64>,
    /// Standard uncertainty of the device's clock in millionths, where it is known better than the board
    /// says; devices on a port only
    #[arg(long, value_name = "PPM", allow_negative_numbers = true)]
    clock_u_ppm: Option<f64>,
    /// Analyse from this amplitude down [default: as the device is set, 10]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    from_deg: Option<f64>,
    /// Analyse down to this amplitude [default: as the device is set, 1]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    to_deg: Option<f64>,
}

pub fn run(arguments: &Monitor) -> Result<()> {
    within("--speed", arguments.speed, 1e-3, 1e6)?;
    if let Some(seconds) = arguments.seconds {
        within("--seconds", seconds, 0.0, 1e9)?;
    }
    let mut shown =
        Shown { jsonl: arguments.jsonl, effects: String::new(), releases: 0, refined: false };
    if let Some(session) = &arguments.replay {
        return replay(session, arguments, &mut shown);
    }
    if let Some(place) = &arguments.record {
        Recording::check(place)?;
    }
    let on_a_port = matches!(arguments.device.device, Target::Port(_));
    if let Some(travel_deg) = arguments.travel_deg {
        within("--travel-deg", travel_deg, 1.0, 36_000.0)?;
        if !on_a_port {
            return Err(Error::usage(
                "--travel-deg is for a device on a port: the built-in rig has its own sensor",
            )
            .help("leave it out, or name the port with --device"));
        }
    }
    if let Some(clock_u_ppm) = arguments.clock_u_ppm {
        within("--clock-u-ppm", clock_u_ppm, 0.0, 1e5)?;
        if !on_a_port {
            return Err(Error::usage(
                "--clock-u-ppm is for a device on a port: the built-in rig's clock is exact",
            )
            .help("leave it out, or name the port with --device"));
        }
    }
    for (flag, given) in [("--from-deg", arguments.from_deg), ("--to-deg", arguments.to_deg)] {
        // As the device takes them.
        given.map_or(Ok(()), |deg| within(flag, deg, 1e-3, 360.0))?;
    }
    let measuring = measuring(arguments, !on_a_port)?;
    let mut bench = arguments.device.open()?;
    set(arguments, &mut bench)?;
    let built_in = match arguments.device.device {
        Target::Port(_) => None,
        _ => {
            let mut built_in = BuiltInRig::new(arguments.speed);
            match &measuring {
                Some(_) => {
                    built_in.wait();
                    crate::say!("the built-in rig is released as it says; Ctrl-C ends it");
                }
                None => crate::say!(
                    "the built-in rig swings: springs K1 to K8, wind off and on; Ctrl-C ends it"
                ),
            }
            Some(built_in)
        }
    };
    let follow = if arguments.record.is_some() { Follow::Trace } else { Follow::Results };
    let mut following = Following {
        session: Session::new(bench, follow)?,
        built_in,
        measuring,
        device: None,
        recording: None,
        recordings: 0,
        shown,
        arguments,
    };
    let followed = following.start().and_then(|()| following.follow());
    let followed = following.unless_lost(followed);
    // However it ended: what was recorded is kept.
    let ended = following.stop();
    followed.and(ended)
}

/// Tells the device the settings that were given; the others stay as they are.
fn set(arguments: &Monitor, bench: &mut Bench) -> Result<()> {
    let Monitor { travel_deg, clock_u_ppm, from_deg, to_deg, .. } = arguments;
    if [travel_deg, clock_u_ppm, from_deg, to_deg].iter().all(|given| given.is_none()) {
        return Ok(());
    }
    let mut settings = bench.client.status()?.settings;
    if let Some(travel_deg) = travel_deg {
        settings.degrees_per_count = (travel_deg / 65_536.0) as f32;
    }
    if let Some(ppm) = clock_u_ppm {
        settings.clock_u_ppm = Some(*ppm as f32);
    }
    let set = |to: &mut f32, given: &Option<f64>| *to = given.map_or(*to, |deg| deg as f32);
    set(&mut settings.from_deg, from_deg);
    set(&mut settings.to_deg, to_deg);
    if settings.from_deg <= settings.to_deg {
        let Settings { from_deg, to_deg, .. } = settings;
        return Err(Error::usage(format!("from {from_deg} deg down to {to_deg} deg: no range"))
            .help("give a larger --from-deg than --to-deg"));
    }
    bench.client.tell(&Request::Configure(settings), "the settings")
}

/// What is to be measured, and where that is kept.
fn measuring(arguments: &Monitor, is_built_in: bool) -> Result<Option<Measuring>> {
    let Some(plan) = arguments.condition.wanted().plan(is_built_in)? else { return Ok(None) };
    if arguments.record.as_ref().is_some_and(|place| place.extension().is_some_and(|e| e == "csv"))
    {
        return Err(Error::usage("the records of a condition need a folder")
            .help("give --record a folder: a campaign.toml comes there, too"));
    }
    Measuring::new(plan, arguments.record.as_deref()).map(Some)
}

struct Following<'a> {
    session: Session,
    built_in: Option<BuiltInRig>,
    measuring: Option<Measuring>,
    /// What was last said of it.
    device: Option<Item>,
    recording: Option<Recording>,
    recordings: u32,
    shown: Shown,
    arguments: &'a Monitor,
}

impl Following<'_> {
    fn follow(&mut self) -> Result<()> {
        let listens = self.arguments.record.is_some() || self.measuring.is_some();
        let typed = listens.then(keys::lines);
        let deadline = self.arguments.seconds.map(|s| Instant::now() + Duration::from_secs_f64(s));
        // Samples that the device had taken when that number last changed, and when it did.
        let mut taken = (0, Instant::now());
        loop {
            if let Some(measuring) = &mut self.measuring {
                measuring.go_on(&mut self.session, self.built_in.as_mut())?;
            }
            if let Some(built_in) = &mut self.built_in {
                built_in.go_on(self.session.bench())?;
            }
            self.take()?;
            if let Some(typed) = &typed {
                self.obey(typed)?;
            }
            if self.has_all() {
                let status = self.session.bench().client.status()?;
                if status.samples != taken.0 {
                    taken = (status.samples, Instant::now());
                }
                let records = self.recording.as_ref().is_some_and(Recording::waits);
                if !records || taken.1.elapsed() > LAST_SAMPLES {
                    // The last release's refined estimate is still to come.
                    if self.shown.refined || !status.refining {
                        // What it had to say went out before it said so.
                        return self.take();
                    }
                }
            }
            // Its last record is written, and its derivatives are shown.
            let records = self.recording.as_ref().is_some_and(Recording::waits);
            if self.measuring.as_ref().is_some_and(Measuring::has_ended) && !records {
                return self.take();
            }
            if deadline.is_some_and(|deadline| Instant::now() >= deadline) {
                return match self.arguments.releases {
                    None if self.session.is_gone() => Err(self.lost()),
                    None => Ok(()),
                    Some(wanted) => Err(Error::new(
                        Exit::Timeout,
                        format!(
                            "{} releases of {wanted} came in the given time",
                            self.shown.releases
                        ),
                    )
                    .help("give it more --seconds, or see that the model is released")),
                };
            }
            interrupt::check()?;
        }
    }

    /// A device that was unplugged is waited for until the user, or the time that was given, ends it.
    fn unless_lost(&mut self, followed: Result<()>) -> Result<()> {
        match followed {
            Err(Error { exit: Exit::Interrupted | Exit::Timeout, .. })
                if self.session.is_gone() =>
            {
                Err(self.lost())
            }
            other => other,
        }
    }

    fn lost(&mut self) -> Error {
        let path = self.session.bench().client.path();
        Error::device(format!("the device on {path} was unplugged and has not come back"))
            .help("plug it in and begin again; what was recorded is kept")
    }

    /// As many releases have ended as were asked for.
    fn has_all(&self) -> bool {
        self.arguments.releases.is_some_and(|wanted| self.shown.releases >= wanted)
    }

    /// Shows and stores what has come, waiting a moment for it.
    fn take(&mut self) -> Result<()> {
        let mut patience = Duration::from_millis(20);
        while let Some(item) = self.session.next(patience)? {
            patience = Duration::ZERO;
            let ends_release = matches!(item, Item::Event { event: Event::Release(_), .. });
            if ends_release && self.has_all() {
                // One more than was asked for.
                break;
            }
            self.shown.show(&item)?;
            if let Some(measuring) = &mut self.measuring {
                measuring.take(&item, self.recording.as_mut())?;
            }
            if let Some(recording) = &mut self.recording {
                let records = recording.put(&item)?;
                self.show_records(&records)?;
            }
            // Not every network's releases are refined.
            let enough = self.has_all() && (self.shown.refined || ends_release);
            if matches!(item, Item::Device { .. }) {
                self.device = Some(item);
            }
            if enough {
                break;
            }
        }
        Ok(())
    }

    fn show_records(&mut self, records: &[Item]) -> Result<()> {
        for record in records {
            self.shown.show(record)?;
            if let Some(measuring) = &mut self.measuring {
                measuring.take(record, None)?;
            }
        }
        Ok(())
    }

    fn obey(&mut self, typed: &Receiver<String>) -> Result<()> {
        while let Ok(line) = typed.try_recv() {
            if let Some(measuring) = &mut self.measuring {
                match line.as_str() {
                    "/next" => measuring.skip(),
                    "/back" => measuring.go_back()?,
                    _ => {}
                }
                if matches!(line.as_str(), "/next" | "/back") {
                    continue;
                }
            }
            match (line.as_str(), self.recording.is_some()) {
                ("", _) => {}
                ("/start", false) => self.start()?,
                ("/stop", true) => self.stop()?,
                ("/start", true) => crate::say!("it is being recorded"),
                ("/stop", false) => crate::say!("nothing is being recorded; /start begins"),
                (other, _) if other.starts_with('/') => {
                    crate::say!("{other}: there are /start and /stop; any other line is a mark");
                }
                (text, _) => self.session.mark(text),
            }
        }
        Ok(())
    }

    /// Begins a recording, if one is wanted.
    fn start(&mut self) -> Result<()> {
        let Some(place) = &self.arguments.record else { return Ok(()) };
        self.recordings += 1;
        let place = match self.recordings {
            2.. if place.extension().is_some_and(|e| e == "csv") => {
                let stem = place.file_stem().unwrap_or_default().to_string_lossy();
                place.with_file_name(format!("{stem}-{}.csv", self.recordings))
            }
            _ => place.clone(),
        };
        let recording = Recording::begin(&place, self.device.as_ref())?;
        let speed = self.built_in.as_ref().map_or(1.0, |_| self.arguments.speed);
        crate::say!(
            "recording to {} ({}); a line typed is a mark, /stop and /start end and begin a recording",
            recording.trace().display(),
            disk::takes(&recording.folder(), speed)
        );
        self.recording = Some(recording);
        Ok(())
    }

    /// Ends the recording, if there is one.
    fn stop(&mut self) -> Result<()> {
        let Some(recording) = self.recording.take() else { return Ok(()) };
        let (finished, records) = recording.finish()?;
        self.show_records(&records)?;
        crate::say!("{}", finished.to_text());
        Ok(())
    }
}

/// Shows a stored session as it went.
fn replay(path: &Path, arguments: &Monitor, shown: &mut Shown) -> Result<()> {
    let stored = Stored::open(path)?;
    let started = stored.started.as_deref().unwrap_or("an unknown time");
    let ended = if stored.finished { "" } else { ", never ended" };
    crate::say!("{}: recorded from {started}{ended}", stored.trace.display());
    let begun = Instant::now();
    let first = stored.items.first().map_or(0, Item::at);
    for item in &stored.items {
        let shown_s = time_s(item.at().saturating_sub(first));
        if arguments.seconds.is_some_and(|most| shown_s > most) {
            return Ok(());
        }
        let due = Duration::from_secs_f64(shown_s / arguments.speed);
        while let Some(left) = due.checked_sub(begun.elapsed()).filter(|left| !left.is_zero()) {
            interrupt::check()?;
            std::thread::sleep(left.min(Duration::from_millis(50)));
        }
        interrupt::check()?;
        shown.show(item)?;
        if shown.refined && arguments.releases.is_some_and(|wanted| shown.releases >= wanted) {
            return Ok(());
        }
    }
    Ok(())
}
