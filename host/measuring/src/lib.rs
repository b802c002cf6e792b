//! A campaign that is being measured on a device: what is released next, and what has come of the releases so
//! far.

#![forbid(unsafe_code)]

pub mod answers;
mod kept;
mod parts;

use answers::{identified, Answer, By};
use kept::Kept;
use parts::{condition, head, text};
use std::path::Path;
use std::time::{Duration, Instant};
use yawrig_base::error::{Error, Result};
use yawrig_campaign::plan::Plan;
use yawrig_core::derivatives::campaign::{Campaign, ReleaseEntry};
use yawrig_core::derivatives::condition::{are_repeats, Identified};
use yawrig_core::derivatives::{inertia_kg_m2, plausible, Computed};
use yawrig_link::condition::check;
use yawrig_link::follow::flag_names;
use yawrig_link::live::built_in_rig::BuiltInRig;
use yawrig_link::live::item::{Item, Next};
use yawrig_link::live::recording::Recording;
use yawrig_link::live::session::Session;
use yawrig_shared::axis::Axis;
use yawrig_shared::wire::{Condition, Event, Flags, Phase, ReleaseResult};

/// How often the device is asked whether it still refines a release.
const ASK: Duration = Duration::from_millis(300);

/// The last of them is over, and its refined estimate is to come.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    release: u32,
    ask_at: Instant,
    /// The device was asked once and had nothing left to do.
    idle: bool,
}

/// The plan under way.
#[derive(Debug)]
pub struct Measuring {
    plan: Plan,
    /// The plan's releases whose records were there before it began.
    skipped: Vec<bool>,
    at: usize,
    /// The device knows what the next one is made under.
    announced: bool,
    told: Option<Condition>,
    not_counted: Option<String>,
    /// The release that is going on or was the last to begin, and which of the plan it is.
    under_way: Option<(u32, Option<usize>)>,
    /// One is going on that began before the device was told.
    stale: bool,
    /// Where the built-in rig makes them: the one that is wanted is let go no sooner than with this sample of
    /// the device.
    no_sooner: Option<u32>,
    /// What is next is still to come, and is said again.
    say_again: bool,
    waiting: Option<Waiting>,
    /// The last result is not yet held against the condition that the device has.
    unchecked: bool,
    /// Releases that count, by their places in the plan.
    made: Vec<(usize, Answer)>,
    kept: Kept,
    ended: bool,
}

/// Whether a release counts; if not, why. A wind-off one counts where the device holds others against it.
fn verdict(wind_speed_m_s: f64, answer: &Answer) -> Option<String> {
    let counts = if wind_speed_m_s == 0.0 { answer.is_reference() } else { answer.is_usable() };
    (!counts).then(|| match flag_names(answer.result.flags).join(" ") {
        flags if flags.is_empty() => "no three cycles of it were seen".to_owned(),
        flags => flags,
    })
}

/// What is known before its refined estimate comes, which is what may count outside the trained range.
fn so_far(result: &ReleaseResult) -> Answer {
    let flags = result.flags.without(Flags::OUT_OF_RANGE);
    Answer { result: ReleaseResult { flags, ..*result }, refined: None }
}

impl Measuring {
    /// Begins it. With a folder, the campaign that is being made there goes on: what it lists is not made
    /// again.
    ///
    /// # Errors
    /// Exit 2 for a condition that cannot be; exit 3 where another campaign is in the folder.
    pub fn new(plan: Plan, folder: Option<&Path>) -> Result<Self> {
        for (index, entry) in plan.campaign.release.iter().enumerate() {
            let known = inertia_kg_m2(&head(&plan.campaign), &[], entry.axis);
            check(&condition(&plan.campaign, entry, known)).map_err(|error| {
                let which = format!("release {} ({} {})", index + 1, entry.spring, entry.axis);
                Error { message: format!("{which}: {}", error.message), ..error }
            })?;
        }
        let kept = Kept::new(&plan.campaign, folder)?;
        let mut there: Vec<&ReleaseEntry> = kept.campaign.release.iter().collect();
        let mut is_there = |wanted: &ReleaseEntry| {
            there
                .iter()
                .position(|r| are_repeats(r, wanted))
                .map(|place| there.remove(place))
                .is_some()
        };
        let skipped = plan.campaign.release.iter().map(|r| !plan.stays && is_there(r)).collect();
        let mut measuring = Self {
            plan,
            skipped,
            at: 0,
            announced: false,
            told: None,
            not_counted: None,
            under_way: None,
            stale: false,
            no_sooner: None,
            say_again: false,
            waiting: None,
            unchecked: false,
            made: Vec::new(),
            kept,
            ended: false,
        };
        measuring.at = measuring.next_from(0);
        Ok(measuring)
    }

    /// Whether all of it is made.
    pub fn has_ended(&self) -> bool {
        self.ended
    }

    fn next_from(&self, place: usize) -> usize {
        let left = place..self.skipped.len();
        left.into_iter().find(|place| !self.skipped[*place]).unwrap_or(self.skipped.len())
    }

    /// Leaves out what is next.
    pub fn skip(&mut self) {
        if !self.plan.stays && self.at < self.skipped.len() {
            self.go_to(self.next_from(self.at + 1));
        }
    }

    /// Takes back the last release that counted, or the one that was left out: it is made again.
    ///
    /// # Errors
    /// Exit 3 where the campaign's file cannot be written.
    pub fn go_back(&mut self) -> Result<()> {
        let before = (0..self.at).rev().find(|place| !self.skipped[*place]);
        let place = if self.plan.stays { Some(self.at) } else { before };
        let Some(place) = place else { return Ok(()) };
        self.ended = false;
        self.go_to(place);
        let Some(of) = self.made.iter().rposition(|(made, _)| *made == place) else {
            return Ok(());
        };
        self.made.remove(of);
        self.kept.unlist(&self.plan.campaign.release[place])
    }

    /// The last release was made under `condition`: it does not count where the device was told another.
    fn made_under(&mut self, condition: Option<Condition>) -> Result<()> {
        if condition.is_none() || condition == self.told {
            return Ok(());
        }
        self.told = None;
        self.take_back("another program has given the device its own condition".to_owned())
    }

    /// The last release does not count after all: it is made again.
    fn take_back(&mut self, why: String) -> Result<()> {
        let Some((place, _)) = self.made.pop() else { return Ok(()) };
        self.go_to(place);
        self.unchecked = false;
        self.not_counted = Some(why);
        self.kept.unlist(&self.plan.campaign.release[place])
    }

    fn go_to(&mut self, place: usize) {
        self.at = place;
        self.announced = false;
        self.say_again = false;
        self.waiting = None;
    }

    /// Takes what happened. Before it is written: a release that counts gets the name of its record.
    pub fn take(&mut self, item: &Item, recording: Option<&mut Recording>) -> Result<()> {
        match item {
            Item::Event { event, .. } => return self.take_event(event, recording),
            Item::Record { release, file, .. } => return self.keep(*release, file),
            Item::Restarted { .. } => {
                (self.under_way, self.stale) = (None, false);
                if self.waiting.is_some() {
                    self.advance()?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn take_event(&mut self, event: &Event, recording: Option<&mut Recording>) -> Result<()> {
        match event {
            Event::Phase { phase: Phase::Released | Phase::Ringing, release, .. }
                if self.under_way.is_none_or(|(known, _)| known != *release) =>
            {
                self.under_way = Some((*release, self.announced.then_some(self.at)));
            }
            Event::Release(result)
                if std::mem::take(&mut self.stale) | self.is_too_soon(result) =>
            {
                self.not_counted =
                    Some("it had begun before the device was given the condition".to_owned());
                self.say_again = true;
            }
            Event::Release(result) => {
                let known = self.under_way.filter(|(release, _)| *release == result.release);
                let place = known.map_or(self.announced.then_some(self.at), |(_, place)| place);
                let Some(place) = place.filter(|place| *place == self.at) else { return Ok(()) };
                let entry = &self.plan.campaign.release[place];
                self.not_counted = verdict(entry.wind_speed_m_s, &so_far(result));
                if self.not_counted.is_some() {
                    self.announced = false;
                    return Ok(());
                }
                if let Some(recording) = recording {
                    let stem = Path::new(&entry.file).file_stem().unwrap_or_default();
                    recording.name(result.release, &stem.to_string_lossy());
                }
                self.made.push((place, Answer { result: *result, refined: None }));
                self.unchecked = true;
                let (release, ask_at) = (result.release, Instant::now() + ASK);
                self.waiting = Some(Waiting { release, ask_at, idle: false });
            }
            Event::Refined(refined) => {
                let of = self.made.iter_mut().rfind(|(_, a)| a.result.release == refined.release);
                if let Some((_, answer)) = of {
                    answer.refined = Some(*refined);
                }
                if self.waiting.is_some_and(|waiting| waiting.release == refined.release) {
                    self.advance()?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Whether the built-in rig had let it go before it was told what is wanted. The device may have been
    /// told while it had yet to see that: what is played waits for it.
    fn is_too_soon(&self, result: &ReleaseResult) -> bool {
        let ahead = |first: u32| result.release_sample.wrapping_sub(first) as i32;
        self.no_sooner.is_some_and(|first| ahead(first) < 0)
    }

    /// All is known of the last release: on to the next one, or to the same once more.
    fn advance(&mut self) -> Result<()> {
        if let Some((place, answer)) = self.made.last() {
            let wind_speed_m_s = self.plan.campaign.release[*place].wind_speed_m_s;
            if let Some(why) = verdict(wind_speed_m_s, answer) {
                return self.take_back(why);
            }
        }
        let next = if self.plan.stays { self.at } else { self.next_from(self.at + 1) };
        self.go_to(next);
        Ok(())
    }

    /// Says to the device, and to the built-in rig where that is before it, what is next, if it is time to.
    ///
    /// # Errors
    /// Those of the line; exit 2 for a spring that the built-in rig does not have.
    pub fn go_on(
        &mut self,
        session: &mut Session,
        mut built_in: Option<&mut BuiltInRig>,
    ) -> Result<()> {
        if std::mem::take(&mut self.unchecked) {
            self.made_under(session.bench().client.status()?.condition)?;
        }
        if let Some(waiting) = self.waiting.as_mut().filter(|w| Instant::now() >= w.ask_at) {
            // A network that was taught effects is not refined. What is said before is still on its way once.
            let is_idle = !session.bench().client.status()?.refining;
            if std::mem::replace(&mut waiting.idle, is_idle) && is_idle {
                self.advance()?;
            } else {
                waiting.ask_at = Instant::now() + ASK;
            }
        }
        if !(self.announced || self.waiting.is_some() || self.ended) {
            self.announce(session, built_in.as_deref_mut())?;
        } else if std::mem::take(&mut self.say_again) {
            self.say_next(session);
        }
        // A device that was reset counts its samples anew.
        let counts_on = session.bench().client.resets() == 0;
        self.no_sooner = built_in.filter(|_| counts_on).map(|rig| rig.ordered_from() as u32);
        Ok(())
    }

    fn announce(&mut self, session: &mut Session, built_in: Option<&mut BuiltInRig>) -> Result<()> {
        self.announced = true;
        let Some(entry) = self.plan.campaign.release.get(self.at) else {
            self.ended = true;
            let at = session.now();
            if let Some(item) = self.derivatives(at) {
                session.note(item);
            }
            return Ok(());
        };
        let inertia = self.inertia_kg_m2(entry.axis);
        let condition = condition(&self.plan.campaign, entry, inertia);
        if self.told != Some(condition) {
            let status = session.set_condition(condition)?;
            self.told = Some(condition);
            self.kept.campaign.rig.clock_u_ppm.get_or_insert(f64::from(status.clock_u_ppm));
            // What is going on was begun under another condition, seen or not.
            self.stale = matches!(status.phase, Phase::Released | Phase::Ringing);
        }
        if let Some(built_in) = built_in {
            built_in.release(&entry.spring, entry.axis, entry.wind_speed_m_s)?;
        }
        self.say_next(session);
        Ok(())
    }

    /// Says what is next, and why the release before does not count.
    fn say_next(&mut self, session: &mut Session) {
        let Some(entry) = self.plan.campaign.release.get(self.at) else { return };
        let next = Next {
            spring: entry.spring.clone(),
            axis: entry.axis,
            wind_speed_m_s: entry.wind_speed_m_s,
            density_kg_m3: self.plan.campaign.density_kg_m3(entry),
            at: entry.at.to_string(),
            inertia_kg_m2: self.inertia_kg_m2(entry.axis),
            place: (!self.plan.stays).then_some([self.at + 1, self.plan.campaign.release.len()]),
            not_counted: self.not_counted.take(),
        };
        let at = session.now();
        session.note(Item::Condition { at, next });
    }

    /// Izz as far as it is known.
    fn inertia_kg_m2(&self, axis: Axis) -> Option<f64> {
        let (campaign, identified) = self.so_far();
        inertia_kg_m2(&campaign, &identified, axis)
    }

    /// The releases that count, as the device has answered.
    fn so_far(&self) -> (Campaign, Vec<Identified>) {
        let entries = self.made.iter().map(|(place, _)| self.plan.campaign.release[*place].clone());
        let (made, answers): (Vec<_>, Vec<_>) = entries.zip(self.made.iter().map(|m| m.1)).unzip();
        let identified = identified(&made, &answers, By::Refined);
        let release = self.kept.before.iter().map(|(entry, _)| entry.clone()).chain(made).collect();
        let before = self.kept.before.iter().map(|(_, identified)| identified.clone());
        let campaign = Campaign { release, ..self.plan.campaign.clone() };
        (campaign, before.chain(identified).collect())
    }

    /// The table of the releases made; none where no spring was released at the middle axis with the wind on.
    fn derivatives(&self, at: u64) -> Option<Item> {
        let (campaign, identified) = self.so_far();
        let table = Computed::new(&campaign, &identified).ok()?;
        let file = self.kept.file();
        let mut table = table.table(file.unwrap_or(Path::new("")), "device");
        table.doubts = plausible::doubts(&campaign, &identified, &[]);
        let text = text(&table, file);
        Some(Item::Derivatives { at, table: serde_json::to_value(&table).ok()?, text })
    }

    /// A release that counts has its record: the campaign's file lists it from now on.
    fn keep(&mut self, release: u32, file: &str) -> Result<()> {
        let made = self.made.iter().rfind(|(_, answer)| answer.result.release == release);
        let Some((place, _)) = made else { return Ok(()) };
        let entry = self.plan.campaign.release[*place].clone();
        self.kept.list(ReleaseEntry { file: file.to_owned(), ..entry })
    }
}

#[cfg(test)]
mod tests;
