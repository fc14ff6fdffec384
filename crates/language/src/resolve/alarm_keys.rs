//! Whether the keys of an alarm fit their tag. Called by `tags`; and by `plain` for the bits of
//! `ack`, which are looked up once all names are declared. A controller file judges the keys of
//! `[[watch]]` with the same rules.

use super::Resolver;
use super::alarm_terms::{AckBit, WrittenAck};
use super::names::kept;
use super::priority::Priority;
use super::program::{Program, TagMeaning};
use super::scope::{MisplacedName, NamedThing};
use crate::source::atom::{Atom, AtomKind};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, Help, pair, write};
use crate::source::reader::Text;
use crate::source::tag::WrittenTag;
use crate::source::wording::is_obeyed;
use rungd_engine::isa::{Address, Bit, BitSpace};

/// The most characters of a group's name.
const GROUP_CHARS_MAX: usize = 40;

/// The finding for a bit that no acknowledgement can turn ON.
pub fn ack_misfit(code: Code, ack: &Text, bit: Bit) -> Option<Finding> {
    if bit.writable_by_ladder() {
        return None;
    }
    let why = match bit {
        Bit::Space(BitSpace::X, _) => "is an input: its device would write over it",
        Bit::Space(..)
        | Bit::InWord(_)
        | Bit::Flag(..)
        | Bit::Stage(_)
        | Bit::Running(_)
        | Bit::Done(_)
        | Bit::Device(..) => "is read-only",
    };
    let name = kept(ack.text.trim());
    let message = format!("no acknowledgement can turn `{name}` ON: it {why}");
    let help = "name a bit of its own, which the ladder turns OFF";
    Some(Finding::new(code, ack.span, message).help(help).or_omit())
}

/// The finding for a group that lists of alarms cannot show in a line. `alarm`: the name of its
/// alarm.
pub fn group_misfit(code: Code, alarm: &str, group: &Text) -> Option<Finding> {
    let count = group.text.chars().count();
    let is_blank = group.text.trim().is_empty();
    if !is_blank && count <= GROUP_CHARS_MAX && !group.text.contains(is_obeyed) {
        return None;
    }
    let message = format!("the `group` of `{}` is no name that a list can show", kept(alarm));
    let help = format!("a group has 1 to {GROUP_CHARS_MAX} characters, as `Pumps`");
    Some(Finding::new(code, group.span, message).help(help).or_omit())
}

impl Resolver<'_> {
    /// Looks up the bits of `ack`.
    pub(super) fn resolve_acks(&mut self, program: &mut Program) {
        for WrittenAck { tag, name } in std::mem::take(&mut self.acks) {
            let Some(bit) = self.ack_bit(&name) else { continue };
            let tag = &mut program.tags[tag];
            if tag.meaning == TagMeaning::Address(Address::Bit(bit)) {
                let message = format!("`ack` names the alarm `{}` itself", tag.name);
                let help = "an acknowledgement would raise the alarm: name a bit of its own, which \
                            the ladder turns OFF";
                self.find(Finding::new(Code::TagKey, name.span, message).help(help).or_omit());
                continue;
            }
            tag.terms.ack = Some(AckBit { name: name.text, bit });
        }
    }

    /// The bit that an `ack` names. Adds a finding if nothing can be written there.
    fn ack_bit(&mut self, ack: &Text) -> Option<Bit> {
        let atom = Atom { kind: AtomKind::Name(ack.text.clone()), span: ack.span };
        let (name, thing) = self.thing(&atom, "a bit", &["bit"])?;
        let NamedThing::Address(address @ Address::Bit(bit)) = thing else {
            let help = "an acknowledgement turns a bit ON: name a tag of one bit";
            self.wrong_kind(MisplacedName { name, span: ack.span, thing }, "a bit", help.into());
            return None;
        };
        if let Some(finding) = ack_misfit(Code::TagKey, ack, bit) {
            self.find(finding);
            return None;
        }
        self.note(name, ack.span, address);
        Some(bit)
    }

    /// Reports terms with a wrong value, and terms without an alarm.
    pub(super) fn alarm_misfits(&mut self, tag: &WrittenTag) {
        self.priority_misfit(tag);
        self.group_misfit(tag);
        let keys = [
            ("priority", tag.priority.as_ref().map(|priority| priority.span)),
            ("delay", tag.delay.as_ref().map(|delay| delay.span)),
            ("off-delay", tag.off_delay.as_ref().map(|delay| delay.span)),
            ("group", tag.group.as_ref().map(|group| group.span)),
            ("ack", tag.ack.as_ref().map(|ack| ack.span)),
        ];
        let keys = keys.into_iter().filter(|_| tag.alarm.is_none());
        for (key, span) in keys.filter_map(|(key, span)| Some((key, span?))) {
            let message = format!("`{key}` goes with `alarm`, and this tag has none");
            let help = match tag.count {
                Some(_) => "leave it out: a tag with `count` has no `alarm`".to_owned(),
                None => {
                    format!("add `alarm = \"…\"`: the text that people read; or leave `{key}` out")
                }
            };
            let finding = Finding::new(Code::TagKey, span, message);
            self.find(finding.help(help).fix(FixEdit::Delete));
        }
    }

    /// Reports a group's name that lists of alarms cannot show in a line.
    fn group_misfit(&mut self, tag: &WrittenTag) {
        let group = tag.group.as_ref();
        let finding = group.and_then(|group| group_misfit(Code::TagKey, &tag.name.text, group));
        finding.into_iter().for_each(|finding| self.find(finding));
    }

    /// Reports a priority with an unknown word.
    fn priority_misfit(&mut self, tag: &WrittenTag) {
        let Some(written) = &tag.priority else { return };
        if Priority::named(&written.text).is_none() {
            let message = format!("`priority` has no value `{}`", kept(&written.text));
            let help = match Priority::named(&written.text.to_lowercase()) {
                Some(meant) => write(pair(format!("priority = \"{}\"", meant.name()))),
                None => {
                    let words = Priority::ALL.map(|priority| format!("`{}`", priority.name()));
                    let fixes =
                        Priority::ALL.map(|priority| format!("priority = \"{}\"", priority.name()));
                    Help::from(format!("the priorities are {}", words.join(", ")))
                        .with_all(fixes.map(|fix| pair(fix).possible()))
                }
            };
            self.find(Finding::new(Code::TagKey, written.span, message).help(help));
        }
    }
}
