//! A plant in software, as a field device: belts with parts on them, tanks, motors, faults.
//!
//! [`Model`] is pure: it takes the time and the outputs to the plant, and returns the inputs. Tests
//! step it by hand; [`RunningPlant`] makes it a driver, and steps it up to the present time at
//! each exchange. `docs/simulated-plant.md` describes the parts and faults. The rules of
//! `[[simulated-device]]` are single parts without a plant ([`RuleSet`], and [`PlantDrive`] beside
//! a running controller).

mod drive;
mod fault;
mod follower;
mod lag;
mod model;
mod part;
mod rules;
pub mod settings;

use std::time::Instant;

pub use drive::{PlantDrive, Rules};
pub use model::{Lost, Model};
pub use rules::RuleSet;

use super::device::{Driver, Exchange, ExchangeExtent, ExchangeFailure};
use settings::PlantSettings as Settings;

/// A plant that runs by the machine's clock.
pub struct RunningPlant {
    model: Model,
    /// The inputs that it drives, as cells.
    pub inputs: Vec<i32>,
    /// The time of its first step.
    started: Option<Instant>,
}

impl RunningPlant {
    /// A plant at rest.
    pub fn new(settings: &Settings) -> RunningPlant {
        RunningPlant {
            model: Model::new(settings),
            inputs: vec![0; settings.inputs.len()],
            started: None,
        }
    }
}

impl Driver for RunningPlant {
    async fn connect(&mut self) -> Result<(), ExchangeFailure> {
        Ok(())
    }

    async fn exchange(
        &mut self,
        exchange: Exchange<'_>,
    ) -> Result<ExchangeExtent, ExchangeFailure> {
        let now_ms = self.started.get_or_insert_with(Instant::now).elapsed().as_millis() as u64;
        if self.model.step(now_ms, exchange.outputs, &mut self.inputs) == Err(Lost) {
            return Err(ExchangeFailure::kept("the plant does not answer: a fault has cut it off"));
        }
        for (input, value) in exchange.inputs.iter_mut().zip(&self.inputs) {
            *input = Some(*value);
        }
        Ok(ExchangeExtent::Whole)
    }

    fn disconnect(&mut self) {}
}
