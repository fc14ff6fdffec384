//! `[[watch]]`: lines that must hold at the end of every scan, as `always` of a test file. The
//! recording's thread judges them behind the scans; a line that does not hold is an alarm.

use std::collections::HashMap;
use std::sync::Arc;

use super::resolver::SettingsResolver;
use rungd_engine::isa::Address;
use rungd_language::resolve::LoadOptions;
use rungd_language::resolve::alarm_keys::{ack_misfit, group_misfit};
use rungd_language::resolve::alarm_terms::{AckBit, AlarmTerms};
use rungd_language::resolve::condition::{ConditionNames, ResolvedCondition};
use rungd_language::resolve::observed::ObservedProgram;
use rungd_language::resolve::priority::Priority;
use rungd_language::resolve::program::Program;
use rungd_language::resolve::reads::ReadOperand;
use rungd_language::source::condition::{WrittenCondition, condition};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::key;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::renaming;
use rungd_language::source::slot::Slot;
use rungd_language::source::span::Span;
use rungd_language::source::value_kind::{KeyWords, Millis, WrongWord};
use rungd_language::source::was;

/// `[[watch]]` as written.
#[derive(Clone, Debug)]
pub(super) struct WrittenWatch {
    name: Option<Text>,
    always: Option<Text>,
    text: Option<Text>,
    priority: Option<Priority>,
    delay_ms: Option<u32>,
    off_delay_ms: Option<u32>,
    group: Option<Text>,
    ack: Option<Text>,
}

impl WrittenWatch {
    /// The part of the machine that its alarm is of.
    pub(super) fn group(&self) -> Option<&str> {
        self.group.as_ref().map(|group| group.text.as_str())
    }
}

/// A line that must hold at the end of every scan.
#[derive(Clone, Debug)]
pub struct WatchedCondition {
    /// Its name, by which people acknowledge its alarm.
    pub name: String,
    /// The line as it is written.
    pub always: String,
    /// The alarm's text.
    pub text: String,
    /// The terms of the alarm; its bit is ON while the line does not hold.
    pub terms: AlarmTerms,
    /// The line, over the names of [`WatchSettings::observed`] if there are some.
    pub condition: ResolvedCondition,
}

/// All lines that are watched.
#[derive(Clone, Debug, Default)]
pub struct WatchSettings {
    /// In file order.
    pub all: Vec<WatchedCondition>,
    /// The program with a place for each `was(x)` of the lines, if one has some.
    pub observed: Option<Arc<ObservedProgram>>,
}

impl WatchSettings {
    /// Whether both are written the same.
    pub fn is_like(&self, other: &WatchSettings) -> bool {
        let keys = |watch: &WatchedCondition| {
            let WatchedCondition { name, always, text, terms, condition: _ } = watch;
            (name.clone(), always.clone(), text.clone(), terms.clone())
        };
        self.all.iter().map(keys).eq(other.all.iter().map(keys))
    }

    /// The bits and words that the lines read.
    pub fn reads(&self) -> impl Iterator<Item = Address> {
        let lines = self.all.iter().flat_map(|watch| watch.condition.contact.reads_of_all());
        let was = self.observed.iter().flat_map(|observed| &observed.was);
        let read = lines.flat_map(|read| match read {
            ReadOperand::Address(address) => vec![address],
            ReadOperand::Array(array) => array.addresses().collect(),
        });
        read.chain(was.map(|remembered| remembered.place))
    }
}

const PRIORITIES: KeyWords<Priority> = KeyWords::new(&[
    (Priority::Critical.name(), Priority::Critical),
    (Priority::High.name(), Priority::High),
    (Priority::Medium.name(), Priority::Medium),
    (Priority::Low.name(), Priority::Low),
])
.refused_as(WrongWord::NoValue);

/// Reads all `[[watch]]`.
pub(super) fn read_in(root: &mut Table<'_>) -> Vec<WrittenWatch> {
    let explained = key("watch", "A line that must hold at the end of every scan, as in a test.");
    root.tables(explained, "a line that is watched").into_iter().map(read_watch).collect()
}

fn read_watch(mut table: Table<'_>) -> WrittenWatch {
    let always = "The line, as in `always` of a test file: contacts, and `was(x)`.";
    let text = "The text of the alarm; if not given, that the line does not hold.";
    let priority = "How soon a person has to act on the alarm; `medium` if not given.";
    let delay = "The alarm rises once the line has not held for this time; at once if not given.";
    let off_delay = "The alarm goes away once the line has held again for this time.";
    let ack = "The bit that an acknowledgement turns ON; the ladder turns it OFF.";
    let watch = WrittenWatch {
        name: table.required_string(key("name", "Its name: that of its alarm.")),
        always: table.required_string(key("always", always).holds(Slot::Condition)),
        text: table.string(key("text", text)),
        priority: table.value_of(key("priority", priority), &PRIORITIES),
        delay_ms: table.value_of(key("delay", delay), &Millis::ANY),
        off_delay_ms: table.value_of(key("off-delay", off_delay), &Millis::ANY),
        group: table.string(key("group", "The part of the machine that the alarm is of.")),
        ack: table.string(key("ack", ack).holds(Slot::Operand)),
    };
    table.finish();
    watch
}

/// The lines of a program, with a finding for each mistake.
pub(super) fn resolve(
    written: &[WrittenWatch],
    program: &Program,
    resolver: &mut SettingsResolver<'_>,
) -> WatchSettings {
    let progress = resolver.progress;
    let mut lines: Vec<(&WrittenWatch, WrittenCondition)> = Vec::new();
    for watch in progress.during(written) {
        let Some(always) = &watch.always else { continue };
        match condition(&always.text, always.span) {
            Ok(line) => {
                resolver.findings.extend(line.doubts());
                lines.push((watch, line));
            }
            Err(finding) => resolver.findings.push(finding),
        }
    }
    if written.is_empty() || progress.is_over() {
        return WatchSettings::default();
    }
    let observed = remembering(program, lines.iter().map(|(_, line)| line));
    let options = LoadOptions::default();
    let mut names = match &observed {
        Some(observed) => ConditionNames::observing(observed, &options),
        None => ConditionNames::of(program, &options),
    };
    let mut taken: HashMap<&str, Span> = HashMap::new();
    let mut watches = WatchSettings::default();
    for (watch, line) in progress.during(lines) {
        let resolved = names.resolve(&line);
        let resolved = resolved.map_err(|mistakes| resolver.findings.extend(mistakes)).ok();
        let terms = terms(watch, resolver);
        let Some(name) = &watch.name else { continue };
        if let Some(finding) = misnamed(name, &names, &taken) {
            resolver.findings.push(finding);
            continue;
        }
        taken.insert(&name.text, name.span);
        let Some(condition) = resolved else { continue };
        let always = line.text.trim().to_owned();
        let text = watch.text.as_ref().map(|text| text.text.clone());
        watches.all.push(WatchedCondition {
            name: name.text.clone(),
            text: text.unwrap_or_else(|| format!("it does not hold: {always}")),
            always,
            terms,
            condition,
        });
    }
    watches.observed = observed;
    watches
}

/// The terms of the alarm of a line, with a finding for each that does not fit.
fn terms(watch: &WrittenWatch, resolver: &mut SettingsResolver<'_>) -> AlarmTerms {
    let name = watch.name.as_ref().map_or("", |name| &name.text);
    let group = watch.group.as_ref();
    let misfit = group.and_then(|group| group_misfit(Code::Controller, name, group));
    resolver.findings.extend(misfit);
    let ack = watch.ack.as_ref().and_then(|ack| {
        let bit = resolver.bit(Some(ack))?;
        let misfit = ack_misfit(Code::Controller, ack, bit);
        let is_fit = misfit.is_none();
        resolver.findings.extend(misfit);
        is_fit.then(|| AckBit { name: ack.text.trim().to_owned(), bit })
    });
    AlarmTerms {
        priority: watch.priority.unwrap_or_default(),
        delay_ms: watch.delay_ms.unwrap_or_default(),
        off_delay_ms: watch.off_delay_ms.unwrap_or_default(),
        group: group.map(|group| group.text.clone()),
        ack,
    }
}

/// The program with a place for each `was(x)` of these lines; `None`: they have none.
fn remembering<'l>(
    program: &Program,
    lines: impl Iterator<Item = &'l WrittenCondition>,
) -> Option<Arc<ObservedProgram>> {
    let mut names: Vec<String> = Vec::new();
    lines.for_each(|line| was::add_names(&line.contact, &mut names));
    if names.is_empty() {
        return None;
    }
    let mut observed = ObservedProgram::bare(program.clone(), program.sizes.clone());
    observed.remember(&names);
    Some(Arc::new(observed))
}

/// The finding for a name that a watch cannot have: an alarm has the name of its tag or watch.
fn misnamed(
    name: &Text,
    names: &ConditionNames<'_>,
    taken: &HashMap<&str, Span>,
) -> Option<Finding> {
    let written = name.text.as_str();
    let is_taken = |name: &str| taken.contains_key(name) || names.scope().look_up(name).is_ok();
    let finding = |message: String| Finding::new(Code::Controller, name.span, message);
    if let Some(first) = taken.get(written) {
        let fix = renaming::another(written, '-', is_taken);
        let finding = finding(format!("a second watch `{written}`"));
        return Some(finding.related(*first, "the first one").fix(fix));
    }
    if written.trim().is_empty() || written.chars().any(char::is_control) {
        return Some(finding("a watch has a name, which its alarm shows".to_owned()));
    }
    if names.scope().look_up(written).is_ok() {
        let fix = renaming::another(written, '-', is_taken);
        let finding = finding(format!("`{written}` is a name of the ladder"));
        return Some(finding.help("an alarm would have two meanings: use another name").fix(fix));
    }
    None
}
