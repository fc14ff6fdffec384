//! A program for the rig: lowered once, for any number of runs.

use std::sync::Arc;

use crate::controller::Controller;
use crate::engine;
use crate::lower::{Symbols, lower};
use crate::resolve::program::Program;
use crate::retain::RetainPlan;
use crate::runtime::Safe;
use crate::runtime::wiring::Wiring;

/// A program with its settings, ready to run.
#[derive(Debug)]
pub struct RigProgram {
    pub(super) code: engine::Program,
    /// Its names and cells.
    pub symbols: Arc<Symbols>,
    /// The settings.
    pub controller: Arc<Controller>,
    pub(super) wirings: Vec<Wiring>,
    pub(super) safe: Vec<Safe>,
    pub(super) plan: RetainPlan,
}

impl RigProgram {
    /// Lowers a program that has no errors.
    pub fn new(program: &Program, controller: &Arc<Controller>) -> RigProgram {
        let (code, symbols) = lower(program);
        RigProgram {
            wirings: controller.wirings(&symbols),
            safe: controller.safe_values(program.sizes.y),
            plan: RetainPlan::new(&controller.retain, program, &symbols),
            controller: Arc::clone(controller),
            symbols: Arc::new(symbols),
            code,
        }
    }
    /// The scan period, ns.
    pub fn period_ns(&self) -> u64 {
        u64::from(self.controller.period_ms) * 1_000_000
    }
}
