//! One ladder in three executions: rungd, the interpreter with its export, rungd with the export's
//! import.

use rungd_base::random::SplitMix64;
use rungd_engine::isa::{Address, Bit, BitSpace, Real, Word, WordSpace};
use rungd_engine::{Cell, EngineCall};
use rungd_import::model::Fate;
use rungd_import::names::legal;
use rungd_import::plcopen;
use rungd_lab::export::{ExportedLadder, VariableOfAddress, exported};
use rungd_language::resolve::program::Program;
use rungd_test_support::plc::Plc;

use crate::numbers::below;
use crate::plant;
use crate::plcopen::interpreter::Machine;
use crate::plcopen::values::Value;

/// A ladder that is executed.
pub struct Judge<'j> {
    pub name: &'j str,
    pub program: &'j Program,
    pub scans: u64,
    /// The longest time from a scan to the next one, in ms.
    pub step_ms_max: u64,
}

impl Judge<'_> {
    /// Executes the ladder. Panics at the first difference. `Err`: what is refused.
    pub fn judge(&self, random: &mut SplitMix64) -> Result<(), Vec<String>> {
        let export = match exported(self.program, rungd_base::scan_period::ScanPeriod::DEFAULT) {
            Ok(export) => export,
            Err(refusals) => return Err(refusals.into_iter().map(|one| one.what).collect()),
        };
        let imported = plcopen::read(&export.text).unwrap();
        for rung in &imported.outcome.rungs {
            let name = self.name;
            assert!(!matches!(rung.fate, Fate::Todo(_)), "{name}: {} {:?}", rung.text, rung.fate);
        }
        // Numbers of 64 bits are of 32 bits behind an import, which says so.
        let fates = imported.outcome.rungs.iter().map(|rung| &rung.fate);
        let is_exact = fates.into_iter().all(|fate| *fate == Fate::Exact);
        let mut round = plant::started(&imported);
        let mut plc = started(self.program.clone());
        let mut machine = Machine::new(&export.text);
        let mut now_ms = 0;
        for scan in 0..self.scans {
            plc.engine.begin_scan(now_ms * 1_000_000, &plc.times, &plc.local);
            round.engine.begin_scan(now_ms * 1_000_000, &round.times, &round.local);
            let mut changes = self.changes(&export, &plc, random);
            let clock = export.variables.iter().filter(|place| is_clock(place.address));
            changes.extend(clock.map(|place| {
                let cell = plc.engine.image().value(cell(&plc, place.address));
                Change { place, cell }
            }));
            for change in changes {
                write(&mut plc, change.place.address, change.cell);
                machine.set(&change.place.variable, value(change.place.address, change.cell));
                let cell = round.cell(&legal(&change.place.variable));
                round.engine.apply(EngineCall::Write(cell, change.cell));
            }
            plc.engine.execute();
            round.engine.execute();
            machine.scan(now_ms as i64);
            for place in &export.variables {
                let wanted = plc.engine.image().value(cell(&plc, place.address));
                let found = content(machine.value(&place.variable));
                let again = round.value(&legal(&place.variable)) as i32;
                let VariableOfAddress { variable, address } = place;
                let name = self.name;
                assert_eq!(found, wanted, "{name}: {variable} ({address}) in scan {scan}");
                let is_same = again == wanted || !is_exact;
                assert!(is_same, "{name}: {variable} imported, in scan {scan}: {again}, {wanted}");
            }
            now_ms += 1 + below(random, self.step_ms_max);
        }
        Ok(())
    }

    /// Random writes before a scan.
    fn changes<'e>(
        &self,
        export: &'e ExportedLadder,
        plc: &Plc,
        random: &mut SplitMix64,
    ) -> Vec<Change<'e>> {
        let mut changes = Vec::new();
        for place in &export.variables {
            let is_input = is_input(plc, place.address);
            if below(random, if is_input { 4 } else { 40 }) > 0 {
                continue;
            }
            let cell = match place.address {
                Address::Bit(bit) if bit.writable_by_ladder() || is_input => {
                    below(random, 2) as i32
                }
                Address::Word(word) if word.writable() || is_input => {
                    let (low, high) = plc.symbols.limits(word);
                    let near = below(random, 40) as i32 - 10;
                    let wide = below(random, 1 << 32) as u32 as i32;
                    let real = Real::nearest(near).cell();
                    let value = if word.is_real() { real } else { near };
                    (if below(random, 8) == 0 && !word.is_real() { wide } else { value })
                        .clamp(low, high)
                }
                _ => continue,
            };
            changes.push(Change { place, cell });
        }
        changes
    }
}

/// A write before a scan.
struct Change<'e> {
    place: &'e VariableOfAddress,
    cell: i32,
}

/// Whether a word is one of the time of day, which only rungd writes itself.
fn is_clock(address: Address) -> bool {
    matches!(address, Address::Word(Word::Space(WordSpace::Dst, _)))
}

/// Whether a value comes from outside in all three.
fn is_input(plc: &Plc, address: Address) -> bool {
    match address {
        Address::Bit(bit) => {
            matches!(bit, Bit::Space(BitSpace::X, _) | Bit::Device(..))
        }
        Address::Word(word) => {
            let is_written = plc.program.instructions().any(|(_, instruction)| {
                let targets = instruction.operands.each();
                targets.into_iter().any(|(name, value)| {
                    name == "to" && format!("{value:?}").contains(&format!("{word:?}"))
                })
            });
            matches!(word, Word::Space(..)) && !is_written && !is_clock(address)
        }
        Address::Structure(_) => false,
    }
}

fn write(plc: &mut Plc, address: Address, content: i32) {
    let cell = cell(plc, address);
    match address {
        Address::Bit(Bit::Space(BitSpace::X, number)) => {
            plc.engine.set_input(number, content != 0);
        }
        _ => plc.engine.apply(EngineCall::Write(cell, content)),
    }
}

fn cell(plc: &Plc, address: Address) -> Cell {
    plc.symbols.layout.cell(address).expect("a bit or word has a cell")
}

fn value(address: Address, cell: i32) -> Value {
    match address {
        Address::Bit(_) => Value::Bool(cell != 0),
        Address::Word(word) if word.is_real() => Value::Real(Real::of_cell(cell).number().into()),
        _ => Value::Whole(cell.into()),
    }
}

fn content(value: Value) -> i32 {
    match value {
        Value::Bool(is_on) => i32::from(is_on),
        Value::Whole(value) => value as i32,
        Value::Real(value) => Real::finite(value as f32).unwrap().cell(),
    }
}

fn started(program: Program) -> Plc {
    let mut plc = Plc::of(program);
    plc.engine.start(0);
    plc
}
