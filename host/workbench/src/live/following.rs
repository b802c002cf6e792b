//! A device that is followed: shown, recorded, its releases added to the list.

use super::shown::{Order, Shown};
use super::teller::Teller;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Receiver;
use std::sync::Arc;
use std::time::Duration;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_campaign::plan::Wanted;
use yawrig_link::bench::{Bench, Target};
use yawrig_link::live::built_in_rig::BuiltInRig;
use yawrig_link::live::disk;
use yawrig_link::live::item::Item;
use yawrig_link::live::recording::Recording;
use yawrig_link::live::session::{Follow, Session};
use yawrig_measuring::Measuring;

/// Folder of recordings made from the page.
pub const FOLDER: &str = "recordings";

/// The device and where it is written to.
struct Following<'a> {
    shown: &'a Arc<Shown>,
    keep: &'a dyn Fn(&Path),
    session: Session,
    recording: Option<Recording>,
    measuring: Option<Measuring>,
    /// Where that is recorded, and whether its recording ended with the last release of its campaign.
    folder: PathBuf,
    ended: bool,
    speed: Option<f64>,
    device: Option<Item>,
    teller: Teller,
}

/// Until the user leaves it; `keep` is given the file of each release that is recorded.
///
/// # Errors
/// Those of the device and of the recording, which is ended however that ends.
pub fn follow(
    shown: &Arc<Shown>,
    target: &Target,
    speed: f64,
    orders: &Receiver<Order>,
    keep: &dyn Fn(&Path),
) -> Result<()> {
    let bench = Bench::open(target)?;
    let speed = match target {
        Target::Port(_) => None,
        _ => Some(speed.clamp(0.01, 1000.0)),
    };
    let mut built_in = speed.map(BuiltInRig::new);
    shown.seen(|seen| seen.speed = speed);
    let mut following = Following {
        shown,
        keep,
        session: Session::new(bench, Follow::Trace)?,
        recording: None,
        measuring: None,
        folder: PathBuf::new(),
        ended: false,
        speed,
        device: None,
        teller: Teller::new(shown),
    };
    following.look_at_the_disk();
    let done = following.run(&mut built_in, orders);
    // However it ended: what was recorded is kept.
    let kept = following.stop();
    following.teller.tell();
    done.and(kept)
}

impl Following<'_> {
    fn run(&mut self, built_in: &mut Option<BuiltInRig>, orders: &Receiver<Order>) -> Result<()> {
        loop {
            interrupt::check()?;
            if let Some(measuring) = &mut self.measuring {
                measuring.go_on(&mut self.session, built_in.as_mut())?;
            }
            if let Some(built_in) = built_in {
                built_in.go_on(self.session.bench())?;
            }
            let mut patience = Duration::from_millis(20);
            while let Some(item) = self.session.next(patience)? {
                patience = Duration::ZERO;
                self.take(item)?;
            }
            self.end_with_the_last_release()?;
            while let Ok(order) = orders.try_recv() {
                match order {
                    Order::Record => self.start(Path::new(FOLDER))?,
                    Order::StopRecording => self.stop()?,
                    Order::Mark(text) => self.session.mark(&text),
                    Order::Measure(wanted) => self.measure(&wanted, built_in)?,
                    Order::Skip => self.measuring.iter_mut().for_each(Measuring::skip),
                    Order::Back => self.go_back()?,
                    Order::Leave => return Ok(()),
                    // Of a stored session.
                    Order::Play | Order::Pause | Order::Speed(_) | Order::Jump(_) => {}
                }
            }
            if self.teller.is_due() {
                self.look_at_the_disk();
                self.teller.tell();
            }
        }
    }

    /// What the pages say of it before a recording begins.
    fn look_at_the_disk(&self) {
        let an_hour = disk::bytes_an_hour(self.speed.unwrap_or(1.0));
        let free = disk::free_bytes(Path::new(FOLDER));
        self.shown.seen(|seen| seen.disk = Some((an_hour, free)));
    }

    /// A campaign's recording ends once its last release is written; another one may be begun.
    fn end_with_the_last_release(&mut self) -> Result<()> {
        let has_ended = self.measuring.as_ref().is_some_and(Measuring::has_ended);
        if self.ended || !has_ended || self.recording.as_ref().is_some_and(Recording::waits) {
            return Ok(());
        }
        self.ended = true;
        self.shown.seen(|seen| seen.measuring.iter_mut().for_each(|(_, ended)| *ended = true));
        self.stop()
    }

    /// The last release is made again, and recorded, where the campaign had ended with it.
    fn go_back(&mut self) -> Result<()> {
        let Some(measuring) = &mut self.measuring else { return Ok(()) };
        measuring.go_back()?;
        if self.ended && !measuring.has_ended() {
            self.ended = false;
            self.shown.seen(|seen| seen.measuring.iter_mut().for_each(|(_, ended)| *ended = false));
            let folder = self.folder.clone();
            self.start(&folder)?;
        }
        Ok(())
    }

    fn take(&mut self, item: Item) -> Result<()> {
        self.teller.show(&item);
        if let Some(measuring) = &mut self.measuring {
            measuring.take(&item, self.recording.as_mut())?;
        }
        let records = match &mut self.recording {
            Some(recording) => recording.put(&item)?,
            None => Vec::new(),
        };
        records.iter().try_for_each(|record| self.keep(record))?;
        if matches!(item, Item::Device { .. }) {
            self.device = Some(item);
        }
        Ok(())
    }

    fn keep(&mut self, record: &Item) -> Result<()> {
        self.teller.show(record);
        if let Some(measuring) = &mut self.measuring {
            measuring.take(record, None)?;
        }
        let Item::Record { file, .. } = record else { return Ok(()) };
        let folder = self.shown.seen(|seen| seen.recording.clone());
        let folder = folder.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
        (self.keep)(&folder.join(file));
        Ok(())
    }

    /// Begins a campaign or a condition; what cannot be is said, and the one before goes on. It is recorded:
    /// in a folder of its own, where its campaign.toml comes, too.
    fn measure(&mut self, wanted: &Wanted, built_in: &mut Option<BuiltInRig>) -> Result<()> {
        let folder = Path::new(FOLDER).join(wanted.name());
        let begun = wanted.plan(self.speed.is_some()).and_then(|plan| match plan {
            Some(plan) => Measuring::new(plan, Some(&folder)),
            None => Err(Error::usage("nothing says what is to be measured")
                .help("give a campaign's file, or a spring, an axis and a wind speed")),
        });
        match begun {
            Ok(measuring) => {
                self.stop()?;
                self.measuring = Some(measuring);
                (self.folder, self.ended) = (folder.clone(), false);
                self.shown.seen(|seen| seen.measuring = Some((json!(wanted), false)));
                built_in.iter_mut().for_each(BuiltInRig::wait);
                self.start(&folder)
            }
            Err(error) => {
                let text = format!("{}\n{}", error.message, error.help);
                self.teller.log(json!({"event": "refused"}), &text);
                Ok(())
            }
        }
    }

    fn start(&mut self, folder: &Path) -> Result<()> {
        if self.recording.is_some() {
            return Ok(());
        }
        let recording = Recording::begin(folder, self.device.as_ref())?;
        self.shown.seen(|seen| seen.recording = Some(recording.trace()));
        self.recording = Some(recording);
        Ok(())
    }

    fn stop(&mut self) -> Result<()> {
        let Some(recording) = self.recording.take() else { return Ok(()) };
        let (finished, records) = recording.finish()?;
        records.iter().try_for_each(|record| self.keep(record))?;
        self.shown.seen(|seen| seen.recording = None);
        let text = finished.to_text();
        let line = json!({
            "event": "recorded",
            "file": finished.trace.display().to_string(),
            "samples": finished.samples, "missing_samples": finished.missing_samples,
            "lost_samples": finished.lost_samples,
        });
        self.teller.log(line, &text);
        Ok(())
    }
}
