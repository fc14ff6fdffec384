//! The difference report: a plan in words, with values of the old memory. Called through
//! [`ReloadPlan::report`].
//!
//! Each line states an effect of the swap. Before the swap, `OldMemory` holds the latest image, and
//! the lines are a forecast: the effect of a pass depends on which elements executed, and the image
//! does not show that. After the swap, `OldMemory` also holds the memory after the passes, and the
//! lines state what happened.

use std::ops::RangeInclusive;

use super::plan::{Difference, InitialStageStart, MovedElement, MovedStage, OldState, ReloadPlan};
use super::rung_texts::FileTexts;
use rungd_engine::isa::{Address, duration};
use rungd_engine::{BitCell, Cell, WordCell};
use rungd_language::lower::Symbols;
use rungd_language::lower::identity::Identity;
pub use rungd_language::resolve::program::Value;

/// Maximum number of lines of a report; further lines are only counted.
const LINES_MAX: usize = 400;

/// The beginning of a line that is a warning.
pub const WARNING: &str = "warning: ";

/// The first line of a report without differences; lines about kept state may follow.
const NONE: &str = "no difference in what the program does";

/// The old program's memory.
#[derive(Clone, Copy, Debug)]
pub struct OldMemory<'a> {
    /// The names of the program that ends.
    pub old: &'a Symbols,
    /// The names of the program that begins.
    pub new: &'a Symbols,
    /// The bits before the swap.
    pub bits: &'a [u8],
    /// The words before the swap.
    pub words: &'a [i32],
    /// The forced cells.
    pub forces: &'a [Cell],
    /// The bits after the termination passes; `None` before the swap.
    pub passed: Option<&'a [u8]>,
}

impl OldMemory<'_> {
    fn is_on(&self, cell: u32) -> bool {
        self.bits.get(cell as usize).is_some_and(|bit| *bit != 0)
    }

    fn word(&self, cell: u32) -> i32 {
        self.words.get(cell as usize).copied().unwrap_or(0)
    }

    fn is_forced(&self, cell: Cell) -> bool {
        self.forces.contains(&cell)
    }

    /// Whether a bit that was ON is OFF after the passes. Before the swap: whether it is `expected`
    /// to go OFF.
    fn goes_off(&self, cell: u32, expected: impl FnOnce() -> bool) -> bool {
        self.is_on(cell)
            && match self.passed {
                Some(bits) => bits.get(cell as usize).is_some_and(|bit| *bit == 0),
                None => expected(),
            }
    }

    /// Whether a Program begins at its initial Stage.
    fn starts(&self, start: &InitialStageStart) -> bool {
        let none_kept = !start.kept.iter().any(|stage| self.is_on(*stage));
        let loses = start.had_none || start.lost.iter().any(|stage| self.is_on(*stage));
        self.is_on(start.running) && loses && none_kept
    }

    fn value(&self, cell: Cell) -> i32 {
        match cell {
            Cell::Bit(BitCell(at)) => i32::from(self.is_on(at)),
            Cell::Word(WordCell(at)) => self.word(at),
            Cell::WordBit(bit) => i32::from(bit.is_on(self.word(bit.word.0))),
        }
    }

    /// A value as text for people, without the text that its tag gives it.
    fn held(&self, cell: Cell, value: i32) -> String {
        match cell {
            Cell::Bit(_) | Cell::WordBit(_) => if value != 0 { "ON" } else { "OFF" }.to_owned(),
            Cell::Word(_) => self.old.layout.text(cell, value),
        }
    }

    /// A value that a cell of the old program has in the new one, with its text there.
    fn begun(&self, cell: Cell, value: i32) -> String {
        match self.old.layout.address(cell) {
            Some(address) => self.new.names.say_value(address, value),
            None => self.held(cell, value),
        }
    }

    /// The value of a cell, with its text in the old program.
    fn shown_value(&self, cell: Cell) -> String {
        self.old.say_value(cell, self.value(cell)) + self.forced(cell)
    }

    /// The value of a cell that stays, with its text in the new program.
    fn kept_value(&self, cell: Cell) -> String {
        self.begun(cell, self.value(cell)) + self.forced(cell)
    }

    fn forced(&self, cell: Cell) -> &'static str {
        if self.is_forced(cell) { " (forced)" } else { "" }
    }

    /// Whether two cells show the same value, with the same forces; their texts may differ.
    fn are_same(&self, a: Cell, b: Cell) -> bool {
        let shown = |cell| (self.held(cell, self.value(cell)), self.is_forced(cell));
        shown(a) == shown(b)
    }
}

impl ReloadPlan {
    /// One line for each difference. If the program only keeps state, the first line says that
    /// there is no difference. `texts`: for the texts of edited, new and removed rungs.
    pub fn report(&self, seen: &OldMemory<'_>, texts: FileTexts<'_>) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        let mut differs = false;
        for difference in &self.differences {
            let Some(line) = line(difference, seen, texts) else { continue };
            lines.push(line);
            let state = difference.state.as_ref();
            differs |= !state.is_some_and(|state| {
                matches!(state, OldState::Stays { .. })
                    || matches!(state, OldState::Keeps { into: None, .. })
            });
        }
        if !differs {
            lines.insert(0, NONE.to_owned());
        }
        if lines.len() > LINES_MAX {
            let more = lines.len() - LINES_MAX;
            lines.truncate(LINES_MAX);
            lines.push(format!("and {more} more"));
        }
        lines
    }

    /// The cells of the old program whose values before the swap the report needs.
    pub fn asked(&self) -> Vec<Cell> {
        let (mut bits, mut words) = (Vec::new(), Vec::new());
        for state in self.differences.iter().filter_map(|d| d.state.as_ref()) {
            state.asked(&mut bits, &mut words);
        }
        let bits = bits.into_iter().map(|at| Cell::Bit(BitCell(at)));
        bits.chain(words.into_iter().map(|at| Cell::Word(WordCell(at)))).collect()
    }
}

impl OldState {
    fn asked(&self, bits: &mut Vec<u32>, words: &mut Vec<u32>) {
        match self {
            OldState::Keeps { acc, preset_word, done, into, .. } => {
                words.push(*acc);
                bits.extend(done);
                words.extend(preset_word);
                if let Some(into) = into {
                    bits.extend(into.stage);
                    into.start.iter().for_each(|start| start.asked(bits));
                }
            }
            OldState::Gone { cell, .. } | OldState::Stays { cell } => bits.push(*cell),
            OldState::Disabled { running } => bits.push(*running),
            OldState::Undriven { bit, active } => bits.extend(active.iter().chain([bit])),
            OldState::Starts(start) => start.asked(bits),
            OldState::Initial { cell, .. } | OldState::Limits { cell, .. } => {
                push(*cell, bits, words)
            }
            OldState::Unwritten { bit } => bits.push(*bit),
            // Depends on no value.
            OldState::Named { .. } | OldState::Rung(_) | OldState::MoreRungs(_) => {}
            OldState::Moved { from, to, .. } => {
                [from, to].into_iter().for_each(|cell| push(*cell, bits, words));
            }
            OldState::MovedArray { elements, .. } => {
                let cells = elements.iter().flat_map(|element| [element.from, element.to]);
                cells.for_each(|cell| push(cell, bits, words));
            }
        }
    }
}

fn push(cell: Cell, bits: &mut Vec<u32>, words: &mut Vec<u32>) {
    match cell {
        Cell::Bit(BitCell(at)) => bits.push(at),
        Cell::Word(WordCell(at)) => words.push(at),
        Cell::WordBit(bit) => words.push(bit.word.0),
    }
}

impl InitialStageStart {
    fn asked(&self, bits: &mut Vec<u32>) {
        bits.push(self.running);
        bits.extend(self.kept.iter().chain(&self.lost));
    }
}

fn line(difference: &Difference, seen: &OldMemory<'_>, texts: FileTexts<'_>) -> Option<String> {
    let text = &difference.text;
    let Some(state) = &difference.state else { return Some(text.clone()) };
    Some(match state {
        OldState::Gone { cell, .. } if seen.is_on(*cell) => format!("{text} and was terminated"),
        OldState::Gone { off, .. } => format!("{text}; it was {off}"),
        OldState::Stays { cell } => return seen.is_on(*cell).then(|| text.clone()),
        OldState::Disabled { running } if !seen.is_on(*running) => return None,
        OldState::Disabled { running } if seen.goes_off(*running, || true) => {
            format!("{text} is disabled and was terminated: the ENTASK that enabled it is gone")
        }
        OldState::Disabled { .. } => format!("{text} continues to run"),
        OldState::Undriven { bit, active } => {
            let active = || active.iter().any(|cell| seen.is_on(*cell));
            let free = !seen.is_forced(Cell::Bit(BitCell(*bit)));
            match seen.goes_off(*bit, || free && active()) {
                true => format!("{text}, and goes OFF"),
                false => text.clone(),
            }
        }
        OldState::Starts(start) => return seen.starts(start).then(|| text.clone()),
        OldState::Initial { cell, value, forced } => {
            let value = seen.begun(*cell, *value);
            match forced.is_some_and(|cell| seen.is_forced(cell)) {
                true => format!("{text} is new: {value}, but stays {}", seen.kept_value(*cell)),
                false => format!("{text} is new: {value}"),
            }
        }
        OldState::Limits { cell, begins, limits } => {
            let begins = begins.filter(|_| !seen.is_forced(*cell));
            let value = begins.unwrap_or_else(|| seen.value(*cell));
            let held = |content: i32| seen.held(*cell, content);
            return (!limits.contains(&value)).then(|| beyond(text, value, limits, held));
        }
        OldState::Unwritten { bit } => {
            let forced = if seen.is_forced(Cell::Bit(BitCell(*bit))) { " (forced)" } else { "" };
            let line = format!("{WARNING}{text} stays ON{forced}, and no rung writes it any more");
            return seen.is_on(*bit).then_some(line);
        }
        OldState::Keeps { .. } => return keeps(text, state, seen),
        OldState::Moved { .. } => moved(text, state, seen),
        OldState::MovedArray { elements, input, force } => {
            let force = left_forces(elements, force, seen);
            match *input && force.is_empty() {
                true => text.clone(),
                false => moved_array(text, elements, &force, seen),
            }
        }
        OldState::Rung(rung) => return rung.line(texts),
        OldState::MoreRungs(_) if texts.new.is_empty() => return None,
        OldState::MoreRungs(count) => format!("and {count} more rungs"),
        OldState::Named { cells, force } => {
            let forced = cells.iter().any(|cell| seen.is_forced(*cell));
            let said = [text.as_str()].into_iter().chain(forced.then_some(force.as_str()));
            let said: Vec<&str> = said.filter(|part| !part.is_empty()).collect();
            return (!said.is_empty()).then(|| said.join("; "));
        }
    })
}

fn keeps(text: &str, state: &OldState, seen: &OldMemory<'_>) -> Option<String> {
    let OldState::Keeps { timer, acc, preset, preset_word, done, into } = state else {
        return None;
    };
    let acc = seen.word(*acc);
    if acc == 0 {
        return None;
    }
    let preset_value = match (preset_word, preset) {
        (Some(word), _) => Some(seen.word(*word)),
        (None, Some(Value::Const(value, _))) => Some(*value),
        _ => None,
    };
    let said = preset_value.map_or_else(String::new, |preset_value| {
        format!(" of {}", count_text(preset_value, *timer))
    });
    let becomes_done = done.is_some_and(|done| !seen.is_on(done))
        && preset_value.is_some_and(|preset_value| acc >= preset_value);
    let done = if becomes_done { ": Done at its next execution" } else { "" };
    let line = format!("{text} keeps {}{said}", count_text(acc, *timer));
    let executes = |into: &MovedStage| {
        into.stage.is_some_and(|stage| seen.is_on(stage))
            || into.start.as_ref().is_some_and(|start| seen.starts(start))
    };
    Some(match into.as_ref().filter(|into| !executes(into)) {
        Some(into) => format!("{line}, until the pass of Stage {}, which is OFF", into.said),
        None => line + done,
    })
}

fn moved(text: &str, state: &OldState, seen: &OldMemory<'_>) -> String {
    let OldState::Moved { from, to, old, new, begins, input, force } = state else {
        return text.to_owned();
    };
    let was = seen.shown_value(*from);
    let force = match seen.is_forced(*from) && !seen.is_forced(*to) {
        true => format!("; {force}"),
        false => String::new(),
    };
    if *input && force.is_empty() {
        return text.to_owned();
    }
    let is = match begins {
        Some(value) if !seen.is_forced(*to) => {
            format!("{new} begins at {}", seen.begun(*to, *value))
        }
        _ if seen.are_same(*to, *from) => return format!("{text}: both are {was}"),
        _ => format!("{new} keeps its own value {}", seen.kept_value(*to)),
    };
    format!("{WARNING}{text}: {is}; {old}'s was {was}{force}")
}

/// The words about forces that stay on the old addresses of an array; empty without such forces.
fn left_forces(elements: &[MovedElement], force: &str, seen: &OldMemory<'_>) -> String {
    let is_left =
        |element: &MovedElement| seen.is_forced(element.from) && !seen.is_forced(element.to);
    match elements.iter().any(is_left) {
        true => format!("; {force}"),
        false => String::new(),
    }
}

/// The line about an array whose addresses have changed: the number of values that differ, and the
/// first of them.
fn moved_array(text: &str, elements: &[MovedElement], force: &str, seen: &OldMemory<'_>) -> String {
    let differs = |element: &&MovedElement| match beginning(element, seen) {
        Some(value) => {
            let was = seen.held(element.from, seen.value(element.from));
            seen.is_forced(element.from) || seen.held(element.to, value) != was
        }
        None => !seen.are_same(element.to, element.from),
    };
    let count = elements.iter().filter(differs).count();
    match elements.iter().find(differs) {
        Some(first) => {
            let (tag, is, was) = (&first.tag, now(first, seen), seen.shown_value(first.from));
            let all = elements.len();
            format!(
                "{WARNING}{text}: {count} of {all} values differ: {tag} is {is}, was {was}{force}"
            )
        }
        None if force.is_empty() => format!("{text}: all values are the same"),
        None => format!("{WARNING}{text}: all values are the same{force}"),
    }
}

/// The value that an element has at its new address.
fn now(element: &MovedElement, seen: &OldMemory<'_>) -> String {
    match beginning(element, seen) {
        Some(value) => seen.begun(element.to, value),
        None => seen.kept_value(element.to),
    }
}

/// The value with which an element begins at its new address; `None`: it keeps the one there.
fn beginning(element: &MovedElement, seen: &OldMemory<'_>) -> Option<i32> {
    element.begins.filter(|_| !seen.is_forced(element.to))
}

/// The line about a value beyond its limits. The reload keeps the value, but retentive memory does
/// not restore a saved value beyond its limits.
fn beyond(
    text: &str,
    value: i32,
    limits: &RangeInclusive<i32>,
    held: impl Fn(i32) -> String,
) -> String {
    let [value, min, max] = [value, *limits.start(), *limits.end()].map(held);
    format!(
        "{WARNING}{text} keeps {value}, which is outside its new limits, {min} to {max}; a restart \
         would discard it"
    )
}

/// A preset as text for people.
pub(super) fn preset(identity: &Identity, value: Value, is_time: bool) -> String {
    match value {
        Value::Const(value, _) => count_text(value, is_time),
        Value::Real(real) => real.to_string(),
        Value::Word(word) => identity.address(Address::Word(word)),
        Value::Element(element) => identity.element(&element),
    }
}

/// A count, or a time: `250 ms`, `4.2 s`, `1m30s`.
fn count_text(value: i32, is_time: bool) -> String {
    match value {
        _ if !is_time => value.to_string(),
        0..1000 => format!("{value} ms"),
        1000..60_000 => format!("{} s", f64::from(value) / 1000.0),
        _ => duration::print(value),
    }
}
