//! The commands that make the model of an answer, for the current folder.

use crate::flags::Flags;
use std::path::{Path, PathBuf};
use yawrig_base::settings::Spelling;
use yawrig_core::diagnosis::diagnose::{Diagnosis, Status};
use yawrig_core::effects::{Effect, SourceKind, MEASURED_LAW};
use yawrig_model::document::DEFAULT;
use yawrig_records::place::is_standard_input;
use yawrig_records::Selection;
use yawrig_text::quoted;

/// A command's words, as a shell hands them over.
pub type Words = Vec<String>;

/// What a model is made of.
pub struct Making<'a> {
    /// Records or a campaign; none where effects are added to a model that is there.
    pub files: &'a [PathBuf],
    pub reading: &'a Selection,
    pub unknown_zero: bool,
    /// Into which.
    pub model: PathBuf,
    /// The users' own effects, each with the file it was read from.
    pub own: &'a [(Effect, String)],
}

/// An effect to be added.
pub struct Addition<'a> {
    /// Its id, or the file it is read from.
    pub effect: &'a str,
    pub source: SourceKind,
    /// Whatever is predicted with it of what was held out: with those that follow it counts, or it was judged
    /// by another prediction.
    pub keep: bool,
}

/// A model's file that is not there yet: what is there is about other records.
pub fn new_model() -> PathBuf {
    let numbered = (2..).map(|n| PathBuf::from(format!("model-{n}.toml")));
    let free = |path: &PathBuf| !path.exists() && !path.with_extension("journal.jsonl").exists();
    std::iter::once(PathBuf::from(DEFAULT)).chain(numbered).find(free).unwrap_or_default()
}

impl Making<'_> {
    fn model_words(&self) -> Words {
        match self.model == Path::new(DEFAULT) {
            true => Vec::new(),
            false => vec![Flags.name("model"), self.model.display().to_string()],
        }
    }

    /// How the records are read.
    pub fn reading_words(&self) -> Words {
        let words = |(name, value): (&str, String)| {
            std::iter::once(Flags.name(name)).chain((!value.is_empty()).then_some(value))
        };
        self.reading.settings().into_iter().flat_map(words).collect()
    }

    /// `fit`, where the model is to be made, and `add` for each of `added`; none about what came by standard
    /// input and is not there any more.
    pub fn commands(&self, added: &[Addition]) -> Vec<Words> {
        let mut all = Vec::new();
        if self.files.iter().any(|file| is_standard_input(file)) {
            return all;
        }
        if !self.files.is_empty() {
            let mut fit = vec!["yawrig".to_owned(), "fit".to_owned()];
            fit.extend(self.files.iter().map(|file| file.display().to_string()));
            fit.extend(self.reading_words());
            fit.extend(self.unknown_zero.then(|| Flags.name("unknown_zero")));
            fit.extend(self.model_words());
            all.push(fit);
        }
        all.extend(added.iter().map(|Addition { effect, source, keep }| {
            let own = self.own.iter().find(|(own, _)| own.id() == *effect);
            let effect = own.map_or(*effect, |(_, file)| file.as_str());
            let mut add = ["yawrig", "add", effect].map(str::to_owned).to_vec();
            let is_said = *source != SourceKind::Mechanical;
            add.extend(is_said.then(|| Flags.name(source.name())));
            add.extend(keep.then(|| Flags.name("keep")));
            add.extend(self.model_words());
            add
        }));
        all
    }

    /// The commands that make the model of `d`; none where nothing is to be done, or a model holds it not.
    pub fn of_diagnosis(&self, d: &Diagnosis, law_is_measured: bool) -> Vec<Words> {
        // What is not down to the noise was judged by pieces, or releases, and not by the later part.
        let by_itself = d.status != Status::Explained;
        let rises = |e: &Effect| {
            // Of a step that predicts worse stands what the one before it leaves.
            let steps = d.steps.windows(2);
            let mut worse = steps.filter(|w| w[1].held_out_over_noise >= w[0].held_out_over_noise);
            worse.any(|w| w[1].added.as_ref() == Some(e))
        };
        // Those of the last model, which a constant moment beside zeros of the sensor is not in.
        let may_be = |e: &&Effect| !(e.is_random() || self.unknown_zero && e.moves_rest());
        let added = d.effects.iter().filter(may_be).map(|e| Addition {
            effect: e.id(),
            source: d.source.get(e.id()).copied().unwrap_or_default(),
            keep: by_itself || rises(e),
        });
        let mut added: Vec<Addition> = added.collect();
        if d.status == Status::Unexplained && law_is_measured {
            let source = SourceKind::Mechanical;
            added = vec![Addition { effect: MEASURED_LAW, source, keep: by_itself }];
        }
        match added.is_empty() {
            true => Vec::new(),
            false => self.commands(&added),
        }
    }
}

/// As lines of a shell.
pub fn lines(commands: &[Words]) -> String {
    let line = |words: &Words| words.iter().map(|w| quoted(w)).collect::<Vec<_>>().join(" ");
    let all: Vec<String> = commands.iter().map(line).collect();
    format!("the model of this answer:\n  {}", all.join("\n  "))
}
