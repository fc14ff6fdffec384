//! Runs the rules of `[[simulated-device]]` beside a controller, with a step every millisecond.

use std::future::Future;
use std::pin::pin;
use std::time::Duration;

use tokio::time::{Instant, MissedTickBehavior, interval};

use super::rules::RuleSet;
use super::settings::InputRule;
use rungd_engine::Layout;
use rungd_engine::isa::{Bit, BitSpace};
pub use rungd_runtime::Generations;
use rungd_runtime::exchange::Port;

/// The time between two steps.
const STEP: Duration = Duration::from_millis(1);

/// The rules for a program, and the program's layout, which has the cells of their bits.
#[derive(Clone, Debug)]
pub struct Rules {
    rules: Vec<InputRule>,
    layout: Layout,
}

impl Rules {
    /// The rules of a controller file, for its program's layout.
    pub fn new(rules: &[InputRule], layout: &Layout) -> Rules {
        Rules { rules: rules.to_vec(), layout: layout.clone() }
    }
}

/// A device that has taken its first step; [`PlantDrive::run`] takes all further steps.
pub struct PlantDrive {
    device: RuleSet,
    programs: Generations<Rules>,
    /// The program whose rules are in use.
    generation: u32,
    layout: Layout,
    port: Port,
    started: Instant,
}

impl PlantDrive {
    /// Takes the device's first step at once, before the first scan, so that this scan sees its
    /// inputs.
    pub fn new(programs: Generations<Rules>, port: Port) -> PlantDrive {
        let first = programs.of_generation(0);
        let (device, layout) = (RuleSet::new(&first.rules), first.layout.clone());
        let mut drive =
            PlantDrive { device, programs, generation: 0, layout, port, started: Instant::now() };
        drive.step();
        drive
    }

    /// Moves the inputs of the rules until `stop`. Afterwards the inputs keep their values.
    pub async fn run(mut self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        let mut tick = interval(STEP);
        tick.set_missed_tick_behavior(MissedTickBehavior::Skip);
        loop {
            tokio::select! {
                () = &mut stop => return,
                _ = tick.tick() => {}
            }
            self.step();
        }
    }

    /// Takes one step. For a Y, the rules read the value of the output, because a plant receives
    /// the safe values too. For any other bit, they read its value after the last complete scan.
    fn step(&mut self) {
        let now_ms = self.started.elapsed().as_millis() as u64;
        let (seen, now) = self.programs.latest(&self.port);
        if seen.generation != self.generation {
            self.device = self.device.going_on(&now.rules);
            (self.generation, self.layout) = (seen.generation, now.layout.clone());
        }
        let layout = &self.layout;
        let read = |bit| {
            if let Bit::Space(BitSpace::Y, n) = bit {
                return seen.outputs[n as usize] != 0;
            }
            seen.value(layout.bit_in(bit)) != 0
        };
        for (x, on) in self.device.step(now_ms, read) {
            self.port.set_input(x, on);
        }
    }
}
