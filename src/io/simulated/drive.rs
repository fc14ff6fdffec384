//! The simulated device beside a running controller.

use std::future::Future;
use std::pin::pin;
use std::time::Duration;

use tokio::time::{Instant, MissedTickBehavior, interval};

use super::device::{Device, Rule, Source};
use crate::runtime::exchange::{Port, Snapshot};

/// The device's time from one step to the next.
const STEP: Duration = Duration::from_millis(1);

/// Moves the inputs of the rules until `stop`. They stay as they are then.
pub async fn run(rules: Vec<Rule>, port: Port, stop: impl Future<Output = ()>) {
    let mut device = Device::new(&rules);
    let mut stop = pin!(stop);
    let mut tick = interval(STEP);
    tick.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let started = Instant::now();
    loop {
        tokio::select! {
            () = &mut stop => return,
            _ = tick.tick() => {}
        }
        let now_ms = started.elapsed().as_millis() as u64;
        let seen = port.latest();
        for (x, on) in device.step(now_ms, |source| read(&seen, source)) {
            port.set_input(x, on);
        }
    }
}

fn read(seen: &Snapshot, source: Source) -> bool {
    match source {
        Source::Output(y) => seen.outputs[y as usize] != 0,
        Source::Image(cell) => seen.bit(cell),
    }
}
