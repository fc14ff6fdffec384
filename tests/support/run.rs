//! Loads a ladder, runs it in the simulator, and compares the result with a case.

use std::io;

use rungd_engine::isa::{Address, Bit, BitSpace, Word};
use rungd_engine::{Cell, Image, Layout};
use rungd_lab::traces::stimulus::{Stimulus, StimulusTarget};
use rungd_lab::traces::trace::{RowName as TraceRow, Trace};
use rungd_language::check::{CheckInputs, check};
use rungd_language::lower::{Symbols, lower, lower_with};
use rungd_language::resolve::program::Program;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::finding::{Finding, Severity};
use rungd_language::source::span::SourceFile;

use super::bare_run::{Plan, run};
use super::case::{Case, Expects};
use super::table::{RowName, Table};

/// The result of one test.
pub struct Outcome {
    pub test: String,
    /// The differences from the expected values; empty if the test passed.
    pub wrong: Vec<String>,
}

/// Loads a ladder; `Err` is all its errors in one text.
pub fn load(ladder: &str) -> Result<Program, String> {
    let file = SourceFile { name: "case.toml".into(), text: ladder.into() };
    let (program, mut findings) = load_ladders(&[file], &LoadOptions::default());
    if let Some(program) = &program {
        findings.extend(check(program, CheckInputs::of(&[])));
    }
    findings.retain(|finding| finding.severity() == Severity::Error);
    let line = |f: &Finding| format!("{}: {}", f.code.name(), f.message);
    let errors = findings.iter().map(line).collect::<Vec<_>>().join("\n");
    program.filter(|_| errors.is_empty()).ok_or(errors)
}

/// The cell of an operand.
pub fn cell(program: &Program, symbols: &Symbols, name: &str) -> Result<Cell, String> {
    let address = program.scope().address(name)?;
    symbols.layout.cell(address).ok_or_else(|| format!("`{name}` is no bit and no word"))
}

/// The target of a stimulus; `Err` if the operand cannot be written.
pub fn target(program: &Program, symbols: &Symbols, name: &str) -> Result<StimulusTarget, String> {
    match program.scope().address(name)? {
        Address::Bit(Bit::Space(BitSpace::X, n)) => Ok(StimulusTarget::Input(n)),
        Address::Bit(bit) if bit.writable_from_outside() => {
            Ok(StimulusTarget::Bit(symbols.layout.bit_in(bit)))
        }
        Address::Word(word) if Word::writable(word) => {
            let (min, max) = symbols.limits(word);
            Ok(StimulusTarget::word(word, symbols.layout.word(word), min, max))
        }
        _ => Err(format!("`{name}` cannot be written")),
    }
}

/// A trace that keeps the watched values of every row.
pub struct Rows {
    pub cells: Vec<Cell>,
    pub rows: Vec<(TraceRow, Vec<i64>)>,
}

impl Rows {
    pub fn new(cells: Vec<Cell>) -> Rows {
        Rows { cells, rows: Vec::new() }
    }
}

/// The value of a cell.
pub fn value(image: &Image, cell: Cell) -> i64 {
    i64::from(image.value(cell))
}

impl Trace for Rows {
    fn row(&mut self, name: TraceRow, _time_ms: u64, image: &Image) -> io::Result<()> {
        let values = self.cells.iter().map(|cell| value(image, *cell)).collect();
        self.rows.push((name, values));
        Ok(())
    }
}

/// Runs a case and returns the outcome of each of its tests.
pub fn run_case(case: &Case) -> Vec<Outcome> {
    match &case.expects {
        Expects::Values(table) => match warned(case).and_then(|()| trace(case, table)) {
            Ok((rows, layout)) => compare(case, table, &rows, &layout),
            Err(error) => failed(case, &error),
        },
        Expects::Refused(code) => refused(case, code),
    }
}

/// Checks that reading and resolving give the warning that the case names.
fn warned(case: &Case) -> Result<(), String> {
    let Some(code) = &case.warned else { return Ok(()) };
    let file = SourceFile { name: "case.toml".into(), text: case.ladder.clone() };
    let (_, findings) = load_ladders(&[file], &LoadOptions::default());
    let found: Vec<&str> = findings.iter().map(|finding| finding.code.name()).collect();
    match found[..] == [code.as_str()] {
        true => Ok(()),
        false => Err(format!("expected the warning `{code}`, found {found:?}")),
    }
}

fn failed(case: &Case, error: &str) -> Vec<Outcome> {
    let wrong = |test| Outcome { test, wrong: vec![error.to_owned()] };
    case.tests().into_iter().map(wrong).collect()
}

fn refused(case: &Case, code: &str) -> Vec<Outcome> {
    let wrong = match load(&case.ladder) {
        Err(errors) if errors.lines().any(|line| line.starts_with(&format!("{code}:"))) => vec![],
        Err(errors) => vec![format!("expected the error `{code}`, found\n{errors}")],
        Ok(_) => vec![format!("expected the error `{code}`, found a program")],
    };
    vec![Outcome { test: case.name.clone(), wrong }]
}

/// More bits than a 16-bit number can address, so that the engine uses its other addressing.
const FAR: u32 = 70_000;

/// The rows of a case. Both lowerings and both kinds of addressing must give the same rows.
fn trace(case: &Case, table: &Table) -> Result<(Rows, Layout), String> {
    let program = load(&case.ladder)?;
    let (engine_program, symbols) = lower(&program);
    let look_up = |name: &str| target(&program, &symbols, name);
    let stimulus = Stimulus::parse(&table.stimulus(), &look_up)
        .map_err(|e| format!("line {} of the stimulus: {}", e.line, e.message))?;
    let cells = table.columns.iter().map(|column| cell(&program, &symbols, &column.operand));
    let cells: Vec<Cell> = cells.collect::<Result<_, _>>()?;
    let plan = Plan {
        period_ms: case.period_ms,
        scans: table.scans(),
        stop: case.stop,
        clock_s: case.clock_s,
        stimulus,
    };
    let mut rows = Rows::new(cells.clone());
    run(engine_program, &plan, &mut rows).map_err(|e| e.to_string())?;
    let mut unordered = Rows::new(cells);
    let (mut far, _) = lower_with(&program, 1);
    far.bit_count = FAR;
    run(far, &plan, &mut unordered).map_err(|e| e.to_string())?;
    if rows.rows != unordered.rows {
        return Err("operations in file order, of a long program, give another trace".to_owned());
    }
    Ok((rows, symbols.layout))
}

fn compare(case: &Case, table: &Table, found: &Rows, layout: &Layout) -> Vec<Outcome> {
    let new = |test| Outcome { test, wrong: Vec::new() };
    let mut outcomes: Vec<Outcome> = case.tests().into_iter().map(new).collect();
    for row in &table.rows {
        let name = match row.name {
            RowName::Scan(scan) => TraceRow::Scan(scan),
            RowName::Stop => TraceRow::Stop,
        };
        let values = found.rows.iter().find(|(at, _)| *at == name).map(|(_, values)| values);
        for (at, column) in table.columns.iter().enumerate() {
            let Some(expected) = &row.expected[at] else { continue };
            let text = |values: &Vec<i64>| layout.text(found.cells[at], values[at] as i32);
            let value = values.map(text);
            if value.as_ref() == Some(expected) {
                continue;
            }
            let value = value.unwrap_or_else(|| "no such row".to_owned());
            let operand = &column.operand;
            let line = format!("{}: {operand}: expected {expected}, found {value}", row.name);
            let test = case.test_of(row.label.as_deref(), &column.alias);
            let outcome = outcomes.iter_mut().find(|outcome| outcome.test == test);
            outcome.expect("a test of the case").wrong.push(line);
        }
    }
    outcomes
}
