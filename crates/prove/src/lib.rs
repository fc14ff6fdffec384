//! Proofs: is there any sequence of inputs that breaks a line of `always`?
//!
//! A [`model::ProofModel`] is a program that judges itself, with what may change before each scan.
//! Two ways decide it, and check each other: [`explore`] visits all states on the engine itself,
//! [`encode`] turns the operations into gates, about which a solver deduces. Nothing here reads a
//! file or prints; `rungd prove` does. What a proof says, and what it does not say, is in
//! `docs/proving.md`.

pub mod aig;
pub mod answer;
pub mod any;
mod asked_events;
pub mod certificate;
pub mod cone;
pub mod decide;
pub mod deduce;
mod device_wait;
pub mod encode;
pub mod equal;
mod equal_answer;
mod equal_difference;
pub mod events;
pub mod explore;
pub mod gates;
mod gates_merged;
mod given_inputs;
pub mod how;
mod inputs;
pub mod kept;
pub mod mistake;
pub mod model;
mod named_input;
pub mod question;
pub mod race;
mod retained;
mod retained_stages;
pub mod rig_memory;
pub mod stage_start;
mod stretched;
pub mod survey;
mod told_events;
mod trial;
