//! Compares a slice with the whole program: after every call, every cell of the slice has the same
//! value in both. All shipped ladders run with random inputs, writes, forces, stops and starts.

use super::tape::ladder;
use crate::observe::Subject;
use crate::observe::slice_run::SliceRun;
use rungd_engine::isa::{Address, Bit, BitSpace};
use rungd_engine::{BitCell, Cell, Engine, EngineCall, ScanTimes, Slice, WordCell};
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use std::sync::Arc;

/// The number of cells of a ladder that get a slice, and the number of scans.
const CELLS: usize = 40;
const SCANS: u64 = 150;

/// Random numbers, the same on every run.
pub(super) struct Random(pub u64);

impl Random {
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963);
        ((self.0 >> 33) as usize) % end.max(1)
    }
}

/// The TOML files of a folder, in order of their names.
pub(super) fn files(folder: &str) -> Vec<SourceFile> {
    let folder = format!("{}/config/{folder}", concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let entries = std::fs::read_dir(&folder).expect("a folder").flatten();
    let file = |entry: std::fs::DirEntry| SourceFile {
        name: entry.file_name().to_string_lossy().into_owned(),
        text: std::fs::read_to_string(entry.path()).expect("a ladder"),
    };
    let entries = entries.filter(|entry| entry.path().is_file());
    let mut files: Vec<SourceFile> = entries.map(file).collect();
    files.sort_by(|a, b| a.name.cmp(&b.name));
    files
}

/// A ladder with the library.
pub(super) fn subject(file: SourceFile) -> Subject {
    let mut all = files("lib");
    all.push(file);
    let (program, findings) = load_ladders(&all, &LoadOptions::default());
    let program = program.unwrap_or_else(|| panic!("{findings:?}"));
    Subject::new(Arc::new(program), all)
}

/// Blocks, Stages, arrays, a STOP.
pub(super) const BLOCKS: &str = r#"
tags.row = { type = "int", count = 4 }
tags.bits = { type = "bit", count = 8 }
tags.at = { at = "D0", min = 0, max = 5 }

[[program]]
name = "Main"
[[program.rung]]
when = ["X0"]
do = ["RUN Side", "ENTASK Often every=row[at]"]
[[program.rung]]
when = ["X1"]
do = ["HALT Side"]
[[program.rung]]
when = ["X2"]
do = ["RESTART Side"]
[[program.rung]]
when = ["X3"]
do = ["ENTASK Once", "ADD D0 1 to=D0"]
[[program.rung]]
when = ["X7", "X6", "X5"]
do = ["STOP"]
[[program.rung]]
when = ["bits[at]"]
do = ["OUT Y5", "MOVE D1 to=row[at]"]

[[program]]
name = "Side"
[[program.rung]]
when = ["X4"]
do = ["OUT Y0", "TMR T0 preset=row[at]"]
[[program.rung]]
when = ["X5", "!X4"]
do = ["EXIT"]
[[program.stage]]
name = "one"
[[program.stage.rung]]
when = ["X6"]
do = ["JMP two", "OUT Y1"]
[[program.stage]]
name = "two"
[[program.stage.rung]]
when = ["$On"]
do = ["OUT Y2", "SET C1"]
[[program.stage.rung]]
when = ["X7 | T0.Done"]
do = ["JMP one", "MATH D2 = row[at] * D3 / D4"]

[[task]]
name = "Once"
[[task.rung]]
when = ["$On"]
do = ["PD C7", "MOVE 5 to=D3"]
[[task.rung]]
leg.data = ["X0"]
leg.clk = ["X3"]
leg.rst = ["X1"]
do = ["SR bits"]

[[task]]
name = "Often"
[[task.rung]]
when = ["X6"]
do = ["OUT Y4", "ADD D4 1 to=D4"]
[[task.rung]]
when = ["$DivideByZero"]
do = ["SET Y6"]
"#;

/// The public cells; some of the cells that the program writes; the cells that can be written from
/// outside.
pub(super) fn cells(subject: &Subject, random: &mut Random) -> [Vec<Cell>; 3] {
    let layout = &subject.symbols.layout;
    let (bits, words) = (layout.bit_count(), layout.word_count());
    let bits = (0..bits).map(|at| Cell::Bit(BitCell(at)));
    let words = (0..words).map(|at| Cell::Word(WordCell(at)));
    let all: Vec<Cell> = bits.chain(words).collect();
    let mut written: Vec<Cell> = all.iter().copied().filter(|of| subject.is_written(*of)).collect();
    let free = |cell: &Cell| match layout.address(*cell) {
        Some(Address::Bit(Bit::Space(space, _))) => space != BitSpace::St,
        Some(Address::Word(_)) => true,
        Some(Address::Bit(_) | Address::Structure(_)) | None => false,
    };
    let named = subject.program.named(8);
    let named: Vec<Cell> = named.iter().filter_map(|of| layout.cell(of.address)).collect();
    let named: Vec<Cell> = named.into_iter().filter(free).collect();
    while written.len() > CELLS {
        written.swap_remove(random.below(written.len()));
    }
    [all, written, named]
}

/// The calls of a scan before its execution.
pub(super) fn calls(
    scan: u64,
    was_last: bool,
    named: &[Cell],
    random: &mut Random,
) -> Vec<EngineCall> {
    // Two of three scans begin within the same millisecond.
    let now_ns = scan / 3 * 30_000_000 + scan % 3 * 300_000;
    let mut calls = Vec::new();
    if was_last {
        calls.push(EngineCall::Terminate);
    }
    if scan == 0 || was_last {
        calls.push(EngineCall::Start { now_ns });
    }
    calls.push(EngineCall::Begin { now_ns, times: ScanTimes::default(), local_s: 0 });
    for _ in 0..random.below(12) {
        let cell = named[random.below(named.len())];
        let value = match cell {
            Cell::Bit(_) | Cell::WordBit(_) => random.below(2) as i32,
            Cell::Word(_) => [0, 1, 2, 3, 25, 40, 100][random.below(7)],
        };
        calls.push(match random.below(60) {
            0 => EngineCall::Force(cell, value),
            1..=3 => EngineCall::Release(cell),
            _ => EngineCall::Write(cell, value),
        });
    }
    if random.below(90) == 0 {
        calls.push(EngineCall::RequestStop);
    }
    calls
}

/// A slice in two engines: one executes all operations, the other leaves out those that would
/// change nothing.
struct Beside<'s> {
    of: Cell,
    engine: Engine,
    run: SliceRun<&'s Slice>,
    known: Vec<Cell>,
}

impl Beside<'_> {
    fn call(&mut self, call: EngineCall) {
        self.engine.apply(call);
        self.run.call(0, call, None);
    }
}

/// Compares the slices of some cells with the whole program, call by call.
fn compare(name: &str, subject: &Subject, random: &mut Random) {
    let [all, written, named] = cells(subject, random);
    let sliced: Vec<_> = written.iter().map(|of| (*of, subject.seen.slice(&[*of]))).collect();
    let mut slices = Vec::new();
    for (of, slice) in &sliced {
        slices.push(Beside {
            of: *of,
            engine: Engine::new(slice.program.clone()),
            run: SliceRun::new(subject, slice),
            known: all.iter().copied().filter(|cell| slice.knows(*cell)).collect(),
        });
    }
    let mut whole = Engine::new(subject.seen.clone());
    let mut last = false;
    for scan in 0..SCANS {
        for call in calls(scan, last, &named, random) {
            whole.apply(call);
            slices.iter_mut().for_each(|beside| beside.call(call));
        }
        last = whole.execute().last;
        for Beside { of, engine, run, known } in &mut slices {
            assert_eq!(engine.execute().last, last, "{name}: {of:?}, scan {scan}");
            run.call(0, EngineCall::Execute, None);
            for cell in known {
                let right = whole.image().value(*cell);
                for engine in [&*engine, run.engine()] {
                    let value = engine.image().value(*cell);
                    assert_eq!(value, right, "{name}: {cell:?}, slice of {of:?}, scan {scan}");
                }
            }
        }
    }
}

#[test]
fn a_slice_computes_its_cells_as_the_whole_program_does() {
    let mut random = Random(7);
    let mut all = files("programs");
    assert!(all.len() > 8, "the shipped ladders are gone");
    all.push(SourceFile { name: "blocks".into(), text: BLOCKS.into() });
    for file in all {
        compare(&file.name.clone(), &subject(file), &mut random);
    }
}

#[test]
fn a_slice_contains_only_operations_that_can_affect_its_cell() {
    let plc = ladder(BLOCKS);
    let places = |name: &str| plc.subject.seen.slice(&[plc.cell(name)]).places.len();
    let whole = plc.subject.seen.tables.batches.len();
    assert!(places("X0") < whole / 4, "STOP and its contacts alone");
    assert!(places("Y5") < whole / 2);
}
