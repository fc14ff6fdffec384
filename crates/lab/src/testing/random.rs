//! Resolves the changes and incidents of a random test: operands, probabilities, limits and steps.
//!
//! Called by `reading`. No random numbers are drawn here.

use super::names::TestTarget;
use super::programs::Programs;
use super::steps::twice;
use super::suite::{Chance, Incident, ProgramId, RandomChange, RandomIncident, RandomMotion};
use super::written::{WrittenChange, WrittenEvents, WrittenRandom};
use crate::traces::stimulus::StimulusTarget;
use rungd_engine::isa::DeviceId;
use rungd_engine::{Cell, TIME_END_NS};
use rungd_language::source::atom::{Atom, AtomKind};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, Help, advise, pair, possible, propose};
use rungd_language::source::reader::Text;
use rungd_language::source::span::Span;
use std::collections::HashMap;

/// The changes of a random test. Adds findings about them.
pub(super) fn changes(
    programs: &Programs<'_>,
    written: &WrittenRandom,
    findings: &mut Vec<Finding>,
) -> Vec<RandomChange> {
    findings.extend(too_long(programs, written));
    let mut changes: Vec<RandomChange> = Vec::new();
    let mut seen: HashMap<(Option<DeviceId>, Cell), Span> = HashMap::new();
    let inputs = written.changes.iter().map(|(name, change)| (name, change, false));
    let writes = written.events.writes.iter().map(|(name, change)| (name, change, true));
    for (name, change, by_operator) in inputs.chain(writes) {
        let target = programs.written(ProgramId(0), &name.text, name.span);
        let change = target.and_then(|target| {
            if by_operator && target.operand.input.is_some() {
                return Err(input_written(&name.text, name.span));
            }
            if let Some(first) =
                seen.insert((target.operand.device, target.operand.cell), name.span)
            {
                return Err(twice(&name.text, name.span, first));
            }
            resolve(target, change)
        });
        match change {
            Ok(change) => changes.push(change),
            Err(finding) => findings.push(finding),
        }
    }
    changes
}

fn input_written(name: &str, span: Span) -> Finding {
    let message = format!("`{name}` is an input: no operator writes it");
    let finding = Finding::new(Code::TestFile, span, message);
    finding.help("let it change at random: move it to `change`").fix(possible(FixEdit::Delete))
}

/// What happens to the controller and its field devices. Adds findings about it.
pub(super) fn incidents(
    programs: &Programs<'_>,
    written: &WrittenEvents,
    findings: &mut Vec<Finding>,
) -> Vec<RandomIncident> {
    let mut incidents = Vec::new();
    let mut add =
        |text: &Option<Text>, all: &[Incident]| match text.as_ref().map(chance).transpose() {
            Ok(None) => {}
            Ok(Some(chance)) => incidents.extend(
                all.iter().map(|incident| RandomIncident { incident: incident.clone(), chance }),
            ),
            Err(finding) => findings.push(finding),
        };
    let devices = programs.names[0].devices();
    let lost = devices.map(|(id, name)| Incident::Device { id, name: name.to_owned() });
    let lost: Vec<Incident> = lost.collect();
    add(&written.lose, &lost);
    add(&written.power_cut, &[Incident::PowerCut]);
    add(&written.restart, &[Incident::Restart]);
    add(&written.stop, &[Incident::Stop]);
    if let (Some(text), true) = (&written.lose, lost.is_empty()) {
        let finding = Finding::new(Code::TestFile, text.span, "there is no field device to lose");
        let help = "devices are those of a controller file, or of `[ladder] devices`";
        findings.push(finding.help(help).fix(FixEdit::Delete));
    }
    incidents
}

fn too_long(programs: &Programs<'_>, written: &WrittenRandom) -> Option<Finding> {
    let scans = written.scans?;
    let period_ns = u128::from(programs.programs[0].controller.period.ns());
    let lasts_ns = u128::from(scans.value.unsigned_abs()) * period_ns;
    (lasts_ns >= u128::from(TIME_END_NS)).then(|| {
        let message = "a run lasts longer than 146 years, the maximum";
        Finding::new(Code::TestFile, scans.span, message).propose(pair("scans = 5000"))
    })
}

fn resolve(target: TestTarget, change: &WrittenChange) -> Result<RandomChange, Finding> {
    let name = &target.operand.name;
    let is_bit = matches!(target.takes, StimulusTarget::Input(_) | StimulusTarget::Bit(_));
    match change {
        WrittenChange::Toggle(text) if is_bit => {
            let chance = chance(text)?;
            Ok(RandomChange { operand: target.operand, chance, motion: RandomMotion::Toggle })
        }
        WrittenChange::Toggle(text) => {
            let message = format!("`{name}` is a word: it does not toggle");
            let finding = Finding::new(Code::TestFile, text.span, message);
            let form = format!("{{ jump = \"0..9\", chance = \"{}\" }}", text.text);
            let help = propose(pair(format!("{name} = {form}"))).and(", or `walk` with a `step`");
            Err(finding.help(help))
        }
        WrittenChange::Moves { span, .. } if is_bit => {
            let message = format!("`{name}` is a bit: it only toggles");
            let finding = Finding::new(Code::TestFile, *span, message);
            Err(finding.propose(pair(format!("{name} = \"1%\""))))
        }
        WrittenChange::Moves { span, walk, jump, step, chance: written } => {
            // A missing chance already has a finding.
            let chance = written.as_ref().map_or(Ok(Chance(0)), chance)?;
            let motion = match (walk, jump, step) {
                (Some(walk), None, Some(step)) => {
                    let (low, high) = limits(&target, walk)?;
                    let step = step_of(&target, step)?;
                    RandomMotion::Walk { low, high, step }
                }
                (None, Some(jump), None) => {
                    let (low, high) = limits(&target, jump)?;
                    RandomMotion::Jump { low, high }
                }
                (Some(_), None, None) => return Err(form(*span, "`walk` wants a `step`")),
                (None, Some(_), Some(step)) => {
                    return Err(form(step.span, "`jump` has no `step`").or_omit());
                }
                (Some(_), Some(_), _) => {
                    return Err(form(*span, "a change has `walk` or `jump`, not both"));
                }
                (None, None, _) => return Err(form(*span, "a change has `walk` or `jump`")),
            };
            Ok(RandomChange { operand: target.operand, chance, motion })
        }
    }
}

fn form(span: Span, message: &str) -> Finding {
    let changes = [
        "{ walk = \"0..100\", step = 3, chance = \"10%\" }",
        "{ jump = \"0..9\", chance = \"2%\" }",
    ];
    let help = advise("write `{}`, or `{}`", changes.map(possible));
    Finding::new(Code::TestFile, span, message).help(help)
}

/// A probability: `0.1%`.
fn chance(text: &Text) -> Result<Chance, Finding> {
    let finding = |message: &str| {
        let message = format!("`{}` {message}", text.text);
        Finding::new(Code::TestFile, text.span, message)
    };
    let number = text.text.trim().strip_suffix('%').map(str::trim_end);
    let parts = number.and_then(|number| {
        let (whole, fraction) = number.split_once('.').unwrap_or((number, "0"));
        let digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
        if !digits(whole) || !digits(fraction) || fraction.len() > 4 {
            return None;
        }
        let whole = whole.parse::<u32>().ok()?.checked_mul(10_000)?;
        whole.checked_add(format!("{fraction:0<4}").parse().ok()?)
    });
    match parts {
        Some(parts @ 1..=1_000_000) => Ok(Chance(parts)),
        Some(_) => Err(finding("is no probability that changes anything")
            .help(propose("\"0.0001%\"").and(" to `\"100%\"`"))),
        None => Err(finding("is no probability")
            .help(advise("write `{}`, `{}`", ["\"1%\"", "\"0.1%\""].map(possible)))),
    }
}

/// The limits of a walk or a jump: `0..100`.
fn limits(target: &TestTarget, text: &Text) -> Result<(f64, f64), Finding> {
    let ends = text
        .text
        .split_once("..")
        .and_then(|(low, high)| Some((number(target, low.trim())?, number(target, high.trim())?)));
    let finding = |code, message: String| Finding::new(code, text.span, message);
    let Some((low, high)) = ends else {
        let finding = finding(Code::TestFile, format!("`{}` is no range of values", text.text));
        return Err(finding.help(match target.takes {
            StimulusTarget::Real(..) => "write `\"-5..100\"`, `\"0.5..2.5\"`".into(),
            StimulusTarget::Input(_) | StimulusTarget::Bit(_) | StimulusTarget::Word(..) => {
                advise("write whole numbers: `{}`", [possible("\"-5..100\"")])
            }
        }));
    };
    if low >= high {
        let finding = finding(Code::OutOfRange, "a range goes from low to high".to_owned());
        return Err(finding.write(format!("\"{high}..{low}\"")));
    }
    let (least, most, shown) = match target.takes {
        StimulusTarget::Word(_, (min, max)) => {
            (min.into(), max.into(), [min, max].map(|n| n.to_string()))
        }
        StimulusTarget::Real(_, (min, max)) => {
            (f64::from(min), f64::from(max), [min, max].map(|n| n.to_string()))
        }
        StimulusTarget::Input(_) | StimulusTarget::Bit(_) => return Ok((low, high)),
    };
    if low < least || high > most {
        let [min, max] = shown;
        let message = format!("`{}` takes {min} to {max}", target.operand.name);
        return Err(finding(Code::OutOfRange, message).help(advise(
            "write a range within it: `{}`",
            [possible(format!("\"{min}..{max}\""))],
        )));
    }
    Ok((low, high))
}

fn step(words: &str, step: &str) -> Help {
    advise(words, [pair(format!("step = {step}")).possible()])
}

fn step_of(target: &TestTarget, text: &Text) -> Result<f64, Finding> {
    match number(target, text.text.trim()) {
        Some(step) if step > 0.0 => Ok(step),
        Some(_) | None => {
            let message = format!("`{}` is no step", text.text);
            let finding = Finding::new(Code::TestFile, text.span, message);
            Err(finding.help(match target.takes {
                StimulusTarget::Real(..) => step("a step is a number above 0: `{}`", "0.5"),
                StimulusTarget::Input(_) | StimulusTarget::Bit(_) | StimulusTarget::Word(..) => {
                    step("a step is a whole number above 0: `{}`", "3")
                }
            }))
        }
    }
}

/// A number in the form of the operand: a whole number for a word.
fn number(target: &TestTarget, text: &str) -> Option<f64> {
    match (Atom::parse(text, Span::default()).ok()?.kind, target.takes) {
        (AtomKind::Integer(number), _) => Some(number.into()),
        (AtomKind::Real(real), StimulusTarget::Real(..)) => Some(real.into()),
        (AtomKind::Name(_) | AtomKind::Duration(_) | AtomKind::Real(_), _) => None,
    }
}
