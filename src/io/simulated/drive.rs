//! The simulated device beside a running controller.

use std::future::Future;
use std::pin::pin;
use std::time::Duration;

use tokio::time::{Instant, MissedTickBehavior, interval};

use super::device::Device;
use crate::engine::Layout;
use crate::isa::{Bit, BitSpace};
use crate::runtime::exchange::Port;

/// The device's time from one step to the next.
const STEP: Duration = Duration::from_millis(1);

/// Moves the inputs of the rules until `stop`. They stay as they are then.
///
/// A Y is read as driven, since a plant feels the safe values too; any other bit as the last
/// complete scan left it.
pub async fn run(mut device: Device, layout: Layout, port: Port, stop: impl Future<Output = ()>) {
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
        let read = |bit| match bit {
            Bit::Space(BitSpace::Y, n) => seen.outputs[n as usize] != 0,
            other => seen.bit(layout.bit(other)),
        };
        for (x, on) in device.step(now_ms, read) {
            port.set_input(x, on);
        }
    }
}
