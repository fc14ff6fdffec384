//! An answer as text for people: the operand, the write, the contacts, and the same for each of
//! them, indented.

use super::answer::{
    About, Cause, ContactDetail, ContactSeen, Cut, Edit, Explanation, Followed, Hindrance, Idle,
    LegSeen, Node, OperandName, Place, Remedy, Restart, RungName, Since, Stop, TapeEnd, When,
    Write,
};
use crate::isa::Real;
use crate::runtime::Origin;

/// Lines, each with an indent.
struct Lines {
    text: String,
    /// The time of the question.
    now: When,
}

impl Explanation {
    /// The answer as text, with a line end.
    pub fn text(&self) -> String {
        let mut lines = Lines { text: String::new(), now: self.at };
        let Node { operand, value, .. } = &self.root;
        let head = format!("{} is {}", operand_text(operand), value_text(operand, *value));
        lines.add(0, &head);
        if let Some(doc) = &operand.doc {
            lines.add(1, &format!("({doc})"));
        }
        lines.node(&self.root, 1);
        if let Some(change) = &self.change {
            lines.change(change, self.root.value == 0);
        }
        lines.text
    }
}

impl Lines {
    fn add(&mut self, indent: usize, line: &str) {
        self.text.push_str(&"  ".repeat(indent));
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// The write of an operand, and what follows from it.
    fn node(&mut self, node: &Node, indent: usize) {
        let value = value_text(&node.operand, node.value);
        let line = self.write(&node.write, &value, node.operand.is_bit);
        self.add(indent, &line);
        if let Some(about) = &node.about {
            let line = self.about(about);
            self.add(indent, &line);
        }
        self.cause(&node.write.cause, indent);
        for idle in &node.idle {
            self.idle(idle, indent);
        }
    }

    fn cause(&mut self, cause: &Cause, indent: usize) {
        match cause {
            Cause::Instruction { legs, operands, .. } => {
                legs.iter().for_each(|leg| self.leg(leg, indent));
                for (operand, value, followed) in operands {
                    let value = value_text(operand, *value);
                    let line = format!("with {} = {value}", operand_text(operand));
                    self.followed(&line, followed, indent + 1);
                }
            }
            Cause::Pass { stop, .. } => match stop {
                Stop::Controller => self.add(indent + 1, "because the controller stopped"),
                Stop::Again(_, Some(restart)) => self.restart(restart, indent + 1),
                Stop::Again(block, None) => {
                    let line = format!("because {} was stopped and started again", block.name);
                    self.add(indent + 1, &line);
                }
                Stop::Bit(node) => self.because(node, indent + 1),
            },
            Cause::Turn { restart: Some(restart), .. } => self.restart(restart, indent + 1),
            Cause::Turn { running: Some(node), .. } => self.because(node, indent + 1),
            Cause::Turn { running: None, .. }
            | Cause::Force { .. }
            | Cause::Outside { .. }
            | Cause::Status
            | Cause::Controller
            | Cause::Initial
            | Cause::Restored
            | Cause::Older(_) => {}
        }
    }

    fn restart(&mut self, restart: &Restart, indent: usize) {
        let (when, rung) = (self.ago(restart.at), rung_text(&restart.rung, &restart.place));
        self.add(indent, &format!("because of {} {when}: {rung}", restart.place.text));
        restart.legs.iter().for_each(|leg| self.leg(leg, indent));
    }

    fn because(&mut self, node: &Node, indent: usize) {
        let value = value_text(&node.operand, node.value);
        self.add(indent, &format!("because {} is {value}", operand_text(&node.operand)));
        self.node(node, indent + 1);
    }

    fn leg(&mut self, leg: &LegSeen, indent: usize) {
        let name = if leg.name == "when" { "the rung" } else { leg.name };
        self.add(indent + 1, &format!("{name} is {}, because", state(leg.on)));
        leg.contacts.iter().for_each(|contact| self.contact(contact, indent + 2, ""));
        leg.also_off.iter().for_each(|contact| self.contact(contact, indent + 2, "also: "));
    }

    fn contact(&mut self, contact: &ContactSeen, indent: usize, also: &str) {
        match &contact.detail {
            ContactDetail::Bit(operand, followed) => {
                let line = format!("{also}{} is {}", operand_text(operand), state(contact.on));
                self.followed(&line, followed, indent);
            }
            ContactDetail::Element { bit, index: (index, value, followed) } => {
                let text = &contact.place.text;
                let line = format!("{also}{text} is {}", state(contact.on));
                match bit {
                    Some((operand, followed)) => {
                        self.followed(&format!("{line}: {}", operand.name), followed, indent);
                    }
                    None => self.add(indent, &format!("{line}: outside of the array")),
                }
                let line = format!("with {} = {value}", operand_text(index));
                self.followed(&line, followed, indent + 1);
            }
            ContactDetail::Compare { sides, real } => {
                let [left, right] = [0, 1].map(|at| {
                    let (value, operand, _) = &sides[at];
                    side_text(*value, operand.as_ref(), real[at])
                });
                let text = &contact.place.text;
                let line = format!("{also}{text} is {} ({left}, {right})", state(contact.on));
                self.add(indent, &line);
                for (value, operand, followed) in sides {
                    let Some(operand) = operand else { continue };
                    let value = value_text(operand, *value);
                    let line = format!("{} is {value}", operand_text(operand));
                    self.followed(&line, followed, indent + 1);
                }
            }
            ContactDetail::Edge { last, inner_on, inner } => {
                let text = &contact.place.text;
                let last = match last {
                    Since::At(_) if contact.on => String::new(),
                    Since::At(when) => format!("; it was ON last {}", self.ago(*when)),
                    Since::Before(when) => format!("; it was not ON since {}", self.scan(*when)),
                };
                self.add(indent, &format!("{also}{text} is {}{last}", state(contact.on)));
                let line = format!("what it is of is {}, because", state(*inner_on));
                self.add(indent + 1, &line);
                inner.iter().for_each(|contact| self.contact(contact, indent + 2, ""));
            }
        }
    }

    fn followed(&mut self, line: &str, followed: &Followed, indent: usize) {
        match followed {
            Followed::Node(node) => {
                self.add(indent, line);
                self.node(node, indent + 1);
            }
            Followed::Cut(Cut::Shown) => self.add(indent, &format!("{line} (see above)")),
            Followed::Cut(Cut::Depth | Cut::Length) => self.add(indent, &format!("{line} …")),
            Followed::Cut(Cut::Constant) => self.add(indent, line),
        }
    }

    fn idle(&mut self, idle: &Idle, indent: usize) {
        let text = &idle.place.text;
        let rung = rung_text(&idle.rung, &idle.place);
        match &idle.because {
            Hindrance::Stopped(bit, followed) => {
                let line = format!("{text} does not execute: {rung}: {} is OFF", bit.name);
                self.followed(&line, followed, indent);
            }
            Hindrance::Legs(legs) => {
                self.add(indent, &format!("{text} leaves it so: {rung}"));
                legs.iter().for_each(|leg| self.leg(leg, indent));
            }
        }
    }

    /// The write in one line.
    fn write(&self, write: &Write, value: &str, is_bit: bool) -> String {
        let when = match write.since {
            Since::At(_) if write.in_last_scan && write.before.is_none() => {
                "in this scan".to_owned()
            }
            Since::At(when) => self.ago(when),
            Since::Before(when) => format!("before {}", self.scan(when)),
        };
        let did = match (write.before, is_bit) {
            (None, _) => "wrote it".to_owned(),
            (Some(_), true) => format!("turned it {value}"),
            (Some(_), false) => format!("made it {value}"),
        };
        match &write.cause {
            Cause::Instruction { rung, place, .. } => {
                format!("{} {did} {when}: {}", place.text, rung_text(rung, place))
            }
            Cause::Pass { rung, place, .. } => {
                let rung = rung_text(rung, place);
                format!("the termination of {} {did} {when}: {rung}", place.text)
            }
            Cause::Turn { block, .. } => {
                format!("the turn of {} {did} {when}: {}", block.name, file(&block.place))
            }
            Cause::Force { who } => format!("forced {when}{}", by(who.as_ref())),
            Cause::Outside { origin, who } => {
                format!("{} {did} {when}{}", origin_text(*origin), by(who.as_ref()))
            }
            Cause::Status => "the controller writes it at the start of every scan".to_owned(),
            Cause::Controller => format!("the controller {did} {when}"),
            Cause::Initial => "nothing wrote it: a cold start's value".to_owned(),
            Cause::Restored => "nothing wrote it: restored at the start".to_owned(),
            Cause::Older(end) => {
                format!("nothing changed it since {}: {}", self.since(write.since), end_text(*end))
            }
        }
    }

    fn about(&self, about: &About) -> String {
        match about {
            About::Timer { acc_ms, preset_ms, timing, since } => {
                let of = preset_ms.map(|preset| format!(" of {}", ms(preset)));
                let of = of.unwrap_or_default();
                let timing = if *timing { "timing" } else { "not timing" };
                format!("{}{of}, {timing}{}", ms(*acc_ms), self.lasting(*since))
            }
            About::Counter { acc, presets, counted, reset } => {
                let presets: Vec<String> = presets.iter().map(i32::to_string).collect();
                let of = match presets.is_empty() {
                    true => String::new(),
                    false => format!(" of {}", presets.join(" and ")),
                };
                let [counted, reset] =
                    [(counted, "counted"), (reset, "reset")].map(|(last, did)| match last {
                        Since::At(when) => format!("last {did} {}", self.ago(*when)),
                        Since::Before(when) => format!("not {did} since {}", self.scan(*when)),
                    });
                format!("{acc}{of}, {counted}, {reset}")
            }
        }
    }

    fn change(&mut self, change: &Remedy, is_off: bool) {
        let to = state(is_off);
        let line = match change {
            Remedy::Edits(edits) => {
                let edits: Vec<String> = edits.iter().map(edit_text).collect();
                format!("{} would turn it {to} in the next scan", edits.join(" and "))
            }
            Remedy::Itself => format!("it turns {to} in the next scan by itself"),
            Remedy::Release => "it is forced: only a release lets it change".to_owned(),
            Remedy::NoScan => "nothing scans: it stays".to_owned(),
            Remedy::None(end) => {
                let all =
                    if end.every_single { "no input alone" } else { "nothing that was tried" };
                format!("{all} would turn it {to} in the next scan ({} tried)", end.tried)
            }
        };
        self.add(0, &line);
    }

    /// `2.1 s ago, in scan 812`; of the last scan `in this scan`.
    fn ago(&self, when: When) -> String {
        let Some(scan) = when.scan else { return "before the first scan".to_owned() };
        if Some(scan) == self.now.scan {
            return "in this scan".to_owned();
        }
        let ago_ms = self.now.now_ns.saturating_sub(when.now_ns) / 1_000_000;
        format!("{} ago, in scan {scan}", ms(i32::try_from(ago_ms).unwrap_or(i32::MAX)))
    }

    fn scan(&self, when: When) -> String {
        match when.scan {
            Some(scan) => format!("scan {scan}"),
            None => "the start".to_owned(),
        }
    }

    /// ` for 2.1 s, since scan 812`.
    fn lasting(&self, since: Since) -> String {
        match since {
            Since::At(when) if when.scan == self.now.scan => " since this scan".to_owned(),
            Since::At(when) => {
                let ago_ms = self.now.now_ns.saturating_sub(when.now_ns) / 1_000_000;
                let ago = ms(i32::try_from(ago_ms).unwrap_or(i32::MAX));
                format!(" for {ago}, since {}", self.scan(when))
            }
            Since::Before(when) => format!(" since before {}", self.scan(when)),
        }
    }

    fn since(&self, since: Since) -> String {
        match since {
            Since::At(when) if when.scan == self.now.scan => "this scan".to_owned(),
            Since::At(when) => self.ago(when).replace(" ago, in ", ", "),
            Since::Before(when) => format!("before {}", self.scan(when)),
        }
    }
}

fn state(on: bool) -> &'static str {
    if on { "ON" } else { "OFF" }
}

fn operand_text(operand: &OperandName) -> String {
    match &operand.address {
        Some(address) => format!("{} ({address})", operand.name),
        None => operand.name.clone(),
    }
}

pub(super) fn value_text(operand: &OperandName, value: i32) -> String {
    if operand.is_bit {
        state(value != 0).to_owned()
    } else if operand.is_real {
        Real::of_cell(value).to_string()
    } else if operand.is_time {
        ms(value)
    } else {
        value.to_string()
    }
}

fn side_text(value: i32, operand: Option<&OperandName>, real: bool) -> String {
    match operand {
        Some(operand) => format!("{} = {}", operand.name, value_text(operand, value)),
        None if real => Real::of_cell(value).to_string(),
        None => value.to_string(),
    }
}

fn edit_text(edit: &Edit) -> String {
    match edit {
        Edit::Write { operand, value } => {
            format!("{} {}", operand_text(operand), value_text(operand, *value))
        }
        Edit::Run { block } => format!("RUN {}", block.name),
    }
}

fn rung_text(rung: &RungName, place: &Place) -> String {
    let name = match &rung.name {
        Some(name) => format!("rung {name}"),
        None => format!("rung {}", rung.number),
    };
    let branch = rung.branch.map(|branch| format!(", branch {branch}")).unwrap_or_default();
    format!("{}, {name}{branch}, {}", rung.element.name, file(place))
}

fn file(place: &Place) -> String {
    format!("{}:{}", place.file, place.line)
}

fn origin_text(origin: Origin) -> &'static str {
    match origin {
        Origin::Inputs => "the input",
        Origin::Device(_) => "the field device",
        Origin::Batch(_) => "a queued write",
        Origin::Command(_) => "a command",
    }
}

fn by(who: Option<&String>) -> String {
    who.map(|who| format!(" by {who}")).unwrap_or_default()
}

fn end_text(end: TapeEnd) -> &'static str {
    match end {
        TapeEnd::Oldest => "the tape begins there",
        TapeEnd::Swapped => "a new program came there",
        TapeEnd::Lost => "scans are missing before it",
        TapeEnd::Restarted => "the process started there",
        TapeEnd::Searched => "what is before it was not searched",
        TapeEnd::Unreadable => "what is before it cannot be read",
    }
}

/// Milliseconds for people: `350 ms`, `2.1 s`, `3 min 20 s`.
fn ms(ms: i32) -> String {
    match ms {
        i32::MIN..1000 => format!("{ms} ms"),
        1000..60_000 if ms % 1000 == 0 => format!("{} s", ms / 1000),
        1000..60_000 => format!("{:.1} s", f64::from(ms / 100) / 10.0),
        60_000.. => format!("{} min {} s", ms / 60_000, ms / 1000 % 60),
    }
}
