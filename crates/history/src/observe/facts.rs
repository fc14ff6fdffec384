//! Facts about a program that is observed, for the modules that convert a recording.

use super::subject::Subject;
use rungd_engine::isa::status::dst;
use rungd_engine::isa::{Address, Bit, DeviceBit, DeviceId, Word, WordSpace};
use rungd_engine::{self as engine, Cell};
use rungd_language::resolve::program::Program;

impl Subject {
    /// The resolved program.
    pub fn program(&self) -> &Program {
        &self.program
    }

    /// The program in executable form.
    pub fn code(&self) -> &engine::EngineProgram {
        &self.seen
    }

    /// The part of the program that can affect a cell. Its states have the same layout as those of
    /// the program.
    pub fn code_for(&self, cell: Cell) -> engine::EngineProgram {
        self.code_for_all(&[cell])
    }

    /// The part of the program that can affect any of some cells.
    pub fn code_for_all(&self, cells: &[Cell]) -> engine::EngineProgram {
        self.seen.slice(cells).program
    }

    /// The whole program, as a slice.
    pub fn whole_code(&self) -> engine::EngineProgram {
        self.seen.whole().program
    }

    /// Whether an instruction of the program may write a cell.
    pub fn is_driven(&self, cell: Cell) -> bool {
        self.is_written(cell)
    }

    /// The `.Ok` bits of the field devices.
    pub fn well(&self) -> Vec<Cell> {
        let ids = (0..self.program.devices.len() as u32).map(DeviceId);
        let layout = &self.symbols.layout;
        ids.map(|id| Cell::Bit(layout.bit(Bit::Device(id, DeviceBit::Ok)))).collect()
    }

    /// Whether the program names a word of the time of day.
    pub fn reads_time_of_day(&self) -> bool {
        self.program.operands.iter().any(|named| match named.address {
            Address::Word(Word::Space(WordSpace::Dst, n)) => dst::is_of_clock(n),
            Address::Word(_) | Address::Bit(_) | Address::Structure(_) => false,
        })
    }
}
