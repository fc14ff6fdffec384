//! The phrases of an answer: names, values, times, the line of a write.

use super::answer::{
    Cause, Edit, LastChange, OperandName, Place, RungName, Since, Stop, TapeEnd, When, Write,
};
use super::compares::side_text;
use rungd_engine::isa::Real;
use rungd_language::lower::formula_value::FormulaNumber;
use rungd_language::resolve::value_texts::with_text;
use rungd_runtime::Origin;

/// Writes times relative to the time of the question.
#[derive(Clone, Copy)]
pub(super) struct PhraseWriter {
    /// The time of the question.
    pub now: When,
}

/// The facts of a write that a phrase needs: its operand, the value, and whether it lies in the
/// past.
#[derive(Clone, Copy)]
pub(super) struct WriteFacts<'a> {
    pub operand: &'a OperandName,
    pub value: i32,
    pub past: bool,
}

impl PhraseWriter {
    /// Whether something happened in an earlier scan than that of the question.
    pub fn is_earlier(self, since: Since) -> bool {
        match since {
            Since::At(when) => when.scan != self.now.scan,
            Since::Before(_) => true,
        }
    }

    /// The write as one line; `changed`: the last change, if this write did not change the value.
    pub fn write(self, write: &Write, written: WriteFacts, changed: Option<&LastChange>) -> String {
        let did = self.did(write, written, changed);
        let value = value_text(written.operand, written.value);
        match &write.cause {
            Cause::Instruction { rung, place, .. } => {
                format!("{} {did}: {}", place.text, rung_text(rung, place))
            }
            Cause::Pass { rung, place, stop } => {
                let stopped = match stop {
                    Stop::Controller => "the controller stopped".to_owned(),
                    Stop::Bit(_) => format!("{} was stopped", rung.element.name),
                    Stop::Again(block, _) => format!("{} was stopped and restarted", block.name),
                };
                let rung = rung_text(rung, place);
                format!("{stopped}, which {did}: {}, {rung}", place.text)
            }
            Cause::Turn { block, restart, .. } => {
                let turn = if restart.is_some() { "restart" } else { "start or end" };
                format!("the {turn} of {} {did}: {}", block.name, file(&block.place))
            }
            Cause::Force { who } => {
                let by = who.as_ref().map(|who| format!(" by {who}")).unwrap_or_default();
                if write.before.is_some() {
                    // The force has ended, or a later force has replaced it.
                    return format!("a force{by} {did}");
                }
                let was = if written.past { "it was forced" } else { "forced" };
                format!("{was} to {value}{by} since {}", self.since(write.since))
            }
            Cause::Outside { origin, who } => match (origin, who) {
                (Origin::Inputs, _) => {
                    let address = written.operand.address.as_ref().unwrap_or(&written.operand.name);
                    format!("input {address} {did}")
                }
                (Origin::Device(_), Some(device)) => format!("device {device} {did}"),
                (Origin::Device(_), None) => format!("a field device {did}"),
                (Origin::Batch(_) | Origin::Command(_), Some(who)) => {
                    format!("{who} wrote {value} {}", self.at(write.since))
                }
                (Origin::Batch(_), None) => format!("a queued write {did}"),
                (Origin::Command(_), None) => format!("a command {did}"),
            },
            Cause::Status => "the controller writes it at the start of every scan".to_owned(),
            Cause::Controller => format!("the controller {did}"),
            Cause::Resumed => format!("the start {did}: it is retained by `[retain] stages`"),
            Cause::Initial | Cause::Restored | Cause::Older(_) => {
                let then = if written.past { "until then " } else { "" };
                let what = if write.cause == Cause::Initial {
                    ": its initial value"
                } else if write.cause == Cause::Restored {
                    ": restored from retentive memory"
                } else {
                    ""
                };
                format!("{then}{}{what}", self.unchanged(write.since, &write.cause))
            }
        }
    }

    /// The effect of a write on the value, and its time.
    fn did(self, write: &Write, written: WriteFacts, changed: Option<&LastChange>) -> String {
        let value = value_text(written.operand, written.value);
        let is_bit = written.operand.is_bit;
        let when = self.at(write.since);
        let at = if is_bit { "" } else { "at " };
        let is_earlier = self.is_earlier(write.since);
        let keeps = if is_earlier { "kept" } else { "keeps" };
        match (write.before, changed) {
            (Some(_), _) if is_bit => format!("turned it {value} {when}"),
            (Some(_), _) => format!("made it {value} {when}"),
            (None, None) if is_earlier => format!("kept it {at}{value} {when}"),
            (None, None) => format!("keeps it {at}{value}"),
            (None, Some(changed)) => match &changed.cause {
                Some(cause @ (Cause::Initial | Cause::Restored | Cause::Older(_))) => {
                    format!("{keeps} it {at}{value}, {}", self.unchanged(changed.since, cause))
                }
                // The line before this one describes the change.
                Some(_) => format!("{keeps} it {at}{value}"),
                None if is_bit => {
                    let when = self.at(changed.since);
                    format!("turned it {value} {when}, and {keeps} it {value}")
                }
                None => format!("{keeps} it {at}{value}, unchanged{}", self.lasting(changed.since)),
            },
        }
    }

    /// A value that nothing has changed as far back as the tape is known.
    fn unchanged(self, since: Since, cause: &Cause) -> String {
        let Cause::Older(end) = cause else {
            return "unchanged since rungd started".to_owned();
        };
        let (Since::At(when) | Since::Before(when)) = since;
        let scan = self.scan(when);
        match end {
            TapeEnd::Oldest if when.scan.is_none() => {
                "unchanged since the recording begins".to_owned()
            }
            TapeEnd::Oldest => format!("unchanged since the recording begins, at {scan}"),
            TapeEnd::Swapped => format!("unchanged since the program was reloaded, after {scan}"),
            TapeEnd::Lost => format!("unchanged since {scan}; scans before that are missing"),
            TapeEnd::Restarted => {
                format!("unchanged since {scan}; the recording has a gap before that")
            }
            TapeEnd::Searched => format!("unchanged since {scan}; not searched before that"),
            TapeEnd::Unreadable => {
                format!("unchanged since {scan}; the recording cannot be read before that")
            }
        }
    }

    /// `2.1 s ago, in scan 812`; for the last scan, `in this scan`.
    pub fn ago(self, when: When) -> String {
        let Some(scan) = when.scan else { return "before the first scan".to_owned() };
        if Some(scan) == self.now.scan {
            return "in this scan".to_owned();
        }
        format!("{} ago, in scan {scan}", ms(self.age_ms(when)))
    }

    fn age_ms(self, when: When) -> i32 {
        let ago_ms = self.now.now_ns.saturating_sub(when.now_ns) / 1_000_000;
        i32::try_from(ago_ms).unwrap_or(i32::MAX)
    }

    /// The same for a time that may lie before the known part of the tape.
    pub fn at(self, since: Since) -> String {
        match since {
            Since::At(when) => self.ago(when),
            Since::Before(when) => format!("before {}", self.scan(when)),
        }
    }

    fn scan(self, when: When) -> String {
        match when.scan {
            Some(scan) => format!("scan {scan}"),
            None => "the first scan".to_owned(),
        }
    }

    /// An event that did not happen: `never ON since scan 812`.
    pub fn missing(self, what: &str, since: When) -> String {
        match since.scan {
            Some(scan) => format!("{what} since scan {scan}"),
            None => format!("{what} since rungd started"),
        }
    }

    /// `scan 812, 2.1 s ago`.
    fn since(self, since: Since) -> String {
        match since {
            Since::At(when) if when.scan == self.now.scan => "this scan".to_owned(),
            Since::At(When { scan: None, .. }) => "before the first scan".to_owned(),
            Since::At(when) => format!("{}, {} ago", self.scan(when), ms(self.age_ms(when))),
            Since::Before(when) => format!("before {}", self.scan(when)),
        }
    }

    /// ` for 2.1 s, since scan 812`; an empty text if the beginning is not known.
    pub fn lasting(self, since: Since) -> String {
        match since {
            Since::At(when) if when.scan == self.now.scan => " since this scan".to_owned(),
            Since::At(when) => format!(" for {}, since {}", ms(self.age_ms(when)), self.scan(when)),
            Since::Before(_) => String::new(),
        }
    }
}

pub(super) fn state(on: bool) -> &'static str {
    if on { "ON" } else { "OFF" }
}

pub(super) fn operand_text(operand: &OperandName) -> String {
    match &operand.address {
        Some(address) => format!("{} ({address})", operand.name),
        None => operand.name.clone(),
    }
}

pub(super) fn value_text(operand: &OperandName, value: i32) -> String {
    let number = if operand.is_bit {
        state(value != 0).to_owned()
    } else if operand.is_real {
        Real::of_cell(value).to_string()
    } else if operand.is_time {
        ms(value)
    } else {
        value.to_string()
    };
    with_text(number, operand.text(value))
}

/// A side of a compare.
pub(super) struct ComparedSide<'a> {
    /// The value that the compare read: a cell's content.
    pub value: i32,
    pub operand: Option<&'a OperandName>,
    pub is_real: bool,
}

/// The sides of a compare with their values: `level = 80, least = 100`. A side that is a number is
/// left out.
pub(super) fn sides_text(text: &str, sides: [ComparedSide; 2]) -> String {
    let mut all = Vec::new();
    for (written, ComparedSide { value, operand, is_real }) in written_sides(text).zip(sides) {
        match operand {
            Some(operand) => all.push(format!("{} = {}", operand.name, value_text(operand, value))),
            None if is_number(written) => {}
            None if is_real => all.push(format!("{written} = {}", Real::of_cell(value))),
            None => all.push(format!("{written} = {value}")),
        }
    }
    all.join(", ")
}

/// The sides of a compare that computes, with their values: `level * 2 = 80, least + 1 = 101`.
pub(super) fn computed_text(text: &str, sides: &[FormulaNumber], is_time: bool) -> String {
    let shown = written_sides(text).zip(sides).filter(|(written, _)| !is_number(written));
    let text = |value: &FormulaNumber| side_text(*value, is_time);
    shown
        .map(|(written, value)| format!("{written} = {}", text(value)))
        .collect::<Vec<_>>()
        .join(", ")
}

/// The texts of a compare's sides.
fn written_sides(text: &str) -> impl Iterator<Item = &str> {
    let is_sign = |char: char| "<>=!".contains(char);
    let (left, right) = text.split_once(is_sign).unwrap_or((text, ""));
    [left, right.trim_start_matches(is_sign)].into_iter().map(str::trim)
}

/// Whether the text of a side shows its value, or is empty.
fn is_number(text: &str) -> bool {
    let begins = text.trim_start_matches('-').bytes().next();
    let computes = text.contains(['+', '*', '/', '%', '(']) || text.contains(" - ");
    begins.is_none_or(|byte| byte.is_ascii_digit()) && !computes
}

pub(super) fn edit_text(edit: &Edit) -> String {
    match edit {
        Edit::Write { operand, value } => {
            format!("{} {}", operand_text(operand), value_text(operand, *value))
        }
        Edit::Run { block } => format!("RUN {}", block.name),
    }
}

pub(super) fn rung_text(rung: &RungName, place: &Place) -> String {
    format!("{}, {}", rung.text(), file(place))
}

impl RungName {
    /// `Main, rung start, branch 2`.
    pub fn text(&self) -> String {
        let branch = self.branch.map(|branch| format!(", branch {branch}")).unwrap_or_default();
        format!("{}, {}{branch}", self.element.name, self.label)
    }
}

fn file(place: &Place) -> String {
    format!("{}:{}", place.file, place.line)
}

/// Milliseconds for people: `350 ms`, `2.1 s`, `3 min 20 s`, `2 h 5 min`.
pub(super) fn ms(ms: i32) -> String {
    match ms {
        i32::MIN..1000 => format!("{ms} ms"),
        1000..60_000 if ms % 1000 == 0 => format!("{} s", ms / 1000),
        1000..60_000 => format!("{:.1} s", f64::from(ms / 100) / 10.0),
        60_000..3_600_000 => format!("{} min {} s", ms / 60_000, ms / 1000 % 60),
        3_600_000.. => format!("{} h {} min", ms / 3_600_000, ms / 60_000 % 60),
    }
}
