//! What takes longer than a click, and how it gets on.

use serde::{Deserialize, Serialize};
use yawrig_core::effects::{SourceKind, MEASURED_LAW};

/// What a user can ask for that takes its time. Effects are named by their ids.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub enum Job {
    Fit,
    Add {
        effect: String,
        why: Option<String>,
        /// Of a measured law: its damping may put energy in.
        #[serde(default)]
        may_drive: bool,
        /// In a model of a campaign: where its strength comes from; by itself what predicts best.
        #[serde(default)]
        source: Option<SourceKind>,
        /// Though with it what was held out is predicted worse.
        #[serde(default)]
        keep: bool,
    },
    Remove {
        effect: String,
        why: Option<String>,
    },
    Reject {
        effect: String,
        why: Option<String>,
    },
    Return {
        step: usize,
        why: Option<String>,
    },
    /// Which effect the present model lacks in a release.
    Diagnose {
        release: usize,
    },
    /// Which effects a campaign needs, and from where.
    Judge,
    /// Which effects the ticked releases need, judged as releases of one rig.
    Together,
    /// The law that the ticked releases show, and the formulas it may be.
    Law {
        #[serde(default)]
        may_drive: bool,
    },
    /// What an effect would do in a release.
    Try {
        release: usize,
        effect: String,
    },
}

impl Job {
    /// What is said while it is under way.
    pub fn what(&self) -> String {
        match self {
            Self::Fit => "fitting the model".to_owned(),
            Self::Add { effect, .. } => format!("adding {effect}"),
            Self::Remove { effect, .. } => format!("removing {effect}"),
            Self::Reject { effect, .. } => format!("rejecting {effect}"),
            Self::Return { step, .. } => format!("returning to step {step}"),
            Self::Diagnose { .. } => "looking for what is missing".to_owned(),
            Self::Law { .. } => "measuring the law".to_owned(),
            Self::Judge => "judging the whole campaign".to_owned(),
            Self::Together => "judging the ticked releases together".to_owned(),
            Self::Try { effect, .. } => format!("trying {effect}"),
        }
    }

    /// The effect of the library, or the user's own, that it needs to know.
    pub fn needs(&self) -> Option<&str> {
        match self {
            // Its law is yet to be estimated.
            Self::Add { effect, .. } if effect == MEASURED_LAW => None,
            Self::Add { effect, .. } | Self::Reject { effect, .. } | Self::Try { effect, .. } => {
                Some(effect)
            }
            _ => None,
        }
    }
}

/// What the worker is doing.
#[derive(Clone, Debug, Serialize)]
pub struct Progress {
    pub what: String,
    pub seconds: f64,
    /// Grows while the work makes progress.
    pub looks: u64,
    pub is_stopping: bool,
}

/// How the last piece of work ended, for the page to say.
#[derive(Clone, Debug, Serialize)]
pub struct Ended {
    pub job: Job,
    pub message: String,
    pub help: String,
    pub is_error: bool,
    /// Grows with each.
    pub number: u64,
}
