//! What there is of a session beside its files, to go on with it another time.

use super::bench::{Bench, Told};
use super::opened;
use super::session::{ListedRelease, Opened, Session, Use};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use yawrig_base::error::Result;
use yawrig_core::effects::Effect;
use yawrig_model::effects::defined;
use yawrig_records::place::Times;
use yawrig_records::Selection;

/// A release as it stands in the list.
#[derive(Clone, Debug, Deserialize, Serialize)]
struct KeptRelease {
    /// What it was opened as.
    file: PathBuf,
    /// What lies between these times is analysed.
    between_s: Option<[Option<f64>; 2]>,
    reading: Selection,
    used: Use,
}

#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub struct Kept {
    campaign: Option<PathBuf>,
    releases: Vec<KeptRelease>,
    /// Own effects: the names of their files, and the texts.
    own: Vec<(PathBuf, String)>,
}

impl Kept {
    pub fn new(session: &Session) -> Self {
        let release = |r: &ListedRelease| KeptRelease {
            file: r.source.origin.clone(),
            between_s: (r.source.path != r.source.origin).then(|| opened::times_of(&r.source.path)),
            reading: r.entry.reading.clone(),
            used: r.used,
        };
        let own = session.own.iter().filter_map(|effect| match effect {
            Effect::Own(own) => Some((format!("{}.toml", own.id).into(), own.text.clone())),
            _ => None,
        });
        Self {
            campaign: session.campaign.as_ref().map(|campaign| campaign.path.clone()),
            releases: session.releases.iter().map(release).collect(),
            own: own.collect(),
        }
    }

    /// The session as it was, its files being there again.
    ///
    /// # Errors
    /// Those of [`Session::new`], of a cut and of an own effect.
    pub fn again(&self, told: Box<Told>) -> Result<Bench> {
        let own: Vec<Effect> =
            self.own.iter().map(|(file, text)| defined(file, text)).collect::<Result<_>>()?;
        let files = match &self.campaign {
            Some(campaign) => vec![campaign.clone()],
            None => self.releases.iter().map(|r| r.file.clone()).collect(),
        };
        let bench = Bench::new(Session::new(&Opened { files, own, ..Opened::default() })?, told);
        for kept in &self.releases {
            let place = bench.session().releases.iter().position(|r| r.source.origin == kept.file);
            // A record of the model stands with it.
            let Some(id) = place else { continue };
            let mut session = bench.session();
            session.read_as(id, &kept.reading);
            session.releases[id].used = kept.used;
            drop(session);
            if let Some([from_s, to_s]) = kept.between_s {
                opened::between(&bench, id, Times { from_s, to_s })?;
            }
        }
        Ok(bench)
    }
}
