//! What has been computed in a session.

use super::{Session, Together};
use crate::shown_law::{about, ShownLaw};
use std::path::Path;
use std::sync::Arc;
use yawrig_base::error::{Error, Result};
use yawrig_core::effects::Effect;
use yawrig_model::effects;
use yawrig_model::law::File;
use yawrig_report::view::View;

impl Session {
    /// What the ticked releases lack together beside the present model, if they have been judged.
    pub fn together(&self) -> Option<&Together> {
        self.together.as_ref().filter(|found| found.about == about(&self.next_model()))
    }

    /// The law of the present model and ticks, if it has been measured.
    pub fn law(&self) -> Option<Arc<ShownLaw>> {
        self.shown_law.clone().filter(|law| law.about == about(&self.next_model()))
    }

    /// The formula of that law whose file is `path`.
    pub fn formula(&self, path: &str) -> Option<File> {
        self.law()?.files().into_iter().find(|file| file.path == Path::new(path))
    }

    pub fn view(&self, id: usize) -> Option<&std::result::Result<Arc<View>, Error>> {
        self.views.get(&(id, self.standing.key))
    }

    /// An effect of the library, of the model, one that was defined on the page or given at the start, or a
    /// formula's file.
    pub fn effect(&self, id: &str) -> Result<Effect> {
        let model =
            self.standing.model.iter().flat_map(|m| m.effects.iter().map(|e| e.effect.clone()));
        let known = self.own.iter().cloned().chain(model).find(|e| e.id() == id);
        match (known, self.formula(id)) {
            (Some(effect), _) => Ok(effect),
            (None, Some(file)) => effects::defined(&file.path, &file.text),
            (None, None) => effects::named(id),
        }
    }

    /// Makes a user's own effect one of those that are tried, in place of an earlier one of its name.
    pub fn take_own(&mut self, effect: Effect) {
        self.own.retain(|e| e.id() != effect.id());
        self.own.push(effect.clone());
        self.ghosts.retain(|k, _| k.2 != effect.id());
    }

    pub(super) fn forget_what_was_found(&mut self, id: usize) {
        self.views.retain(|(other, _), _| *other != id);
        self.diagnosed.retain(|(other, _), _| *other != id);
        self.ghosts.retain(|(other, _, _), _| *other != id);
    }
}
