//! The model of a plant: one step of it.
//!
//! Time goes in ticks of a millisecond, however far apart the steps are, so that the same commands
//! at the same times give the same plant. In a tick every command takes the value of what drives
//! it as the tick before left it; then every part moves: the order of the parts means nothing.
//! Numbers are integers, and nothing is rounded on the way. No clock.

use super::fault::{Falsifies, Fault};
use super::part::Part;
use super::settings::{Command, Effect, Feed, Plant, PointId};

/// The most ticks that a step catches up with: a process that was held up for longer finds its
/// plant as if that had stood still too.
const CATCH_UP_MS: u64 = 1000;

/// A plant with its state.
#[derive(Clone, Debug)]
pub struct Model {
    parts: Vec<(usize, Part)>,
    faults: Vec<Fault>,
    /// Faults by which the device is lost.
    losses: Vec<PointId>,
    commands: Vec<Command>,
    /// The first point of a fault.
    first_fault: usize,
    inputs: Vec<usize>,
    /// All points, and as the tick before left them.
    values: Vec<i32>,
    before: Vec<i32>,
    /// What goes out to the plant, as it came last.
    outputs: Vec<i32>,
    /// The time as given last; nothing before the first step.
    given_ms: Option<u64>,
    /// The time of the last tick.
    time_ms: u64,
}

/// The device is lost, as a fault wants it: nothing comes in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lost;

impl Model {
    /// A plant at rest.
    pub fn new(settings: &Plant) -> Model {
        let is_command = |point| settings.commands.iter().any(|command| command.point == point);
        let faults = settings.faults.iter().enumerate();
        let faults = faults.filter_map(|(at, fault)| {
            let seed = settings.seed.wrapping_add(at as u64);
            Fault::new(fault, seed, is_command)
        });
        let lost = |effect: &Effect| matches!(effect, Effect::Lost);
        let losses = settings.faults.iter().filter(|fault| lost(&fault.effect));
        let parts = settings.parts.iter();
        let parts: Vec<_> =
            parts.map(|part| (part.first.0 as usize, Part::new(&part.kind))).collect();
        let mut values = vec![0; settings.points];
        for (first, part) in &parts {
            part.begin(&mut values[*first..]);
        }
        Model {
            parts,
            faults: faults.collect(),
            losses: losses.map(|fault| fault.when).collect(),
            commands: settings.commands.clone(),
            first_fault: settings.points - settings.faults.len(),
            inputs: settings.inputs.iter().map(|point| point.0 as usize).collect(),
            values,
            before: vec![0; settings.points],
            outputs: vec![0; settings.outputs],
            given_ms: None,
            time_ms: 0,
        }
    }

    /// Moves the plant on to a time, which never goes back: with the outputs as they were until
    /// then, and as they are now. Both slices are one value a point of the device.
    ///
    /// # Errors
    /// A fault wants the device to be lost; inputs stay as they are.
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
        for (input, point) in inputs.iter_mut().zip(&self.inputs) {
            *input = self.values[*point];
        }
        Ok(())
    }

    /// Outputs reach the plant; of a lost one, those by which faults are brought about.
    fn take(&mut self, outputs: &[i32]) {
        if !self.is_lost() {
            let many = self.outputs.len().min(outputs.len());
            return self.outputs[..many].copy_from_slice(&outputs[..many]);
        }
        let commands = self.commands.iter();
        for command in commands.filter(|command| command.point.0 as usize >= self.first_fault) {
            if let Feed::Output(at) = command.feed
                && let (Some(known), Some(now)) = (self.outputs.get_mut(at), outputs.get(at))
            {
                *known = *now;
            }
        }
    }

    fn is_lost(&self) -> bool {
        self.losses.iter().any(|point| self.values[point.0 as usize] != 0)
    }

    fn tick(&mut self) {
        self.before.copy_from_slice(&self.values);
        for Command { point, feed, gain } in &self.commands {
            let value = match *feed {
                Feed::Output(at) => self.outputs[at],
                Feed::Point(from) => self.before[from.0 as usize],
                Feed::Fixed(value) => value,
            };
            self.values[point.0 as usize] = value.saturating_mul(*gain);
        }
        self.falsify(Falsifies::Command);
        for (first, part) in &mut self.parts {
            part.tick(self.time_ms, &mut self.values[*first..]);
        }
        self.falsify(Falsifies::Report);
    }

    fn falsify(&mut self, what: Falsifies) {
        for fault in self.faults.iter_mut().filter(|fault| fault.falsifies == what) {
            fault.tick(self.time_ms, &mut self.values, &self.before);
        }
    }
}
