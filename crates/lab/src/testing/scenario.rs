//! Writes a part of a recording as the text of a test file.
//!
//! The scenario is first tried in virtual time: the file contains an expectation only if the trial
//! meets it. A scenario begins with a cold start. If the recording does not, `set` restores the
//! values of bits and words, but timers, counters, histories and Stages begin again; a comment in
//! the file says so.

use std::fmt::Write as _;

use super::happened::{HappenedScan, happened};
use super::pasted::quoted;
use rungd_base::calendar::{LocalTime, Utc};
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{Bit, BitSpace, Word, WordSpace};
use rungd_engine::{Cell, Engine, EngineCall, EngineState, ScanTimes};
use rungd_history::observe::Subject;
use rungd_runtime::{TapeEntry, TapeSection};

/// The maximum number of operands in one `expect` line.
const OPERANDS_MAX: usize = 12;

/// The source of a scenario.
#[derive(Debug)]
pub struct ScenarioOf<'a> {
    /// The program.
    pub subject: &'a Subject,
    /// The names of its ladder files.
    pub ladders: Vec<String>,
    /// The scan period.
    pub period: ScanPeriod,
    /// Sections without a gap, at least one.
    pub sections: &'a [TapeSection],
    /// The name of the scenario.
    pub name: String,
}

/// The text of a test file.
pub fn scenario(source: &ScenarioOf) -> String {
    let subject = source.subject;
    let watched = outputs(subject);
    let mut engine = Engine::new(subject.code().clone());
    let Some(first) = source.sections.first() else { return String::new() };
    if !engine.resume(&first.state) {
        return String::new();
    }
    let period_ns = source.period.ns();
    let scans = happened(engine, source.sections, period_ns, &watched);
    let set = set(subject, &first.state);
    let trial = trial(subject, &set, &scans, source);
    let mut text = head(source, &set, first);
    text += "steps = [\n";
    if let Some(local_s) = clock(subject, source.sections) {
        let _ = writeln!(text, "    \"clock {}\",", iso(local_s));
    }
    let lines = steps(subject, &scans, &watched, &trial);
    lines.iter().for_each(|line| text += &format!("    {line}\n"));
    text += "]\n";
    text
}

fn head(source: &ScenarioOf, set: &[(Cell, i32)], first: &TapeSection) -> String {
    let ladders: Vec<String> = source.ladders.iter().map(|name| quoted(name)).collect();
    let mut text = String::from("# Made from a recording by `rungd record test`.\n");
    if first.start.number > 1 || first.state.scans() > 0 {
        let number = first.start.number;
        let _ = writeln!(
            text,
            "# It begins at scan {number} of that recording, but with a cold start: timers, \
             counters,\n# histories of edges, Stages and blocks begin again."
        );
    }
    let _ = writeln!(text, "ladder = [{}]", ladders.join(", "));
    let _ = writeln!(text, "period = \"{}\"\n", source.period);
    let _ = writeln!(text, "[[scenario]]\nname  = {}", quoted(&source.name));
    if !set.is_empty() {
        let one = |(cell, value): &(Cell, i32)| {
            format!(
                "{} = {}",
                quoted(&source.subject.operand(*cell).name),
                shown(source.subject, *cell, *value)
            )
        };
        let all: Vec<String> = set.iter().map(one).collect();
        let _ = writeln!(text, "set   = {{ {} }}", all.join(", "));
    }
    text
}

/// The outputs that the program writes, and the bits of alarms.
fn outputs(subject: &Subject) -> Vec<Cell> {
    let symbols = subject.symbols();
    let layout = &symbols.layout;
    let y = (0..layout.sizes().y).map(|n| Cell::Bit(layout.bit(Bit::Space(BitSpace::Y, n))));
    let mut all: Vec<Cell> = y.filter(|cell| subject.is_driven(*cell)).collect();
    all.extend(symbols.alarms.iter().map(|alarm| alarm.bit));
    all.dedup();
    all
}

/// The inputs, bits and words that differ from those of a cold start.
fn set(subject: &Subject, state: &EngineState) -> Vec<(Cell, i32)> {
    let layout = &subject.symbols().layout;
    let cold = EngineState::of(&Engine::new(subject.code().clone()));
    let bits = [BitSpace::X, BitSpace::Y, BitSpace::C, BitSpace::Mc, BitSpace::Mi];
    let words = [WordSpace::V, WordSpace::D, WordSpace::R, WordSpace::Mhr, WordSpace::Mir];
    let bits = bits.into_iter().flat_map(|space| {
        let range = space.first()..space.first() + space.count(layout.sizes());
        range.map(move |n| Cell::Bit(layout.bit(Bit::Space(space, n))))
    });
    let words = words.into_iter().flat_map(|space| {
        let range = space.first()..space.first() + space.count(layout.sizes());
        range.map(move |n| Cell::Word(layout.word(Word::Space(space, n))))
    });
    let differs = |cell: &Cell| state.value(*cell) != cold.value(*cell);
    bits.chain(words).filter(differs).map(|cell| (cell, state.value(cell))).collect()
}

/// The watched cells at the end of each scan of the scenario, in a trial in virtual time.
fn trial(
    subject: &Subject,
    set: &[(Cell, i32)],
    scans: &[HappenedScan],
    source: &ScenarioOf,
) -> Vec<Vec<i32>> {
    let watched = outputs(subject);
    let mut engine = Engine::new(subject.code().clone());
    let period_ns = source.period.ns();
    let local_s = clock(subject, source.sections).unwrap_or(LocalTime::SIMULATED_S);
    // The test does not change field devices, so their `.Ok` bits are ON.
    let well = subject.well();
    set.iter().for_each(|(cell, value)| put(&mut engine, *cell, *value));
    engine.apply(EngineCall::Start { now_ns: 0 });
    let (mut at, mut tried) = (0, Vec::new());
    for scan in scans {
        if scan.begins_run {
            engine.apply(EngineCall::Start { now_ns: at * period_ns });
        }
        while at <= scan.at {
            let is_its = at == scan.at;
            if is_its && scan.is_last {
                engine.request_stop();
            }
            let local = local_s.saturating_add((at * period_ns / 1_000_000_000) as i64);
            engine.begin_scan(at * period_ns, &ScanTimes::default(), &LocalTime::of(local));
            if at == 0 {
                well.iter().for_each(|cell| put(&mut engine, *cell, 1));
            }
            if is_its {
                scan.calls.iter().for_each(|call| engine.apply(*call));
            }
            let end = engine.execute();
            if is_its {
                tried.push(watched.iter().map(|cell| engine.image().value(*cell)).collect());
            }
            if end.last {
                engine.terminate();
            }
            at += 1;
        }
    }
    tried
}

fn put(engine: &mut Engine, cell: Cell, value: i32) {
    engine.apply(EngineCall::Write(cell, value));
}

/// The lines of the steps.
fn steps(
    subject: &Subject,
    scans: &[HappenedScan],
    watched: &[Cell],
    trial: &[Vec<i32>],
) -> Vec<String> {
    let mut lines = Vec::new();
    let mut told: Vec<Option<i32>> = vec![None; watched.len()];
    let mut pending = 0;
    let mut last = None;
    for (at, scan) in scans.iter().enumerate() {
        let idle = last.map_or(0, |last| scan.at - last - 1);
        let before = at.checked_sub(1).map(|before| (&scans[before].values, &trial[before]));
        let comes_in = !scan.calls.is_empty() || scan.is_last || scan.begins_run;
        pending += idle;
        if comes_in {
            run(&mut lines, &mut pending);
            if let Some((values, tried)) = before {
                let end = ComparedEnd { watched, values, tried };
                expect(subject, &mut lines, end, &mut told);
            }
            step_in(subject, &mut lines, scan);
        }
        pending += u64::from(!scan.is_last);
        last = Some(scan.at);
    }
    run(&mut lines, &mut pending);
    if let (Some(scan), Some(tried)) = (scans.last().filter(|scan| !scan.is_last), trial.last()) {
        let end = ComparedEnd { watched, values: &scan.values, tried };
        expect(subject, &mut lines, end, &mut told);
    }
    lines
}

/// Adds a `run` line for the scans without changes.
fn run(lines: &mut Vec<String>, pending: &mut u64) {
    match std::mem::take(pending) {
        0 => {}
        1 => lines.push("\"run 1 scans\",".to_owned()),
        scans => lines.push(format!("\"run {scans} scans\",")),
    }
}

/// Adds the lines for the calls before a scan.
fn step_in(subject: &Subject, lines: &mut Vec<String>, scan: &HappenedScan) {
    if scan.begins_run {
        lines.push("\"start\",".to_owned());
    }
    for call in &scan.calls {
        let name = |cell: &Cell| subject.operand(*cell).name;
        lines.push(match call {
            EngineCall::Write(cell, value) => {
                format!("\"set {} {}\",", name(cell), shown(subject, *cell, *value))
            }
            EngineCall::Force(cell, value) => {
                format!("\"force {} {}\",", name(cell), shown(subject, *cell, *value))
            }
            EngineCall::Release(cell) => format!("\"unforce {}\",", name(cell)),
            EngineCall::Start { .. }
            | EngineCall::RequestStop
            | EngineCall::Begin { .. }
            | EngineCall::Execute
            | EngineCall::Terminate => continue,
        });
    }
    if scan.is_last {
        lines.push("\"stop\",".to_owned());
    }
}

/// The watched cells at the end of a scan.
struct ComparedEnd<'a> {
    watched: &'a [Cell],
    /// Their recorded values.
    values: &'a [i32],
    /// Their values in the trial.
    tried: &'a [i32],
}

/// Adds the outputs that have changed since the last `expect`. If the value in the trial differs,
/// the line is a comment.
fn expect(
    subject: &Subject,
    lines: &mut Vec<String>,
    ComparedEnd { watched, values, tried }: ComparedEnd,
    told: &mut [Option<i32>],
) {
    let (mut met, mut missed) = (Vec::new(), Vec::new());
    for (at, cell) in watched.iter().enumerate() {
        if told[at] == Some(values[at]) {
            continue;
        }
        told[at] = Some(values[at]);
        let name = subject.operand(*cell).name;
        let contact = if values[at] != 0 { name } else { format!("!{name}") };
        let list = if tried[at] == values[at] { &mut met } else { &mut missed };
        list.push(contact);
    }
    for (contacts, mark) in [(met, ""), (missed, "# different scan in virtual time: ")] {
        for some in contacts.chunks(OPERANDS_MAX) {
            lines.push(format!("{mark}\"expect: {}\",", some.join(" & ")));
        }
    }
}

/// The local time of the first scan, if the program reads the time of day.
fn clock(subject: &Subject, sections: &[TapeSection]) -> Option<i64> {
    if !subject.reads_time_of_day() {
        return None;
    }
    sections.iter().flat_map(|section| &section.entries).find_map(|entry| {
        if let TapeEntry::Call(EngineCall::Begin { local_s, .. }) = entry {
            Some(*local_s)
        } else {
            None
        }
    })
}

fn iso(local_s: i64) -> String {
    let utc = Utc::of(local_s.max(0).unsigned_abs());
    format!("{utc}T{}", utc.time())
}

fn shown(subject: &Subject, cell: Cell, value: i32) -> String {
    subject.symbols().layout.text(cell, value)
}
