//! When a test turns `.Stale` of a lost device ON: as the field devices of a rig do it
//! (`crates/lab/src/rig/field.rs`).
//!
//! For `stretched`. A device exchanges at each multiple of `poll`, and when one of its inputs is
//! set. It is stale when its last exchange is older than `loss-after`. A device without settings is
//! stale as soon as it is lost, and never waits.

use crate::named_input::InputSetting;
use crate::question::Questions;
use rungd_engine::Cell;
use rungd_engine::isa::{Bit, DeviceBit, DeviceId};

/// A device whose `.Stale` is free in a model, in a test.
#[derive(Clone, Debug)]
pub(crate) struct DeviceWait {
    /// The place of `.Ok` among the choices of a scan.
    ok: usize,
    /// The place of `.Stale`.
    stale: usize,
    /// The places of its inputs.
    inputs: Vec<usize>,
    poll_ms: u64,
    loss_after_ms: u64,
    /// The values of its inputs in the last scan.
    brought: Vec<i32>,
    is_there: bool,
    /// The time of its last exchange, or that of the start of the process, ms.
    good_ms: u64,
    /// The time of its next exchange, ms.
    next_ms: u64,
}

impl DeviceWait {
    /// All of them.
    pub fn all(questions: &Questions) -> Vec<DeviceWait> {
        let model = &questions.model;
        let place = |cell: Cell| model.inputs.iter().position(|input| input.cell == cell);
        let bit = |id: DeviceId, bit| {
            place(Cell::Bit(model.code.layout.bit(Bit::Device(id, bit)))).filter(|at| {
                let setting = &questions.inputs[*at].setting;
                matches!(setting, InputSetting::Device(_) | InputSetting::Follows)
            })
        };
        let devices = questions.suite.programs[0].controller.devices.iter();
        let device = devices.filter_map(|device| {
            let [ok, stale] = [DeviceBit::Ok, DeviceBit::Stale].map(|name| bit(device.id, name));
            let cells = device.inputs.iter();
            let cells = cells.filter_map(|input| model.code.layout.cell(input.address));
            let inputs: Vec<usize> = cells.filter_map(place).collect();
            Some(DeviceWait {
                ok: ok?,
                stale: stale?,
                brought: vec![0; inputs.len()],
                inputs,
                poll_ms: u64::from(device.poll_ms.max(1)),
                loss_after_ms: device.loss_after_ms.into(),
                is_there: true,
                good_ms: 0,
                next_ms: 0,
            })
        });
        device.collect()
    }

    /// Whether a test turns its `.Stale` ON in a scan at this time, if it is lost.
    fn is_stale(&self, now_ms: u64) -> bool {
        now_ms.saturating_sub(self.good_ms) > self.loss_after_ms
    }

    /// Whether a scan at this time needs its `.Stale` sooner than a test turns it ON.
    pub fn has_to_wait(&self, choices: &[i32], now_ms: u64) -> bool {
        choices[self.ok] == 0 && choices[self.stale] != 0 && !self.is_stale(now_ms)
    }

    /// Gives a scan at this time the bits of the device while a scan with these choices waits.
    pub fn put(&self, quiet: &mut [i32], choices: &[i32], now_ms: u64) {
        quiet[self.ok] = choices[self.ok];
        quiet[self.stale] = i32::from(choices[self.ok] == 0 && self.is_stale(now_ms));
    }

    /// A scan is executed at this time.
    pub fn scan(&mut self, choices: &[i32], now_ms: u64) {
        let is_there = choices[self.ok] != 0;
        let brought: Vec<i32> = self.inputs.iter().map(|at| choices[*at]).collect();
        if is_there && (!self.is_there || brought != self.brought) {
            self.next_ms = self.next_ms.min(now_ms);
        }
        (self.is_there, self.brought) = (is_there, brought);
        while self.next_ms <= now_ms {
            if is_there {
                self.good_ms = self.next_ms;
            }
            self.next_ms += self.poll_ms;
        }
    }

    /// A new process begins at this time.
    pub fn begin_process(&mut self, now_ms: u64) {
        (self.good_ms, self.next_ms) = (now_ms, now_ms);
    }
}
