//! `[[simulated-device]]`, an older form: each rule becomes a part of a plant, of kind `pulse` or
//! `delay`, between one input and the bits that drive the part (`io::plant::rules`).
//!
//! New files have such parts in a `[[device]]` with `driver = "simulated"`; `rungd fmt --upgrade`
//! rewrites old ones. Nothing else knows the older keys.

use std::collections::HashMap;

use super::resolver::SettingsResolver;
use rungd_engine::isa::{Bit, BitSpace};
use rungd_io::plant::settings::{Delays, InputRule, PartSettings, RuleCommand};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, pair, possible};
use rungd_language::source::key::key;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::slot::Slot;
use rungd_language::source::span::{Located, Span};

/// `[[simulated-device]]`: a rule that moves one input.
#[derive(Clone, Debug)]
pub struct WrittenRule {
    /// The place of its header.
    pub span: Span,
    /// `input`.
    pub input: Option<Text>,
    /// `pulse`, ms.
    pub pulse_ms: Option<Located<i32>>,
    /// `every`, ms.
    pub every_ms: Option<Located<i32>>,
    /// `offset`, ms.
    pub offset_ms: Option<Located<i32>>,
    /// `follows`.
    pub follows: Option<Text>,
    /// `after`, ms.
    pub after_ms: Option<Located<i32>>,
    /// `release`, ms.
    pub release_ms: Option<Located<i32>>,
    /// `while`.
    pub while_on: Option<Text>,
    /// `invert`.
    pub invert: bool,
}

/// The schema's condition on a whole rule.
const PULSES_OR_FOLLOWS: &str = r#"{"oneOf":[
            {"required":["pulse","every"],
             "not":{"anyOf":[{"required":["after"]},{"required":["release"]}]}},
            {"required":["follows"],
             "not":{"anyOf":[{"required":["pulse"]},{"required":["every"]},
                             {"required":["offset"]}]}}]}"#;

/// The schema's mark of an older form.
const DEPRECATED: &str = r#"{"deprecated":true}"#;

/// Reads all `[[simulated-device]]` tables.
pub(super) fn read_in(root: &mut Table<'_>) -> Vec<WrittenRule> {
    let explained = key(
        "simulated-device",
        "An older form of a simulated plant's parts: `rungd fmt --upgrade` rewrites it.",
    );
    let explained = explained.limited(DEPRECATED);
    root.tables(explained, "a simulated device").into_iter().map(read).collect()
}

fn read(mut table: Table<'_>) -> WrittenRule {
    table.together(PULSES_OR_FOLLOWS);
    let rule = WrittenRule {
        span: table.span(),
        input: table.required_string(
            key("input", "The input that moves: an X, or a tag of one.").holds(Slot::Operand),
        ),
        pulse_ms: table.duration(key("pulse", "The length of each pulse.")),
        every_ms: table.duration(key("every", "The time between the beginnings of two pulses.")),
        offset_ms: table.duration(key("offset", "When the first pulse begins.")),
        follows: table.string(key("follows", "The bit that it follows.").holds(Slot::Operand)),
        after_ms: table
            .duration(key("after", "How long that bit is ON before the input comes ON.")),
        release_ms: table.duration(key(
            "release",
            "How long that bit is OFF before the input goes OFF; `after` if not given.",
        )),
        while_on: table
            .string(key("while", "It moves only while this bit is ON.").holds(Slot::Operand)),
        invert: table
            .boolean(key("invert", "ON where the rule says OFF."))
            .is_some_and(|invert| invert.value),
    };
    table.finish();
    rule
}

impl SettingsResolver<'_> {
    pub(super) fn rules(&mut self, rules: &[WrittenRule]) -> Vec<InputRule> {
        let mut devices: Vec<InputRule> = Vec::new();
        let mut firsts: HashMap<u32, Span> = HashMap::new();
        for rule in self.progress.during(rules) {
            let Some(device) = self.rule(rule) else { continue };
            if let Some(first) = firsts.get(&device.input) {
                let message = format!("a second rule for `X{}`", device.input);
                let finding = Finding::new(Code::Controller, rule.span, message);
                self.findings
                    .push(finding.related(*first, "the first one").fix(possible(FixEdit::Delete)));
                continue;
            }
            firsts.insert(device.input, device.span);
            devices.push(device);
        }
        devices
    }

    fn rule(&mut self, rule: &WrittenRule) -> Option<InputRule> {
        let input = self.bit(rule.input.as_ref());
        let while_on = self.command(rule.while_on.as_ref());
        let follows = self.command(rule.follows.as_ref());
        let part = self.part(rule);
        let input = input?;
        let Bit::Space(BitSpace::X, input) = input else {
            let span = rule.input.as_ref().map_or(rule.span, |input| input.span);
            let finding = Finding::new(Code::Controller, span, "a simulated device moves an input");
            let finding = finding.help("name an X bit, or a tag of one");
            self.findings.push(match input {
                Bit::Space(_, number) => finding.fix(possible(format!("X{number}"))),
                Bit::Flag(..)
                | Bit::Stage(_)
                | Bit::Running(_)
                | Bit::Done(_)
                | Bit::Device(..)
                | Bit::InWord(_) => finding,
            });
            return None;
        };
        let commands = match rule.follows {
            Some(_) => vec![Some(follows?), while_on],
            None => vec![while_on],
        };
        Some(InputRule { input, part: part?, commands, span: rule.span })
    }

    fn command(&mut self, name: Option<&Text>) -> Option<RuleCommand> {
        let (bit, name) = (self.bit(name)?, name?);
        Some(RuleCommand { bit, span: name.span })
    }

    fn part(&mut self, rule: &WrittenRule) -> Option<PartSettings> {
        let pulse_keys = [&rule.pulse_ms, &rule.every_ms, &rule.offset_ms];
        let follow_keys = [&rule.after_ms, &rule.release_ms];
        let given = |keys: &[&Option<Located<i32>>]| keys.iter().find_map(|k| k.as_ref()).cloned();
        let stray = match (&rule.follows, given(&pulse_keys), given(&follow_keys)) {
            (Some(_), Some(pulse), _) => Some(pulse),
            (None, Some(_), Some(follow)) => Some(follow),
            _ => None,
        };
        let help =
            "either `pulse` and `every` (and `offset`), or `follows` (and `after`, `release`)";
        if let Some(stray) = stray {
            let message = "a device pulses or follows, not both";
            let finding = Finding::new(Code::Controller, stray.span, message).help(help);
            self.findings.push(finding.fix(possible(FixEdit::Delete)));
            return None;
        }
        let ms = |value: &Option<Located<i32>>| value.as_ref().map(|ms| ms.value.unsigned_abs());
        if rule.follows.is_some() {
            let after_ms = ms(&rule.after_ms).unwrap_or(0);
            let release_ms = ms(&rule.release_ms).unwrap_or(after_ms);
            let delays = Delays { after_ms, release_ms };
            return Some(PartSettings::Delay { delays, invert: rule.invert });
        }
        let (Some(width_ms), Some(every_ms)) = (ms(&rule.pulse_ms), ms(&rule.every_ms)) else {
            let message = "a rule without `pulse` or `follows` moves nothing";
            let lines = "pulse = \"200ms\"\nevery = \"800ms\"".to_owned();
            let pulses = possible(FixEdit::Lines { lines, instead: None });
            let finding = Finding::new(Code::MissingKey, rule.span, message).help(help);
            self.findings.push(finding.fix(pulses));
            return None;
        };
        if width_ms == 0 || width_ms >= every_ms {
            let span = rule.pulse_ms.as_ref().map_or(rule.span, |pulse| pulse.span);
            let message = "`pulse` must be above 0ms and below `every`";
            let half = pair(format!("pulse = \"{}ms\"", every_ms.div_ceil(2))).possible();
            self.findings.push(Finding::new(Code::Controller, span, message).fix(half));
            return None;
        }
        let offset_ms = ms(&rule.offset_ms).unwrap_or(0);
        Some(PartSettings::Pulse { width_ms, every_ms, offset_ms, invert: rule.invert })
    }
}
