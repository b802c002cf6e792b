//! A device that is followed: shown, recorded, its releases added to the list.

use super::shown::{Order, Shown};
use super::teller::Teller;
use serde_json::json;
use std::path::Path;
use std::sync::mpsc::Receiver;
use std::sync::Arc;
use std::time::Duration;
use yawrig_base::error::Result;
use yawrig_base::interrupt;
use yawrig_link::bench::{Bench, Target};
use yawrig_link::live::item::Item;
use yawrig_link::live::recording::Recording;
use yawrig_link::live::session::{Follow, Session};
use yawrig_link::live::swing::Swing;

/// Folder of recordings made from the page.
pub const FOLDER: &str = "recordings";

/// The device and where it is written to.
struct Following<'a> {
    shown: &'a Arc<Shown>,
    keep: &'a dyn Fn(&Path),
    session: Session,
    recording: Option<Recording>,
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
    orders: &Receiver<Order>,
    keep: &dyn Fn(&Path),
) -> Result<()> {
    let bench = Bench::open(target)?;
    let mut swing = match target {
        Target::Port(_) => None,
        _ => Some(Swing::new(1.0)),
    };
    let mut following = Following {
        shown,
        keep,
        session: Session::new(bench, Follow::Trace)?,
        recording: None,
        device: None,
        teller: Teller::new(shown),
    };
    let done = following.run(&mut swing, orders);
    // However it ended: what was recorded is kept.
    let kept = following.stop();
    following.teller.tell();
    done.and(kept)
}

impl Following<'_> {
    fn run(&mut self, swing: &mut Option<Swing>, orders: &Receiver<Order>) -> Result<()> {
        loop {
            interrupt::check()?;
            if let Some(swing) = swing {
                swing.go_on(self.session.bench())?;
            }
            let mut patience = Duration::from_millis(20);
            while let Some(item) = self.session.next(patience)? {
                patience = Duration::ZERO;
                self.take(item)?;
            }
            while let Ok(order) = orders.try_recv() {
                match order {
                    Order::Record => self.start()?,
                    Order::StopRecording => self.stop()?,
                    Order::Mark(text) => self.session.mark(&text),
                    Order::Leave => return Ok(()),
                    // Of a stored session.
                    Order::Play | Order::Pause | Order::Speed(_) | Order::Jump(_) => {}
                }
            }
            if self.teller.is_due() {
                self.teller.tell();
            }
        }
    }

    fn take(&mut self, item: Item) -> Result<()> {
        self.teller.show(&item);
        let records = match &mut self.recording {
            Some(recording) => recording.put(&item)?,
            None => Vec::new(),
        };
        records.iter().for_each(|record| self.keep(record));
        if matches!(item, Item::Device { .. }) {
            self.device = Some(item);
        }
        Ok(())
    }

    fn keep(&mut self, record: &Item) {
        self.teller.show(record);
        let Item::Record { file, .. } = record else { return };
        let folder = self.shown.seen(|seen| seen.recording.clone());
        let folder = folder.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
        (self.keep)(&folder.join(file));
    }

    fn start(&mut self) -> Result<()> {
        if self.recording.is_some() {
            return Ok(());
        }
        let recording = Recording::begin(Path::new(FOLDER), self.device.as_ref())?;
        self.shown.seen(|seen| seen.recording = Some(recording.trace()));
        self.recording = Some(recording);
        Ok(())
    }

    fn stop(&mut self) -> Result<()> {
        let Some(recording) = self.recording.take() else { return Ok(()) };
        let (finished, records) = recording.finish()?;
        records.iter().for_each(|record| self.keep(record));
        self.shown.seen(|seen| seen.recording = None);
        let missing = match finished.missing_samples {
            0 => "none missing".to_owned(),
            count => format!("{count} missing"),
        };
        let text = format!(
            "{}: {} samples, {missing}, {} releases",
            finished.trace.display(),
            finished.samples,
            finished.releases
        );
        let line = json!({
            "event": "recorded",
            "file": finished.trace.display().to_string(),
            "samples": finished.samples, "missing_samples": finished.missing_samples,
        });
        self.teller.log(line, &text);
        Ok(())
    }
}
