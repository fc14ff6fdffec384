//! The events of the minute as texts for people: changes of modes, blocks, Stages, alarms and
//! logged tags, and the actions of people and clients.

use std::sync::Arc;

use super::program::LiveProgram;
use rungd_base::duration_text::duration_text;
use rungd_engine::isa::{Address, Bit, BlockId, StageId};
use rungd_engine::{Cell, EngineCall};
use rungd_language::resolve::alarm_terms::AlarmTerms;
use rungd_runtime::{Origin, TapeEntry, TapeSection};

/// The most events; only the newest are kept.
const EVENTS_MAX: usize = 500;

/// An event.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LiveEvent {
    /// The scan.
    pub scan: u64,
    /// The time of the scan, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// Whether an alarm was raised.
    pub is_alarm: bool,
    /// The text of the event.
    pub text: String,
    /// The operand that the event is about.
    pub operand: Option<String>,
}

/// The events of sections, the newest last.
pub(super) fn events(program: &LiveProgram, sections: &[Arc<TapeSection>]) -> Vec<LiveEvent> {
    let told = reported_cells(program);
    let cells: Vec<Cell> = told.iter().map(|(cell, _)| *cell).collect();
    let changes = program.subject.changes(sections, &cells);
    let mut all: Vec<LiveEvent> = Vec::new();
    for change in changes.iter().filter(|change| change.before.is_some()) {
        let kinds = told.iter().filter(|(cell, _)| *cell == change.cell);
        all.extend(kinds.map(|(_, what)| LiveEvent {
            scan: change.scan,
            unix_ns: change.unix_ns,
            is_alarm: change.after != 0 && matches!(what, ChangeKind::Alarm { on: None, .. }),
            text: what.text([change.before.unwrap_or(0), change.after], &|content| {
                value_text(program, change.cell, content)
            }),
            operand: Some(what.operand().to_owned()),
        }));
    }
    sections.iter().for_each(|section| outside(program, section, &mut all));
    all.sort_by_key(|event| (event.unix_ns, event.scan));
    all.split_off(all.len().saturating_sub(EVENTS_MAX))
}

/// The kind of event that a change of a cell causes.
enum ChangeKind {
    Block(String),
    Stage(String),
    /// The bit of an alarm; `on`, `off`: its delays, if it has them.
    Alarm {
        tag: String,
        text: String,
        on: Option<String>,
        off: Option<String>,
    },
    Bit(String),
    Word(String),
}

impl ChangeKind {
    fn operand(&self) -> &str {
        match self {
            ChangeKind::Block(name)
            | ChangeKind::Stage(name)
            | ChangeKind::Alarm { tag: name, .. }
            | ChangeKind::Bit(name)
            | ChangeKind::Word(name) => name,
        }
    }

    /// The text of a change. `value`: the text of a content.
    fn text(&self, [before, after]: [i32; 2], value: &dyn Fn(i32) -> String) -> String {
        let state = if after != 0 { "ON" } else { "OFF" };
        match self {
            ChangeKind::Block(name) => {
                let name = name.trim_end_matches(".Running");
                format!("{name} {}", if after != 0 { "started" } else { "stopped" })
            }
            ChangeKind::Stage(name) => format!("Stage {name} is {state}"),
            ChangeKind::Alarm { tag, text, on: Some(on), .. } if after != 0 => {
                format!("{tag} is ON; an alarm if it stays ON for {on}: {text}")
            }
            ChangeKind::Alarm { tag, text, off: Some(off), .. } if after == 0 => {
                format!("{tag} is OFF; its alarm is gone if it stays OFF for {off}: {text}")
            }
            ChangeKind::Alarm { tag, text, .. } if after != 0 => format!("alarm: {text} ({tag})"),
            ChangeKind::Alarm { tag, text, .. } => format!("alarm gone: {text} ({tag})"),
            ChangeKind::Bit(name) => format!("{name} is {}", value(after)),
            ChangeKind::Word(name) => format!("{name} is {}, was {}", value(after), value(before)),
        }
    }
}

fn reported_cells(program: &LiveProgram) -> Vec<(Cell, ChangeKind)> {
    let symbols = program.subject.symbols();
    let bit = |bit: Bit| symbols.layout.cell(Address::Bit(bit));
    let blocks = (0..).zip(&symbols.names.blocks).filter_map(|(at, block)| {
        let running = ChangeKind::Block(format!("{}.Running", block.name));
        Some((bit(Bit::Running(BlockId(at)))?, running))
    });
    let stages = (0..).zip(&symbols.names.stages).filter_map(|(at, stage)| {
        Some((bit(Bit::Stage(StageId(at)))?, ChangeKind::Stage(stage.whole.clone())))
    });
    let alarms = symbols.alarms.iter().map(|alarm| {
        let AlarmTerms { delay_ms, off_delay_ms, .. } = alarm.terms;
        let told = |ms: u32| (ms > 0).then(|| duration_text(u64::from(ms) * 1_000_000));
        let (on, off) = (told(delay_ms), told(off_delay_ms));
        let (tag, text) = (alarm.tag.clone(), alarm.text.clone());
        (alarm.bit, ChangeKind::Alarm { tag, text, on, off })
    });
    let tags = symbols.logged.iter().map(|logged| match logged.cell {
        Cell::Bit(_) | Cell::WordBit(_) => (logged.cell, ChangeKind::Bit(logged.tag.clone())),
        Cell::Word(_) => (logged.cell, ChangeKind::Word(logged.tag.clone())),
    });
    blocks.chain(stages).chain(alarms).chain(tags).collect()
}

/// The changes of the mode, and the actions of people and clients.
fn outside(program: &LiveProgram, section: &TapeSection, all: &mut Vec<LiveEvent>) {
    let mut origin = None;
    for step in section.steps() {
        let event = |text: String, operand: Option<String>| LiveEvent {
            scan: step.number,
            unix_ns: section.start.unix_ns(step.now_ns),
            is_alarm: false,
            text,
            operand,
        };
        match step.entry {
            TapeEntry::Mode(mode) => all.push(event(mode.to_string(), None)),
            TapeEntry::Origin(entry_origin) => origin = Some(entry_origin),
            TapeEntry::Call(call) => {
                let who = origin.and_then(|origin| who(section, origin));
                all.extend(done(program, call, who).map(|(text, name)| event(text, Some(name))));
            }
            TapeEntry::Number(_)
            | TapeEntry::Swap { .. }
            | TapeEntry::State { .. }
            | TapeEntry::Lost { .. } => {}
        }
    }
}

/// The person or client behind an origin.
fn who(section: &TapeSection, origin: Origin) -> Option<&str> {
    match origin {
        Origin::Inputs | Origin::Device(_) => None,
        Origin::Batch(_) | Origin::Command(_) => {
            let mut known = section.who.iter().filter(|(known_origin, _)| *known_origin == origin);
            known.next().map(|(_, who)| who.as_str())
        }
    }
}

/// A content for people: ON or OFF of a bit, the number of a word, each with its text.
fn value_text(program: &LiveProgram, cell: Cell, content: i32) -> String {
    program.subject.symbols().say_value(cell, content)
}

/// The action of a person or client on an operand: its text, and the operand.
fn done(program: &LiveProgram, call: EngineCall, who: Option<&str>) -> Option<(String, String)> {
    let (who, name) = (who?, |cell| program.subject.operand(cell).name);
    let text = |cell, value| value_text(program, cell, value);
    match call {
        EngineCall::Write(cell, value) => {
            Some((format!("{who} wrote {} to {}", text(cell, value), name(cell)), name(cell)))
        }
        EngineCall::Force(cell, value) => {
            Some((format!("{who} forced {} to {}", name(cell), text(cell, value)), name(cell)))
        }
        EngineCall::Release(cell) => {
            Some((format!("{who} ended the force of {}", name(cell)), name(cell)))
        }
        EngineCall::Start { .. }
        | EngineCall::RequestStop
        | EngineCall::Begin { .. }
        | EngineCall::Execute
        | EngineCall::Terminate => None,
    }
}
