//! What a page asks, as the workbench's server is asked.

use serde::Deserialize;
use yawrig_records::Selection;

/// A release and a stretch of its time.
#[derive(Deserialize)]
pub struct Stretch {
    pub release: usize,
    pub from: Option<f64>,
    pub to: Option<f64>,
    /// What is laid over it.
    pub ghost: Option<String>,
    /// About so many are drawn of each curve.
    pub points: Option<usize>,
}

#[derive(Deserialize)]
pub struct OfRelease {
    pub release: usize,
}

#[derive(Deserialize)]
pub struct AsRead {
    pub file: String,
    pub reading: Selection,
}

/// Something to do.
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub enum Order {
    Open {
        file: String,
        #[serde(default)]
        reading: Selection,
    },
    Diagnose {
        release: usize,
    },
    Try {
        release: usize,
        effect: String,
    },
    Between {
        release: usize,
        from_s: Option<f64>,
        to_s: Option<f64>,
    },
}
