//! The thesis's studies (Ramli 2008, chapters 4 and 5), rerun: one file a study.
//!
//! Training and test draws come from fixed seeds: the same tables on every run and any number of threads.
#![forbid(unsafe_code)]

mod beside_thesis;
mod conventional;
mod cycles;
pub mod decays;
mod hidden;
pub mod information;
mod inputs;
pub mod lab;
mod noise;
mod pca_components;
mod pca_estimates;
mod pca_rig;
mod pca_samples;
mod pca_structures;
pub mod report;
mod response;
mod rig_records;
mod samples;
mod second_layer;
mod setting;
mod starts;
mod validation;

pub use conventional::{SAMPLES as TABLE_4_7_SAMPLES, THESIS as TABLE_4_7};
pub use report::Report;
pub use setting::{Size, StudySetting};

use report::Outcome;
use yawrig_base::error::{Error, Result};

/// One study of the thesis.
pub struct Study {
    pub name: &'static str,
    /// Where the thesis has it.
    pub reruns: &'static str,
    run: fn(&StudySetting<'_>) -> Result<Outcome>,
}

const fn study(
    name: &'static str,
    reruns: &'static str,
    run: fn(&StudySetting<'_>) -> Result<Outcome>,
) -> Study {
    Study { name, reruns, run }
}

/// Every study, in the thesis's order.
pub static STUDIES: [Study; 15] = [
    study("starts", "random starts, Fig 4.5", starts::run),
    study("cycles", "cycles in a window, Fig 4.6", cycles::run),
    study("inputs", "points in a window, Fig 4.7", inputs::run),
    study("samples", "training samples, Table 4.1 and Fig 4.9", samples::run),
    study("hidden", "hidden nodes, Fig 4.10", hidden::run),
    study("second-layer", "a second hidden layer, Table 4.2 and Fig 4.11", second_layer::run),
    study("noise", "noise and structure, Figs 4.13 to 4.18 and Table 4.5", noise::run),
    study("conventional", "conventional method and network, Table 4.7", conventional::run),
    study("response", "variation through a response, Fig 4.20", response::run),
    study("validation", "derivatives validated, Figs 4.22 and 4.23", validation::run),
    study("pca-samples", "whole record: training samples, Fig 5.4", pca_samples::run),
    study("pca-components", "whole record: components, Figs 5.5 and 5.6", pca_components::run),
    study("pca-structures", "whole record: structures, Figs 5.9 and 5.10", pca_structures::run),
    study("pca-estimates", "whole record: estimates, Figs 5.12 and 5.13", pca_estimates::run),
    study("pca-rig", "components on rig records, Tables 5.3 and 5.4", pca_rig::run),
];

impl Study {
    /// The study of this name.
    ///
    /// # Errors
    /// Exit 2 for any other, with all names.
    pub fn named(name: &str) -> Result<&'static Self> {
        STUDIES.iter().find(|study| study.name == name).ok_or_else(|| {
            let names: Vec<&str> = STUDIES.iter().map(|study| study.name).collect();
            Error::usage(format!("there is no study `{name}`"))
                .help(format!("the studies are: {}; or `all`", names.join(", ")))
        })
    }

    /// Runs it.
    ///
    /// # Errors
    /// 130 where the user stops it, 6 where a training comes to nothing.
    pub fn run(&self, setting: &StudySetting<'_>) -> Result<Report> {
        let Outcome { tables, findings, plots } = (self.run)(setting)?;
        let (study, title) = (self.name.to_owned(), self.reruns.to_owned());
        Ok(Report { study, title, tables, findings, plots })
    }
}

#[cfg(test)]
mod tests;
