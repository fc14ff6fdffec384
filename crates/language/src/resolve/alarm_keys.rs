//! Whether the keys of an alarm fit their tag. Called by `tags`.

use super::Resolver;
use super::names::kept;
use super::priority::Priority;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, Help, pair, write};
use crate::source::tag::WrittenTag;
use crate::source::wording::is_obeyed;

/// The most characters of a group's name.
const GROUP_CHARS_MAX: usize = 40;

impl Resolver<'_> {
    /// Reports terms with a wrong value, and terms without an alarm.
    pub(super) fn alarm_misfits(&mut self, tag: &WrittenTag) {
        self.priority_misfit(tag);
        self.group_misfit(tag);
        let keys = [
            ("priority", tag.priority.as_ref().map(|priority| priority.span)),
            ("delay", tag.delay.as_ref().map(|delay| delay.span)),
            ("off-delay", tag.off_delay.as_ref().map(|delay| delay.span)),
            ("group", tag.group.as_ref().map(|group| group.span)),
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
        let Some(group) = &tag.group else { return };
        let count = group.text.chars().count();
        let is_blank = group.text.trim().is_empty();
        if is_blank || count > GROUP_CHARS_MAX || group.text.contains(is_obeyed) {
            let name = kept(&tag.name.text);
            let message = format!("the `group` of `{name}` is no name that a list can show");
            let help = format!("a group has 1 to {GROUP_CHARS_MAX} characters, as `Pumps`");
            self.find(Finding::new(Code::TagKey, group.span, message).help(help).or_omit());
        }
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
