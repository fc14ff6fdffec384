//! A step as written: one string, split into its parts, each with its place.
//!
//! `reading` calls [`parse`]. It parses the forms of all steps; `steps` resolves the names of the
//! ladder. The help for a mistake can be copied into the file.

use super::step_forms::{FORMS, step_form};
use super::step_words::{StepWord, StepWords, count};
use super::suite::TestTime;
use crate::rig::PowerOff;
use rungd_base::calendar;
use rungd_engine::isa::duration;
use rungd_language::source::atom::bad_duration;
use rungd_language::source::condition::{WrittenCondition, condition};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, Help, advise, meant, possible, propose, proposed};
use rungd_language::source::nearest::nearest;
use rungd_language::source::span::{Located, Span};

/// The repetition of a pulse.
#[derive(Clone, Copy, Debug)]
pub(super) struct PulseRepeat {
    /// The time from one pulse to the next, ms.
    pub every: Located<u32>,
    /// The number of pulses.
    pub times: u32,
}

/// A step as written.
#[derive(Clone, Debug)]
pub(super) enum WrittenStep {
    Set(StepWord, StepWord),
    Force(StepWord, StepWord),
    Unforce(StepWord),
    Pulse { operand: StepWord, on_ms: u32, repeat: Option<PulseRepeat> },
    Beat { operand: StepWord, on_ms: u32, every: Located<u32> },
    Run(TestTime),
    Late(u32),
    Expect(WrittenCondition),
    Within(u32, WrittenCondition),
    Hold(u32, WrittenCondition),
    Stop,
    Start,
    Restart(u32),
    PowerCut(PowerOff),
    Reload(Vec<StepWord>),
    Lose(StepWord),
    Restore(StepWord),
    Clock(i64),
}

type ParsedStep<T> = Result<T, Box<Finding>>;

/// Words of other test languages, each with the form of this language.
const HABITS: [(&str, &str); 16] = [
    ("wait", "run 2s"),
    ("sleep", "run 2s"),
    ("delay", "run 2s"),
    ("advance", "run 2s"),
    ("scan", "run 1 scans"),
    ("assert", "expect: pusher"),
    ("check", "expect: pusher"),
    ("until", "within 2s: pusher"),
    ("always", "hold 300ms: full_lamp"),
    ("write", "set bottle 1"),
    ("reset", "set bottle 0"),
    ("toggle", "pulse bottle 100ms"),
    ("release", "unforce pusher"),
    ("powercut", "power-cut"),
    ("disconnect", "lose plant"),
    ("connect", "restore plant"),
];

/// Parses a step; `span` is the place of its text.
///
/// # Errors
/// Its first mistake.
pub(super) fn parse(text: &str, span: Span) -> Result<WrittenStep, Finding> {
    step(text, span).map_err(|finding| *finding)
}

fn step(text: &str, span: Span) -> ParsedStep<WrittenStep> {
    let mut words = StepWords::new(text, span);
    let Some(first) = words.next() else {
        let finding = error(span, "an empty step");
        let help = advise("take it away, or write `{}`", [proposed("run 2s")]);
        return Err(finding.help(help.with(FixEdit::Delete)).into());
    };
    // `expect:` and `expect :` are the same.
    let name = first.value.split(':').next().unwrap_or_default().to_owned();
    let Some(form) = step_form(&name).map(|step| step.form) else {
        return Err(unknown(&first, &name).into());
    };
    let mut step = StepParser { words, name: name.clone(), form };
    match name.as_str() {
        "expect" => return step.expect(text, span, first.span),
        "within" => {
            let (ms, condition) = step.timed(text, span, first.span)?;
            return Ok(WrittenStep::Within(ms, condition));
        }
        "hold" => {
            let (ms, condition) = step.timed(text, span, first.span)?;
            return Ok(WrittenStep::Hold(ms, condition));
        }
        _ => {}
    }
    if first.value != name {
        let finding = error(first.span, format!("`{name}` has no `:` after it"));
        return Err(finding.propose(form).into());
    }
    let read = step.plain(&name)?;
    step.end()?;
    Ok(read)
}

fn error(place: Span, message: impl Into<String>) -> Finding {
    Finding::new(Code::TestStep, place, message)
}

fn unknown(first: &StepWord, name: &str) -> Finding {
    let finding = error(first.span, format!("there is no step `{name}`"));
    let lower = name.to_ascii_lowercase();
    if let Some((_, form)) = HABITS.iter().find(|(habit, _)| *habit == lower) {
        return finding.help(as_form(form));
    }
    let colon = if first.value.ends_with(':') { ":" } else { "" };
    let near = nearest(name, FORMS.iter().map(|step| step.name));
    let near = near.map(|near| meant(format!("{near}{colon}")));
    finding.help(near.unwrap_or_else(|| {
        let names: Vec<String> = FORMS.iter().map(|step| format!("`{}`", step.name)).collect();
        format!("the steps are {}", names.join(", ")).into()
    }))
}

/// The place of a duration with the word `every` before it.
pub(super) fn behind_every(duration: Span) -> Span {
    Span { start: duration.start.saturating_sub("every ".len() as u32), ..duration }
}

/// The help to write a step in its form.
fn as_form(form: &str) -> Help {
    advise("write it as `{}`", [proposed(form)])
}

/// The rest of a step after its name.
struct StepParser<'t> {
    words: StepWords<'t>,
    name: String,
    /// An example.
    form: &'static str,
}

impl WrittenStep {
    /// The condition that it waits for.
    pub fn condition(&self) -> Option<&WrittenCondition> {
        match self {
            WrittenStep::Expect(condition)
            | WrittenStep::Within(_, condition)
            | WrittenStep::Hold(_, condition) => Some(condition),
            WrittenStep::Set(..)
            | WrittenStep::Force(..)
            | WrittenStep::Unforce(_)
            | WrittenStep::Pulse { .. }
            | WrittenStep::Beat { .. }
            | WrittenStep::Run(_)
            | WrittenStep::Late(_)
            | WrittenStep::Stop
            | WrittenStep::Start
            | WrittenStep::Restart(_)
            | WrittenStep::PowerCut(_)
            | WrittenStep::Reload(_)
            | WrittenStep::Lose(_)
            | WrittenStep::Restore(_)
            | WrittenStep::Clock(_) => None,
        }
    }
}

impl StepParser<'_> {
    /// A step without a condition.
    fn plain(&mut self, name: &str) -> ParsedStep<WrittenStep> {
        Ok(match name {
            "set" => {
                let (operand, value) = self.assigned()?;
                WrittenStep::Set(operand, value)
            }
            "force" => {
                let (operand, value) = self.assigned()?;
                WrittenStep::Force(operand, value)
            }
            "unforce" => WrittenStep::Unforce(self.word("an operand")?),
            "pulse" => self.pulse()?,
            "beat" => self.beat()?,
            "run" => WrittenStep::Run(self.run()?),
            "late" => WrittenStep::Late(self.periods()?),
            "stop" => WrittenStep::Stop,
            "start" => WrittenStep::Start,
            "restart" => WrittenStep::Restart(self.down()?),
            "power-cut" => WrittenStep::PowerCut(self.power_off()?),
            "reload" => self.reload()?,
            "lose" => WrittenStep::Lose(self.word("a device")?),
            "restore" => WrittenStep::Restore(self.word("a device")?),
            _ => WrittenStep::Clock(self.clock()?),
        })
    }

    fn fail(&self, place: Span, message: impl Into<String>) -> Box<Finding> {
        Box::new(error(place, message).help(as_form(self.form)))
    }

    /// The next word; `what`: the meaning of the word.
    fn word(&mut self, what: &str) -> ParsedStep<StepWord> {
        self.words.next().ok_or_else(|| {
            let (what, which) = what.split_once(": ").unwrap_or((what, ""));
            let which = if which.is_empty() { String::new() } else { format!(": {which}") };
            self.fail(self.words.end(), format!("`{}` wants {what} here{which}", self.name))
        })
    }

    /// Checks that no more words follow.
    fn end(&mut self) -> ParsedStep<()> {
        let Some(word) = self.words.next() else { return Ok(()) };
        let place = word.span.to(self.words.end());
        Err(self.fail(place, format!("nothing may follow this `{}`", self.name)))
    }

    /// An operand and its value.
    fn assigned(&mut self) -> ParsedStep<(StepWord, StepWord)> {
        let operand = self.word("an operand and a value")?;
        let value = self.words.next();
        let sign = value.as_ref().filter(|word| word.value.starts_with([':', '=']));
        if let Some(sign) = sign {
            let name = &self.name;
            let value = self.words.next().map_or("1".to_owned(), |word| word.value);
            let finding = error(sign.span, format!("`{name}` has no `{}`", sign.value));
            return Err(finding.write(format!("{name} {} {value}", operand.value)).into());
        }
        if let Some((left, right)) = operand.value.split_once('=') {
            let finding = error(operand.span, format!("`{}` has no `=`", self.name));
            let right = format!("{} {left} {}", self.name, right.trim_start_matches('='));
            return Err(finding.write(right).into());
        }
        match value {
            Some(value) => Ok((operand, value)),
            None => {
                let message = format!("`{} {}` wants a value here", self.name, operand.value);
                let finding = error(self.words.end(), message);
                Err(finding.propose(format!("{} {} 1", self.name, operand.value)).into())
            }
        }
    }

    fn pulse(&mut self) -> ParsedStep<WrittenStep> {
        let operand = self.word("an operand and a duration")?;
        let on = self.duration("how long it is ON")?;
        let Some(every) = self.words.next() else {
            return Ok(WrittenStep::Pulse { operand, on_ms: on.value, repeat: None });
        };
        if every.value != "every" {
            return Err(self.fail(every.span, "`every` or the end of the step belongs here"));
        }
        let every = self.duration("the time from one pulse to the next")?;
        self.literal("times")?;
        let times = self.word("the number of pulses")?;
        let written = count(&times.value).ok().and_then(|count| u32::try_from(count).ok());
        let Some(count) = written.filter(|count| *count > 0) else {
            let message = format!("`{}` is no number of pulses", times.value);
            return Err(self.fail(times.span, message));
        };
        self.not_shorter(on, every)?;
        let repeat = Some(PulseRepeat { every, times: count });
        Ok(WrittenStep::Pulse { operand, on_ms: on.value, repeat })
    }

    fn beat(&mut self) -> ParsedStep<WrittenStep> {
        let operand = self.word("an operand and two durations")?;
        let on = self.duration("how long it is ON")?;
        self.literal("every")?;
        let every = self.duration("the time from one pulse to the next")?;
        self.not_shorter(on, every)?;
        Ok(WrittenStep::Beat { operand, on_ms: on.value, every })
    }

    fn not_shorter(&self, on: Located<u32>, every: Located<u32>) -> ParsedStep<()> {
        if every.value > on.value {
            return Ok(());
        }
        let shown = |ms: u32| duration::print(ms.cast_signed());
        let message =
            format!("a pulse of {} every {} is never OFF", shown(on.value), shown(every.value));
        let finding = error(every.span, message).related(on.span, "ON for this time");
        let longer = on.value.saturating_mul(2).max(1).min(i32::MAX.cast_unsigned());
        let place = behind_every(every.span);
        let every = possible(format!("every {}", shown(longer))).at(place);
        Err(finding.help(advise("`every` is longer than the pulse: `{}`", [every])).into())
    }

    fn literal(&mut self, wanted: &str) -> ParsedStep<()> {
        let word = self.word(&format!("`{wanted}`"))?;
        if word.value == wanted {
            return Ok(());
        }
        Err(self.fail(word.span, format!("`{wanted}` belongs here")))
    }

    fn duration(&mut self, what: &str) -> ParsedStep<Located<u32>> {
        let word = self.word(&format!("a duration: {what}"))?;
        milliseconds(&word).map_err(Box::new)
    }

    fn run(&mut self) -> ParsedStep<TestTime> {
        let first = self.word("a duration, or a number of scans")?;
        let digits = first.value.strip_prefix("0x").unwrap_or(&first.value);
        let is_number = match digits.len() == first.value.len() {
            true => digits.bytes().all(|b| b.is_ascii_digit()),
            false => !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_hexdigit()),
        };
        if !is_number {
            return Ok(TestTime::Ms(milliseconds(&first)?.value));
        }
        let n = first.value.as_str();
        match self.words.next() {
            Some(word) if word.value == "scans" => {
                let (message, help) = match count(n) {
                    Ok(0) => {
                        let help = propose("run 1 scans").and(", or take it away");
                        ("no scan passes here", help.with(FixEdit::Delete))
                    }
                    Ok(scans) => return Ok(TestTime::Scans(scans)),
                    Err(_) => ("more scans than can be counted", propose("run 1000000 scans")),
                };
                Err(error(first.span, message).help(help).into())
            }
            Some(word) => {
                let message = format!("`scans` belongs here, not `{}`", word.value);
                let unit = ["ms", "s", "m", "h"].contains(&word.value.as_str());
                let joined = if unit { format!("{n}{}", word.value) } else { format!("{n} scans") };
                Err(error(word.span, message).propose(format!("run {joined}")).into())
            }
            None => {
                let finding = error(first.span, format!("`{n}` of what?"));
                let runs = ["s", "ms", " scans"].map(|unit| possible(format!("run {n}{unit}")));
                Err(finding.help(advise("write `{}`, `{}` or `{}`", runs)).into())
            }
        }
    }

    /// A number of periods.
    fn periods(&mut self) -> ParsedStep<u32> {
        let word = self.word("a number of periods")?;
        let written = count(&word.value).ok().and_then(|count| u32::try_from(count).ok());
        written.filter(|periods| *periods > 0).ok_or_else(|| {
            self.fail(word.span, format!("`{}` is no number of periods", word.value))
        })
    }

    /// `for D`, or nothing.
    fn down(&mut self) -> ParsedStep<u32> {
        let Some(word) = self.words.next() else { return Ok(0) };
        if word.value != "for" {
            return Err(self.fail(word.span, "`for` or the end of the step belongs here"));
        }
        Ok(self.duration("how long no process runs")?.value)
    }

    /// `lose D` and `for D`, in any order, or less.
    fn power_off(&mut self) -> ParsedStep<PowerOff> {
        let (mut down_ms, mut lose_ms) = (None, None);
        while let Some(word) = self.words.next() {
            let (part, meaning) = match word.value.as_str() {
                "for" => (&mut down_ms, "how long no process runs"),
                "lose" => (&mut lose_ms, "how old the restored image is"),
                _ => {
                    let message = "`for`, `lose` or the end of the step belongs here";
                    return Err(self.fail(word.span, message));
                }
            };
            if part.is_some() {
                return Err(self.fail(word.span, format!("`{}` stands here twice", word.value)));
            }
            *part = Some(self.duration(meaning)?.value);
        }
        Ok(PowerOff { down_ms: down_ms.unwrap_or(0), lose_ms: lose_ms.unwrap_or(0) })
    }

    fn reload(&mut self) -> ParsedStep<WrittenStep> {
        let mut files = vec![self.word("the files to load")?];
        while let Some(file) = self.words.next() {
            files.push(file);
        }
        Ok(WrittenStep::Reload(files))
    }

    fn clock(&mut self) -> ParsedStep<i64> {
        let word = self.word("a date and a time")?;
        calendar::parse_seconds(&word.value).ok_or_else(|| {
            self.fail(word.span, format!("`{}` is not a time of the calendar", word.value))
        })
    }

    /// `expect: CONTACTS`.
    fn expect(&mut self, text: &str, span: Span, name: Span) -> ParsedStep<WrittenStep> {
        let at = (name.start - span.start) as usize + "expect".len();
        let behind = &text[at..];
        let spaces = behind.len() - behind.trim_start().len();
        if !behind.trim_start().starts_with(':') {
            let finding = error(span.part(at, text.len()), "`expect` wants a `:` after it");
            return Err(finding.write(format!("expect: {}", behind.trim())).into());
        }
        self.contacts(text, span, at + spaces + 1).map(WrittenStep::Expect)
    }

    /// `D: CONTACTS`.
    fn timed(&mut self, text: &str, span: Span, name: Span) -> ParsedStep<(u32, WrittenCondition)> {
        let at = (name.start - span.start) as usize + self.name.len();
        let found = if lacks_colon(&text[at..]) { None } else { colon(&text[at..]) };
        let Some(colon) = found.map(|colon| at + colon) else {
            return Err(self.no_colon(&text[at..], span.part(at, text.len())));
        };
        let written = &text[at..colon];
        let begin = at + written.len() - written.trim_start().len();
        let word = written.trim();
        if word.is_empty() {
            let place = span.part(at, colon + 1);
            return Err(
                self.fail(place, format!("`{}` wants a duration before its `:`", self.name))
            );
        }
        let place = span.part(begin, begin + word.len());
        let ms = milliseconds(&Located { value: word.to_owned(), span: place })?;
        Ok((ms.value, self.contacts(text, span, colon + 1)?))
    }

    fn no_colon(&self, behind: &str, place: Span) -> Box<Finding> {
        let behind = behind.trim();
        let (word, rest) = behind.split_once([' ', '\t']).unwrap_or((behind, ""));
        let name = &self.name;
        let finding = error(place, format!("`{name}` wants a duration and a `:` after it"));
        if duration::parse(word).is_ok() && !rest.is_empty() {
            return Box::new(finding.write(format!("{name} {word}: {}", rest.trim())));
        }
        Box::new(finding.help(as_form(self.form)))
    }

    fn contacts(&self, text: &str, span: Span, at: usize) -> ParsedStep<WrittenCondition> {
        if text[at..].trim().is_empty() {
            let message = format!("`{}` wants contacts after its `:`", self.name);
            return Err(self.fail(span.part(at - 1, text.len()), message));
        }
        Ok(condition(&text[at..], span.part(at, text.len()))?)
    }
}

/// Whether a text begins with a duration without a `:` after it.
fn lacks_colon(text: &str) -> bool {
    let text = text.trim_start();
    let word = text.split(char::is_whitespace).next().unwrap_or_default();
    duration::parse(word).is_ok() && !text[word.len()..].trim_start().starts_with(':')
}

/// The place of the `:` after a duration. In the vendor's form, the duration itself contains `:`.
fn colon(text: &str) -> Option<usize> {
    let colons = || text.match_indices(':').map(|(at, _)| at);
    let first = colons().next()?;
    let before = text[..first].trim();
    let is_vendor = !before.is_empty() && before.bytes().all(|b| b.is_ascii_digit());
    colons().nth(3).filter(|_| is_vendor).or(Some(first))
}

/// The milliseconds of a word.
fn milliseconds(word: &StepWord) -> Result<Located<u32>, Finding> {
    match duration::parse(&word.value) {
        Ok(ms) => Ok(Located { value: ms.unsigned_abs(), span: word.span }),
        Err(error) => Err(bad_duration(&word.value, word.span, error)),
    }
}
