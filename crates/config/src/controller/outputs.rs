//! What the outputs of a controller are driven to: in RUN the bits of memory, outside RUN the safe
//! values; and which of them hang on a device that is lost.
//!
//! The one rule for every place that shows a Y of a recorded scan: pages, trends, `why`, metrics.
//! The running controller itself drives `Snapshot::outputs`, by the same [`SafeState`]; it knows
//! more about a lost device than its log, and `daemon::operator_server` shows that.

use std::collections::HashMap;

use super::settings::Controller;
use rungd_engine::isa::{Address, Bit, BitSpace, DeviceBit};
use rungd_engine::{BitCell, Cell};
use rungd_language::lower::Symbols;
use rungd_runtime::SafeState;
use rungd_runtime::exchange::Mode;

/// The state of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputState {
    /// In RUN: it has the value of its bit in memory.
    AsMemory,
    /// Outside RUN: it has its safe value.
    Safe(bool),
    /// Its device is lost, so its state is not known: the last one that is known.
    Unknown(Option<bool>),
}

impl OutputState {
    /// The words for the state, after a separator; empty if memory shows it.
    pub fn text(self, separator: &str) -> String {
        let word = |on| if on { "ON" } else { "OFF" };
        match self {
            OutputState::AsMemory => String::new(),
            OutputState::Safe(on) => format!("{separator}output {}", word(on)),
            OutputState::Unknown(Some(last)) => {
                format!("{separator}output not known, last {}", word(last))
            }
            OutputState::Unknown(None) => format!("{separator}output not known"),
        }
    }

    /// As [`OutputState::text`], where there is room for `safe value`.
    pub fn long_text(self, separator: &str) -> String {
        let text = self.text(separator);
        match self {
            OutputState::Safe(_) => format!("{text} (safe value)"),
            OutputState::AsMemory | OutputState::Unknown(_) => text,
        }
    }
}

/// The content of an output whose state is not known, in place of 0 and 1.
pub const OUTPUT_UNKNOWN: i32 = -1;

/// The rules of one program and its controller file.
#[derive(Clone, Debug, Default)]
pub struct OutputRules {
    /// The cell of Y0; Y1 and so on follow it.
    first: u32,
    safe: Vec<SafeState>,
    /// The devices that an output is wired to, each as the cell of its `.Ok`.
    devices: HashMap<u32, Vec<BitCell>>,
}

impl OutputRules {
    /// The rules of a controller file; without one every output is OFF outside RUN.
    pub fn of(controller: Option<&Controller>, symbols: &Symbols) -> OutputRules {
        let layout = &symbols.layout;
        let count = layout.sizes().y;
        let safe = controller.map_or_else(
            || vec![SafeState::Off; count as usize],
            |controller| controller.safe_values(count),
        );
        let mut devices: HashMap<u32, Vec<BitCell>> = HashMap::new();
        for device in controller.map_or(&[][..], |controller| &controller.devices) {
            let ok = layout.bit(Bit::Device(device.id, DeviceBit::Ok));
            for output in &device.outputs {
                if let Address::Bit(Bit::Space(BitSpace::Y, n)) = output.address {
                    devices.entry(n).or_default().push(ok);
                }
            }
        }
        let first = layout.bit(Bit::Space(BitSpace::Y, 0)).0;
        OutputRules { first, safe, devices }
    }

    /// The number of the output of a cell; `None`: the cell is no Y.
    pub fn number(&self, cell: Cell) -> Option<u32> {
        let Cell::Bit(BitCell(at)) = cell else { return None };
        at.checked_sub(self.first).filter(|n| (*n as usize) < self.safe.len())
    }

    /// The bits `.Ok` of the devices that the output of a cell is wired to.
    pub fn devices(&self, cell: Cell) -> &[BitCell] {
        let devices = self.number(cell).and_then(|n| self.devices.get(&n));
        devices.map_or(&[], Vec::as_slice)
    }

    /// Whether the device of the output of a cell is lost. `bit`: the bits of memory.
    pub fn is_lost(&self, cell: Cell, bit: impl Fn(BitCell) -> bool) -> bool {
        self.devices(cell).iter().any(|ok| !bit(*ok))
    }

    /// Whether an output keeps its value outside RUN.
    pub fn is_held(&self, cell: Cell) -> bool {
        self.number(cell).is_some_and(|n| self.safe[n as usize] == SafeState::Hold)
    }

    /// What a cell with a content in memory is driven to in a mode, or [`OUTPUT_UNKNOWN`]; the
    /// content of any other cell stays. `bit`: the bits of memory.
    pub fn shown(
        &self,
        cell: Cell,
        content: i32,
        mode: Mode,
        bit: impl Fn(BitCell) -> bool,
    ) -> i32 {
        if self.is_lost(cell, bit) { OUTPUT_UNKNOWN } else { self.driven(cell, mode, content) }
    }

    /// What a cell is driven to in a mode, if it is a Y and its device is well; any other content
    /// stays. `held`: its bit in memory.
    pub fn driven(&self, cell: Cell, mode: Mode, held: i32) -> i32 {
        match self.number(cell) {
            Some(n) if mode != Mode::Run => self.safe[n as usize].driven(held != 0).into(),
            Some(_) | None => held,
        }
    }
}
