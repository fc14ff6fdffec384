//! An answer as text for people: the operand, the write and the contacts; below each contact the
//! same for its operand, indented. States in an earlier scan are in the past tense.

use super::answer::{
    About, CallPlace, Cause, ContactDetail, ContactSeen, Cut, ExplainedOperand, ExplainedValue,
    Explanation, Followed, Hindrance, Idle, LastChange, LegSeen, ModeSince, Node, Remedy, Restart,
    Since, Stop,
};
use super::phrases::{
    ComparedSide, PhraseWriter, WriteFacts, computed_text, edit_text, ms, operand_text, rung_text,
    sides_text, state, value_text,
};
use super::reasons::TOLD_MAX;
use rungd_config::controller::OutputState;
use rungd_language::source::wording::escaped;
use rungd_runtime::exchange::Mode;

/// The number of contacts that are told of a leg that has many of them.
const CONTACTS_TOLD: usize = 4;

/// The number of explained operands of earlier programs that are compared.
const SHOWN_MAX: usize = 500;

/// Lines, each with an indent.
struct IndentedLines {
    text: String,
    telling: PhraseWriter,
    /// The number of earlier programs whose answers are being told.
    earlier: u32,
    /// The operands that answers of earlier programs have explained. Each program answers on its
    /// own, so two of them, or two answers of one, may have the same explanation.
    shown: Vec<Node>,
}

/// The form of a line: its indent, and whether it is in the past tense.
#[derive(Clone, Copy)]
struct Line {
    indent: usize,
    past: bool,
}

impl Line {
    fn deeper(self, by: usize) -> Line {
        Line { indent: self.indent + by, ..self }
    }

    fn is(self) -> &'static str {
        if self.past { "was" } else { "is" }
    }

    fn are(self) -> &'static str {
        if self.past { "were" } else { "are" }
    }
}

impl Explanation {
    /// The answer as text, with a line end.
    pub fn text(&self) -> String {
        let telling = PhraseWriter { now: self.at };
        let mut lines =
            IndentedLines { text: String::new(), telling, earlier: 0, shown: Vec::new() };
        let Node { operand, value, .. } = &self.root;
        let head = format!("{} is {}", operand_text(operand), value_text(operand, *value));
        let head = head + &self.output_text();
        lines.add(0, &head);
        if let Some(doc) = &operand.doc {
            lines.add(1, &format!("({})", doc.replace(['\n', '\r'], " ")));
        }
        if self.mode.is_some() {
            lines.add(1, "(nothing is scanned: times are counted back from the last scan)");
        }
        let line = Line { indent: 1, past: false };
        if let Some(changed) = &self.changed {
            lines.changed(changed, &self.root, line);
        }
        lines.node(&self.root, self.changed.as_ref(), line);
        if let Some(change) = &self.change {
            let told = lines.change(self, change);
            lines.add(0, &told);
        }
        lines.text
    }

    /// The state of the output beside the value in memory.
    fn output_text(&self) -> String {
        let mode =
            self.mode.map_or("outside RUN".to_owned(), |now| format!("in {}", now.mode.name()));
        match self.output {
            OutputState::AsMemory => String::new(),
            OutputState::Safe(on) => {
                format!(" in memory; its output is {}, the safe value {mode}", state(on))
            }
            OutputState::Unknown(last) => {
                let last = last.map_or(String::new(), |on| format!(", last {}", state(on)));
                format!(" in memory; its output is not known{last}: its device is lost")
            }
        }
    }

    /// The meaning of the marks `…` in the text: lines, each with a line end.
    pub fn hints(&self) -> String {
        let mut hints = String::new();
        if let Some(depth) = self.deeper {
            hints.push_str(&format!("…: more with --depth {depth}\n"));
        }
        if self.is_long {
            let end = "…: the answer became too long; ask about these operands separately";
            hints.push_str(&format!("{end}\n"));
        }
        hints
    }

    /// The line for a search without success.
    fn not_found(&self, every_single: bool, tried: u32, to: &str) -> String {
        // One scan was tried without any edit.
        let singles = tried.saturating_sub(self.combined + 1);
        match (every_single, self.combined) {
            (true, 0) if singles == 0 => format!("no input turns it {to} in the next scan"),
            (true, 0) => {
                format!(
                    "one input is not enough to turn it {to} in the next scan ({singles} tried)"
                )
            }
            (true, combined) => format!(
                "one input is not enough to turn it {to} in the next scan ({singles} tried), nor \
                 two or three ({combined} tried)"
            ),
            (false, _) => {
                format!("nothing that was tried turns it {to} in the next scan ({tried} tried)")
            }
        }
    }
}

/// Whether an instruction is the OUT that changed the bit, and its rung has the same power as at
/// that time. Then the OUT keeps the value: it will write the same value again.
fn keeps(idle: &Idle, legs: &[LegSeen], node: &Node) -> bool {
    let Cause::Instruction { place, .. } = &node.write.cause else { return false };
    let is_out = *place == idle.place && place.text.starts_with("OUT ");
    is_out && legs.iter().all(|leg| leg.on) == (node.value != 0)
}

impl IndentedLines {
    fn add(&mut self, indent: usize, line: &str) {
        self.text.push_str(&"  ".repeat(indent));
        // A text of the ladder must not add a line to the answer.
        self.text.push_str(&escaped(line));
        self.text.push('\n');
    }

    /// The last change of the operand of the question, unless the line of its write contains it.
    fn changed(&mut self, changed: &LastChange, root: &Node, line: Line) {
        let cause = match &changed.cause {
            Some(Cause::Initial | Cause::Restored | Cause::Older(_)) | None => return,
            Some(cause) => cause,
        };
        let write = super::answer::Write {
            since: changed.since,
            before: changed.before,
            in_last_scan: false,
            cause: cause.clone(),
        };
        let written = WriteFacts { operand: &root.operand, value: root.value, past: line.past };
        let told = self.telling.write(&write, written, None);
        self.add(line.indent, &told);
        self.cause(cause, Line { past: true, ..line });
    }

    /// The write of an operand, with its reasons.
    fn node(&mut self, node: &Node, changed: Option<&LastChange>, line: Line) {
        let written = WriteFacts { operand: &node.operand, value: node.value, past: line.past };
        if !node.is_told_by_earlier() {
            let told = self.telling.write(&node.write, written, changed);
            self.add(line.indent, &told);
        }
        if let Some(about) = &node.about {
            let about = self.about(about, line.past);
            self.add(line.indent, &about);
        }
        let past = line.past || self.telling.is_earlier(node.write.since);
        self.cause(&node.write.cause, Line { past, ..line });
        for idle in &node.idle {
            self.idle(idle, node, line);
        }
        if let Some(earlier) = &node.earlier {
            self.earlier(earlier, node.value, line);
        }
    }

    /// The answer of the program before a reload: of the last one in which the value changed, or
    /// before which it is not known.
    fn earlier(&mut self, earlier: &Explanation, value: i32, line: Line) {
        let root = &earlier.root;
        let is_same = root.value == value;
        if let Some(before) = &root.earlier
            && is_same
            && (root.is_told_by_earlier() || earlier.changed.is_some())
        {
            return self.earlier(before, value, line);
        }
        let scan = match earlier.at.scan {
            Some(scan) => format!("after scan {scan}"),
            None => "before the first scan".to_owned(),
        };
        let was = match is_same {
            true => String::new(),
            false => format!(", it was {}", value_text(&root.operand, root.value)),
        };
        let head = format!("before the program was reloaded, {scan}{was}");
        self.earlier += 1;
        if self.is_shown(root) {
            self.add(line.indent, &format!("{head} (see above)"));
        } else {
            self.add(line.indent, &format!("{head}:"));
            let line = Line { indent: line.indent + 1, past: true };
            if let Some(changed) = &earlier.changed {
                self.changed(changed, root, line);
            }
            self.node(root, earlier.changed.as_ref(), line);
        }
        self.earlier -= 1;
    }

    /// Whether an answer of an earlier program has explained an operand in the same way; else notes
    /// that it does now.
    fn is_shown(&mut self, node: &Node) -> bool {
        if self.earlier == 0 {
            return false;
        }
        let is_shown = self.shown.contains(node);
        if !is_shown && self.shown.len() < SHOWN_MAX {
            self.shown.push(node.clone());
        }
        is_shown
    }

    fn cause(&mut self, cause: &Cause, line: Line) {
        match cause {
            Cause::Instruction { legs, operands, zeros, calls, .. } => {
                for CallPlace { rung, place } in calls {
                    let rung = rung_text(rung, place);
                    self.add(line.indent + 1, &format!("by {}: {rung}", place.text));
                }
                legs.iter().for_each(|leg| self.leg(leg, line));
                for ExplainedOperand { operand, value, followed } in operands {
                    let value = value_text(operand, *value);
                    let text = format!("with {} = {value}", operand_text(operand));
                    self.followed(&text, followed, line.deeper(1));
                }
                if *zeros > 0 {
                    self.add(line.indent + 1, &format!("and {zeros} that {} 0", line.are()));
                }
            }
            Cause::Pass { stop, .. } => match stop {
                Stop::Controller | Stop::Again(_, None) => {}
                Stop::Again(_, Some(restart)) => self.restart(restart, line.deeper(1)),
                Stop::Bit(node) => self.because(node, line.deeper(1)),
            },
            Cause::Turn { restart: Some(restart), .. } => self.restart(restart, line.deeper(1)),
            Cause::Turn { running: Some(node), .. } => self.because(node, line.deeper(1)),
            Cause::Turn { running: None, .. }
            | Cause::Force { .. }
            | Cause::Outside { .. }
            | Cause::Status
            | Cause::Controller
            | Cause::Resumed
            | Cause::Initial
            | Cause::Restored
            | Cause::Older(_) => {}
        }
    }

    fn restart(&mut self, restart: &Restart, line: Line) {
        let when = self.telling.ago(restart.at);
        let rung = rung_text(&restart.rung, &restart.place);
        self.add(line.indent, &format!("because of {} {when}: {rung}", restart.place.text));
        let past = line.past || self.telling.is_earlier(Since::At(restart.at));
        restart.legs.iter().for_each(|leg| self.leg(leg, Line { past, ..line }));
    }

    fn because(&mut self, node: &Node, line: Line) {
        let value = value_text(&node.operand, node.value);
        let (operand, is) = (operand_text(&node.operand), line.is());
        self.add(line.indent, &format!("because {operand} {is} {value}"));
        self.node(node, None, line.deeper(1));
    }

    fn leg(&mut self, leg: &LegSeen, line: Line) {
        let name = if leg.name == "when" { "the rung" } else { leg.name };
        self.add(line.indent + 1, &format!("{name} {} {}, because", line.is(), state(leg.on)));
        let deciding: Vec<&ContactSeen> =
            leg.latest.iter().filter_map(|at| leg.contacts.get(*at)).collect();
        self.contacts(&deciding, line.deeper(2), "");
        self.contacts(&leg.also_off.iter().collect::<Vec<_>>(), line.deeper(2), "also ");
    }

    /// Contacts; of many, only the first ones, and the number of the others.
    fn contacts(&mut self, all: &[&ContactSeen], line: Line, before: &str) {
        let told = if all.len() > TOLD_MAX { CONTACTS_TOLD } else { all.len() };
        all.iter().take(told).for_each(|contact| self.contact(contact, line, before));
        let folded = &all[told..];
        for on in [true, false] {
            let count = folded.iter().filter(|contact| contact.on == on).count();
            if count > 0 {
                let are = line.are();
                self.add(line.indent, &format!("and {count} that {are} {before}{}", state(on)));
            }
        }
    }

    /// A contact; `before`: the text before its line.
    fn contact(&mut self, contact: &ContactSeen, line: Line, before: &str) {
        let on = state(contact.on);
        let head = |name: &str| match before {
            "also " => format!("also {on}: {name}"),
            _ => format!("{before}{name} {} {on}", line.is()),
        };
        match &contact.detail {
            ContactDetail::Bit(operand, followed) => {
                self.followed(&head(&operand_text(operand)), followed, line);
            }
            ContactDetail::Element { bit, index } => {
                let text = &contact.place.text;
                match bit {
                    Some((operand, followed)) => {
                        let name = format!("{text} ({})", operand.name);
                        self.followed(&head(&name), followed, line);
                    }
                    None => self.add(line.indent, &head(&format!("{text} (outside of the array)"))),
                }
                let with = format!("with {} = {}", operand_text(&index.operand), index.value);
                self.followed(&with, &index.followed, line.deeper(1));
            }
            ContactDetail::Compare { sides, real } => {
                let text = &contact.place.text;
                let side = |at: usize| ComparedSide {
                    value: sides[at].value,
                    operand: sides[at].operand.as_ref(),
                    is_real: real[at],
                };
                let values = sides_text(text, [side(0), side(1)]);
                let colon = if values.is_empty() { "" } else { ": " };
                self.add(line.indent, &format!("{}{colon}{values}", head(text)));
                for ExplainedValue { value, operand, followed } in sides {
                    let Some(operand) = operand else { continue };
                    let value = value_text(operand, *value);
                    let side = format!("{} {} {value}", operand_text(operand), line.is());
                    self.followed(&side, followed, line.deeper(1));
                }
            }
            ContactDetail::Computed { sides, is_time, operands } => {
                let text = &contact.place.text;
                let values = computed_text(text, sides, *is_time);
                let colon = if values.is_empty() { "" } else { ": " };
                self.add(line.indent, &format!("{}{colon}{values}", head(text)));
                for ExplainedOperand { operand, value, followed } in operands {
                    let value = value_text(operand, *value);
                    let side = format!("{} {} {value}", operand_text(operand), line.is());
                    self.followed(&side, followed, line.deeper(1));
                }
            }
            ContactDetail::Edge { last, inner_on, inner } => {
                let last = match last {
                    Since::At(_) if contact.on => String::new(),
                    Since::At(when) => format!("; last ON {}", self.telling.ago(*when)),
                    Since::Before(when) => {
                        format!("; {}", self.telling.missing("never ON", *when))
                    }
                };
                self.add(line.indent, &format!("{}{last}", head(&contact.place.text)));
                self.inner(&contact.place.text, *inner_on, inner, line.deeper(1));
            }
        }
    }

    /// The contacts in an edge.
    fn inner(&mut self, edge: &str, on: bool, inner: &[ContactSeen], line: Line) {
        let text = edge.split_once('(').map_or(edge, |(_, text)| text);
        let text = text.strip_suffix(')').unwrap_or(text).trim();
        if let [contact] = inner
            && contact.place.text == text
        {
            return self.contact(contact, line, "inside: ");
        }
        self.add(line.indent, &format!("inside: {text} {} {}, because", line.is(), state(on)));
        inner.iter().for_each(|contact| self.contact(contact, line.deeper(1), ""));
    }

    fn followed(&mut self, text: &str, followed: &Followed, line: Line) {
        match followed {
            Followed::Node(node) if self.is_shown(node) => {
                self.add(line.indent, &format!("{text} (see above)"));
            }
            Followed::Node(node) => {
                self.add(line.indent, text);
                self.node(node, None, line.deeper(1));
            }
            Followed::Cut(Cut::Shown) => self.add(line.indent, &format!("{text} (see above)")),
            Followed::Cut(Cut::Depth | Cut::Length) => {
                self.add(line.indent, &format!("{text} …"));
            }
            Followed::Cut(Cut::Constant) => self.add(line.indent, text),
        }
    }

    fn idle(&mut self, idle: &Idle, node: &Node, line: Line) {
        let text = &idle.place.text;
        let rung = rung_text(&idle.rung, &idle.place);
        let (does, is) = (if line.past { "did" } else { "does" }, line.is());
        match &idle.because {
            Hindrance::Stopped(bit, followed) => {
                let bit = operand_text(bit);
                let told = format!("{text} {does} not execute ({rung}), because {bit} {is} OFF");
                self.followed(&told, followed, line);
            }
            Hindrance::Legs(legs) => {
                let value = value_text(&node.operand, node.value);
                let told = if keeps(idle, legs, node) {
                    format!(
                        "{text} {} it {value}: {rung}",
                        if line.past { "kept" } else { "keeps" }
                    )
                } else {
                    format!("{text} could change it, but {does} not: {rung}")
                };
                self.add(line.indent, &told);
                legs.iter().for_each(|leg| self.leg(leg, line));
            }
        }
    }

    fn about(&self, about: &About, past: bool) -> String {
        let lasting = |since| match past {
            true => String::new(),
            false => self.telling.lasting(since),
        };
        match about {
            About::Timer { acc_ms, preset_ms, timing, since, done } => {
                let preset_text = preset_ms.map(|preset| format!(" of {}", ms(preset)));
                let time = format!("{}{}", ms(*acc_ms), preset_text.unwrap_or_default());
                match done {
                    Some(done) => format!("done{}: {time}", lasting(*done)),
                    None => {
                        let timing = if *timing { "timing" } else { "not timing" };
                        format!("{time}, {timing}{}", lasting(*since))
                    }
                }
            }
            About::Counter { acc, presets, counted, reset } => {
                let presets: Vec<String> = presets.iter().map(i32::to_string).collect();
                let preset_text = match presets.is_empty() {
                    true => String::new(),
                    false => format!(" of {}", presets.join(" and ")),
                };
                let [counted, reset] =
                    [(counted, "counted"), (reset, "reset")].map(|(last, did)| match last {
                        Since::At(when) => format!("last {did} {}", self.telling.ago(*when)),
                        Since::Before(when) => self.telling.missing(&format!("not {did}"), *when),
                    });
                format!("{acc}{preset_text}, {counted}, {reset}")
            }
        }
    }

    fn change(&self, explanation: &Explanation, change: &Remedy) -> String {
        let to = state(explanation.root.value == 0);
        match change {
            Remedy::Edits(edits) => {
                if let [super::answer::Edit::Write { operand, .. }] = edits.as_slice()
                    && operand.cell == explanation.root.operand.cell
                {
                    return "nothing in the ladder writes it".to_owned();
                }
                let edits: Vec<String> = edits.iter().map(edit_text).collect();
                format!("{} would turn it {to} in the next scan", edits.join(" and "))
            }
            Remedy::Itself => format!("it turns {to} in the next scan by itself"),
            Remedy::Release => "it is forced: only a release lets it change".to_owned(),
            Remedy::NoScan => self.no_scan(explanation.mode),
            Remedy::None(end) => explanation.not_found(end.every_single, end.tried, to),
        }
    }

    fn no_scan(&self, mode: Option<ModeSince>) -> String {
        let Some(ModeSince { mode, since }) = mode else {
            return "the controller does not scan: it stays".to_owned();
        };
        let since = match since {
            Since::At(when) => when.scan.map(|scan| format!(" since scan {scan}")),
            Since::Before(_) => None,
        };
        let reason = match mode {
            Mode::Run => String::new(),
            Mode::Stop(reason) => format!(" ({reason})"),
            Mode::Fault(reason) => format!(" ({reason})"),
        };
        let (name, since) = (mode.name(), since.unwrap_or_default());
        format!("the controller is in {name}{since}{reason}: no scan changes it")
    }
}
