//! Where a second-order model fails, which physical effect is missing, and what adding it does.
//!
//! A record's free swing is taken as block means over a fiftieth of a period ([`swing`]); a model with any effects of
//! the library and the user's own ([`effects`]) is simulated ([`simulate`]) and fitted ([`fitting`]), to one release or
//! to several at once ([`joint`]); [`diagnose`] fits every effect, alone and together, and judges by evidence, held-out
//! data and physical size; [`compare`] says where a model fails; [`campaign`] judges releases together and says where
//! an effect comes from ([`origin`]). What is made of it stands in a file ([`model`]) whose every step is kept
//! ([`journal`], [`store`]).

pub mod account;
pub mod amplitude;
pub mod appraisal;
pub mod buffeting;
pub mod campaign;
mod campaign_fit;
pub mod cards;
pub mod compare;
pub mod comparison;
pub mod diagnose;
pub mod effects;
pub mod fitting;
mod floor;
mod forced;
pub mod joint;
pub mod journal;
mod late_release;
pub mod limits;
pub mod model;
pub mod model_fit;
mod model_reading;
mod model_text;
pub mod noise;
pub mod origin;
mod own_motion;
mod prediction;
mod problem;
mod promise;
mod reach;
pub mod records;
pub mod revise;
pub mod search;
mod segments;
mod sharing;
pub mod simulate;
mod starts;
pub mod store;
mod structure;
mod survivors;
pub mod swing;
mod terms;
mod together;
pub mod unfitted;
