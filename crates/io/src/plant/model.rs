//! The model of a plant, and a step of the plant.
//!
//! Time passes in ticks of a millisecond, independently of the distance between steps, so the same
//! commands at the same times give the same results. In a tick, every command first takes the value
//! that its driver had after the previous tick; then every part moves. The order of the parts
//! therefore does not matter. The values of points are integers. Parts keep their state in finer
//! units, so rounding does not add up. The model has no clock.

use super::fault::{Falsifies, Fault};
use super::part::PartState;
use super::settings::{
    CommandShare, FaultEffect, Feed, PlantCommand, PlantSettings, PointId, opening,
};
use crate::scaling::Scaling;

/// The most ticks that one step catches up with. If the process stood still for longer, the rest of
/// that time does not pass for the plant.
const CATCH_UP_MS: u64 = 1000;

/// A plant with its state.
#[derive(Clone, Debug)]
pub struct Model {
    parts: Vec<(usize, PartState)>,
    faults: Vec<Fault>,
    /// Whether a fault was on in the previous tick.
    had_fault: bool,
    /// The points of faults that make the device lost.
    losses: Vec<PointId>,
    commands: Vec<PlantCommand>,
    /// The first point of a fault.
    first_fault: usize,
    inputs: Vec<(usize, Scaling)>,
    output_scaling: Vec<Scaling>,
    /// All points; `before` has their values after the previous tick.
    values: Vec<i32>,
    before: Vec<i32>,
    /// The last outputs to the plant, in the plant's numbers.
    outputs: Vec<i32>,
    /// The time of the last step; `None` before the first step.
    given_ms: Option<u64>,
    /// The time of the last tick.
    time_ms: u64,
}

/// A fault has made the device lost: it supplies no inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lost;

impl Model {
    /// A plant at rest.
    pub fn new(settings: &PlantSettings) -> Model {
        let is_command = |point| settings.commands.iter().any(|command| command.point == point);
        let faults = settings.faults.iter().enumerate();
        let faults = faults.filter_map(|(at, fault)| {
            let seed = settings.seed.wrapping_add(at as u64);
            Fault::new(fault, seed, is_command)
        });
        let lost = |effect: &FaultEffect| matches!(effect, FaultEffect::Lost);
        let losses = settings.faults.iter().filter(|fault| lost(&fault.effect));
        let parts = settings.parts.iter();
        let parts: Vec<_> =
            parts.map(|part| (part.first.0 as usize, PartState::new(&part.kind))).collect();
        let mut values = vec![0; settings.points];
        for (first, part) in &parts {
            part.begin(&mut values[*first..]);
        }
        let inputs = settings.inputs.iter().map(|point| point.0 as usize);
        Model {
            parts,
            faults: faults.collect(),
            had_fault: false,
            losses: losses.map(|fault| fault.when).collect(),
            commands: settings.commands.clone(),
            first_fault: settings.points - settings.faults.len(),
            inputs: inputs.zip(settings.input_scaling.iter().copied()).collect(),
            output_scaling: settings.output_scaling.clone(),
            values,
            before: vec![0; settings.points],
            outputs: vec![0; settings.outputs],
            given_ms: None,
            time_ms: 0,
        }
    }

    /// Moves the plant to the time `now_ms`, which never goes back. The previous outputs apply
    /// until that time; `outputs` apply from then on. Both slices have one value of memory per
    /// point of the device.
    ///
    /// # Errors
    /// A fault makes the device lost; `inputs` stays unchanged.
    pub fn step(&mut self, now_ms: u64, outputs: &[i32], inputs: &mut [i32]) -> Result<(), Lost> {
        let elapsed_ms = self.given_ms.map(|given_ms| now_ms.saturating_sub(given_ms));
        self.given_ms = Some(now_ms);
        let end_ms = self.time_ms + elapsed_ms.unwrap_or(0).min(CATCH_UP_MS);
        while self.time_ms + 1 < end_ms {
            self.time_ms += 1;
            self.tick();
        }
        self.take(outputs);
        if elapsed_ms.is_none() || self.time_ms < end_ms {
            self.time_ms = end_ms;
            self.tick();
        }
        if self.is_lost() {
            return Err(Lost);
        }
        for (input, (point, scaling)) in inputs.iter_mut().zip(&self.inputs) {
            *input = scaling.of_integer(self.values[*point].into());
        }
        Ok(())
    }

    /// Passes outputs to the plant; while the device is lost, only those that turn faults on and
    /// off.
    fn take(&mut self, outputs: &[i32]) {
        let is_lost = self.is_lost();
        let is_fault = |point: PointId| point.0 as usize >= self.first_fault;
        for command in self.commands.iter().filter(|command| !is_lost || is_fault(command.point)) {
            // An output is always the only driver of its command.
            if let Some(&CommandShare { feed: Feed::Output(at), .. }) = command.drives.first()
                && let (Some(known), Some(now)) = (self.outputs.get_mut(at), outputs.get(at))
            {
                let number = self.output_scaling[at].to_integer(*now);
                *known = number.clamp(i32::MIN.into(), i32::MAX.into()) as i32;
            }
        }
    }

    fn is_lost(&self) -> bool {
        self.losses.iter().any(|point| self.values[point.0 as usize] != 0)
    }

    fn tick(&mut self) {
        self.before.copy_from_slice(&self.values);
        for PlantCommand { point, drives } in &self.commands {
            self.values[point.0 as usize] = match drives.as_slice() {
                [drive] => self.driven(drive),
                shares => {
                    let opened = |drive| self.driven(drive).clamp(0, opening::FULL);
                    shares.iter().map(opened).sum::<i32>() / shares.len().max(1) as i32
                }
            };
        }
        // If no fault acts in this tick or acted in the previous one, no fault has a point to
        // falsify or a state to reset.
        let has_fault = self.faults.iter().any(|fault| fault.acts(&self.values));
        let stirs = has_fault || self.had_fault;
        self.had_fault = has_fault;
        if stirs {
            self.falsify(Falsifies::Command);
        }
        for (first, part) in &mut self.parts {
            part.tick(self.time_ms, &mut self.values[*first..]);
        }
        if stirs {
            self.falsify(Falsifies::Report);
        }
    }

    fn driven(&self, CommandShare { feed, gain }: &CommandShare) -> i32 {
        let value = match *feed {
            Feed::Output(at) => self.outputs[at],
            Feed::Point(from) => self.before[from.0 as usize],
            Feed::Fixed(value) => value,
        };
        value.saturating_mul(*gain)
    }

    fn falsify(&mut self, what: Falsifies) {
        for fault in self.faults.iter_mut().filter(|fault| fault.falsifies == what) {
            fault.tick(self.time_ms, &mut self.values, &self.before);
        }
    }
}
