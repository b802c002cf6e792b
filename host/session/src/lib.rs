//! What a page is about, whoever serves it: releases, the model on the disk and its steps, and what has been
//! computed. What is asked is answered from what is known (`requests`, `show`, `state`); what takes longer is
//! a job (`job`, `steps`). The steps are those of [`yawrig_model::revise`], so that a model and its journal
//! are the same whether made on a page or on the command line.
#![forbid(unsafe_code)]

mod bench;
mod derived;
pub mod followed;
pub mod job;
mod kept;
mod law;
mod opened;
mod own;
pub mod requests;
mod session;
mod show;
mod shown_law;
mod state;
pub mod steps;

pub use bench::{Bench, Told};
pub use kept::Kept;
pub use own::Form;
pub use session::{ListedRelease, Opened, Session, Use};
pub use show::{derivatives, library};
pub use state::state;
