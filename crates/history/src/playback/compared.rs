//! Compares two programs scan by scan: which operands differ, the first time, how often, and for
//! how long.
//!
//! `rungd replay --ladder` executes both programs by a [`TwinRun`](super::TwinRun) and calls this
//! module after each scan. An operand is looked up in each program separately: an output by its
//! address, an alarm or a watched operand by its name.

use std::collections::HashSet;

use super::programs::{PlayableProgram, RecordedPrograms};
use super::replay::PlayedScan;
use super::twin_run::TwinScan;
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Bit, BitSpace, Real};

/// The maximum number of elements of an array that count as outputs.
const ELEMENTS_MAX: usize = 2048;

/// The reason why an operand is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComparedAs {
    /// An output of a device, or a Y.
    Output,
    /// The bit of an alarm.
    Alarm,
    /// The command names it.
    Watched,
}

/// An operand of both programs.
#[derive(Debug)]
pub struct ComparedOperand {
    /// Its text in the report.
    pub label: String,
    /// Its name in commands.
    pub name: String,
    /// Why it is compared.
    pub compared_as: ComparedAs,
    /// Its cell in each recorded program.
    old: Vec<Option<Cell>>,
    new: Option<Cell>,
    /// Whether it is a word that holds a real.
    pub real: bool,
    /// Its first difference.
    pub first: Option<FirstDifference>,
    /// How often it began to differ.
    pub times: u64,
    /// The scans in which it differs.
    pub scans: u64,
    /// The time for which it differs, ns.
    pub ns: i64,
    /// The beginning of the present difference; `None` if both values are the same.
    since_ns: Option<i64>,
}

/// The first difference of an operand.
#[derive(Clone, Copy, Debug)]
pub struct FirstDifference {
    /// Its scan.
    pub scan: PlayedScan,
    old: i32,
    new: i32,
}

/// All operands that are compared.
#[derive(Debug)]
pub struct ProgramComparison {
    /// The operands.
    pub operands: Vec<ComparedOperand>,
    /// The values of the last scan: the old and the new value of each operand.
    pub values: Vec<i32>,
}

/// The names of a compared operand.
struct ComparedName {
    /// Its text in the report.
    label: String,
    /// Its name in commands.
    name: String,
    compared_as: ComparedAs,
}

impl ComparedOperand {
    /// An operand with its cells: in each recorded program, and in the new `program`.
    fn new(
        ComparedName { label, name, compared_as }: ComparedName,
        old: Vec<Option<Cell>>,
        new: Option<Cell>,
        program: &PlayableProgram,
    ) -> ComparedOperand {
        let is_real = |cell| matches!(cell, Cell::Word(word) if program.layout().is_real(word));
        let real = new.or(old.iter().find_map(|cell| *cell)).is_some_and(is_real);
        let (first, since_ns) = (None, None);
        let (times, scans, ns) = (0, 0, 0);
        ComparedOperand {
            label,
            name,
            compared_as,
            old,
            new,
            real,
            first,
            times,
            scans,
            ns,
            since_ns,
        }
    }

    /// Its cell in the new program, or else in a recorded one.
    pub fn cell(&self) -> Option<Cell> {
        self.new.or(self.old.iter().find_map(|cell| *cell))
    }

    /// The texts of the old and the new value at the first difference, if it differs.
    pub fn first_texts(&self) -> Option<[String; 2]> {
        let FirstDifference { old, new, .. } = self.first?;
        let cell = self.old.iter().find_map(|cell| *cell);
        Some([self.text(old, cell), self.text(new, self.new)])
    }

    fn text(&self, content: i32, cell: Option<Cell>) -> String {
        match cell {
            None => "absent".to_owned(),
            Some(Cell::Bit(_) | Cell::WordBit(_)) => {
                if content != 0 { "ON" } else { "OFF" }.to_owned()
            }
            Some(Cell::Word(_)) if self.real => Real::of_cell(content).to_string(),
            Some(Cell::Word(_)) => content.to_string(),
        }
    }

    fn look(&mut self, old: i32, new: i32, scan: &PlayedScan) {
        if old == new {
            self.close(scan.unix_ns);
            return;
        }
        self.scans += 1;
        self.first.get_or_insert(FirstDifference { scan: *scan, old, new });
        if self.since_ns.is_none() {
            self.times += 1;
            self.since_ns = Some(scan.unix_ns);
        }
    }

    fn close(&mut self, now_ns: i64) {
        if let Some(since_ns) = self.since_ns.take() {
            self.ns = self.ns.saturating_add(now_ns.saturating_sub(since_ns).max(0));
        }
    }
}

impl ProgramComparison {
    /// The outputs and alarms of the programs, and the watched operands.
    ///
    /// # Errors
    /// No program has a watched operand: the command line is wrong.
    pub fn of(
        programs: &RecordedPrograms,
        new: &PlayableProgram,
        watch: Option<&[String]>,
    ) -> Result<ProgramComparison, String> {
        let mut operands = outputs(programs, new);
        operands.extend(mapped_words(programs, new));
        operands.extend(alarms(programs, new));
        for name in watch.unwrap_or_default() {
            let name = name.trim().to_owned();
            let old: Vec<_> = each(programs, |program| program.cell(&name));
            let here = new.cell(&name);
            if here.is_none() && old.iter().all(Option::is_none) {
                return Err(format!("--watch: neither program has a bit or word `{name}`"));
            }
            let compared_as = ComparedAs::Watched;
            let label = ComparedName { label: name.clone(), name, compared_as };
            operands.push(ComparedOperand::new(label, old, here, new));
        }
        Ok(ProgramComparison { operands, values: Vec::new() })
    }

    /// Compares both images at the end of a scan.
    pub fn look(&mut self, seen: &TwinScan<'_>) {
        let (old, new) = (seen.old.image(), seen.new.image());
        self.values.clear();
        for operand in &mut self.operands {
            let cell = operand.old.get(seen.place).copied().flatten();
            // An operand that a program does not have counts as 0.
            let [old, new] = [(old, cell), (new, operand.new)]
                .map(|(image, cell)| cell.map_or(0, |cell| image.value(cell)));
            operand.look(old, new, &seen.scan);
            self.values.extend([old, new]);
        }
    }

    /// Ends all present differences, because a stretch of the recording ends.
    pub fn end(&mut self, now_ns: i64) {
        self.operands.iter_mut().for_each(|operand| operand.close(now_ns));
    }
}

fn each(
    programs: &RecordedPrograms,
    cell: impl Fn(&PlayableProgram) -> Option<Cell>,
) -> Vec<Option<Cell>> {
    programs.all.iter().map(|program| program.as_ref().ok().and_then(&cell)).collect()
}

fn output(programs: &RecordedPrograms, new: &PlayableProgram, address: Address) -> ComparedOperand {
    let mut both = std::iter::once(new).chain(programs.first());
    let tag = both.find_map(|program| program.symbols.names.tag(address));
    let label = tag.map_or_else(|| address.to_string(), |tag| format!("{tag} ({address})"));
    let name = tag.map_or_else(|| address.to_string(), str::to_owned);
    let old = each(programs, |program| program.layout().cell(address));
    let label = ComparedName { label, name, compared_as: ComparedAs::Output };
    ComparedOperand::new(label, old, new.layout().cell(address), new)
}

/// Every Y that a ladder names or a device outputs, in order.
fn outputs(programs: &RecordedPrograms, new: &PlayableProgram) -> Vec<ComparedOperand> {
    let mut numbers = HashSet::new();
    for program in std::iter::once(new).chain(programs.all.iter().flatten()) {
        let named = program.program.named(ELEMENTS_MAX).into_iter().map(|operand| operand.address);
        for address in named.chain(taken(program).into_iter().flatten()) {
            if let Address::Bit(Bit::Space(BitSpace::Y, number)) = address {
                numbers.insert(number);
            }
        }
    }
    let mut numbers: Vec<u32> = numbers.into_iter().collect();
    numbers.sort_unstable();
    let address = |number| Address::Bit(Bit::Space(BitSpace::Y, number));
    numbers.into_iter().map(|number| output(programs, new, address(number))).collect()
}

/// The addresses that devices output, device by device.
fn taken(program: &PlayableProgram) -> Vec<Vec<Address>> {
    let devices = program.loaded.controller.iter().flat_map(|controller| &controller.devices);
    devices.map(|device| device.outputs.iter().map(|output| output.address).collect()).collect()
}

/// The words and other bits that devices output. Both programs have the same controller file, so
/// the points are paired by their places in it: the address of a tag may differ.
fn mapped_words(programs: &RecordedPrograms, new: &PlayableProgram) -> Vec<ComparedOperand> {
    let mut all = Vec::new();
    for (device, addresses) in taken(new).iter().enumerate() {
        for (point, address) in addresses.iter().enumerate() {
            if matches!(address, Address::Bit(Bit::Space(BitSpace::Y, _))) {
                continue;
            }
            let mut operand = output(programs, new, *address);
            operand.old = each(programs, |program| {
                let address = *taken(program).get(device)?.get(point)?;
                program.layout().cell(address)
            });
            all.push(operand);
        }
    }
    let mut seen = HashSet::new();
    all.retain(|operand| seen.insert(operand.label.clone()));
    all
}

/// The alarms of both programs, by their tags.
fn alarms(programs: &RecordedPrograms, new: &PlayableProgram) -> Vec<ComparedOperand> {
    let mut tags: Vec<&str> = Vec::new();
    let mut seen = HashSet::new();
    for program in programs.all.iter().flatten().chain([new]) {
        let own = program.symbols.alarms.iter().map(|alarm| alarm.tag.as_str());
        tags.extend(own.filter(|tag| seen.insert(*tag)));
    }
    let cell = |program: &PlayableProgram, tag: &str| {
        let alarm = program.symbols.alarms.iter().find(|alarm| alarm.tag == tag)?;
        Some(alarm.bit)
    };
    let compared = |tag: &str| {
        let old = each(programs, |program| cell(program, tag));
        let (label, name) = (tag.to_owned(), tag.to_owned());
        let label = ComparedName { label, name, compared_as: ComparedAs::Alarm };
        ComparedOperand::new(label, old, cell(new, tag), new)
    };
    tags.into_iter().map(compared).collect()
}
