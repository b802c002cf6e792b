#![doc = include_str!("../README.md")]
//!
//! # Where to begin
//!
//! | to | use |
//! |---|---|
//! | hold a record | [`record::Record`] |
//! | identify wn and zeta with their uncertainties | [`identify::identify`], [`quantity::Quantity`] |
//! | find what the second-order model lacks | [`diagnosis::diagnose::diagnose`], of one release, several or a campaign |
//! | fit chosen effects | [`fit::free_decay::FreeDecay`], [`fit::fitting`], to several releases [`fit::joint`] |
//! | choose effects, or bring one | [`effects::Effect`], [`effects::Terms`] |
//! | simulate | [`motion::simulate`] |
//! | learn what a sensor errs by, as a table | [`linearity::Swings`] |
//! | measure a law that no effect holds, and name it | [`law::estimate::measure`], [`law::names::names`] |
//! | choose the next release | [`plan::rank`] |
//! | write a roll decay in the coefficients of naval architecture | [`roll::RollDecay`] |
//! | compute derivatives of a campaign | [`derivatives::campaign::Campaign`], [`derivatives::table::Table`] |
//! | stop a long computation, tell what went wrong | [`stop::Stop`], [`error::Error`] |
//!
//! # Words
//!
//! | word | meaning |
//! |---|---|
//! | free decay | what a record shows between the release and rest |
//! | zero | the sensor's reading at no yaw; the *rest angle* is where the model comes to rest |
//! | initial condition, state | yaw angle and yaw rate at the first instant |
//! | natural frequency wn, damping ratio zeta | of the linear part, b'' = -2 zeta wn r - wn^2 b, at rest |
//! | effect | a moment over the inertia, or a change of the reading, that a second-order response lacks |
//! | residual | model less record; *over noise*: its rms on block means over the noise of such a mean |
//! | held out | data that a model was not fitted to, with the state estimated anew, on which it is tried |
//! | joint fit, shared parameters | one fit to several releases that have some numbers in common |
//! | evidence (`delta_bic`) | a difference of BIC ([`bic`]) |
//!
//! Signs: yaw angle b and rate r positive to one side, moments divided by Izz; damping ratio negative where
//! the oscillation grows; Cn_beta > 0 lowers the stiffness, Cn_r < 0 adds damping (the thesis's convention).
#![forbid(unsafe_code)]
#![warn(missing_docs, unnameable_types, unreachable_pub)]

pub mod bic;
pub mod derivatives;
pub mod diagnosis;
pub(crate) mod discrepancy;
pub mod effects;
pub mod error;
pub mod fit;
pub mod identify;
pub mod law;
pub mod linearity;
pub mod motion;
pub(crate) mod par_map;
pub mod plan;
pub mod quantity;
pub mod record;
pub mod roll;
pub mod solver;
pub(crate) mod spectrum;
pub mod statistics;
pub mod stop;
