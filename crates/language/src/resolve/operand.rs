//! Resolves instructions: checks each operand against the instruction table. Called by `rung`.

use std::ops::RangeInclusive;

use super::Resolver;
use super::declare::BUILT_IN;
use super::instruction::{Instruction, OperandList, OperandValue, ResolvedOperand, Value};
use super::mistake::{LISTED_MAX, declared_table};
use super::places::type_of;
use super::program::BlockKind;
use super::scope::{MisplacedName, NamedThing};
use super::writable::reset_of;
use crate::source::atom::Atom;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, Help, advise, possible, proposed, write};
use crate::source::instruction::{self as written};
use crate::source::nearest::did_you_mean;
use crate::source::span::Span;
use rungd_engine::isa::duration;
pub use rungd_engine::isa::{Address, BlockId, LegName, OperandKind, OperandSpec, Spec, Structure};

impl Resolver<'_> {
    /// Resolves one instruction; `None` if it has a mistake.
    pub(super) fn instruction(
        &mut self,
        text: &written::WrittenInstruction,
        spec: &'static Spec,
        block: BlockId,
    ) -> Option<Instruction> {
        if let Some(formula) = &text.formula {
            return self.math(text.span, formula, spec);
        }
        if let Some(copy) = self.record_copy(text, spec) {
            return copy;
        }
        let mut whole = true;
        let mut operands = OperandList::default();
        let mut given = Vec::new();
        for operand in &text.operands {
            let Some(row) = self.row(text, operand, spec, &given) else {
                whole = false;
                continue;
            };
            if !given.contains(&row.name) {
                given.push(row.name);
            }
            match self.arg(row, &operand.value, spec, block) {
                Some(value) => {
                    let span = operand.value.span;
                    operands.0.push(ResolvedOperand { row, value, span });
                }
                None => whole = false,
            }
        }
        for row in spec.operands.iter().filter(|row| !row.optional && !given.contains(&row.name)) {
            // A superfluous operand is often the missing one without its key, so one finding is
            // enough.
            whole = false;
            if !has_lost(text, spec) {
                self.find(missing_operand(text, spec, row));
            }
        }
        let order = |name| spec.operands.iter().position(|row| row.name == name);
        operands.0.sort_by_key(|operand| order(operand.row.name));
        let mnemonic = spec.mnemonic;
        whole &= self.arrays_fit(&operands, spec) && self.packing_fits(&operands, spec);
        whole.then_some(Instruction { mnemonic, span: text.span, operands, calculation: None })
    }

    /// The operand's row in the instruction table.
    fn row(
        &mut self,
        text: &written::WrittenInstruction,
        operand: &written::OperandText,
        spec: &'static Spec,
        given: &[&str],
    ) -> Option<&'static OperandSpec> {
        let Some(key) = &operand.key else {
            let row = positional(spec, given);
            if row.is_none() {
                self.find(too_many(text, operand, spec));
            }
            return row;
        };
        let row = spec.row(Some(&key.value), 0);
        if row.is_none() {
            let message = format!("`{}` has no operand `{}=`", spec.name, key.value);
            let keys = spec.operands.iter().filter_map(|row| row.key);
            let form = format!("its form is `{}`", spec.form());
            let free = spec.operands.iter().filter_map(|row| row.key);
            let free = free.filter(|key| !given.contains(key)).map(possible);
            let help = match did_you_mean(&key.value, keys) {
                Some(near) => near.and(&format!(" {form}")),
                None => Help::from(form).with_all(free),
            };
            self.find(Finding::new(Code::UnknownOperand, key.span, message).help(help));
        }
        if given.contains(&key.value.as_str()) {
            let message = format!("`{}=` is given twice", key.value);
            self.find(Finding::new(Code::InstructionSyntax, operand.span, message).or_omit());
            return None;
        }
        row
    }

    fn arg(
        &mut self,
        row: &OperandSpec,
        atom: &Atom,
        spec: &Spec,
        block: BlockId,
    ) -> Option<OperandValue> {
        let mut structure = |like| self.structure(atom, like, spec).map(OperandValue::Structure);
        match row.kind {
            OperandKind::WritableBit => match self.selected(atom, true, spec) {
                Some(found) => found,
                None => self.writable_bit(atom, spec).map(OperandValue::Bit),
            },
            // The text of MATH has no operands; `math` resolves its target.
            OperandKind::WritableWord | OperandKind::Target => {
                match self.selected(atom, false, spec) {
                    Some(found) => found,
                    None => self.writable_word(atom, spec).map(OperandValue::Word),
                }
            }
            OperandKind::Array => {
                self.run(atom, spec, true).map(|run| OperandValue::Array(run.array))
            }
            OperandKind::WritableArray => {
                let run = self.run(atom, spec, true)?;
                self.writable_run(run, atom, spec).map(|run| OperandValue::Array(run.array))
            }
            OperandKind::Bits => {
                let run = self.run(atom, spec, true)?;
                self.packed_bits(run, atom, spec)
            }
            OperandKind::WritableBits => {
                let run = self.run(atom, spec, true)?;
                let run = self.writable_run(run, atom, spec)?;
                self.packed_bits(run, atom, spec)
            }
            OperandKind::Shifted => {
                let run = self.run(atom, spec, false)?;
                self.writable_run(run, atom, spec).and_then(|run| self.shifted(run, atom))
            }
            OperandKind::Filling => self.filling(atom),
            OperandKind::Counter => structure(Structure::Counter(0)),
            OperandKind::Timer => structure(Structure::Timer(0)),
            OperandKind::Sensaphone => structure(Structure::Sensaphone(0)),
            OperandKind::Number => self.value(atom).map(OperandValue::Value),
            OperandKind::Value(least, most) => {
                let value = self.whole(atom, row)?;
                self.within(value, least..=most, atom, row)
            }
            OperandKind::Duration => {
                let value = self.whole(atom, row)?;
                self.within(value, 0..=i32::MAX, atom, row)
            }
            OperandKind::Interval => self.whole(atom, row).map(OperandValue::Value),
            OperandKind::Program
            | OperandKind::Block
            | OperandKind::Task
            | OperandKind::Subroutine => {
                self.block_operand(atom, row.kind).map(OperandValue::Block)
            }
            OperandKind::Stage | OperandKind::Stages => self.stage_operand(atom, spec, block),
        }
    }

    /// Resolves a value that must not be a real: presets and intervals are whole numbers.
    fn whole(&mut self, atom: &Atom, row: &OperandSpec) -> Option<Value> {
        let value = self.value(atom)?;
        if value.is_real() {
            let message = format!("the {} `{atom}` is a real, not a whole number", row.name);
            let finding = Finding::new(Code::OperandType, atom.span, message);
            self.find(finding.help(whole_help(atom, value, row)));
            return None;
        }
        Some(value)
    }

    fn within(
        &mut self,
        value: Value,
        range: RangeInclusive<i32>,
        atom: &Atom,
        row: &OperandSpec,
    ) -> Option<OperandValue> {
        let (least, most) = range.into_inner();
        if let Value::Const(n, _) = value
            && !(least..=most).contains(&n)
        {
            let message = format!("the {} {n} lies outside {least}..{most}", row.name);
            let nearest = if n < least { least } else { most };
            let help = match (row.kind, row.key) {
                (OperandKind::Duration, _) => {
                    let times = [possible("3s")];
                    advise("a time is never negative: `{}`, or a number of ms", times)
                }
                (_, Some(key)) => {
                    advise("the nearest is `{}`", [proposed(format!("{key}={nearest}"))])
                }
                _ => advise("the nearest is `{}`", [proposed(nearest.to_string())]),
            };
            self.find(Finding::new(Code::OutOfRange, atom.span, message).help(help));
            return None;
        }
        Some(OperandValue::Value(value))
    }

    /// A structure of the same kind as `like`.
    pub(super) fn structure(
        &mut self,
        atom: &Atom,
        like: Structure,
        spec: &Spec,
    ) -> Option<Structure> {
        let wanted = match like {
            Structure::Counter(_) => "a counter",
            Structure::Timer(_) => "a timer",
            Structure::Sensaphone(_) => "a Sensaphone counter",
        };
        let kind = type_of(like.space());
        let (name, thing) = self.thing(atom, wanted, kind.as_slice())?;
        let fits = |structure: &Structure| structure.space() == like.space();
        if let NamedThing::Address(address @ Address::Structure(structure)) = thing
            && fits(&structure)
        {
            self.note(name, atom.span, address);
            return Some(structure);
        }
        let base = whole(name);
        let help = match self.scope.look_up(base).map(|found| found.thing) {
            Ok(NamedThing::Address(Address::Structure(structure)))
                if fits(&structure) && base != name =>
            {
                advise("name the whole structure: `{}`", [proposed(base)])
            }
            Ok(NamedThing::Address(Address::Structure(structure)))
                if spec.legs == [LegName::When] && !spec.mnemonic.owns_structure() =>
            {
                write(format!("{} {base}", reset_of(structure)))
            }
            Ok(_) | Err(_) => {
                let words = format!("`{}` works on {wanted}: `{{}}`, or a tag of one", spec.name);
                advise(&words, [possible(like.to_string())])
            }
        };
        self.wrong_kind(MisplacedName { name, span: atom.span, thing }, wanted, help);
        None
    }

    /// Resolves a block of any kind. The rule `block-rule` checks whether the instruction may act
    /// on it.
    fn block_operand(&mut self, atom: &Atom, kind: OperandKind) -> Option<BlockId> {
        let wanted = kind_words(kind);
        let name = self.name_of(atom, wanted)?;
        let block = self.scope.block(name).map(|block| block.id);
        if block.is_none() {
            self.unknown_block(atom, kind);
        }
        block
    }

    fn unknown_block(&mut self, atom: &Atom, kind: OperandKind) {
        let (name, wanted) = (atom.to_string(), kind_words(kind));
        if atom.name().is_some_and(|name| self.scope.tag_index(name).is_some()) {
            self.mark_used(&name);
            let message = format!("`{name}` is a tag, not {wanted}");
            self.find(Finding::new(Code::OperandType, atom.span, message));
            return;
        }
        if BUILT_IN.iter().any(|(built_in, _)| *built_in == name) {
            let message = format!("`{name}` is a built-in task: nothing starts or stops it");
            let finding = Finding::new(Code::BuiltInTask, atom.span, message);
            return self.find(
                finding
                    .help("delete this; a task of your own needs a different name")
                    .fix(FixEdit::Delete),
            );
        }
        let is_subroutine = kind == OperandKind::Subroutine;
        let what = if is_subroutine { "subroutine" } else { "program or task" };
        let header = match kind == OperandKind::Task {
            true => "task",
            false if is_subroutine => "subroutine",
            false => "program",
        };
        let declare = declared_table(&format!("[[{header}]]"), &name);
        let message = format!("no {what} is called `{name}`");
        let finding = Finding::new(Code::UnknownBlock, atom.span, message).help(declare);
        self.find(finding.near(&name, self.scope.known_blocks()));
    }

    fn stage_operand(&mut self, atom: &Atom, spec: &Spec, block: BlockId) -> Option<OperandValue> {
        let name = self.name_of(atom, "the name of a stage")?.to_owned();
        let (program, names) = self.scope.block_of(block)?;
        if let Some(id) = names.stages.get(&name) {
            return Some(OperandValue::Stage(*id));
        }
        let message = format!("`{program}` has no stage `{name}`");
        let own = name.strip_prefix(program).and_then(|rest| rest.strip_prefix('.'));
        let help = if let Some(stage) = own.filter(|stage| names.stages.contains_key(*stage)) {
            advise("a stage of the same program goes without its name: `{}`", [stage])
        } else if name.contains('.') {
            let own_stages = names.known_stages().iter().take(LISTED_MAX);
            Help::from(format!("`{}` reaches the stages of its own program only", spec.name))
                .with_all(own_stages.map(possible))
        } else if names.kind == BlockKind::Subroutine {
            let words = "a subroutine has no stages, and switches none: let it set a bit, and jump \
                         where the stage is";
            words.into()
        } else if names.stages.is_empty() && names.kind != BlockKind::Program {
            "tasks have no stages; make it a `[[program]]`".into()
        } else if names.stages.is_empty() {
            "stages are declared by `[[program.stage]]`, and only a rung of a stage jumps".into()
        } else {
            let declare = declared_table("[[program.stage]]", &name);
            let finding = Finding::new(Code::UnknownStage, atom.span, message).help(declare);
            self.find(finding.near(&name, names.known_stages()));
            return None;
        };
        self.find(Finding::new(Code::UnknownStage, atom.span, message).help(help));
        None
    }
}

/// The help for a real in the place of a whole number.
fn whole_help(atom: &Atom, value: Value, row: &OperandSpec) -> Help {
    let is_time = matches!(row.kind, OperandKind::Duration | OperandKind::Interval);
    let seconds = match value {
        Value::Real(real) if is_time => duration::of_seconds(f64::from(real.number())),
        Value::Real(_) | Value::Const(..) | Value::Word(_) | Value::Element(_) => None,
    };
    let key = row.key.map_or(String::new(), |key| format!("{key}="));
    match (seconds, atom.name()) {
        (Some(time), None) => {
            advise("if it is in seconds, write `{}`", [proposed(format!("{key}{time}"))])
        }
        (Some(time), Some(name)) => format!(
            "if it is in seconds, give the tag a duration: `{name} = {{ value = \"{time}\" }}`"
        )
        .into(),
        (None, _) if is_time => {
            format!("compute the ms in a D word, and name it here: `MATH D0 = {atom} * 1000.0`")
                .into()
        }
        (None, _) => "`MOVE` a real to a D word, and name that word here".into(),
    }
}

/// The part of a name that names the structure: `CT0` in `CT0.Acc`, `N,0` in `N,0,6`.
fn whole(name: &str) -> &str {
    let mut commas = name.match_indices(',').map(|(at, _)| at);
    let end = name.find('.').or(commas.nth(1)).unwrap_or(name.len());
    &name[..end]
}

/// The first positional operand that is not given yet.
fn positional(spec: &'static Spec, given: &[&str]) -> Option<&'static OperandSpec> {
    let mut rows = spec.operands.iter().filter(|row| row.key.is_none());
    rows.find(|row| row.kind == OperandKind::Stages || !given.contains(&row.name))
}

/// Whether an operand has no row: its key is unknown, or there are more operands than rows.
fn has_lost(text: &written::WrittenInstruction, spec: &Spec) -> bool {
    let (keyed, positional): (Vec<_>, Vec<_>) =
        text.operands.iter().partition(|operand| operand.key.is_some());
    let known = |key: &str| spec.row(Some(key), 0).is_some();
    let unknown_key = keyed.iter().filter_map(|o| o.key.as_ref()).any(|key| !known(&key.value));
    let rows = || spec.operands.iter().filter(|row| row.key.is_none());
    unknown_key
        || (!rows().any(|row| row.kind == OperandKind::Stages) && positional.len() > rows().count())
}

fn too_many(
    text: &written::WrittenInstruction,
    operand: &written::OperandText,
    spec: &Spec,
) -> Finding {
    // There may be thousands of operands; the first 32 are enough.
    let near = || text.operands.iter().take(32).filter_map(|operand| operand.key.as_ref());
    let is_taken = |key: &str| near().any(|taken| taken.value == key);
    let free = spec.operands.iter().filter_map(|row| row.key).find(|key| !is_taken(key));
    let message = format!("`{}` has no place for `{}`", spec.name, operand.value);
    let help = match free {
        Some(key) => write(format!("{key}={}", operand.value))
            .and(&format!("; the form is `{}`", spec.form())),
        None => format!("its form is `{}`", spec.form()).into(),
    };
    let finding = Finding::new(Code::UnknownOperand, operand.span, message);
    let finding = finding.label("one too many").help(help);
    if free.is_none() { finding.or_omit() } else { finding }
}

fn missing_operand(text: &written::WrittenInstruction, spec: &Spec, row: &OperandSpec) -> Finding {
    let what = match row.key {
        Some(key) => format!("`{key}=`"),
        None => format!("{} to work on", kind_words(row.kind)),
    };
    let message = format!("`{}` lacks {what}", spec.name);
    let end = Span { start: text.span.start, ..text.span };
    let finding = Finding::new(Code::MissingOperand, end, message);
    let finding = finding.help(format!("its form is `{}`", spec.form()));
    let behind = Span { start: text.span.end, ..text.span };
    match example(row) {
        Some(example) => finding.fix(possible(format!(" {example}")).at(behind)),
        None => finding,
    }
}

/// An example of an operand.
fn example(row: &OperandSpec) -> Option<String> {
    let value = match row.kind {
        OperandKind::WritableBit => "C0".to_owned(),
        OperandKind::WritableWord | OperandKind::Target => "D0".to_owned(),
        OperandKind::Number => "1".to_owned(),
        OperandKind::Value(least, most) => 1.clamp(least, most).to_string(),
        OperandKind::Duration | OperandKind::Interval => "1s".to_owned(),
        OperandKind::Array
        | OperandKind::WritableArray
        | OperandKind::Bits
        | OperandKind::WritableBits
        | OperandKind::Shifted
        | OperandKind::Filling
        | OperandKind::Counter
        | OperandKind::Timer
        | OperandKind::Sensaphone
        | OperandKind::Program
        | OperandKind::Block
        | OperandKind::Task
        | OperandKind::Subroutine
        | OperandKind::Stage
        | OperandKind::Stages => return None,
    };
    Some(row.key.map_or(value.clone(), |key| format!("{key}={value}")))
}

fn kind_words(kind: OperandKind) -> &'static str {
    match kind {
        OperandKind::WritableBit => "a bit",
        OperandKind::WritableWord => "a word",
        OperandKind::Target => "a word or bit",
        OperandKind::Array | OperandKind::WritableArray => "an array",
        OperandKind::Bits | OperandKind::WritableBits | OperandKind::Shifted => "an array of bits",
        OperandKind::Filling => "a value",
        OperandKind::Counter => "a counter",
        OperandKind::Timer => "a timer",
        OperandKind::Sensaphone => "a Sensaphone counter",
        OperandKind::Number | OperandKind::Value(..) => "a value",
        OperandKind::Duration | OperandKind::Interval => "a duration",
        OperandKind::Program => "a program",
        OperandKind::Block => "a program or task",
        OperandKind::Task => "a task",
        OperandKind::Subroutine => "a subroutine",
        OperandKind::Stage | OperandKind::Stages => "a stage",
    }
}
