//! Resolves tags: the meaning of each, and whether its keys fit that meaning. Called by `declare`.

use std::collections::HashSet;

use super::Resolver;
use super::alarm_terms::AlarmTerms;
use super::layers::Layers;
use super::mistake::address_mistake;
use super::names::kept;
use super::program::{ConstantForm, Program, Tag, TagMeaning};
use super::tag::TagLimits;
use super::tag_texts::HeldNumbers;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Fix, FixEdit, Help, advise, pair, possible, propose, text};
use crate::source::ladder;
use crate::source::reader::{Constant, Text};
use crate::source::span::{Located, Span};
use rungd_engine::isa::address_text::{self, AddressError};
use rungd_engine::isa::{Address, Bit, BitSpace, NumberMap, Real};

/// Maximum number of characters of an alarm's text, and of a text with the arguments of a use: the
/// text becomes a line of the log.
pub(super) const TEXT_MAX: usize = 1000;

impl Resolver<'_> {
    /// Resolves a tag without `count` and adds it to the program; returns its meaning.
    pub(super) fn tag(
        &mut self,
        tag: &ladder::WrittenTag,
        program: &mut Program,
    ) -> Option<TagMeaning> {
        self.long_alarm(tag);
        let meaning = self.meaning(tag)?;
        self.misfits(tag, meaning);
        self.no_list(tag);
        self.no_record(tag);
        let mut cell =
            |value: &Option<_>| value.as_ref().and_then(|value| self.tag_value(value, meaning));
        let initial = cell(&tag.initial);
        let limits = self.limits(tag, meaning);
        let texts = self.value_texts(tag, HeldNumbers::new(meaning, &limits));
        let TagLimits { min, max } = limits;
        let resolved = Tag {
            name: kept(&tag.name.text),
            span: tag.name.span,
            doc: tag.doc.clone(),
            meaning,
            initial,
            min,
            max,
            alarm: tag.alarm.as_ref().map(|alarm| alarm.text.clone()),
            terms: AlarmTerms::of(tag),
            log_changes: tag.log.is_some(),
            unit: tag.unit.clone(),
            texts,
            metric: tag.metric.as_ref().is_some_and(|metric| metric.value),
            spare: tag.spare.as_ref().is_some_and(|spare| spare.value),
            used: false,
            of_array: None,
        };
        self.ranges(&resolved);
        program.tags.push(resolved);
        Some(meaning)
    }

    /// Reports the `initial` of a record for any other tag.
    pub(super) fn no_record(&mut self, tag: &ladder::WrittenTag) {
        if let Some(records) = &tag.records {
            let message = "a table of values does not fit a tag that is no record";
            let finding = Finding::new(Code::TagKey, records.span, message);
            self.find(finding.help("write one value: `initial = 12`").or_omit());
        }
    }

    /// Reports a list of initial values for a tag without `count`.
    fn no_list(&mut self, tag: &ladder::WrittenTag) {
        if let Some(list) = &tag.initials {
            let message = "a list of values does not fit a tag without `count`";
            let finding = Finding::new(Code::TagKey, list.span, message);
            self.find(finding.help(match list.value.len() {
                0 | 1 => Help::from("write one value, without brackets").with(unbracketed(list)),
                count => propose(pair(format!("count = {count}"))).and(", or one value"),
            }));
        }
    }

    /// Reports an alarm's text that is too long. Texts of templates are checked elsewhere, with
    /// their arguments.
    pub(super) fn long_alarm(&mut self, tag: &ladder::WrittenTag) {
        let Some(alarm) = tag.alarm.as_ref().filter(|alarm| !Layers::is_layered(alarm.span)) else {
            return;
        };
        let count = alarm.text.chars().count();
        if count > TEXT_MAX {
            let name = kept(&tag.name.text);
            let message = format!("the `alarm` of `{name}` has {count} characters");
            let help = format!("a text has at most {TEXT_MAX}; `doc` has room for what to do");
            self.find(Finding::new(Code::TagKey, alarm.span, message).help(help));
        }
    }

    /// `min` and `max`. For a bit, both are already refused.
    pub(super) fn limits(&mut self, tag: &ladder::WrittenTag, meaning: TagMeaning) -> TagLimits {
        if matches!(meaning, TagMeaning::Address(Address::Bit(_))) {
            return TagLimits::default();
        }
        let mut cell =
            |value: &Option<_>| value.as_ref().and_then(|value| self.tag_value(value, meaning));
        TagLimits { min: cell(&tag.min), max: cell(&tag.max) }
    }

    pub(super) fn meaning(&mut self, tag: &ladder::WrittenTag) -> Option<TagMeaning> {
        let name = &tag.name.text;
        if let Some(kind) = &tag.kind {
            let other = tag.at.as_ref().map(|at| ("at", at.span));
            let other = other.or(tag.value.as_ref().map(|value| ("value", value.span)));
            let Some((key, span)) = other else { return self.typed(tag, kind) };
            let message = format!("tag `{name}` has both `type` and `{key}`");
            let finding = Finding::new(Code::TagKey, kind.span, message)
                .related(span, format!("`{key}` is here"))
                .help("with a `type`, rungd gives the tag its place: keep one")
                .fix(possible(FixEdit::Delete));
            self.find(finding);
            return None;
        }
        match (&tag.at, &tag.value) {
            (Some(at), Some(value)) => {
                let message = format!("tag `{name}` has both `at` and `value`");
                let finding = Finding::new(Code::TagKey, value.span, message)
                    .related(at.span, "`at` is here")
                    .help("`at` names an address, `value` a constant: keep one")
                    .fix(possible(FixEdit::Delete));
                self.find(finding);
                None
            }
            (Some(at), None) => self.at(at).map(TagMeaning::Address),
            (None, Some(value)) => match value.value {
                Constant::Integer(n) => Some(TagMeaning::Constant(n, ConstantForm::Integer)),
                Constant::Duration(ms) => Some(TagMeaning::Constant(ms, ConstantForm::Duration)),
                Constant::Real(real) => Some(TagMeaning::Real(real)),
                Constant::Bit(on) => {
                    let nickname = if on { "$On" } else { "$Off" };
                    let message = "a constant is a number or a duration";
                    let finding = Finding::new(Code::WrongType, value.span, message);
                    let help = format!("a bit that never changes is `{nickname}`");
                    let at = pair(format!("at = \"{nickname}\"")).possible();
                    self.find(finding.help(help).fix(at));
                    None
                }
            },
            (None, None) => {
                if !tag.has_meaning {
                    let message = format!("tag `{name}` has none of `at`, `type` and `value`");
                    let finding = Finding::new(Code::MissingKey, tag.name.span, message);
                    self.find(finding.propose(pair(format!("{name} = {{ type = \"bit\" }}"))));
                }
                None
            }
        }
    }

    fn at(&mut self, at: &Text) -> Option<Address> {
        match address_text::parse(&at.text, &self.options.sizes) {
            Err(AddressError::NotAnAddress)
                if let Some(found) =
                    self.tag_words.as_ref().and_then(|words| words.bit(&at.text)) =>
            {
                found.map_err(|mistake| self.findings.extend(mistake.finding(at.span))).ok()
            }
            Ok(address) => Some(address),
            Err(error) => {
                self.findings.extend(address_mistake(&at.text, error).finding(at.span));
                None
            }
        }
    }

    /// Reports keys that do not fit the tag's meaning.
    pub(super) fn misfits(&mut self, tag: &ladder::WrittenTag, meaning: TagMeaning) {
        let (bit, word, read_only, what) = match meaning {
            TagMeaning::Constant(..) | TagMeaning::Real(_) | TagMeaning::Array(_) => {
                (false, false, true, "a constant")
            }
            TagMeaning::Address(Address::Bit(Bit::InWord(_))) => {
                (true, false, true, "a bit of a word")
            }
            TagMeaning::Address(Address::Bit(bit)) => (true, false, !bit_has_initial(bit), "a bit"),
            TagMeaning::Address(Address::Word(word)) => (false, true, !word.writable(), "a word"),
            TagMeaning::Address(Address::Structure(_)) => (false, false, true, "a structure"),
        };
        let constant = matches!(meaning, TagMeaning::Constant(..) | TagMeaning::Real(_));
        let keys = [
            ("initial", tag.initial.as_ref().map(|v| v.span), !read_only && (bit || word)),
            ("min", tag.min.as_ref().map(|v| v.span), word && !read_only),
            ("max", tag.max.as_ref().map(|v| v.span), word && !read_only),
            ("alarm", tag.alarm.as_ref().map(|v| v.span), bit),
            ("log", tag.log.as_ref().map(|v| v.span), bit || word),
            ("unit", tag.unit.as_ref().map(|v| v.span), word),
            (
                "texts",
                tag.texts.as_ref().map(|v| v.span),
                HeldNumbers::new(meaning, &TagLimits::default()).is_some(),
            ),
            ("metric", tag.metric.as_ref().map(|v| v.span), !constant),
        ];
        for (key, span, fits) in keys {
            let Some(span) = span.filter(|_| !fits) else { continue };
            let is_in_word = what == "a bit of a word";
            let what = match read_only && (bit || word) && !is_in_word {
                true => "a read-only location",
                false => what,
            };
            let message = format!("`{key}` does not fit {what}");
            let help = match key {
                "alarm" => {
                    "an alarm watches a bit: OUT a C bit from the compare, and watch that".into()
                }
                "initial" if is_in_word => "give it to a tag of the whole word".into(),
                "min" | "max" => "only a word has limits: `D0`, `V0`, `CT0.Acc`".into(),
                _ if constant => Help::from("a constant never changes").with(FixEdit::Delete),
                "unit" if bit => {
                    Help::from("a bit is ON or OFF; `doc` has room for what that means")
                        .with(FixEdit::Delete)
                }
                "texts" if word => {
                    Help::from("only whole numbers and bits have texts").with(FixEdit::Delete)
                }
                "log" | "unit" | "texts" => {
                    advise("name a member: `{}`", [pair("at = \"CT0.Acc\"").possible()])
                }
                _ => "bits and words of memory have an initial value: `X0`, `Y0`, `D0`, `CT0.Acc`"
                    .into(),
            };
            let finding = Finding::new(Code::TagKey, span, message).help(help);
            self.find(if key == "alarm" { finding } else { finding.or_omit() });
        }
        if let Some(log) = tag.log.as_ref().filter(|log| log.text != "change") {
            let message = format!("`log` has no value `{}`", log.text);
            let finding = Finding::new(Code::TagKey, log.span, message);
            self.find(finding.write(pair("log = \"change\"")));
        }
        self.alarm_misfits(tag);
        self.unit_misfits(tag);
    }

    /// The content of the tag's cell for a value of `initial`, `min` or `max`.
    pub(super) fn tag_value(
        &mut self,
        value: &Located<Constant>,
        meaning: TagMeaning,
    ) -> Option<(i32, Span)> {
        let (cell, misfit) = match meaning {
            TagMeaning::Address(Address::Bit(_)) => bit_cell(value.value),
            TagMeaning::Address(Address::Word(word)) if word.is_real() => real_cell(value.value),
            TagMeaning::Address(Address::Word(_) | Address::Structure(_))
            | TagMeaning::Constant(..)
            | TagMeaning::Real(_)
            | TagMeaning::Array(_) => whole_cell(value.value),
        };
        if cell.is_none() {
            let right = fitting(value.value, misfit).map(possible);
            self.find(Finding::new(Code::WrongType, value.span, misfit).fixes(right));
        }
        Some((cell?, value.span))
    }

    /// Checks that `min` <= `initial` <= `max`, and that all lie within the location's range.
    pub(super) fn ranges(&mut self, tag: &Tag) {
        if let TagMeaning::Address(address @ Address::Word(word)) = tag.meaning {
            let (least, most) = word.range();
            for (n, span) in [tag.min, tag.max, tag.initial].into_iter().flatten() {
                if !(least..=most).contains(&n) {
                    let is_low = n < least;
                    let [least, most, n] = [least, most, n].map(|cell| word.text(cell));
                    let address = self.scope.places().say(address);
                    let message = format!("`{address}` holds {least}..{most}, not {n}");
                    let nearest = text(if is_low { least } else { most });
                    self.find(Finding::new(Code::OutOfRange, span, message).fix(nearest));
                }
            }
        }
        let mut between = |low: Option<_>, high: Option<_>, message, help| {
            let located = |(value, span)| Located { value, span };
            let (Some(low), Some(high)) = (low, high) else { return };
            let cells = OrderedCells { low: located(low), high: located(high) };
            self.between(tag, cells, message, help);
        };
        let exchange = |low: &str, high: &str| {
            let lines = format!("min = {high}\nmax = {low}");
            Help::from(format!("exchange them: `min = {high}, max = {low}`"))
                .with(FixEdit::Lines { lines, instead: None })
        };
        between(tag.min, tag.max, "`min` is greater than `max`", exchange);
        let change = |low: &str, _: &str| {
            Help::from("`min` <= `initial` <= `max`: change one of them").with(possible(low))
        };
        between(tag.min, tag.initial, "`initial` is less than `min`", change);
        between(tag.initial, tag.max, "`initial` is greater than `max`", change);
    }

    /// Reports a pair of values in the wrong order. The help is made from both.
    fn between(&mut self, tag: &Tag, cells: OrderedCells, message: &str, help: PairHelp) {
        let OrderedCells { low, high } = cells;
        if low.value > high.value {
            let (low_span, high_span) = (low.span, high.span);
            let [low, high] = [low.value, high.value].map(|cell| match tag.meaning {
                TagMeaning::Address(Address::Word(word)) => word.text(cell),
                TagMeaning::Address(_)
                | TagMeaning::Constant(..)
                | TagMeaning::Real(_)
                | TagMeaning::Array(_) => cell.to_string(),
            });
            let finding = Finding::new(Code::OutOfRange, high_span, message);
            let finding = finding.related(low_span, format!("{low} here, {high} there"));
            self.find(finding.help(help(&low, &high)));
        }
    }

    /// Reports two tags of one location with different `initial`, `min` or `max`.
    pub(super) fn check_aliases(&mut self, program: &Program) {
        let mut first: NumberMap<(Address, u32), (i32, Span, Span)> = NumberMap::default();
        // Two arrays may share many elements: one finding for each pair of tags is enough.
        let mut found = HashSet::new();
        for tag in &program.tags {
            let TagMeaning::Address(address) = tag.meaning else { continue };
            let values = [("initial", tag.initial), ("min", tag.min), ("max", tag.max)];
            for (number, (key, value)) in (0..).zip(values) {
                let Some((n, span)) = value else { continue };
                let (other, place, unit) =
                    *first.entry((address, number)).or_insert((n, span, tag.span));
                if other != n && found.insert((key, tag.span, unit)) {
                    let message = format!("`{key}` of `{address}` is given twice, differently");
                    let finding = Finding::new(Code::TagKey, span, message);
                    let finding = finding.related(place, "another tag of this address gives this");
                    let help = format!("leave `{key}` to one of the two tags");
                    self.find(finding.help(help).fix(possible(FixEdit::Delete)));
                }
            }
        }
    }
}

/// The fix that takes the brackets of a list away.
fn unbracketed(list: &Located<Vec<Located<Constant>>>) -> Fix {
    let Span { file, start, end } = list.span;
    let bracket = |start: u32| text("").at(Span { file, start, end: start + 1 });
    let Fix { edits, .. } = bracket(end - 1);
    edits.into_iter().fold(bracket(start), Fix::after).possible()
}

/// The value of a tag's kind that is nearest to a constant which does not fit; `misfit` says the
/// kind.
fn fitting(value: Constant, misfit: &str) -> Option<String> {
    Some(match value {
        Constant::Bit(on) => u8::from(on).to_string(),
        Constant::Integer(n) | Constant::Duration(n) if misfit == NO_BIT => (n != 0).to_string(),
        Constant::Real(real) if misfit != NO_BIT => format!("{:.0}", real.number()),
        Constant::Integer(_) | Constant::Duration(_) | Constant::Real(_) => return None,
    })
}

/// The message about a value that does not fit a bit.
const NO_BIT: &str = "a bit is `true` or `false`";

/// Two values of a tag: the first must not be greater than the second.
struct OrderedCells {
    low: Located<i32>,
    high: Located<i32>,
}

/// Makes a help from two values of a tag, as they are written.
type PairHelp = fn(&str, &str) -> Help;

/// The content of a bit's cell; `None` with the message of the finding.
fn bit_cell(value: Constant) -> (Option<i32>, &'static str) {
    let cell = match value {
        Constant::Bit(on) => Some(i32::from(on)),
        Constant::Integer(n @ 0..=1) => Some(n),
        Constant::Integer(_) | Constant::Duration(_) | Constant::Real(_) => None,
    };
    (cell, NO_BIT)
}

/// The content of an R word's cell.
fn real_cell(value: Constant) -> (Option<i32>, &'static str) {
    let cell = match value {
        Constant::Integer(n) | Constant::Duration(n) => Some(Real::nearest(n).cell()),
        Constant::Real(real) => Some(real.cell()),
        Constant::Bit(_) => None,
    };
    (cell, "a word holds a number, not `true` or `false`")
}

/// The content of any other word's cell.
fn whole_cell(value: Constant) -> (Option<i32>, &'static str) {
    match value {
        Constant::Integer(n) | Constant::Duration(n) => (Some(n), ""),
        Constant::Real(_) => (None, "this word holds whole numbers; an R word holds reals"),
        Constant::Bit(_) => (None, "a word holds a number, not `true` or `false`"),
    }
}

fn bit_has_initial(bit: Bit) -> bool {
    matches!(bit, Bit::Space(space, _) if space != BitSpace::St)
}
