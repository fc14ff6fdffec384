//! The status bits that are computed at the top of the program: clock bits, and the time since the
//! last scan, which they and the timers need.

use super::functions::{self, call_of_two, number, of_two};
use super::library::LibraryBlock;
use super::memory::ExportMemory;
use super::project::{
    BlockCall, CallResult, CoilAction, ExportedNetwork, NetworkBody, NetworkCoil, NetworkPower, off,
};
use rungd_engine::isa::status::st;

/// A clock bit.
struct ClockBit {
    number: u32,
    name: &'static str,
    period_ms: i64,
}

/// The clock bits, by their numbers.
const CLOCK_BITS: [ClockBit; 4] = [
    ClockBit { number: st::ONE_MINUTE, name: "OneMinute", period_ms: 60_000 },
    ClockBit { number: st::ONE_SECOND, name: "OneSecond", period_ms: 1000 },
    ClockBit { number: st::HUNDRED_MS, name: "HundredMs", period_ms: 100 },
    ClockBit { number: st::FIFTY_MS, name: "FiftyMs", period_ms: 50 },
];
/// The variable of `$ScanToggle`.
const TOGGLE: &str = "ScanToggle";

/// The variable of a status bit; `None`, if it is not exported.
pub(super) fn variable(memory: &mut ExportMemory<'_>, bit: u32) -> Option<String> {
    match bit {
        st::FIRST_SCAN => Some(memory.shared("FirstScan", "BOOL")),
        st::SCAN_TOGGLE => {
            memory.shared("FirstScan", "BOOL");
            Some(memory.shared(TOGGLE, "BOOL"))
        }
        bit => {
            let found = CLOCK_BITS.iter().find(|clock| clock.number == bit)?;
            memory.shared("Elapsed", "DINT");
            Some(memory.shared(found.name, "BOOL"))
        }
    }
}

/// The networks before all others.
pub(super) fn top(memory: &mut ExportMemory<'_>) -> Vec<ExportedNetwork> {
    let mut networks = Vec::new();
    let mut push = |doc: &str, body| {
        networks.push(ExportedNetwork { doc: doc.to_owned(), body });
    };
    if memory.has_shared("Elapsed") {
        let block = LibraryBlock::Clock;
        let instance = Some(memory.instance("Clock", block));
        let call = BlockCall { type_name: block.name().to_owned(), instance, inputs: Vec::new() };
        let variable = memory.shared("Elapsed", "DINT");
        let results = vec![CallResult { pin: "Elapsed", variable, is_coil: false }];
        push("Whole ms since the last scan", NetworkBody::Call { call, results });
    }
    for clock in CLOCK_BITS {
        if !memory.has_shared(clock.name) {
            continue;
        }
        let elapsed = memory.shared("Elapsed", "DINT");
        let phase = memory.fresh(&format!("{}_phase", clock.name), "DINT");
        let sum = of_two("ADD", functions::variable(&phase), functions::variable(&elapsed));
        let call = call_of_two("MOD", sum, number(clock.period_ms));
        let results = vec![CallResult { pin: "OUT", variable: phase.clone(), is_coil: false }];
        push(clock.name, NetworkBody::Call { call, results });
        let call = call_of_two("LT", functions::variable(&phase), number(clock.period_ms / 2));
        let variable = memory.shared(clock.name, "BOOL");
        let results = vec![CallResult { pin: "OUT", variable, is_coil: true }];
        push("", NetworkBody::Call { call, results });
    }
    if memory.has_shared(TOGGLE) {
        let (toggle, first) = (memory.shared(TOGGLE, "BOOL"), memory.shared("FirstScan", "BOOL"));
        let power = NetworkPower::all([off(&toggle), off(&first)]);
        let coil = NetworkCoil {
            power: NetworkPower::Constant(true),
            variable: toggle,
            action: CoilAction::Assign,
        };
        push(TOGGLE, NetworkBody::Coils { power, coils: vec![coil] });
    }
    networks
}
