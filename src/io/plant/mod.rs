//! A plant in software, as a field device: belts with parts on them, tanks, motors, faults.
//!
//! [`Model`] is pure: it takes the time and the outputs to the plant, and gives the inputs. Tests
//! step it by hand; [`Plant`] makes it a driver, with a step up to the present at each exchange.
//! `docs/simulated-plant.md` describes the parts and faults. The rules of `[[simulated-device]]`
//! are single parts without a plant ([`RuleSet`], and [`Drive`] beside a running controller).

mod drive;
mod fault;
mod follower;
mod model;
mod part;
mod rules;
pub mod settings;

use std::time::Instant;

pub(crate) use drive::{Drive, Rules};
pub use model::{Lost, Model};
pub use rules::RuleSet;

use crate::isa::Real;

use super::device::{Done, Driver, Exchange, Trouble};
use settings::Plant as Settings;

/// A plant that runs by the machine's clock.
pub(crate) struct Plant {
    model: Model,
    inputs: Vec<i32>,
    outputs: Vec<i32>,
    real_inputs: Vec<bool>,
    real_outputs: Vec<bool>,
    /// The time of its first step.
    started: Option<Instant>,
}

impl Plant {
    /// A plant at rest.
    pub fn new(settings: &Settings) -> Plant {
        Plant {
            model: Model::new(settings),
            inputs: vec![0; settings.inputs.len()],
            outputs: vec![0; settings.outputs],
            real_inputs: settings.real_inputs.clone(),
            real_outputs: settings.real_outputs.clone(),
            started: None,
        }
    }
}

impl Driver for Plant {
    async fn connect(&mut self) -> Result<(), Trouble> {
        Ok(())
    }

    async fn exchange(&mut self, exchange: Exchange<'_>) -> Result<Done, Trouble> {
        let now_ms = self.started.get_or_insert_with(Instant::now).elapsed().as_millis() as u64;
        let outputs = exchange.outputs.iter().zip(&self.real_outputs);
        for (output, (content, is_real)) in self.outputs.iter_mut().zip(outputs) {
            let whole = || Real::of_cell(*content).number().round() as i32;
            *output = if *is_real { whole() } else { *content };
        }
        if self.model.step(now_ms, &self.outputs, &mut self.inputs) == Err(Lost) {
            return Err(Trouble::kept("the plant does not answer: a fault has cut it off"));
        }
        let values = self.inputs.iter().zip(&self.real_inputs);
        for (input, (value, is_real)) in exchange.inputs.iter_mut().zip(values) {
            *input = Some(if *is_real { Real::nearest(*value).cell() } else { *value });
        }
        Ok(Done::Whole)
    }

    fn disconnect(&mut self) {}
}
