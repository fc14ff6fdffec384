//! Resolves an operator's texts: tags, addresses and ranges, by the names of the ladder.
//!
//! Made once for each program; `daemon::operator_server` looks up every operand of a request in it.
//! `operand` decides whether an operand may be written or forced.

use std::collections::{HashMap, HashSet};

use super::groups::Groups;
use super::metric::MetricNames;
use super::offer::NameOffer;
use super::operand::Variable;
use super::protocol::{
    GivenValue, MetricList, OPERANDS_MAX, OfferedName, RefusalKind, RequestRefusal,
};
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Bit, BitSpace, DeviceBit, OperandRole};
use rungd_language::lower::Symbols;
use rungd_language::resolve::mistake::sentence;
use rungd_language::resolve::program::{BlockKind, Program, TagMeaning};
use rungd_language::resolve::range::{is_range, other_range, resolve_range};
use rungd_language::resolve::record::RecordPlace;
use rungd_language::resolve::scope::{NamedThing, Scope};
use rungd_language::source::finding::Finding;
use rungd_language::source::reader::Text;
use rungd_language::source::span::Span;
use rungd_runtime::exchange::{Mode, Snapshot};

/// The number of names that are searched for the nearest one if a name is unknown. All clients, the
/// Modbus server and the field devices share one thread: an answer may not occupy it for long.
const SEARCHED_MAX: usize = 100;

/// All names of a program.
#[derive(Debug)]
pub struct OperandNames {
    scope: Scope,
    symbols: Symbols,
    /// The units of words.
    units: HashMap<Address, String>,
    metrics: MetricNames,
    /// The names that stand for several bits or words.
    groups: Groups,
    offered: NameOffer,
    /// The addresses of tags, in file order.
    tagged: Vec<Address>,
    /// The bits that the ladder turns OFF, or writes, but drives in no scan by itself.
    taken: HashSet<Bit>,
}

impl OperandNames {
    /// The names of a program.
    pub fn new(program: &Program, symbols: &Symbols) -> OperandNames {
        let mut names = OperandNames {
            scope: Scope::of(program).searching_at_most(SEARCHED_MAX),
            symbols: symbols.clone(),
            units: HashMap::new(),
            metrics: MetricNames::of(program),
            groups: Groups::of(program),
            offered: NameOffer::default(),
            tagged: Vec::new(),
            taken: taken(program),
        };
        for tag in &program.tags {
            if let TagMeaning::Address(address) = tag.meaning {
                let kind = program.names.places.at(address).map(|(place, _)| place.type_name());
                let kind = kind.map_or_else(|| address.to_string(), str::to_owned);
                let about = match &tag.doc {
                    Some(doc) => format!("{kind}: {doc}"),
                    None => kind,
                };
                names.tag(&tag.name, address, &about);
                names.tagged.push(address);
                if let Some(unit) = &tag.unit {
                    names.units.insert(address, unit.text.clone());
                }
            }
        }
        for block in program.blocks.iter().filter(|block| !block.is_subroutine()) {
            names.offered.add(&format!("{}.Running", block.name), "a block");
            if block.kind != BlockKind::Program {
                names.offered.add(&format!("{}.Done", block.name), "a block");
            }
            for stage in &block.stages {
                names.offered.add(&format!("{}.{}", block.name, stage.name), "a Stage");
            }
        }
        for device in &program.devices {
            for health in DeviceBit::ALL {
                names.offered.add(&format!("{}.{}", device, health.name()), "a field device");
            }
        }
        for (name, about) in names.groups.names() {
            names.offered.add(name, about);
        }
        for operand in &program.operands {
            names.offered.add(&operand.name(), "named in the ladder");
        }
        names
    }

    fn tag(&mut self, name: &str, address: Address, about: &str) {
        self.offered.add(name, about);
        if let Address::Structure(_) = address {
            for (name, member) in address.named_operands(name) {
                self.offered.add(&name, &self.scope.places().say(member));
            }
        }
    }

    /// The operands that a text names: one bit or word, a range, or all members of a structure, a
    /// block, a device or a use.
    ///
    /// # Errors
    /// The text names nothing, or names more operands than one request may read.
    pub fn find(&self, text: &str) -> Result<Vec<Variable>, RequestRefusal> {
        self.find_at_most(OPERANDS_MAX, text)
    }

    /// As [`OperandNames::find`], for a request with room for this many operands.
    pub(super) fn find_at_most(
        &self,
        most: usize,
        text: &str,
    ) -> Result<Vec<Variable>, RequestRefusal> {
        let written = written(text);
        if is_range(&written.text) || self.is_array(&written.text) {
            return self.range(most, &written);
        }
        if let Some(group) = self.group(most, &written.text) {
            return group;
        }
        // Look up the whole text first: a name may contain a `-` without being a range.
        let what = self.look_up(&written.text).map_err(|unknown| {
            other_range(&self.scope, &written).map_or(unknown, |finding| refusal(&finding))
        })?;
        self.members(&written.text, what)
    }

    /// The members of a block, a device or a use; `None` for any other name.
    fn group(&self, most: usize, text: &str) -> Option<Result<Vec<Variable>, RequestRefusal>> {
        let is_one = match self.scope.look_up(text).map(|found| found.thing) {
            Ok(NamedThing::Block(_) | NamedThing::Device(_)) | Err(_) => true,
            Ok(
                NamedThing::Address(_)
                | NamedThing::Constant(..)
                | NamedThing::Real(_)
                | NamedThing::Array(_)
                | NamedThing::Element(_),
            ) => false,
            Ok(NamedThing::Record(place)) => return Some(self.record(most, text, place)),
        };
        let members = if is_one { self.groups.members(text, most) } else { Vec::new() };
        if members.is_empty() {
            return None;
        }
        let mut found = Vec::new();
        for (name, what) in members {
            match self.members(&name, what) {
                Ok(operands) => found.extend(operands),
                Err(refusal) => return Some(Err(refusal)),
            }
        }
        Some(match found.len() > most {
            true => Err(too_many(most, text)),
            false => Ok(found),
        })
    }

    /// The bits and words of a whole record, or of all records of an array.
    fn record(
        &self,
        most: usize,
        text: &str,
        place: RecordPlace,
    ) -> Result<Vec<Variable>, RequestRefusal> {
        let mut found = Vec::new();
        for name in self.scope.fields(place) {
            found.extend(self.members(&name, self.look_up(&name)?)?);
            if found.len() > most {
                return Err(too_many(most, text));
            }
        }
        Ok(found)
    }

    fn is_array(&self, text: &str) -> bool {
        let found = self.scope.look_up(text).map(|found| found.thing);
        matches!(found, Ok(NamedThing::Array(_)))
    }

    fn range(&self, most: usize, written: &Text) -> Result<Vec<Variable>, RequestRefusal> {
        let range = resolve_range(&self.scope, written).map_err(|finding| refusal(&finding))?;
        let mut found = Vec::new();
        for what in range.addresses() {
            found.extend(self.members(&self.address(what), what)?);
            if found.len() > most {
                return Err(too_many(most, &written.text));
            }
        }
        Ok(found)
    }

    fn members(&self, text: &str, what: Address) -> Result<Vec<Variable>, RequestRefusal> {
        what.named_operands(text).map(|(name, what)| self.operand(&name, what)).collect()
    }

    /// The one bit or word that a text names.
    ///
    /// # Errors
    /// The text names nothing, or a structure.
    pub fn find_one(&self, text: &str) -> Result<Variable, RequestRefusal> {
        let written = written(text);
        let range = || {
            let message = format!("`{}` is a range: name one element of it", written.text);
            RequestRefusal::new(RefusalKind::BadOperand, message)
        };
        if is_range(&written.text) {
            return Err(range());
        }
        let what = self.look_up(&written.text).map_err(|unknown| {
            let of_use = || self.use_only(&written.text, unknown);
            other_range(&self.scope, &written).map_or_else(of_use, |_| range())
        })?;
        self.operand(&written.text, what)
    }

    /// The operand of an earlier program in this one: by the text of its request if that still
    /// names the same address, otherwise by its address. `None` if this program does not have it.
    pub fn again(&self, operand: &Variable) -> Option<Variable> {
        let texts = [&operand.operand, &operand.address];
        let mut found = texts.into_iter().filter_map(|text| self.find_one(text).ok());
        found.find(|now| now.address == operand.address)
    }

    /// The refusal of a name that is not an operand; it may be a use of a template.
    fn use_only(&self, text: &str, unknown: RequestRefusal) -> RequestRefusal {
        let is_block = self.scope.look_up(text).is_ok();
        match self.groups.members(text, 0).first() {
            Some((tag, _)) if !is_block => {
                let message =
                    format!("`{text}` is a use of a template: name one of its tags, as `{tag}`");
                RequestRefusal::new(RefusalKind::BadOperand, message)
            }
            Some(_) | None => unknown,
        }
    }

    /// The addresses of tags, in file order; of several tags of one address, each.
    pub(super) fn tagged(&self) -> &[Address] {
        &self.tagged
    }

    /// The names of the tags of records to which operands belong, each once, in their order.
    pub(super) fn records_of(&self, operands: &[Variable]) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for operand in operands {
            let Some(record) = self.scope.record_around(&operand.operand) else { continue };
            if names.last() != Some(&record.name) {
                names.push(record.name.clone());
            }
        }
        names.sort_unstable();
        names.dedup();
        names
    }

    /// Whether the content of a word is within the limits of a write.
    pub(super) fn is_within_limits(&self, operand: &Variable, content: i32) -> bool {
        let Address::Word(word) = operand.what else { return true };
        let (min, max) = self.symbols.limits(word);
        (min..=max).contains(&content)
    }

    /// The operand at an address, with its name in this program.
    pub(crate) fn called(&self, what: Address) -> Option<Variable> {
        let name = self.tag_of(what).unwrap_or_else(|| self.address(what));
        self.operand(&name, what).ok()
    }

    /// Converts a given value to this operand's number.
    ///
    /// # Errors
    /// The value does not fit.
    pub fn number(&self, operand: &Variable, given: &GivenValue) -> Result<i32, RequestRefusal> {
        if let Some(word) = self.symbols.limited_word(operand.what) {
            let message = format!(
                "`{}` cannot be written alone: a tag of `{word}` has `min` or `max`",
                operand.operand
            );
            return Err(RequestRefusal::new(RefusalKind::BadValue, message));
        }
        operand.number(given, |word| self.symbols.limits(word))
    }

    fn look_up(&self, text: &str) -> Result<Address, RequestRefusal> {
        let wrong = |message| RequestRefusal::new(RefusalKind::BadOperand, message);
        self.scope.address(text).map_err(wrong)
    }

    fn operand(&self, text: &str, what: Address) -> Result<Variable, RequestRefusal> {
        let wrong = |message| RequestRefusal::new(RefusalKind::BadOperand, message);
        let cell = self.symbols.cell(what, text).map_err(wrong)?;
        let (tag, unit) = (self.tag_of(what), self.units.get(&what).cloned());
        let (operand, address) = (text.to_owned(), self.address(what));
        let texts = self.symbols.names.texts(what).cloned();
        Ok(Variable { operand, tag, address, unit, texts, what, cell })
    }

    fn address(&self, what: Address) -> String {
        self.symbols.names.address(what)
    }

    /// The first tag of an address or of its structure.
    fn tag_of(&self, what: Address) -> Option<String> {
        self.symbols.names.operand_tag(what).map(|tag| tag.to_string())
    }

    /// Whether the ladder may take a bit as a command: it can turn the bit OFF, and no coil drives
    /// it.
    pub fn may_take(&self, what: Address) -> bool {
        matches!(what, Address::Bit(bit) if self.taken.contains(&bit))
    }

    /// Whether an address is an element of a tag with a `type`: a force of it belongs to the name.
    pub fn is_placed(&self, what: Address) -> bool {
        self.scope.places().at(what).is_some()
    }

    /// The operand in a forced cell, with its name in this program.
    pub fn at(&self, cell: Cell) -> Option<Variable> {
        self.called(self.symbols.layout.address(cell)?)
    }

    /// The outputs whose state differs from memory or, by `is_unknown`, is not known; in order, at
    /// most as many as one request reads.
    pub fn held_otherwise(
        &self,
        image: &Snapshot,
        is_unknown: &dyn Fn(u32) -> bool,
    ) -> Vec<Variable> {
        let outputs = 0..image.outputs.len() as u32;
        let differs = |n: &u32| {
            let cell = self.symbols.layout.bit(Bit::Space(BitSpace::Y, *n));
            image.bit(cell) != (image.outputs[*n as usize] != 0)
        };
        let named = |n| self.called(Address::Bit(Bit::Space(BitSpace::Y, n)));
        // In RUN the outputs follow memory: only a lost device makes a difference.
        let is_otherwise = |n: &u32| is_unknown(*n) || image.mode != Mode::Run && differs(n);
        outputs.filter(is_otherwise).filter_map(named).take(OPERANDS_MAX).collect()
    }

    /// The operands of tags with `metric = true`.
    pub fn metrics(&self) -> MetricList {
        self.metrics.list()
    }

    /// The names that begin with a prefix, for completion.
    pub fn beginning(&self, prefix: &str) -> Vec<OfferedName> {
        self.offered.beginning(prefix)
    }
}

/// The bits that an instruction can turn OFF, without those that a coil drives: a coil writes its
/// bit in every execution, so it takes no command.
fn taken(program: &Program) -> HashSet<Bit> {
    let bits = |is: fn(OperandRole) -> bool| {
        program.instructions().flat_map(move |(_, instruction)| instruction.bits_written_as(is))
    };
    let driven: HashSet<Bit> = bits(|role| role == OperandRole::Drives).collect();
    let written = bits(|role| !matches!(role, OperandRole::Drives | OperandRole::TurnsOn));
    written.filter(|bit| !driven.contains(bit)).collect()
}

fn too_many(most: usize, text: &str) -> RequestRefusal {
    let message =
        format!("`{text}` has more than {most} operands, and one request reads at most {most}");
    RequestRefusal::new(RefusalKind::BadRequest, message)
}

/// A text from a request, without the spaces around it.
fn written(text: &str) -> Text {
    Text { text: text.trim().to_owned(), span: Span::default(), exact: false }
}

fn refusal(finding: &Finding) -> RequestRefusal {
    RequestRefusal::new(RefusalKind::BadOperand, sentence(finding))
}

#[cfg(test)]
#[path = "names_tests.rs"]
mod tests;
